// SPDX-License-Identifier: BSD-3-Clause
// Builds an index in one pass over the splat: a sample says where the curve through the scene is to
// be cut into chunks of about one size, the pass sorts what the index needs of each Gaussian into
// those chunks, on disk where memory does not do, and each chunk is then sorted by itself.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <future>
#include <string>
#include <utility>

#include "base/checksum.h"
#include "base/error.h"
#include "base/files.h"
#include "base/parallel.h"
#include "out_of_core/index_header.h"
#include "out_of_core/splat_index.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kStage = "index";
constexpr uint64_t kSample = 16384;       // Gaussians
constexpr size_t kPartRecords = 2048;     // parsed by one task
constexpr size_t kReadBytes = 32u << 20;  // in memory at a time, and as much read ahead
constexpr int kSizeClasses = 4;

struct Entry {
  std::array<float, 3> mean;
  float sigma;
  uint32_t record;
};
static_assert(sizeof(Entry) == 20);

// An entry and its place on the curve.
struct Placed {
  uint64_t code;
  Entry entry;
  bool operator<(const Placed& other) const {
    return code != other.code ? code < other.code : entry.record < other.entry.record;
  }
};

Entry EntryOf(const GaussianModel& model, size_t g, uint64_t record) {
  Entry entry;
  std::copy_n(&model.means[3 * g], 3, entry.mean.begin());
  const float* const s = &model.log_scales[3 * g];
  // Beyond any scene; an infinite bound would make products with zero that are no number.
  constexpr float kLargest = 1e30F;
  entry.sigma = std::min(kLargest, std::exp(std::max({s[0], s[1], s[2]})));
  entry.record = static_cast<uint32_t>(record);
  return entry;
}

// Bits of a 20-bit integer, two apart.
uint64_t Spread(uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffffULL;
  x = (x | x << 16) & 0x1f0000ff0000ffULL;
  x = (x | x << 8) & 0x100f00f00f00f00fULL;
  x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
  return (x | x << 2) & 0x1249249249249249ULL;
}

// A Morton curve for each class of size: one large Gaussian among small ones would make their
// block's bounds as large as its own. The grid spans the bulk of a sample; what lies beyond is put
// on its border, which makes blocks looser there, never wrong.
class Curve {
 public:
  explicit Curve(const std::vector<Entry>& sample) {
    std::vector<float> values(sample.size());
    const auto quantile = [&](double q, auto value) {
      std::transform(sample.begin(), sample.end(), values.begin(), value);
      const auto at =
          values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), at, values.end());
      return *at;
    };
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto mean = [axis](const Entry& entry) { return entry.mean[axis]; };
      const double low = double(quantile(0.005, mean)), high = double(quantile(0.995, mean));
      const double margin = 0.1 * (high - low);
      origin_[axis] = low - margin;
      extent_ = std::max(extent_, high - low + 2 * margin);
    }
    extent_ = std::max(extent_, 1e-30);
    small_ = double(quantile(0.9, [](const Entry& entry) { return entry.sigma; }));
  }

  uint64_t CodeOf(const Entry& entry) const {
    uint64_t code = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      const double cell = (double(entry.mean[axis]) - origin_[axis]) / extent_ * 0x1p20;
      code |= Spread(static_cast<uint64_t>(std::clamp(cell, 0.0, 0x1p20 - 1))) << axis;
    }
    uint64_t size = 0;
    for (double limit = small_; double(entry.sigma) > limit && size + 1 < kSizeClasses;
         limit *= 4) {
      ++size;
    }
    return size << 60 | code;
  }
  static uint64_t SizeClass(uint64_t code) { return code >> 60; }

 private:
  std::array<double, 3> origin_{};
  double extent_ = 0, small_ = 0;
};

// Entries by chunk. What does not fit into memory goes to a file without a name in `folder`.
class ChunkStore {
 public:
  ChunkStore(size_t chunks, size_t memory_bytes, const fs::path& index)
      : index_(index), memory_bytes_(memory_bytes), chunks_(chunks) {}
  ~ChunkStore() {
    if (fd_ >= 0) close(fd_);
  }
  ChunkStore(const ChunkStore&) = delete;
  ChunkStore& operator=(const ChunkStore&) = delete;

  void Add(size_t chunk, const Entry& entry) {
    chunks_[chunk].entries.push_back(entry);
    if (++held_ * sizeof(Entry) >= memory_bytes_) Spill();
  }

