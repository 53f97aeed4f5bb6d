// SPDX-License-Identifier: BSD-3-Clause
// Builds an index in one pass over the splat: the entries of the Gaussians are sorted along a curve
// through the scene, on disk if memory does not do, and cut into blocks.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <thread>
#include <utility>

#include "base/checksum.h"
#include "base/error.h"
#include "base/files.h"
#include "base/parallel.h"
#include "out_of_core/entry_sorter.h"
#include "out_of_core/index_header.h"
#include "out_of_core/index_pass.h"
#include "out_of_core/splat_index.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kStage = "index";
constexpr uint64_t kSample = 16384;  // Gaussians

// How the memory of a build is shared out.
struct Plan {
  uint64_t piece = 1;      // records read at a time, and as many read ahead
  size_t part = 1;         // of them, parsed by one task
  size_t capacity = 1;     // entries sorted at a time
  size_t runs = 1;         // that become of them
  size_t merge_bytes = 0;  // of entries read ahead while the runs are merged
  bool works = false;
};

constexpr size_t kFixedBytes = size_t{3} << 20;  // the sample and the file that is written
constexpr size_t kMostPieceBytes = size_t{32} << 20;
constexpr size_t kLeastRunBytes = 4096;  // of a run's entries read ahead: else the disk seeks
constexpr size_t kUsualRunBytes = 65536;
constexpr size_t kMostParts = 64;
constexpr size_t kParsedBytes = 320;  // of a Gaussian's values, with its number

size_t MostBlocks(uint64_t count, const SplatIndexOptions& options) {
  return static_cast<size_t>(count / options.block) + MortonCurve::kSizeClasses;
}

size_t FixedBytes(uint64_t count, const SplatIndexOptions& options) {
  constexpr size_t kMemberBytes = 32;  // of the block under way
  return kFixedBytes + MostBlocks(count, options) * sizeof(IndexBlock) +
         options.block * kMemberBytes;
}

// A quarter of the memory is for reading, an eighth for parsing, the rest for sorting. When runs
// are merged all that is given up.
Plan PlanOf(const PlyFile& splat, size_t bytes) {
  const uint64_t count = std::max<uint64_t>(1, splat.count()), stride = splat.record_bytes();
  const size_t threads = std::max(1U, std::thread::hardware_concurrency());
  Plan plan;
  plan.piece = std::clamp<uint64_t>(std::min(bytes / 8, kMostPieceBytes) / stride, 1, count);
  plan.part = std::clamp<size_t>(bytes / 8 / threads / kParsedBytes, 32, 2048);
  plan.capacity = std::min<uint64_t>(count, bytes / 8 * 5 / sizeof(PlacedEntry));
  plan.merge_bytes = bytes / 2;
  plan.runs = std::min(threads, kMostParts);
  if (plan.capacity < plan.piece) return plan;
  if (plan.capacity < count) {
    const uint64_t whole = plan.capacity / plan.piece * plan.piece;  // is sorted at a time
    const uint64_t times = (count + whole - 1) / whole;
    if (times * kLeastRunBytes > plan.merge_bytes) return plan;
    plan.runs = std::clamp<size_t>(plan.merge_bytes / kUsualRunBytes / times, 1, plan.runs);
  }
  plan.works = true;
  return plan;
}

IndexEntry EntryOf(const GaussianModel& model, size_t g, uint64_t record) {
  IndexEntry entry;
  std::copy_n(&model.means[3 * g], 3, entry.mean.begin());
  const float* const s = &model.log_scales[3 * g];
  // Beyond any scene; an infinite bound would make products with zero that are no number.
  constexpr float kLargest = 1e30F;
  entry.sigma = std::min(kLargest, std::exp(std::max({s[0], s[1], s[2]})));
  entry.record = static_cast<uint32_t>(record);
  return entry;
}

