// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/ply_file.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "base/input_file.h"
#include "base/parallel.h"
#include "scene/sh_band4.h"
#include "splat_io/ply_rows.h"

namespace retint {
namespace {

// Records with smaller gaps are read together: reading the gap costs less than another read.
constexpr uint64_t kGapBytes = uint64_t{32} << 10;
constexpr uint64_t kRunBytes = uint64_t{4} << 20;

FileStamp StampOf(const struct stat& info) {
  return {static_cast<uint64_t>(info.st_size),
          int64_t{info.st_mtim.tv_sec} * 1'000'000'000 + info.st_mtim.tv_nsec};
}

// Records [begin, end) of a list, close to each other in the file.
struct Stretch {
  size_t begin, end;
};

std::vector<Stretch> Stretches(std::span<const uint32_t> records, uint64_t record_bytes) {
  std::vector<Stretch> stretches;
  for (size_t i = 0; i < records.size(); ++i) {
    if (!stretches.empty()) {
      Stretch& last = stretches.back();
      const uint64_t gap = (records[i] - records[last.end - 1] - 1) * record_bytes;
      const uint64_t length = (records[i] - records[last.begin] + 1) * record_bytes;
      if (gap <= kGapBytes && length <= kRunBytes) {
        last.end = i + 1;
        continue;
      }
    }
    stretches.push_back({i, i + 1});
  }
  return stretches;
}

// A float or double column of a record.
struct Column {
  size_t offset;
  bool is_double;
  void Put(float value, char* record) const {
    const double wide = value;
    if (is_double) {
      std::memcpy(record + offset, &wide, sizeof(wide));
    } else {
      std::memcpy(record + offset, &value, sizeof(value));
    }
  }
};

}  // namespace

struct PlyFile::Impl {
  explicit Impl(const std::filesystem::path& path) : file(path), layout(ReadPlyLayout(file)) {
    struct stat info {};
    if (fstat(file.descriptor(), &info) != 0) throw InputError(path, std::strerror(errno));
    stamp = StampOf(info);
    identity = {info.st_dev, info.st_ino};
    if (layout.header.format != "binary_little_endian") {
      throw InputError(path, "is a PLY of format " + layout.header.format +
                                 ", whose records are not of one size; `retint convert` makes it "
                                 "binary");
    }
    if (layout.count() > std::numeric_limits<uint32_t>::max()) {
      throw InputError(path, std::to_string(layout.count()) +
                                 " Gaussians are more than record numbers of 32 bits can name");
    }
  }

  Column ColumnOf(const std::string& name) const {
    for (const PlyProperty& property : layout.header.elements[0].properties) {
      if (property.name == name) return {layout.offsets.at(name), property.bytes == 8};
    }
    throw InputError(file.path(), "lacks the column " + name);
  }
  // The columns that an edit changes, in the order of GaussianModel::sh.
  std::vector<Column> Colors() const {
    std::vector<Column> columns;
    for (const std::string& name : layout.fields.back().columns) columns.push_back(ColumnOf(name));
    return columns;
  }
  std::vector<Column> Band4() const {
    std::vector<Column> columns;
    if (layout.degree < 4) return columns;
    for (const ExtraColumn& extra : layout.source.extras) {
      if (ShBand4Columns::IsName(extra.name)) columns.push_back(ColumnOf(extra.name));
    }
    return columns;
  }
  GaussianModel Empty(size_t count) const {
    GaussianModel model;
    model.source = layout.source;
    model.source.extras.clear();  // the file keeps them
    model.Resize(count, std::min(layout.degree, 3));
    return model;
  }

