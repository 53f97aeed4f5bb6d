// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/sog_files.h"

#include <webp/decode.h>
#include <zip.h>

#include "base/error.h"
#include "base/files.h"
#include "splat_io/compression.h"
#include "splat_io/input_file.h"

namespace retint {
namespace {

class ZipBundle : public SogFiles {
 public:
  explicit ZipBundle(const std::filesystem::path& path)
      : path_(path), bytes_(InputFile(path).size()) {
    int code = 0;
    zip_.reset(zip_open(path.c_str(), ZIP_RDONLY, &code));
    if (!zip_) throw InputError(path, "truncated, or the zip archive is damaged");
  }

  std::string Read(const std::string& name) const override {
    zip_stat_t info;
    if (zip_stat(zip_.get(), name.c_str(), 0, &info) != 0 || !(info.valid & ZIP_STAT_SIZE)) {
      throw InputError(path_, "the bundle lacks " + name);
    }
    if (info.size > MostUnpacked(bytes_)) {
      throw InputError(path_, name + " announces " + std::to_string(info.size) +
                                  " bytes, more than the bundle can hold");
    }
    const std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file(
        zip_fopen(zip_.get(), name.c_str(), 0), zip_fclose);
    std::string bytes(file ? info.size : 0, '\0');
    // Reading to the end has the checksum compared.
    char end;
    if (!file || zip_fread(file.get(), bytes.data(), info.size) != zip_int64_t(info.size) ||
        zip_fread(file.get(), &end, 1) != 0) {
      throw InputError(path_, name + " in the bundle is damaged");
    }
    return bytes;
  }

  uint64_t PackedBytes() const override { return bytes_; }

 private:
  std::filesystem::path path_;
  uint64_t bytes_;
  std::unique_ptr<zip_t, void (*)(zip_t*)> zip_{nullptr, zip_discard};
};

class Folder : public SogFiles {
 public:
  explicit Folder(const std::filesystem::path& meta) : meta_(meta) {
    std::error_code code;
    for (const auto& entry : std::filesystem::directory_iterator(Parent(), code)) {
      if (entry.path().extension() == ".webp") bytes_ += entry.file_size(code);
    }
  }

  std::string Read(const std::string& name) const override {
    return ReadFile(name == "meta.json" ? meta_ : Parent() / name);
  }

  uint64_t PackedBytes() const override { return bytes_; }

 private:
  std::filesystem::path Parent() const {
    return meta_.has_parent_path() ? meta_.parent_path() : std::filesystem::path(".");
  }

  std::filesystem::path meta_;
  uint64_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<SogFiles> SogFiles::Open(const std::filesystem::path& path) {
  const InputFile file(path);
  char first = '\0';
  if (file.size() > 0) file.ReadAt(0, &first, 1);
  if (first == 'P') return std::make_unique<ZipBundle>(path);
  return std::make_unique<Folder>(path);
}

RgbaPicture DecodeWebp(const std::string& bytes, uint64_t least_pixels, uint64_t most_pixels,
                       const std::filesystem::path& path, const std::string& what) {
  const auto* data = reinterpret_cast<const uint8_t*>(bytes.data());
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(data, bytes.size(), &features) != VP8_STATUS_OK) {
    throw InputError(path, what + " is no WebP picture, or damaged");
  }
  if (features.format != 2) {
    throw InputError(path, what + " is not a lossless WebP picture: its numbers are lost");
  }
  RgbaPicture picture{features.width, features.height, {}};
  const uint64_t pixels = uint64_t(picture.width) * uint64_t(picture.height);
  if (pixels < least_pixels || pixels > most_pixels) {
    throw InputError(path, what + " has " + std::to_string(pixels) + " pixels, expected " +
                               std::to_string(least_pixels) + " to " + std::to_string(most_pixels));
  }
  picture.rgba.resize(pixels * 4);
  if (!WebPDecodeRGBAInto(data, bytes.size(), picture.rgba.data(), picture.rgba.size(),
                          picture.width * 4)) {
    throw InputError(path, what + " is truncated or damaged");
  }
  return picture;
}

}  // namespace retint
