// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/sog_files.h"

#include <webp/decode.h>
#include <webp/encode.h>
#include <zip.h>

#include <algorithm>
#include <cctype>
#include <deque>
#include <new>

#include "base/error.h"
#include "base/files.h"
#include "base/input_file.h"
#include "splat_io/compression.h"

namespace retint {
namespace {

// Pictures are packed already. Text shrinks to a tenth.
constexpr uint64_t kSmall = 65536, kMostRatio = 16;
constexpr int kWebpEffort = 4;  // of 9: higher efforts take several times as long for a few percent

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
    const bool knows_packed = (info.valid & ZIP_STAT_COMP_SIZE) != 0;
    if (!knows_packed || info.comp_size > bytes_ ||
        info.size > kSmall + kMostRatio * info.comp_size) {
      throw InputError(path_, name + " announces " + std::to_string(info.size) +
                                  " bytes, more than the bundle can hold");
    }
    const std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file(
        zip_fopen(zip_.get(), name.c_str(), 0), zip_fclose);
    std::string bytes(file ? info.size : 0, '\0');
    // Reading to the end makes libzip compare the checksum.
    char end;
    if (!file || zip_fread(file.get(), bytes.data(), info.size) != zip_int64_t(info.size) ||
        zip_fread(file.get(), &end, 1) != 0) {
      throw InputError(path_, name + " in the bundle is damaged");
    }
    return bytes;
  }

  std::vector<std::filesystem::path> Paths(const std::vector<std::string>&) const override {
    return {path_};
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
    for (const std::filesystem::path& path : ListFolder(Parent())) {
      const uint64_t size =
          path.extension() == ".webp" ? std::filesystem::file_size(path, code) : 0;
      if (!code) bytes_ += size;
    }
  }

  std::string Read(const std::string& name) const override { return ReadFile(PathOf(name)); }

  std::vector<std::filesystem::path> Paths(const std::vector<std::string>& names) const override {
    std::vector<std::filesystem::path> paths;
    for (const std::string& name : names) paths.push_back(PathOf(name));
    return paths;
  }

  uint64_t PackedBytes() const override { return bytes_; }

 private:
  // The meta.json may have another name.
  std::filesystem::path PathOf(const std::string& name) const {
    return name == "meta.json" ? meta_ : Parent() / name;
  }

  std::filesystem::path Parent() const {
    return meta_.has_parent_path() ? meta_.parent_path() : std::filesystem::path(".");
  }

  std::filesystem::path meta_;
  uint64_t bytes_ = 0;
};

constexpr zip_int64_t kNoDate =
    315532800;  // 1980, the earliest in a zip: bytes do not depend on the date

[[noreturn]] void FailZip() { throw RunError("a zip bundle cannot be made"); }

// meta.json comes first, because it tells a SOG from other archives.
std::string Zip(const std::map<std::string, std::string>& files) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* const bundle = zip_source_buffer_create(nullptr, 0, 0, &error);
  if (!bundle) FailZip();
  const std::unique_ptr<zip_source_t, void (*)(zip_source_t*)> free_bundle(bundle, zip_source_free);
  zip_source_keep(bundle);  // closing the archive releases it once
  zip_t* const zip = zip_open_from_source(bundle, ZIP_TRUNCATE, &error);
  if (!zip) {
    zip_source_free(bundle);
    FailZip();
  }
  const auto add = [&](const std::string& name, const std::string& bytes) {
    zip_source_t* const source = zip_source_buffer(zip, bytes.data(), bytes.size(), 0);
    const zip_int64_t index =
        source ? zip_file_add(zip, name.c_str(), source, ZIP_FL_ENC_UTF_8) : -1;
    if (source && index < 0) zip_source_free(source);
    if (index < 0) return false;
    const auto at = static_cast<zip_uint64_t>(index);
    return zip_set_file_compression(zip, at, ZIP_CM_STORE, 0) == 0 &&
           zip_file_set_mtime(zip, at, kNoDate, 0) == 0;
  };
  bool added = add("meta.json", files.at("meta.json"));
  for (const auto& [name, bytes] : files) added &= name == "meta.json" || add(name, bytes);
  if (!added || zip_close(zip) != 0) {
    zip_discard(zip);
    FailZip();
  }
  zip_stat_t info;
  std::string bytes;
  if (zip_source_stat(bundle, &info) != 0 || zip_source_open(bundle) != 0) FailZip();
  bytes.resize(info.size);
  const zip_int64_t got = zip_source_read(bundle, bytes.data(), bytes.size());
  zip_source_close(bundle);
  if (got != static_cast<zip_int64_t>(bytes.size())) FailZip();
  return bytes;
}

bool IsBundle(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".sog";
}

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

std::string EncodeWebp(const RgbaPicture& picture) {
  WebPConfig config;
  WebPPicture webp;
  if (!WebPConfigInit(&config) || !WebPPictureInit(&webp)) throw std::bad_alloc();
  WebPConfigLosslessPreset(&config, kWebpEffort);
  config.exact = 1;
  webp.use_argb = 1;
  webp.width = picture.width;
  webp.height = picture.height;
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  webp.writer = WebPMemoryWrite;
  webp.custom_ptr = &writer;
  const bool done = WebPPictureImportRGBA(&webp, picture.rgba.data(), 4 * picture.width) != 0 &&
                    WebPEncode(&config, &webp) != 0;
  WebPPictureFree(&webp);
  std::string bytes(reinterpret_cast<const char*>(writer.mem), done ? writer.size : 0);
  WebPMemoryWriterClear(&writer);
  if (!done) throw std::bad_alloc();
  return bytes;
}

void WriteSogFiles(const std::filesystem::path& path,
                   const std::map<std::string, std::string>& files) {
  if (IsBundle(path)) return WriteFile(path, Zip(files));
  // All files are on disk before the first is put in place.
  std::deque<AtomicFile> staged;
  for (const auto& [name, bytes] : files) {
    if (name == "meta.json") continue;
    staged.emplace_back(path.parent_path() / name).Write(bytes);
  }
  staged.emplace_back(path).Write(files.at("meta.json"));
  for (AtomicFile& file : staged) file.Sync();
  for (AtomicFile& file : staged) file.Commit();
}

}  // namespace retint
