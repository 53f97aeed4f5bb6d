// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/image_io.h"

#include <algorithm>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/files.h"
#include "colmap_io/image_check.h"
#include "colmap_io/jpeg_decode.h"
#include "colmap_io/mask_names.h"
#include "colmap_io/photo.h"
#include "scene/image_checks.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

void CheckSize(int width, int height, const fs::path& path, const SizeCheck& check) {
  if (check) check(width, height);
  if (int64_t{width} * height > kMostPixels) {
    throw InputError(path, "is " + SizeText(width, height) + ", more than " +
                               std::to_string(kMostPixels >> 20) + " megapixels");
  }
}

// BGR(A) or gray, 8 or 16 bits, as `flags` ask for.
cv::Mat Decode(const fs::path& path, int flags, const SizeCheck& check = {}) {
  static const bool silenced = [] {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    return true;
  }();
  (void)silenced;
  std::string bytes = ReadFile(path);
  CheckImageFile(bytes, path);
  KeepTiffAsStored(&bytes);
  if (bytes.size() > static_cast<size_t>(std::numeric_limits<int>::max())) {
    throw InputError(path, "is larger than 2 GiB");
  }
  if (const auto size = ImageSizeIn(bytes)) {
    CheckSize(size->first, size->second, path, check);
  }
  cv::Mat pixels;
  if (IsJpeg(bytes)) {
    Image8 rgb = DecodeJpeg(bytes, path);
    for (size_t i = 0; i < rgb.data.size(); i += 3) std::swap(rgb.data[i], rgb.data[i + 2]);
    return cv::Mat(rgb.height, rgb.width, CV_8UC3, rgb.data.data()).clone();
  }
  try {
    const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8U, bytes.data());
    pixels = cv::imdecode(raw, flags);
  } catch (const cv::Exception&) {
    pixels.release();
  }
  if (pixels.empty()) throw InputError(path, "is not a picture that can be read");
  if (pixels.depth() != CV_8U && pixels.depth() != CV_16U) {
    throw InputError(path, "has neither 8 nor 16 bits a channel");
  }
  CheckSize(pixels.cols, pixels.rows, path, check);
  return pixels;
}

// RGB in [0, 1] or [0, 255] out of BGR of either depth.
template <typename From, typename To>
void CopyRgb(const cv::Mat& pixels, To (*convert)(From), PixelArray<To, 3>& out) {
  for (int y = 0; y < out.height; ++y) {
    const From* from = pixels.ptr<From>(y);
    To* to = out.data.data() + out.Index(0, y);
    for (int x = 0; x < out.width; ++x, from += 3, to += 3) {
      to[0] = convert(from[2]);
      to[1] = convert(from[1]);
      to[2] = convert(from[0]);
    }
  }
}

template <typename From>
Mask MaskFrom(const cv::Mat& pixels) {
  const int channels = pixels.channels();
  const bool has_alpha = channels == 2 || channels == 4;
  const int colors = has_alpha ? channels - 1 : channels;
  constexpr From kFull = std::numeric_limits<From>::max();
  Mask by_color(pixels.cols, pixels.rows), by_alpha;
  if (has_alpha) by_alpha = Mask(pixels.cols, pixels.rows);
  bool opaque = true;
  const auto to_8 = [](From value) {
    return static_cast<uint8_t>((value * 255u + kFull / 2) / kFull);
  };
  for (int y = 0; y < pixels.rows; ++y) {
    const From* from = pixels.ptr<From>(y);
    for (int x = 0; x < pixels.cols; ++x, from += channels) {
      by_color(x, y) = to_8(*std::max_element(from, from + colors));
      if (!has_alpha) continue;
      by_alpha(x, y) = to_8(from[colors]);
      opaque &= from[colors] == kFull;
    }
  }
  return opaque ? by_color : by_alpha;
}

// Empty when that fails.
std::vector<uint8_t> PngBytes(int width, int height, int channels, const uint8_t* data) {
  cv::Mat pixels(height, width, CV_8UC(channels), const_cast<uint8_t*>(data));
  std::vector<uint8_t> bytes;
  bool encoded = false;
  try {
    encoded = cv::imencode(".png", pixels, bytes);
  } catch (const cv::Exception&) {
    encoded = false;
  }
  if (!encoded) bytes.clear();
  return bytes;
}

void Encode(const fs::path& path, int width, int height, int channels, const uint8_t* data) {
  if (width <= 0 || height <= 0) throw RunError(path.string() + ": nothing to write, 0 pixels");
  const std::vector<uint8_t> bytes = PngBytes(width, height, channels, data);
  if (bytes.empty()) throw RunError(path.string() + ": cannot encode the picture");
  AtomicFile file(path);
  file.Write(bytes.data(), bytes.size());
  file.Commit();
}

uint8_t To8(float value) {
  // NaN fails the comparison and becomes 0.
  return value > 0 ? static_cast<uint8_t>(std::min(value, 1.0f) * 255.0f + 0.5f) : 0;
}

}  // namespace

constexpr int kColorFlags = cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION;

Image ReadImage(const fs::path& path, const SizeCheck& check) {
  const cv::Mat pixels = Decode(path, kColorFlags, check);
  Image image(pixels.cols, pixels.rows);
  if (pixels.depth() == CV_8U) {
    CopyRgb<uint8_t, float>(
        pixels, [](uint8_t v) { return static_cast<float>(v) / 255.0f; }, image);
  } else {
    CopyRgb<uint16_t, float>(
        pixels, [](uint16_t v) { return static_cast<float>(v) / 65535.0f; }, image);
  }
  return image;
}

