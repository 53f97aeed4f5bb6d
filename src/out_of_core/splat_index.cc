// SPDX-License-Identifier: BSD-3-Clause
#include "out_of_core/splat_index.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

#include "base/checksum.h"
#include "base/error.h"
#include "base/files.h"
#include "base/parallel.h"
#include "out_of_core/index_header.h"

namespace retint {
namespace {

template <typename T>
std::string_view BytesOf(const T* values, size_t count) {
  return {reinterpret_cast<const char*>(values), count * sizeof(T)};
}

[[noreturn]] void FailDamaged(const std::filesystem::path& path) {
  throw InputError(path, "the index is damaged; remove it, and it is built again");
}

uint64_t HeaderChecksum(const IndexHeader& header) {
  return Xxh64(BytesOf(&header, 1).substr(0, offsetof(IndexHeader, header_xxh64)));
}

void CheckHeader(const IndexHeader& header, const InputFile& file, const PlyFile& splat) {
  const std::filesystem::path& path = file.path();
  if (std::memcmp(header.magic, kIndexMagic, sizeof(kIndexMagic)) != 0) {
    throw InputError(path, "is not an index of a splat");
  }
  if (header.version != kSplatIndexVersion || header.header_bytes != sizeof(IndexHeader)) {
    throw InputError(path, "is an index of version " + std::to_string(header.version) +
                               ", this program reads " + std::to_string(kSplatIndexVersion));
  }
  if (header.header_xxh64 != HeaderChecksum(header)) FailDamaged(path);
  const uint64_t table = header.num_blocks * sizeof(IndexBlock);
  if (header.num_blocks > file.size() / sizeof(IndexBlock) || header.table_offset > file.size() ||
      file.size() - header.table_offset != table) {
    throw InputError(path, "truncated: the index announces " + std::to_string(header.num_blocks) +
                               " blocks, which it does not hold");
  }
  if (header.splat_bytes != splat.stamp().bytes || header.count != splat.count() ||
      header.first_byte != splat.first_byte() || header.record_bytes != splat.record_bytes()) {
    throw InputError(path, "is the index of another file than " + splat.path().string());
  }
  if (header.splat_modified_ns != splat.stamp().modified_ns) {
    throw InputError(path, splat.path().string() + " was written after its index");
  }
}

// InputError unless the numbers fit the block.
void Decode(const IndexBlock& block, std::string_view bytes, uint64_t count,
            const std::filesystem::path& path, uint32_t* to) {
  if (static_cast<uint32_t>(Xxh64(bytes)) != block.checksum) FailDamaged(path);
  uint64_t next = 0;
  size_t at = 0;
  for (uint32_t i = 0; i < block.count; ++i) {
    uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      if (at == bytes.size() || shift > 28) FailDamaged(path);
      const auto byte = static_cast<uint8_t>(bytes[at++]);
      value |= uint64_t{byte & 0x7fU} << shift;
      if (byte < 0x80) break;
    }
    next += value;
    if (next >= count) FailDamaged(path);
    to[i] = static_cast<uint32_t>(next++);
  }
  if (at != bytes.size()) FailDamaged(path);
}

// Those that are set.
std::vector<uint32_t> NumbersOf(const std::vector<uint8_t>& flags) {
  std::vector<uint32_t> numbers;
  for (size_t b = 0; b < flags.size(); ++b) {
    if (flags[b]) numbers.push_back(static_cast<uint32_t>(b));
  }
  return numbers;
}

bool Reaches(const GaussianBounds& bounds, const Eigen::AlignedBox3f& box) {
  const Eigen::AlignedBox3f means(Eigen::Vector3f(bounds.low.data()),
                                  Eigen::Vector3f(bounds.high.data()));
  return box.intersects(means);
}

}  // namespace

std::filesystem::path SplatIndex::PathFor(const std::filesystem::path& splat) {
  return splat.string() + ".index";
}

SplatIndex::SplatIndex(const std::filesystem::path& path, const PlyFile& splat)
    : file_(std::make_unique<InputFile>(path, /*is_input=*/false)) {
  IndexHeader header{};
  if (file_->size() < sizeof(header)) throw InputError(path, "truncated: has no index's header");
  file_->ReadAt(0, &header, sizeof(header));
  CheckHeader(header, *file_, splat);
  count_ = header.count;
  splat_xxh64_ = header.splat_xxh64;
  blocks_.resize(header.num_blocks);
  file_->ReadAt(header.table_offset, blocks_.data(), blocks_.size() * sizeof(IndexBlock));
  if (Xxh64(BytesOf(blocks_.data(), blocks_.size())) != header.table_xxh64) FailDamaged(path);
  uint64_t sum = 0;
  for (const IndexBlock& block : blocks_) {
    sum += block.count;
    // A record's number takes a byte at least.
    if (block.offset > header.table_offset || block.bytes > header.table_offset - block.offset ||
        block.count > block.bytes) {
      FailDamaged(path);
    }
  }
  if (sum != count_) FailDamaged(path);
}

