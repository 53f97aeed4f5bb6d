// SPDX-License-Identifier: BSD-3-Clause
// The places of Gaussians in a splat file: blocks of Gaussians that are neighbors in space, with
// their bounds and the numbers of their records. The file's records stay where they are.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "base/error.h"
#include "base/input_file.h"
#include "base/monitor.h"
#include "out_of_core/frustum.h"
#include "splat_io/ply_file.h"

namespace retint {

inline constexpr uint32_t kSplatIndexVersion = 1;

// One block as the file has it, 56 bytes.
struct IndexBlock {
  GaussianBounds bounds;
  uint32_t count = 0;     // Gaussians
  uint64_t offset = 0;    // in the index, of the block's record numbers: ascending, the first and
  uint32_t bytes = 0;     // then the differences less one as variable-length integers (LEB128)
  uint32_t checksum = 0;  // the low half of their XXH64
  uint64_t reserved = 0;
};
static_assert(sizeof(IndexBlock) == 56);

struct SplatIndexOptions {
  uint32_t block = 512;                     // Gaussians of one, at most
  size_t memory_bytes = size_t{512} << 20;  // of the build, whatever the file's size
};

// Of SplatIndex::Build(): options.memory_bytes is too little.
class IndexMemoryError : public OptionError {
 public:
  IndexMemoryError(uint64_t count, size_t least_bytes);
  size_t least_bytes() const { return least_bytes_; }  // that will do

 private:
  size_t least_bytes_;
};

class SplatIndex {
 public:
  // <splat>.index
  static std::filesystem::path PathFor(const std::filesystem::path& splat);
  // InputError for a file that is no index of this version, is damaged, or is of another file than
  // `splat` or of an earlier state of it. Only the table of blocks is read.
  SplatIndex(const std::filesystem::path& path, const PlyFile& splat);

  // Reads `splat` once, in its order, and writes the index, atomically. Values that are not finite
  // are an InputError, as when the file is read whole; so is a file at `path` that is no index.
  // IndexMemoryError before memory is taken. While it works it may put a temporary file of 20 bytes
  // a Gaussian into the index's folder. The index is the same whatever the memory. Stage "index".
  static void Build(const PlyFile& splat, const std::filesystem::path& path,
                    const SplatIndexOptions& options, Monitor& monitor);
  // The least memory of Build(): the table of blocks, 3 MiB, and some of the file.
  static size_t LeastBytes(const PlyFile& splat, const SplatIndexOptions& options);
  // The index at `path`, built where it is missing or cannot be used; then `built` says why.
  static SplatIndex OpenOrBuild(const PlyFile& splat, const std::filesystem::path& path,
                                const SplatIndexOptions& options, Monitor& monitor,
                                std::string* built);

  // Writes this index as that of `copy`, a copy of its splat in which nothing but colors differs,
  // atomically. OptionError where the copy's records are others, RunError where it cannot be
  // written.
  void WriteFor(const PlyFile& copy, const std::filesystem::path& path) const;
  // Whether there is nothing at `path`, or an index, or the beginning of one.
  static bool IsReplaceable(const std::filesystem::path& path);

  std::span<const IndexBlock> blocks() const { return blocks_; }
  uint64_t count() const { return count_; }
  uint64_t splat_xxh64() const { return splat_xxh64_; }  // of the whole file; 0: not known
  const std::filesystem::path& path() const { return file_->path(); }

  // Numbers of the blocks that one of the views may see or that reach into the box; ascending.
  std::vector<uint32_t> Visible(std::span<const Frustum> views,
                                const std::optional<Eigen::AlignedBox3f>& within = {}) const;
  // Numbers of the blocks that hold one of these records; ascending. Reads the whole index.
  // InputError where it is damaged.
  std::vector<uint32_t> Holding(std::span<const uint32_t> records) const;
  uint64_t CountOf(std::span<const uint32_t> blocks) const;  // Gaussians
  // The records of these blocks, ascending. InputError where the index is damaged.
  std::vector<uint32_t> Records(std::span<const uint32_t> blocks) const;

 private:
  // The records of a block, ascending, to `to`; `bytes` is scratch.
  void ReadBlock(const IndexBlock& block, std::string* bytes, uint32_t* to) const;
  static void CheckReplaceable(const std::filesystem::path& path);  // InputError where it is not

  std::unique_ptr<InputFile> file_;
  std::vector<IndexBlock> blocks_;
  uint64_t count_ = 0, splat_xxh64_ = 0;
};

}  // namespace retint
