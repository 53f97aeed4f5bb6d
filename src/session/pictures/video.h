// SPDX-License-Identifier: BSD-3-Clause
// Films without another program: motion JPEG in an AVI file, which VLC, mpv, ffmpeg and most
// editors of video open. Each picture is a JPEG of its own, so a file is some five times as large
// as one of a modern codec.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "scene/image.h"

namespace retint {

// Layout: "AVI RIFF File Reference" (Microsoft): one video stream, an index at the end. Pictures
// are kept in memory, encoded, until the file is written whole.
class AviWriter {
 public:
  // Pixels of each picture, pictures a second, quality of the JPEGs from 1 to 100. OptionError for
  // a path that does not end in .avi, and for numbers out of range.
  AviWriter(std::filesystem::path path, int width, int height, double fps, int quality = 90);

  // OptionError for a picture of another size; RunError beyond 2 GB, which is all that the format
  // can hold.
  void Add(const Image8& picture);
  // Writes the file, or throws RunError and leaves what was there. OptionError without a picture.
  void Commit();

 private:
  std::string Header(size_t movie_bytes) const;

  std::filesystem::path path_;
  int width_, height_, quality_;
  double fps_;
  std::vector<std::string> frames_;  // each a chunk's data, padded to an even length
  std::vector<size_t> sizes_;        // without the padding
  size_t bytes_ = 0, largest_ = 0;
};

// The film of <folder>/0000.png, 0001.png, ... (or longer numbers), as ExportFrames() writes them.
// InputError where there is none. Stage: "video".
void FilmOfFrames(const std::filesystem::path& folder, const std::filesystem::path& film,
                  double fps, Monitor& monitor);

}  // namespace retint