Image8 ReadImage8(const fs::path& path) {
  const cv::Mat pixels = Decode(path, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  Image8 image(pixels.cols, pixels.rows);
  CopyRgb<uint8_t, uint8_t>(
      pixels, [](uint8_t v) { return v; }, image);
  return image;
}

std::optional<Image8> AsJpegHolds(const Image8& picture, std::string_view file) {
  return IsJpeg(file) ? RecodeJpeg(picture, file) : std::nullopt;
}

bool IsOpaque(const fs::path& path) {
  const cv::Mat pixels = Decode(path, cv::IMREAD_UNCHANGED);
  if (pixels.channels() != 2 && pixels.channels() != 4) return true;
  cv::Mat alpha;
  cv::extractChannel(pixels, alpha, pixels.channels() - 1);
  double least = 0;
  cv::minMaxLoc(alpha, &least);
  return least >= (alpha.depth() == CV_8U ? 255 : 65535);
}

Mask ReadMask(const fs::path& path, const SizeCheck& check) {
  const cv::Mat pixels = Decode(path, cv::IMREAD_UNCHANGED, check);
  return pixels.depth() == CV_8U ? MaskFrom<uint8_t>(pixels) : MaskFrom<uint16_t>(pixels);
}

Mask ReadMask(const fs::path& path, int width, int height) {
  return ReadMask(path, [&](int mask_width, int mask_height) {
    if (mask_width == width && mask_height == height) return;
    throw InputError(path, "mask is " + SizeText(mask_width, mask_height) + ", its view is " +
                               SizeText(width, height));
  });
}

Mask ReadBrushMask(const fs::path& path, int width, int height) {
  Mask mask = ReadMask(path, width, height);
  const int most = mask.data.empty() ? 0 : *std::max_element(mask.data.begin(), mask.data.end());
  if (most == 0) throw InputError(path, "mask is empty: no pixel is selected");
  for (uint8_t& value : mask.data) value = static_cast<uint8_t>((value * 255 + most / 2) / most);
  return mask;
}

void WritePng(const fs::path& path, const Image& image) {
  std::vector<uint8_t> bgr(image.data.size());
  for (size_t i = 0; i < bgr.size(); i += 3) {
    for (size_t c = 0; c < 3; ++c) bgr[i + c] = To8(image.data[i + 2 - c]);
  }
  Encode(path, image.width, image.height, 3, bgr.data());
}

void WritePng(const fs::path& path, const Image8& image) {
  std::vector<uint8_t> bgr(image.data.size());
  for (size_t i = 0; i < bgr.size(); i += 3) {
    for (size_t c = 0; c < 3; ++c) bgr[i + c] = image.data[i + 2 - c];
  }
  Encode(path, image.width, image.height, 3, bgr.data());
}

void WritePng(const fs::path& path, const Mask& mask) {
  Encode(path, mask.width, mask.height, 1, mask.data.data());
}

void WritePng(const fs::path& path, const ScalarImage& image) {
  std::vector<uint8_t> gray(image.data.size());
  std::transform(image.data.begin(), image.data.end(), gray.begin(), To8);
  Encode(path, image.width, image.height, 1, gray.data());
}

std::string EncodePng(const Mask& mask) {
  std::vector<uint8_t> bytes;
  if (!mask.Empty()) bytes = PngBytes(mask.width, mask.height, 1, mask.data.data());
  if (bytes.empty()) throw RunError("cannot encode a mask");
  return {bytes.begin(), bytes.end()};
}

std::string EncodeJpeg(const Image8& image, int quality) {
  std::vector<uint8_t> bytes;
  if (!image.Empty()) {
    cv::Mat bgr(image.height, image.width, CV_8UC3);
    for (size_t i = 0; i < image.NumPixels(); ++i) {
      for (size_t c = 0; c < 3; ++c) bgr.data[3 * i + c] = image.data[3 * i + 2 - c];
    }
    cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  }
  if (bytes.empty()) throw RunError("cannot encode a picture");
  return {bytes.begin(), bytes.end()};
}

fs::path ViewFile(const fs::path& folder, std::string_view image_name, std::string_view suffix) {
  const fs::path relative = fs::path(image_name).lexically_normal();
  if (image_name.empty() || relative.is_absolute() || *relative.begin() == ".." ||
      !relative.has_filename()) {
    throw InputError("the image name \"" + std::string(image_name) +
                     "\" leads outside the folder of its pictures; rename the image in the model "
                     "(images.bin, images.txt or transforms.json)");
  }
  return folder / (relative.string() + std::string(suffix));
}

std::map<ViewId, Mask> ReadMasks(const fs::path& folder, const Reconstruction& model) {
  std::vector<std::string> names;
  for (const auto& [id, view] : model.views) names.push_back(view.name);
  const auto files = FindMasks(folder, names);
  std::map<ViewId, Mask> masks;
  for (const auto& [id, view] : model.views) {
    const auto file = files.find(view.name);
    if (file == files.end()) continue;
    const Camera& camera = model.cameras.at(view.camera_id);
    masks.emplace(id, ReadMask(file->second, camera.width, camera.height));
  }
  return masks;
}

void WriteMasks(const fs::path& folder, const Reconstruction& model,
                const std::map<ViewId, Mask>& masks) {
  for (const auto& [id, mask] : masks) {
    WritePng(ViewFile(folder, model.views.at(id).name), mask);
  }
}

}  // namespace retint
