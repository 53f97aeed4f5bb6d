// SPDX-License-Identifier: BSD-3-Clause
// The files of a SOG scene, in a zip bundle or side by side in a folder, with bounds on what they
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
  // A bundle, or the folder of a meta.json. InputError when it cannot be opened.
  static std::unique_ptr<SogFiles> Open(const std::filesystem::path& path);
  // The file `name`, a plain name. InputError naming it when it is missing, damaged, or larger than
  // what a file of the bundle's size may hold.
  virtual std::string Read(const std::string& name) const = 0;
  // Where the files of these names are: the bundle, or each in the folder.
  virtual std::vector<std::filesystem::path> Paths(const std::vector<std::string>& names) const = 0;
  // What all may hold, packed: the bundle's bytes, or the folder's.
  virtual uint64_t PackedBytes() const = 0;
};

struct RgbaPicture {
  int width = 0, height = 0;
  std::vector<uint8_t> rgba;  // [H, W, 4]
};

// Decodes a lossless WebP. `what` names it in an InputError of `path`, when it is damaged, lossy,
// or has fewer than `least_pixels` or more than `most_pixels`.
RgbaPicture DecodeWebp(const std::string& bytes, uint64_t least_pixels, uint64_t most_pixels,
                       const std::filesystem::path& path, const std::string& what);

// A lossless WebP, which keeps the color of transparent pixels too.
std::string EncodeWebp(const RgbaPicture& picture);

// The files by their names: a zip bundle where `path` ends with ".sog", else beside meta.json,
// which is `path` and put in place last. RunError on a failed write.
void WriteSogFiles(const std::filesystem::path& path,
                   const std::map<std::string, std::string>& files);

}  // namespace retint
