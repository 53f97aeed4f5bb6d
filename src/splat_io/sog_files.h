// SPDX-License-Identifier: BSD-3-Clause
// The files of a SOG scene, in a zip bundle or in a folder, with limits on the bytes that they
// unpack to.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace retint {

class SogFiles {
 public:
  virtual ~SogFiles() = default;
  // Opens a bundle, or the folder of a meta.json. InputError if it cannot be opened.
  static std::unique_ptr<SogFiles> Open(const std::filesystem::path& path);
  // The file `name`, without folders. InputError with the name if it is missing, damaged, or larger
  // than a file in a bundle of this size can be.
  virtual std::string Read(const std::string& name) const = 0;
  // The paths that hold these files: the bundle, or each file in the folder.
  virtual std::vector<std::filesystem::path> Paths(const std::vector<std::string>& names) const = 0;
  // The packed size of all files: the bytes of the bundle or of the folder.
  virtual uint64_t PackedBytes() const = 0;
};

struct RgbaPicture {
  int width = 0, height = 0;
  std::vector<uint8_t> rgba;  // [H, W, 4]
};

// Decodes a lossless WebP. InputError of `path`, naming `what`, if it is damaged, lossy, or has
// fewer than `least_pixels` or more than `most_pixels`.
RgbaPicture DecodeWebp(const std::string& bytes, uint64_t least_pixels, uint64_t most_pixels,
                       const std::filesystem::path& path, const std::string& what);

// Encodes a lossless WebP. Transparent pixels keep their color.
std::string EncodeWebp(const RgbaPicture& picture);

// Writes files by their names: to a zip bundle if `path` ends with ".sog"; otherwise beside `path`,
// a meta.json, which is put in place last. RunError for a failed write.
void WriteSogFiles(const std::filesystem::path& path,
                   const std::map<std::string, std::string>& files);

}  // namespace retint