std::vector<IndexEntry> Sample(const PlyFile& splat) {
  const uint64_t count = splat.count(), wanted = std::min(count, kSample);
  const uint64_t stride = splat.record_bytes();
  std::vector<IndexEntry> sample(wanted);
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

// Cuts sorted entries into blocks and writes their record numbers.
class BlockWriter {
 public:
  BlockWriter(AtomicFile& file, uint64_t offset, uint32_t block, size_t most_blocks)
      : file_(file), offset_(offset), block_(block) {
    members_.reserve(block);
    blocks_.reserve(most_blocks);
  }

  void Add(const PlacedEntry& next) {
    const bool fits = members_.size() < block_ &&
                      (members_.empty() || MortonCurve::SizeClass(next.code) == class_);
    if (!fits) Finish();
    class_ = MortonCurve::SizeClass(next.code);
    members_.push_back(next.entry);
  }

  // The last block, too.
  void Finish() {
    if (members_.empty()) return;
    IndexBlock block{};
    block.bounds.low = block.bounds.high = members_[0].mean;
    records_.clear();
    for (const IndexEntry& member : members_) {
      for (size_t i = 0; i < 3; ++i) {
        block.bounds.low[i] = std::min(block.bounds.low[i], member.mean[i]);
        block.bounds.high[i] = std::max(block.bounds.high[i], member.mean[i]);
      }
      block.bounds.sigma = std::max(block.bounds.sigma, member.sigma);
      records_.push_back(member.record);
    }
    std::sort(records_.begin(), records_.end());
    bytes_.clear();
    uint64_t next = 0;
    for (const uint32_t record : records_) {
      uint64_t value = record - next;
      for (; value >= 0x80; value >>= 7) bytes_ += static_cast<char>(value | 0x80);
      bytes_ += static_cast<char>(value);
      next = uint64_t{record} + 1;
    }
    block.count = static_cast<uint32_t>(records_.size());
    block.offset = offset_;
    block.bytes = static_cast<uint32_t>(bytes_.size());
    block.checksum = static_cast<uint32_t>(Xxh64(bytes_));
    file_.Write(bytes_);
    offset_ += bytes_.size();
    blocks_.push_back(block);
    members_.clear();
  }

  const std::vector<IndexBlock>& blocks() const { return blocks_; }
  uint64_t offset() const { return offset_; }

 private:
  AtomicFile& file_;
  uint64_t offset_, class_ = 0;
  uint32_t block_;
  std::vector<IndexEntry> members_;  // of the block under way
  std::vector<uint32_t> records_;
  std::string bytes_;
  std::vector<IndexBlock> blocks_;
};

// The whole pass; returns the file's checksum.
uint64_t ReadEntries(const PlyFile& splat, const MortonCurve& curve, const Plan& plan,
                     EntrySorter* sorter, Monitor& monitor) {
  const uint64_t stride = splat.record_bytes();
  IndexPass pass(splat, plan.piece * stride);
  for (uint64_t first = 0; first < splat.count(); first += plan.piece) {
    monitor.Step(kStage, static_cast<double>(first), 1.25 * static_cast<double>(splat.count()));
    const std::string_view bytes = pass.Next();
    const size_t records = bytes.size() / stride;
    const std::span<PlacedEntry> placed = sorter->Room(records);
    const size_t parts = (records + plan.part - 1) / plan.part;
    ParallelTasks(static_cast<int64_t>(parts), [&](int64_t task) {
      const size_t begin = static_cast<size_t>(task) * plan.part;
      const size_t count = std::min(plan.part, records - begin);
      const GaussianModel model = splat.Parse(bytes.data() + begin * stride, first + begin, count);
      for (size_t g = 0; g < count; ++g) {
        const IndexEntry entry = EntryOf(model, g, first + begin + g);
        placed[begin + g] = {curve.CodeOf(entry), entry};
      }
    });
  }
  return pass.Checksum();
}

void MergeIntoBlocks(EntrySorter* sorter, const Plan& plan, uint64_t count, BlockWriter* blocks,
                     Monitor& monitor) {
  constexpr uint64_t kBetweenReports = 1 << 18;
  uint64_t done = 0;
  sorter->Merge(plan.merge_bytes, [&](const PlacedEntry& entry) {
    if (done++ % kBetweenReports == 0) {
      monitor.Step(kStage, 4 + static_cast<double>(done) / static_cast<double>(count), 5);
    }
    blocks->Add(entry);
  });
  blocks->Finish();
}

}  // namespace

IndexMemoryError::IndexMemoryError(uint64_t count, size_t least_bytes)
    : OptionError("an index of " + std::to_string(count) + " Gaussians takes " +
                  std::to_string((least_bytes >> 20) + 1) + " MiB of memory to build"),
      least_bytes_(least_bytes) {}

size_t SplatIndex::LeastBytes(const PlyFile& splat, const SplatIndexOptions& options) {
  constexpr size_t kFirst = size_t{64} << 10;
  size_t bytes = kFirst;
  while (!PlanOf(splat, bytes).works) bytes += bytes / 8;
  return FixedBytes(splat.count(), options) + bytes;
}

void SplatIndex::Build(const PlyFile& splat, const fs::path& path, const SplatIndexOptions& options,
                       Monitor& monitor) {
  CheckOption(options.block > 0, "a block of an index holds at least one Gaussian");
  CheckReplaceable(path);
  const size_t fixed = FixedBytes(splat.count(), options);
  const Plan plan = PlanOf(splat, std::max(options.memory_bytes, fixed) - fixed);
  if (!plan.works) throw IndexMemoryError(splat.count(), LeastBytes(splat, options));
  AtomicFile file(path);
  const MortonCurve curve(Sample(splat));
  EntrySorter sorter(curve, plan.capacity, plan.runs, path);
  IndexHeader header{};
  header.splat_xxh64 = ReadEntries(splat, curve, plan, &sorter, monitor);

  file.Write(&header, sizeof(header));
  BlockWriter blocks(file, sizeof(header), options.block, MostBlocks(splat.count(), options));
  MergeIntoBlocks(&sorter, plan, splat.count(), &blocks, monitor);
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
