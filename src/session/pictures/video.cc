// SPDX-License-Identifier: BSD-3-Clause
#include "session/pictures/video.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"

namespace retint {
namespace {

constexpr size_t kMostBytes = size_t{2'000'000'000};  // readers take sizes for signed numbers
constexpr uint32_t kHasIndex = 0x10, kKeyFrame = 0x10;
constexpr size_t kChunkHead = 8;  // a name and a size
constexpr uint32_t kFpsScale = 1000;

void PutNumber(std::string& bytes, uint32_t value, int count = 4) {
  for (int i = 0; i < count; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFF);
}

// A chunk: its name, the length of its data, the data.
std::string Chunk(const char* name, const std::string& data) {
  std::string bytes = name;
  PutNumber(bytes, static_cast<uint32_t>(data.size()));
  return bytes + data;
}

}  // namespace

AviWriter::AviWriter(std::filesystem::path path, int width, int height, double fps, int quality)
    : path_(std::move(path)), width_(width), height_(height), quality_(quality), fps_(fps) {
  CheckOption(path_.extension() == ".avi", path_.string() + ": the name of a film ends in .avi");
  CheckOption(width >= 1 && height >= 1 && width <= 65535 && height <= 65535,
              "pictures of a film have 1 to 65535 pixels a side");
  CheckOption(fps >= 0.1 && fps <= 1000, "a film has from 0.1 to 1000 pictures a second");
  CheckOption(quality >= 1 && quality <= 100, "the quality of a film is from 1 to 100");
}

void AviWriter::Add(const Image8& picture) {
  CheckOption(picture.width == width_ && picture.height == height_,
              "all pictures of a film have one size");
  std::string frame = EncodeJpeg(picture, quality_);
  sizes_.push_back(frame.size());
  largest_ = std::max(largest_, frame.size());
  if (frame.size() % 2 == 1) frame += '\0';
  // Each picture has an entry of 16 bytes in the index.
  bytes_ += frame.size() + kChunkHead + 16;
  if (bytes_ > kMostBytes) {
    throw RunError(path_.string() +
                   ": a film of this kind cannot be larger than 2 GB; write fewer "
                   "or smaller pictures");
  }
  frames_.push_back(std::move(frame));
}

std::string AviWriter::Header(size_t movie_bytes) const {
  const auto count = static_cast<uint32_t>(frames_.size());
  const auto width = static_cast<uint32_t>(width_), height = static_cast<uint32_t>(height_);
  const auto largest = static_cast<uint32_t>(largest_ + kChunkHead);
  std::string main;  // AVIMAINHEADER
  PutNumber(main, static_cast<uint32_t>(std::lround(1e6 / fps_)));
  PutNumber(main, static_cast<uint32_t>(std::min(4e9, std::ceil(double(largest) * fps_))));
  for (const uint32_t value : {0U, kHasIndex, count, 0U, 1U, largest, width, height}) {
    PutNumber(main, value);
  }
  main.append(16, '\0');
  std::string stream = "vidsMJPG";  // AVISTREAMHEADER
  for (const uint32_t value :
       {0U, 0U, 0U, kFpsScale, static_cast<uint32_t>(std::lround(fps_ * kFpsScale)), 0U, count,
        largest, UINT32_MAX, 0U}) {
    PutNumber(stream, value);
  }
  for (const uint32_t corner : {0U, 0U, width, height}) PutNumber(stream, corner, 2);
  std::string format;  // BITMAPINFOHEADER
  for (const uint32_t value : {40U, width, height}) PutNumber(format, value);
  PutNumber(format, 1, 2);
  PutNumber(format, 24, 2);
  format += "MJPG";
  PutNumber(format, width * height * 3);
  format.append(16, '\0');
  const std::string streams = Chunk("LIST", "strl" + Chunk("strh", stream) + Chunk("strf", format));
  const std::string headers = Chunk("LIST", "hdrl" + Chunk("avih", main) + streams);
  const size_t index_bytes = kChunkHead + 16 * frames_.size();
  std::string bytes = "RIFF";
  PutNumber(bytes,
            static_cast<uint32_t>(4 + headers.size() + kChunkHead + movie_bytes + index_bytes));
  bytes += "AVI " + headers + "LIST";
  PutNumber(bytes, static_cast<uint32_t>(movie_bytes));
  return bytes;
}

void AviWriter::Commit() {
  CheckOption(!frames_.empty(), "a film needs a picture");
  size_t movie_bytes = 4;  // "movi", and the pictures
  for (const std::string& frame : frames_) movie_bytes += kChunkHead + frame.size();
  AtomicFile file(path_);
  file.Write(Header(movie_bytes));
  file.Write("movi");
  std::string index;
  size_t offset = 4;
  for (size_t i = 0; i < frames_.size(); ++i) {
    std::string head = "00dc";
    PutNumber(head, static_cast<uint32_t>(sizes_[i]));
    file.Write(head);
    file.Write(frames_[i]);
    index += "00dc";
    PutNumber(index, kKeyFrame);
    PutNumber(index, static_cast<uint32_t>(offset));
    PutNumber(index, static_cast<uint32_t>(sizes_[i]));
    offset += kChunkHead + frames_[i].size();
  }
  file.Write(Chunk("idx1", index));
  file.Commit();
}

void FilmOfFrames(const std::filesystem::path& folder, const std::filesystem::path& film,
                  double fps, Monitor& monitor) {
  size_t digits = 4;
  while (digits < 9 && !IsFile(folder / (std::string(digits, '0') + ".png"))) ++digits;
  std::vector<std::filesystem::path> files;
  for (;;) {
    const std::string number = std::to_string(files.size());
    if (number.size() > digits) break;
    auto path = folder / (std::string(digits - number.size(), '0') + number + ".png");
    if (!IsFile(path)) break;
    files.push_back(std::move(path));
  }
  if (files.empty()) throw InputError(folder, "holds no frame 0000.png");
  const Image8 first = ReadImage8(files.front());
  AviWriter writer(film, first.width, first.height, fps);
  for (size_t i = 0; i < files.size(); ++i) {
    monitor.Step("video", double(i), double(files.size()));
    writer.Add(i == 0 ? first : ReadImage8(files[i]));
  }
  monitor.ThrowIfCancelled();
  writer.Commit();
}

}  // namespace retint