  std::vector<Entry> Take(size_t chunk) {
    Chunk& from = chunks_[chunk];
    std::vector<Entry> entries(from.spilled + from.entries.size());
    size_t at = 0;
    for (const auto& [offset, count] : from.runs) {
      ReadRun(offset, &entries[at], count);
      at += count;
    }
    std::copy(from.entries.begin(), from.entries.end(),
              entries.begin() + static_cast<std::ptrdiff_t>(at));
    from = {};
    return entries;
  }

 private:
  struct Chunk {
    std::vector<Entry> entries;
    std::vector<std::pair<uint64_t, size_t>> runs;  // offset, entries
    size_t spilled = 0;
  };

  [[noreturn]] void Fail(const char* what) const {
    throw RunError(index_.string() + ": cannot " + what +
                   " its temporary file: " + std::strerror(errno));
  }

  void Open() {
    if (fd_ >= 0) return;
    std::string name = (fs::absolute(index_).parent_path() / ".retint-index-XXXXXX").string();
    fd_ = mkostemp(name.data(), O_CLOEXEC);
    if (fd_ < 0) Fail("make");
    unlink(name.c_str());
  }

  void Spill() {
    Open();
    for (Chunk& chunk : chunks_) {
      if (chunk.entries.empty()) continue;
      const auto* from = reinterpret_cast<const char*>(chunk.entries.data());
      size_t left = chunk.entries.size() * sizeof(Entry);
      chunk.runs.emplace_back(end_, chunk.entries.size());
      chunk.spilled += chunk.entries.size();
      while (left > 0) {
        const ssize_t wrote = pwrite(fd_, from, left, static_cast<off_t>(end_));
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote <= 0) Fail("write");
        from += wrote;
        left -= static_cast<size_t>(wrote);
        end_ += static_cast<uint64_t>(wrote);
      }
      chunk.entries.clear();
    }
    held_ = 0;
  }

  void ReadRun(uint64_t offset, Entry* to, size_t count) const {
    auto* bytes = reinterpret_cast<char*>(to);
    for (size_t left = count * sizeof(Entry); left > 0;) {
      const ssize_t got = pread(fd_, bytes, left, static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) Fail("read");
      bytes += got;
      offset += static_cast<uint64_t>(got);
      left -= static_cast<size_t>(got);
    }
  }

  const fs::path& index_;
  size_t memory_bytes_, held_ = 0;
  std::vector<Chunk> chunks_;
  int fd_ = -1;
  uint64_t end_ = 0;
};

// The file from front to back, one piece read ahead, and the checksum of all that went by.
class FilePass {
 public:
  explicit FilePass(const PlyFile& file, uint64_t piece_bytes) : file_(file), piece_(piece_bytes) {
    head_.resize(file.first_byte());
    file.ReadBytes(0, head_.data(), head_.size());
    sum_.Add(head_);
    at_ = file.first_byte();
    ReadAhead();
  }

  // The next piece; empty at the end of the records. Valid until the next call.
  const std::string& Next() {
    current_ = next_.valid() ? next_.get() : std::string();
    ReadAhead();
    // Beside the parsing of the caller.
    if (hashed_.valid()) hashed_.get();
    to_hash_ = current_;
    hashed_ = std::async(std::launch::async, [this] { sum_.Add(to_hash_); });
    return current_;
  }

  uint64_t Checksum() {
    if (hashed_.valid()) hashed_.get();
    std::string rest;
    for (uint64_t at = end(); at < file_.stamp().bytes; at += rest.size()) {
      rest.resize(std::min<uint64_t>(kReadBytes, file_.stamp().bytes - at));
      file_.ReadBytes(at, rest.data(), rest.size());
      sum_.Add(rest);
    }
    return sum_.Get();
  }

 private:
  uint64_t end() const { return file_.first_byte() + file_.count() * file_.record_bytes(); }
  void ReadAhead() {
    const uint64_t size = std::min(piece_, end() - at_);
    if (size == 0) return;
    next_ = std::async(std::launch::async, [this, size, from = at_] {
      std::string bytes(size, '\0');
      file_.ReadBytes(from, bytes.data(), bytes.size());
      return bytes;
    });
    at_ += size;
  }