  InputFile file;
  PlyLayout layout;
  FileStamp stamp;
  std::pair<dev_t, ino_t> identity;
};

PlyFile::PlyFile(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}
PlyFile::~PlyFile() = default;

const std::filesystem::path& PlyFile::path() const { return impl_->file.path(); }
const FileStamp& PlyFile::stamp() const { return impl_->stamp; }
uint64_t PlyFile::count() const { return impl_->layout.count(); }
int PlyFile::sh_degree() const { return std::min(impl_->layout.degree, 3); }
bool PlyFile::has_sh_band4() const { return !impl_->Band4().empty(); }
uint64_t PlyFile::first_byte() const { return impl_->layout.header.bytes; }
uint64_t PlyFile::record_bytes() const { return impl_->layout.stride; }

void PlyFile::ReadBytes(uint64_t offset, char* to, size_t size) const {
  impl_->file.ReadAt(offset, to, size);
}

GaussianModel PlyFile::Parse(const char* bytes, uint64_t first, size_t count) const {
  GaussianModel model = impl_->Empty(count);
  std::vector<uint32_t> numbers(count);
  for (size_t i = 0; i < count; ++i) numbers[i] = static_cast<uint32_t>(first + i);
  PlyRowReader reader(impl_->layout, model, path(), BadRows::kRefuse);
  reader.Take(bytes, 0, count, numbers.data());
  return model;
}

GaussianModel PlyFile::Read(std::span<const uint32_t> records, Monitor& monitor) const {
  GaussianModel model = impl_->Empty(records.size());
  PlyRowReader reader(impl_->layout, model, path(), BadRows::kRefuse);
  const uint64_t stride = record_bytes();
  const std::vector<Stretch> stretches = Stretches(records, stride);
  constexpr size_t kBatch = 64;  // between two reports
  for (size_t first = 0; first < stretches.size(); first += kBatch) {
    monitor.Step("load", static_cast<double>(first), static_cast<double>(stretches.size()));
    const size_t batch = std::min(kBatch, stretches.size() - first);
    ParallelTasks(static_cast<int64_t>(batch), [&](int64_t task) {
      const auto [begin, end] = stretches[first + static_cast<size_t>(task)];
      const uint64_t from = records[begin];
      std::vector<char> bytes((records[end - 1] - from + 1) * stride);
      ReadBytes(first_byte() + from * stride, bytes.data(), bytes.size());
      // Moves the records together, in place.
      for (size_t i = begin; i < end; ++i) {
        std::memmove(&bytes[(i - begin) * stride], &bytes[(records[i] - from) * stride], stride);
      }
      reader.Take(bytes.data(), begin, end - begin, records.data() + begin);
    });
  }
  return model;
}

void PlyFile::CheckUnchanged() const {
  struct stat info {};
  if (stat(path().c_str(), &info) != 0) {
    throw InputError(path(), std::string("changed while it was in use: ") + std::strerror(errno));
  }
  if (StampOf(info) != stamp() || std::pair(info.st_dev, info.st_ino) != impl_->identity) {
    throw InputError(path(), "changed while it was in use; run again");
  }
}

void PlyFile::WritePatched(const std::filesystem::path& path_to, std::span<const uint32_t> records,
                           std::span<const float> sh, Monitor& monitor) const {
  const auto degree = static_cast<size_t>(sh_degree());
  const size_t width = (degree + 1) * (degree + 1) * 3;
  CheckOption(sh.size() == records.size() * width,
              "the patch's coefficients are not of " + path().string());
  CheckUnchanged();
  AtomicFile copy(path_to);
  monitor.Step("save", 0, 1);
  // Without bytes after the announced ones, as PlyCodec writes it.
  const uint64_t bytes_copied = impl_->layout.header.elements.size() > 1
                                    ? stamp().bytes
                                    : first_byte() + count() * record_bytes();
  copy.CopyFrom(impl_->file.descriptor(), bytes_copied, [&](uint64_t done) {
    monitor.Step("save", static_cast<double>(done), static_cast<double>(bytes_copied + 1));
  });
  const std::vector<Column> colors = impl_->Colors(), band4 = impl_->Band4();
  const uint64_t stride = record_bytes();
  std::vector<char> bytes;
  for (const auto [begin, end] : Stretches(records, stride)) {
    monitor.ThrowIfCancelled();
    const uint64_t from = records[begin];
    bytes.resize((records[end - 1] - from + 1) * stride);
    ReadBytes(first_byte() + from * stride, bytes.data(), bytes.size());
    for (size_t i = begin; i < end; ++i) {
      char* const record = &bytes[(records[i] - from) * stride];
      for (size_t k = 0; k < width; ++k) colors[k].Put(sh[i * width + k], record);
      for (const Column& column : band4) column.Put(0, record);
    }
    copy.WriteAt(first_byte() + from * stride, bytes.data(), bytes.size());
  }
  copy.Sync();
  CheckUnchanged();
  copy.Commit();
}

}  // namespace retint
