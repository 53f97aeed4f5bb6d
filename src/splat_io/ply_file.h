// SPDX-License-Identifier: BSD-3-Clause
// Reads and patches single records of a 3DGS .ply. Files may be larger than memory: only requested
// records are read.
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

// Tells two states of a file apart without reading it.
struct FileStamp {
  uint64_t bytes = 0;
  int64_t modified_ns = 0;  // since the epoch
  bool operator==(const FileStamp&) const = default;
};

// Gaussians are numbered by their records, from 0, in the file's order. The file stays open, so
// that a new file under the same name is not mixed with it.
class PlyFile {
 public:
  // InputError as PlyCodec::Read() for faults of the header and the length. Also for files with
  // 2^32 Gaussians or more, or not binary little-endian, because their records differ in size.
  explicit PlyFile(const std::filesystem::path& path);
  ~PlyFile();
  PlyFile(const PlyFile&) = delete;
  PlyFile& operator=(const PlyFile&) = delete;

  const std::filesystem::path& path() const;
  const FileStamp& stamp() const;
  uint64_t count() const;
  int sh_degree() const;        // of the models that Read() returns, 0 to 3
  bool has_sh_band4() const;    // coefficients of degree 4, which are kept but not shown
  uint64_t first_byte() const;  // of record 0
  uint64_t record_bytes() const;

  // The bytes [offset, offset + size) of the file. Any thread.
  void ReadBytes(uint64_t offset, char* to, size_t size) const;
  // The records at `bytes`, `count` of them, as a model. `first`: number of the first record.
  // InputError for a value that is not finite.
  GaussianModel Parse(const char* bytes, uint64_t first, size_t count) const;
  // The Gaussians of `records`, which must ascend, in that order. Without the columns that
  // Retint does not interpret and without trailing elements: the file keeps them. Stage
  // "load".
  GaussianModel Read(std::span<const uint32_t> records, Monitor& monitor) const;

  // InputError if the file is no longer the opened one: it has another length or time, or is
  // gone.
  void CheckUnchanged() const;

  // Copies the file to `path` with new coefficients: sh[i], [n, K, 3], for record records[i];
  // records must ascend. Coefficients of degree 4 become zero, because nothing edits them. Leaves
  // out bytes after the announced ones, as PlyCodec does. Shares the file's blocks if the file
  // system can. Atomic: RunError for a failed write, InputError if the file has changed; then
  // nothing is written. Stage "save".
  void WritePatched(const std::filesystem::path& path, std::span<const uint32_t> records,
                    std::span<const float> sh, Monitor& monitor) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace retint