  const PlyFile& file_;
  uint64_t piece_, at_ = 0;
  std::string head_, current_, to_hash_;
  std::future<std::string> next_;
  Xxh64Stream sum_;
  std::future<void> hashed_;  // last: its thread reads the rest
};

std::vector<Entry> Sample(const PlyFile& splat) {
  const uint64_t count = splat.count(), wanted = std::min(count, kSample);
  const uint64_t stride = splat.record_bytes();
  std::vector<Entry> sample(wanted);
  ParallelRanges(static_cast<int64_t>(wanted), 512, [&](int64_t begin, int64_t end) {
    std::vector<char> bytes(stride);
    for (auto i = static_cast<uint64_t>(begin); i < static_cast<uint64_t>(end); ++i) {
      const uint64_t record = i * count / wanted;
      splat.ReadBytes(splat.first_byte() + record * stride, bytes.data(), stride);
      sample[i] = EntryOf(splat.Parse(bytes.data(), record, 1), 0, record);
    }
  });
  return sample;
}

// The first codes of the chunks after the first.
std::vector<uint64_t> Splitters(const Curve& curve, const std::vector<Entry>& sample,
                                size_t chunks) {
  std::vector<uint64_t> codes;
  for (const Entry& entry : sample) codes.push_back(curve.CodeOf(entry));
  std::sort(codes.begin(), codes.end());
  std::vector<uint64_t> splitters;
  for (size_t i = 1; i < chunks; ++i) splitters.push_back(codes[i * codes.size() / chunks]);
  splitters.erase(std::unique(splitters.begin(), splitters.end()), splitters.end());
  return splitters;
}

// Cuts sorted entries into blocks and writes their record numbers.
class BlockWriter {
 public:
  BlockWriter(AtomicFile& file, uint64_t offset, uint32_t block)
      : file_(file), offset_(offset), block_(block) {}

  void Add(const std::vector<Placed>& sorted) {
    for (size_t begin = 0; begin < sorted.size();) {
      size_t end = begin;
      while (end < sorted.size() && end - begin < block_ &&
             Curve::SizeClass(sorted[end].code) == Curve::SizeClass(sorted[begin].code)) {
        ++end;
      }
      AddBlock({sorted.data() + begin, end - begin});
      begin = end;
    }
  }

  const std::vector<IndexBlock>& blocks() const { return blocks_; }
  uint64_t offset() const { return offset_; }

 private:
  void AddBlock(std::span<const Placed> members) {
    IndexBlock block{};
    block.bounds.low = block.bounds.high = members[0].entry.mean;
    std::vector<uint32_t> records;
    for (const Placed& member : members) {
      for (size_t i = 0; i < 3; ++i) {
        block.bounds.low[i] = std::min(block.bounds.low[i], member.entry.mean[i]);
        block.bounds.high[i] = std::max(block.bounds.high[i], member.entry.mean[i]);
      }
      block.bounds.sigma = std::max(block.bounds.sigma, member.entry.sigma);
      records.push_back(member.entry.record);
    }
    std::sort(records.begin(), records.end());
    std::string bytes;
    uint64_t next = 0;
    for (const uint32_t record : records) {
      uint64_t value = record - next;
      for (; value >= 0x80; value >>= 7) bytes += static_cast<char>(value | 0x80);
      bytes += static_cast<char>(value);
      next = uint64_t{record} + 1;
    }
    block.count = static_cast<uint32_t>(records.size());
    block.offset = offset_;
    block.bytes = static_cast<uint32_t>(bytes.size());
    block.checksum = static_cast<uint32_t>(Xxh64(bytes));
    file_.Write(bytes);
    offset_ += bytes.size();
    blocks_.push_back(block);
  }

  AtomicFile& file_;
  uint64_t offset_;
  uint32_t block_;
  std::vector<IndexBlock> blocks_;
};