bool SplatIndex::IsReplaceable(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) return true;
  const InputFile file(path, /*is_input=*/false);
  char head[sizeof(kIndexMagic)] = {};
  const size_t size = std::min<size_t>(file.size(), sizeof(head));
  file.ReadAt(0, head, size);
  return std::memcmp(head, kIndexMagic, size) == 0;
}

void SplatIndex::CheckReplaceable(const std::filesystem::path& path) {
  if (IsReplaceable(path)) return;
  throw InputError(path, "is not an index of a splat, and is not written over; name another file");
}

void SplatIndex::WriteFor(const PlyFile& copy, const std::filesystem::path& path) const {
  IndexHeader header{};
  file_->ReadAt(0, &header, sizeof(header));
  // The copy may lack bytes that follow the records.
  CheckOption(copy.stamp().bytes <= header.splat_bytes && copy.count() == header.count &&
                  copy.first_byte() == header.first_byte &&
                  copy.record_bytes() == header.record_bytes,
              copy.path().string() + " is no copy of the splat that is indexed");
  header.splat_bytes = copy.stamp().bytes;
  header.splat_modified_ns = copy.stamp().modified_ns;
  header.splat_xxh64 = 0;
  header.header_xxh64 = HeaderChecksum(header);
  AtomicFile file(path);
  file.CopyFrom(file_->descriptor(), file_->size(), [](uint64_t) {});
  file.WriteAt(0, &header, sizeof(header));
  file.Sync();
  file.Commit();
}

SplatIndex SplatIndex::OpenOrBuild(const PlyFile& splat, const std::filesystem::path& path,
                                   const SplatIndexOptions& options, Monitor& monitor,
                                   std::string* built) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) {
    *built = "there was no " + path.string();
  } else {
    try {
      return SplatIndex(path, splat);
    } catch (const InputError& error) {
      *built = error.what();
    }
  }
  Build(splat, path, options, monitor);
  return SplatIndex(path, splat);
}

std::vector<uint32_t> SplatIndex::Visible(std::span<const Frustum> views,
                                          const std::optional<Eigen::AlignedBox3f>& within) const {
  std::vector<uint8_t> seen(blocks_.size());
  ParallelRanges(static_cast<int64_t>(blocks_.size()), 256, [&](int64_t begin, int64_t end) {
    for (auto b = static_cast<size_t>(begin); b < static_cast<size_t>(end); ++b) {
      const GaussianBounds& bounds = blocks_[b].bounds;
      seen[b] = (within && Reaches(bounds, *within)) ||
                std::any_of(views.begin(), views.end(),
                            [&](const Frustum& view) { return view.MaySee(bounds); });
    }
  });
  return NumbersOf(seen);
}

uint64_t SplatIndex::CountOf(std::span<const uint32_t> blocks) const {
  uint64_t count = 0;
  for (const uint32_t b : blocks) count += blocks_[b].count;
  return count;
}

void SplatIndex::ReadBlock(const IndexBlock& block, std::string* bytes, uint32_t* to) const {
  bytes->resize(block.bytes);
  file_->ReadAt(block.offset, bytes->data(), bytes->size());
  Decode(block, *bytes, count_, path(), to);
}

std::vector<uint32_t> SplatIndex::Holding(std::span<const uint32_t> records) const {
  std::vector<bool> wanted(count_);
  for (const uint32_t record : records) wanted.at(record) = true;
  std::vector<uint8_t> holds(blocks_.size());
  ParallelRanges(static_cast<int64_t>(blocks_.size()), 256, [&](int64_t begin, int64_t end) {
    std::string bytes;
    std::vector<uint32_t> members;
    for (auto b = static_cast<size_t>(begin); b < static_cast<size_t>(end); ++b) {
      members.resize(blocks_[b].count);
      ReadBlock(blocks_[b], &bytes, members.data());
      holds[b] = std::any_of(members.begin(), members.end(), [&](uint32_t r) { return wanted[r]; });
    }
  });
  return NumbersOf(holds);
}

std::vector<uint32_t> SplatIndex::Records(std::span<const uint32_t> blocks) const {
  std::vector<uint32_t> records(CountOf(blocks));
  std::vector<uint64_t> first(blocks.size());
  uint64_t sum = 0;
  for (size_t i = 0; i < blocks.size(); ++i) {
    first[i] = sum;
    sum += blocks_[blocks[i]].count;
  }
  ParallelRanges(static_cast<int64_t>(blocks.size()), 64, [&](int64_t begin, int64_t end) {
    std::string bytes;
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      ReadBlock(blocks_[blocks[i]], &bytes, records.data() + first[i]);
    }
  });
  std::sort(records.begin(), records.end());
  if (std::adjacent_find(records.begin(), records.end()) != records.end()) FailDamaged(path());
  return records;
}

}  // namespace retint
