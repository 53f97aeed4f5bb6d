// SPDX-License-Identifier: BSD-3-Clause
// A photo's file, to be written again with other pixels: in its format, at its size, with its
// metadata (EXIF and with it the orientation, ICC profile, XMP, text).
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "scene/image.h"

namespace retint {

class PhotoFile {
 public:
  // The photo of a camera of this size, of which it may be a larger or a smaller picture, and
  // turned (Workspace::ReadPhoto()). InputError as ReadImage().
  PhotoFile(const std::filesystem::path& path, int width, int height);
  ~PhotoFile();

  // All its pixels, as the camera sees them. Stored pixels that EXIF says must be turned are turned
  // only if that gives the camera's shape.
  Image Shown() const;
  // The file with the pixels of `shown`; nullopt if no value changes. Unchanged values keep their
  // bits; in a JPEG, unchanged blocks of 8 x 8 pixels do. A JPEG keeps its quantization and
  // subsampling, a PNG its depth and alpha. InputError for a JPEG of inks.
  std::optional<std::string> With(const Image& shown) const;
  // Whether With() keeps the metadata: in JPEG and PNG.
  bool KeepsMetadata() const;

 private:
  struct Pixels;
  std::filesystem::path path_;
  std::string bytes_;
  int orientation_ = 1;
  std::unique_ptr<const Pixels> pixels_;
};

}  // namespace retint
