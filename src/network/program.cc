// SPDX-License-Identifier: BSD-3-Clause
#include "network/program.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/printable.h"
#include "colmap_io/image_io.h"
#include "network/pixel_file.h"

namespace retint {

namespace fs = std::filesystem;

NetworkProgram::NetworkProgram(std::string command) : command_(std::move(command)) {}

ScalarImage NetworkProgram::Ask(const std::vector<const Image8*>& images,
                                const Monitor& monitor) const {
  const std::lock_guard lock(mutex_);
  try {
    if (!folder_) folder_ = std::make_unique<TemporaryFolder>();
    return Answer(images, monitor);
  } catch (...) {
    // Its next line may belong to this question: the next question starts another program.
    process_.reset();
    throw;
  }
}

ScalarImage NetworkProgram::Answer(const std::vector<const Image8*>& images,
                                   const Monitor& monitor) const {
  std::string line;
  for (size_t i = 0; i < images.size(); ++i) {
    const fs::path path = folder_->path() / fmt::format("image{}.png", i);
    WritePng(path, *images[i]);
    line += path.string() + "\t";
  }
  const fs::path output = folder_->path() / "output";
  for (const char* extension : kPixelFiles) {
    std::error_code ignored;
    fs::remove(output.string() + extension, ignored);
  }
  line += output.string();
  if (!process_) process_ = std::make_unique<LineProcess>(command_);
  const std::string answer = process_->Ask(line, monitor);
  if (answer != "ok") {
    constexpr size_t kMost = 200;
    throw RunError(fmt::format("'{}' answered '{}' instead of ok", command_,
                               Printable(answer.substr(0, kMost))));
  }
  for (const char* extension : kPixelFiles) {
    const fs::path path = output.string() + extension;
    if (!IsFile(path)) continue;
    ScalarImage pixels = ReadPixels(path);
    const Image8& first = *images.front();
    if (pixels.width != first.width || pixels.height != first.height) {
      throw InputError(fmt::format("'{}' wrote {}x{} pixels for an image of {}x{}", command_,
                                   pixels.width, pixels.height, first.width, first.height));
    }
    return pixels;
  }
  throw InputError(fmt::format("'{}' answered ok but wrote no output.npy, .pfm or .png", command_));
}

}  // namespace retint
