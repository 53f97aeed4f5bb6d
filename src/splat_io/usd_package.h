// SPDX-License-Identifier: BSD-3-Clause
// .usdz packages: zip archives of uncompressed, unencrypted files that begin at multiples of 64
// bytes (openusd.org, "Usdz File Format Specification").
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.h"

namespace retint {

struct UsdPackageFile {
  std::string name;
  std::string_view bytes;
};

// The files in order; the first is the stage's layer. InputError of `path` for an archive that is
// damaged or empty, or has compressed or encrypted files.
std::vector<UsdPackageFile> ReadUsdPackage(std::string_view archive,
                                           const std::filesystem::path& path);

// Whether `head`, the first bytes of a file, belongs to an archive that begins with a layer.
bool IsUsdPackage(std::string_view head);

// Writes a package file by file. RunError if the archive would exceed 4 GiB.
class UsdPackageWriter {
 public:
  UsdPackageWriter(AtomicFile& file, const std::filesystem::path& path)
      : file_(file), path_(path) {}

  // `content` passes the file's bytes to its argument, piece by piece.
  using Write = std::function<void(std::string_view)>;
  void Add(const std::string& name, const std::function<void(const Write&)>& content);
  void Finish();

 private:
  struct Entry {
    std::string name;
    uint64_t at = 0, bytes = 0;
    uint32_t checksum = 0;
    size_t padding = 0;
  };
  static std::string LocalHeader(const Entry& entry);
  void CheckSize(uint64_t at) const;

  AtomicFile& file_;
  const std::filesystem::path& path_;
  std::vector<Entry> entries_;
  uint64_t at_ = 0;
};

}  // namespace retint
