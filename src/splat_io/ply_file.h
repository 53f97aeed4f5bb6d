// SPDX-License-Identifier: BSD-3-Clause
// A 3DGS .ply whose records are read, and patched in a copy, where they lie: of a file larger than
// memory only the requested records are touched.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/monitor.h"
#include "scene/gaussian_model.h"

namespace retint {

// A mark that tells one state of a file from another without reading it.
struct FileStamp {
  uint64_t bytes = 0;
  int64_t modified_ns = 0;  // since the epoch
  bool operator==(const FileStamp&) const = default;
};

// Gaussians are numbered by their records, from 0, in the file's order. The file is open all the
// while, so that one put in its place under the same name is not mixed with it.
class PlyFile {
 public:
  // InputError as PlyCodec::Read() for what the header and the length tell, and for a file that is
  // not binary little-endian, which has no records of one size, or has 2^32 Gaussians or more.
  explicit PlyFile(const std::filesystem::path& path);
  ~PlyFile();
  PlyFile(const PlyFile&) = delete;
  PlyFile& operator=(const PlyFile&) = delete;

  const std::filesystem::path& path() const;
  const FileStamp& stamp() const;
  uint64_t count() const;
  int sh_degree() const;        // of the models that are read, 0 to 3
  bool has_sh_band4() const;    // coefficients of degree 4, which are kept and not shown
  uint64_t first_byte() const;  // of record 0
  uint64_t record_bytes() const;

  // The bytes [offset, offset + size) of the file. Any thread.
  void ReadBytes(uint64_t offset, char* to, size_t size) const;
  // `count` records that lie at `bytes`, of which the first is number `first`, as a model.
  // InputError for a value that is not finite.
  GaussianModel Parse(const char* bytes, uint64_t first, size_t count) const;
  // The Gaussians of these records, ascending, in their order, without the columns that
  // Retint does not interpret and without trailing elements: the file keeps those.
  // Stage "load".
  GaussianModel Read(std::span<const uint32_t> records, Monitor& monitor) const;

  // InputError when the file is no longer the one that was opened: of another length or time, or
  // gone.
  void CheckUnchanged() const;

  // A copy of the file's bytes at `path`, in which record records[i] has the coefficients sh[i],
  // [n, K, 3], the records ascending; degree 4, which nothing edits, is zero there. Bytes that
  // follow all that the header announces are left out, as when a whole splat is written. Shares the
  // file's blocks where the file system can. Atomic: RunError for a failed write, InputError when
  // the file changed meanwhile; then nothing is written. Stage "save".
  void WritePatched(const std::filesystem::path& path, std::span<const uint32_t> records,
                    std::span<const float> sh, Monitor& monitor) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace retint