// The whole pass; returns the file's checksum.
uint64_t SortIntoChunks(const PlyFile& splat, const Curve& curve,
                        const std::vector<uint64_t>& splitters, ChunkStore* store,
                        Monitor& monitor) {
  const uint64_t stride = splat.record_bytes();
  const uint64_t piece = std::max<uint64_t>(1, kReadBytes / stride);  // records
  FilePass pass(splat, piece * stride);
  for (uint64_t first = 0; first < splat.count(); first += piece) {
    monitor.Step(kStage, static_cast<double>(first), 1.25 * static_cast<double>(splat.count()));
    const std::string& bytes = pass.Next();
    const size_t records = bytes.size() / stride;
    const size_t parts = (records + kPartRecords - 1) / kPartRecords;
    std::vector<std::vector<std::pair<uint32_t, Entry>>> found(parts);
    ParallelTasks(static_cast<int64_t>(parts), [&](int64_t task) {
      const size_t begin = static_cast<size_t>(task) * kPartRecords;
      const size_t count = std::min(kPartRecords, records - begin);
      const GaussianModel model = splat.Parse(bytes.data() + begin * stride, first + begin, count);
      auto& out = found[static_cast<size_t>(task)];
      out.reserve(count);
      for (size_t g = 0; g < count; ++g) {
        const Entry entry = EntryOf(model, g, first + begin + g);
        const auto chunk =
            std::upper_bound(splitters.begin(), splitters.end(), curve.CodeOf(entry)) -
            splitters.begin();
        out.emplace_back(static_cast<uint32_t>(chunk), entry);
      }
    });
    for (const auto& part : found) {
      for (const auto& [chunk, entry] : part) store->Add(chunk, entry);
    }
  }
  return pass.Checksum();
}

std::vector<Placed> Sorted(const Curve& curve, const std::vector<Entry>& entries) {
  std::vector<Placed> placed(entries.size());
  std::transform(entries.begin(), entries.end(), placed.begin(), [&](const Entry& entry) {
    return Placed{curve.CodeOf(entry), entry};
  });
  std::sort(placed.begin(), placed.end());
  return placed;
}

}  // namespace

void SplatIndex::Build(const PlyFile& splat, const fs::path& path, const SplatIndexOptions& options,
                       Monitor& monitor) {
  CheckOption(options.block > 0, "a block of an index holds at least one Gaussian");
  CheckReplaceable(path);
  AtomicFile file(path);
  const std::vector<Entry> sample = Sample(splat);
  const Curve curve(sample);
  // Two chunks are sorted at a time, with their codes.
  const size_t chunk_bytes = std::max<size_t>(size_t{1} << 12, options.memory_bytes / 8);
  const size_t chunks = static_cast<size_t>(splat.count() * sizeof(Placed) / chunk_bytes + 1);
  const std::vector<uint64_t> splitters = Splitters(curve, sample, chunks);
  ChunkStore store(splitters.size() + 1, options.memory_bytes / 2, path);
  IndexHeader header{};
  header.splat_xxh64 = SortIntoChunks(splat, curve, splitters, &store, monitor);

  file.Write(&header, sizeof(header));
  BlockWriter blocks(file, sizeof(header), options.block);
  constexpr size_t kAtOnce = 2;
  const size_t num_chunks = splitters.size() + 1;
  for (size_t first = 0; first < num_chunks; first += kAtOnce) {
    monitor.Step(kStage, 4 + static_cast<double>(first) / static_cast<double>(num_chunks), 5);
    std::array<std::vector<Placed>, kAtOnce> sorted;
    const size_t batch = std::min(kAtOnce, num_chunks - first);
    ParallelTasks(static_cast<int64_t>(batch), [&](int64_t i) {
      const auto at = static_cast<size_t>(i);
      sorted[at] = Sorted(curve, store.Take(first + at));
    });
    for (size_t i = 0; i < batch; ++i) blocks.Add(sorted[i]);
  }
  std::copy_n(kIndexMagic, sizeof(kIndexMagic), header.magic);
  header.version = kSplatIndexVersion;
  header.header_bytes = sizeof(header);
  header.splat_bytes = splat.stamp().bytes;
  header.splat_modified_ns = splat.stamp().modified_ns;
  header.count = splat.count();
  header.first_byte = splat.first_byte();
  header.record_bytes = splat.record_bytes();
  header.num_blocks = blocks.blocks().size();
  header.table_offset = blocks.offset();
  const std::string_view table(reinterpret_cast<const char*>(blocks.blocks().data()),
                               blocks.blocks().size() * sizeof(IndexBlock));
  header.table_xxh64 = Xxh64(table);
  header.header_xxh64 =
      Xxh64({reinterpret_cast<const char*>(&header), offsetof(IndexHeader, header_xxh64)});
  file.Write(table);
  file.WriteAt(0, &header, sizeof(header));
  file.Sync();
  splat.CheckUnchanged();
  file.Commit();
  monitor.Step(kStage, 1, 1);
}

}  // namespace retint
