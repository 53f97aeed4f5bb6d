// SPDX-License-Identifier: BSD-3-Clause
// Photos, pictures and masks on disk. Values are the file's own (no gamma is undone); EXIF
// orientation is ignored, as COLMAP does. Readers throw InputError for a missing, cut-off or
// damaged file; writers put a whole file in place or none (RunError).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

// More pixels than any camera has: a picture with more is an InputError before it is decoded.
inline constexpr int64_t kMostPixels = int64_t{1} << 28;

// Throws if a picture of that size is of no use. It is called before the pixels are decoded, if the
// header of the format is known (ImageSizeIn()), and after.
using SizeCheck = std::function<void(int width, int height)>;

// RGB in [0, 1] from 8 or 16 bits a channel; gray becomes RGB, alpha is dropped.
Image ReadImage(const std::filesystem::path& path, const SizeCheck& check = {});
Image8 ReadImage8(const std::filesystem::path& path);
// `picture` after a round trip through a JPEG with the quantization and subsampling of the one
// whose bytes are `file`. So it has the losses that such a file would have. None if `file` is not a
// whole JPEG of three channels.
std::optional<Image8> AsJpegHolds(const Image8& picture, std::string_view file);
// Whether no pixel of a picture is transparent.
bool IsOpaque(const std::filesystem::path& path);

// A mask from any picture, 0 outside and 255 inside. If the picture has an alpha channel that is
// not opaque everywhere, it is its alpha. Else it is the largest of its color channels, so that
// strokes of any color on black count. 16 bits become 8.
Mask ReadMask(const std::filesystem::path& path, const SizeCheck& check = {});
// Also checks the size: InputError naming both.
Mask ReadMask(const std::filesystem::path& path, int width, int height);
// The user's own mask of a view. Its brightest pixels count as opaque, so that a dark brush on
// black selects the same pixels as a white one. InputError also if no pixel is selected.
Mask ReadBrushMask(const std::filesystem::path& path, int width, int height);

// 8-bit PNG; floats are clamped to [0, 1] and rounded.
void WritePng(const std::filesystem::path& path, const Image& image);
void WritePng(const std::filesystem::path& path, const Image8& image);
void WritePng(const std::filesystem::path& path, const Mask& mask);
void WritePng(const std::filesystem::path& path, const ScalarImage& image);
std::string EncodePng(const Mask& mask);  // the file's bytes
// The bytes of a JPEG of quality 1 to 100. RunError when it cannot be encoded.
std::string EncodeJpeg(const Image8& image, int quality);

// <folder>/<image name><suffix>, COLMAP's own naming of masks ("sub/0001.jpg.png"), also for any
// other output that goes by view. InputError for an image name that would leave the folder.
std::filesystem::path ViewFile(const std::filesystem::path& folder, std::string_view image_name,
                               std::string_view suffix = ".png");

// One mask a view, written at ViewFile(folder, name), read by any name of mask_names.h. A view
// without a file has no entry; InputError when no view of `model` has one, or when a mask is not of
// its camera's size.
std::map<ViewId, Mask> ReadMasks(const std::filesystem::path& folder, const Reconstruction& model);
void WriteMasks(const std::filesystem::path& folder, const Reconstruction& model,
                const std::map<ViewId, Mask>& masks);

}  // namespace retint
