// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/splat_codec.h"

#include <array>
#include <atomic>
#include <span>

#include "base/files.h"
#include "base/finite.h"
#include "base/input_file.h"
#include "base/memory.h"
#include "splat_io/parallel_rows.h"
#include "splat_io/row_vectors.h"
#include "splat_io/splat_row.h"

namespace retint {
namespace {

constexpr size_t kRecordBytes = 32;
constexpr size_t kScaleAt = 12, kColorAt = 24, kOpacityAt = 27, kRotationAt = 28;
constexpr size_t kBlockRecords = 8192;   // per write
constexpr size_t kRecordsAPiece = 2048;  // per read; decoded in a core's cache
constexpr const char* kMark = ".splat";  // of SourceLayout::packed_format

const std::array<float, 256>& Sh0OfBytes() {
  static const std::array<float, 256> values = [] {
    std::array<float, 256> table;
    for (size_t i = 0; i < table.size(); ++i) {
      table[i] = (static_cast<float>(i) / 255 - 0.5f) / kShC0;
    }
    return table;
  }();
  return values;
}

// `to`: the first row's places, in a model of degree 0.
void Decode(const char* records, size_t count, const RowPlaces& to) {
  const std::array<float, 256>& sh0_of = Sh0OfBytes();
  const std::array<float, 256>& logit_of = LogitsOfBytes();
  for (size_t g = 0; g < count; ++g) {
    const char* record = records + g * kRecordBytes;
    std::memcpy(to.mean + 3 * g, record, 3 * sizeof(float));
    std::memcpy(to.log_scale + 3 * g, record + kScaleAt, 3 * sizeof(float));
    for (size_t i = 0; i < 3; ++i)
      to.sh[3 * g + i] = sh0_of[LoadAs<uint8_t>(record + kColorAt + i)];
    to.opacity_logit[g] = logit_of[LoadAs<uint8_t>(record + kOpacityAt)];
    for (size_t i = 0; i < 4; ++i) {
      const int byte = LoadAs<uint8_t>(record + kRotationAt + i);
      to.quat_wxyz[4 * g + i] = static_cast<float>(byte - 128) * (1.0f / 128);
    }
  }
  LogScales(to.log_scale, 3 * count);
}

// Encodes only the values of `row` that differ from `was`, the values of `record`.
void Encode(const SplatRow& row, const SplatRow& was, char* record) {
  for (size_t i = 0; i < 3; ++i) {
    if (row.mean[i] != was.mean[i]) StoreAs(record + 4 * i, row.mean[i]);
    if (row.log_scale[i] != was.log_scale[i]) {
      StoreAs(record + kScaleAt + 4 * i, std::exp(std::min(row.log_scale[i], 88.0f)));  // finite
    }
    if (row.sh[i] != was.sh[i]) {
      StoreAs(record + kColorAt + i,
              static_cast<uint8_t>(RoundTo(255 * (0.5 + double(kShC0) * row.sh[i]), 255)));
    }
  }
  if (row.opacity_logit != was.opacity_logit) {
    StoreAs(record + kOpacityAt,
            static_cast<uint8_t>(RoundTo(255 * Sigmoid(row.opacity_logit), 255)));
  }
  if (row.quat_wxyz != was.quat_wxyz) {
    const std::array<double, 4> unit = Normalized(row.quat_wxyz);
    for (size_t i = 0; i < 4; ++i) {
      StoreAs(record + kRotationAt + i, static_cast<uint8_t>(RoundTo(unit[i] * 128 + 128, 255)));
    }
  }
}

}  // namespace

std::span<const std::string_view> DotSplatCodec::Extensions() const {
  static constexpr std::array<std::string_view, 1> extensions = {".splat"};
  return extensions;
}

GaussianModel DotSplatCodec::Read(const std::filesystem::path& path, Monitor& monitor,
                                  BadRows bad) const {
  const InputFile file(path);
  if (file.size() == 0 || file.size() % kRecordBytes != 0) {
    throw InputError(path, "not a .splat, or truncated: its " + std::to_string(file.size()) +
                               " bytes are no whole number of records of 32 bytes");
  }
  const size_t count = file.size() / kRecordBytes;
  GaussianModel model;
  model.ResizeUnset(count, 0);
  model.source.packed_format = kMark;
  ReservePopulated(model.source.packed, file.size());
  model.source.packed.resize(file.size());
  std::atomic<bool> finite = true;
  ForRows(
      count,
      [&](size_t done) {
        monitor.Step("load", static_cast<double>(done), static_cast<double>(count));
      },
      [&](size_t begin, size_t end) {
        char* records = model.source.packed.data();
        file.ReadAt(begin * kRecordBytes, records + begin * kRecordBytes,
                    (end - begin) * kRecordBytes);
        Decode(records + begin * kRecordBytes, end - begin, RowPlaces(model, begin));
        // Only these can be infinite.
        for (const FloatArray* values : {&model.means, &model.log_scales}) {
          if (!AllFinite(std::span(*values).subspan(3 * begin, 3 * (end - begin)))) finite = false;
        }
      },
      kRecordsAPiece);
  if (!finite) ValidateRead(model, path, bad);
  return model;
}

void DotSplatCodec::Write(const std::filesystem::path& path, const GaussianModel& model,
                          Monitor& monitor) const {
  ValidateWrite(model, path);
  const size_t count = model.NumGaussians();
  const bool patch =
      model.source.packed_format == kMark && model.source.packed.size() == count * kRecordBytes;
  AtomicFile file(path);
  std::vector<char> block;
  GaussianModel was;
  for (size_t first = 0; first < count; first += kBlockRecords) {
    monitor.Step("save", static_cast<double>(first), static_cast<double>(count));
    const size_t end = std::min(count, first + kBlockRecords);
    block.assign((end - first) * kRecordBytes, '\0');
    if (patch) {
      std::memcpy(block.data(), model.source.packed.data() + first * kRecordBytes, block.size());
    }
    was.Resize(end - first, 0);
    Decode(block.data(), end - first, RowPlaces(was, 0));
    for (size_t g = first; g < end; ++g) {
      Encode(GetRow(model, g), GetRow(was, g - first), block.data() + (g - first) * kRecordBytes);
    }
    file.Write(block.data(), block.size());
  }
  file.Commit();
}

std::vector<std::string> DotSplatCodec::Losses(const GaussianModel& model) const {
  return CommonLosses(model, 0, Name());
}

}  // namespace retint
