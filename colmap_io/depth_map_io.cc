// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/depth_map_io.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string>

#include "base/files.h"

namespace retint {
namespace {

constexpr size_t kMaxHeaderBytes = 64;
constexpr uint64_t kMaxSide = 1'000'000;

// Reads "W&H&C&" and drops it from `bytes`.
std::array<uint64_t, 3> ReadHeader(const std::filesystem::path& path, std::string_view& bytes) {
  std::array<uint64_t, 3> sizes{};
  const char* at = bytes.data();
  const char* end = at + std::min(bytes.size(), kMaxHeaderBytes);
  for (uint64_t& size : sizes) {
    const auto [next, code] = std::from_chars(at, end, size);
    if (code != std::errc{} || next == end || *next != '&') {
      throw InputError(path, "is not a COLMAP depth map: it does not begin with W&H&1&");
    }
    at = next + 1;
  }
  bytes.remove_prefix(static_cast<size_t>(at - bytes.data()));
  return sizes;
}

}  // namespace

DepthMap ReadDepthMap(const std::filesystem::path& path) {
  const std::string file = ReadFile(path);
  std::string_view bytes = file;
  const auto [width, height, channels] = ReadHeader(path, bytes);
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (channels != 1) {
    throw InputError(path, "has " + std::to_string(channels) + " channels; a depth map has 1");
  }
  if (width == 0 || height == 0 || width > kMaxSide || height > kMaxSide) {
    throw InputError(path, "depth map size " + size + " is out of range");
  }
  if (bytes.size() != width * height * sizeof(float)) {
    throw InputError(path, (bytes.size() < width * height * sizeof(float) ? "truncated: " : "") +
                               size + " depths take " +
                               std::to_string(width * height * sizeof(float)) + " bytes, " +
                               std::to_string(bytes.size()) + " follow the header");
  }
  DepthMap depth(static_cast<int>(width), static_cast<int>(height));
  std::memcpy(depth.data.data(), bytes.data(), bytes.size());
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (!std::isfinite(depth.data[i])) {
      throw InputError(path, "depth at pixel (" + std::to_string(i % width) + ", " +
                                 std::to_string(i / width) + ") is " +
                                 (std::isnan(depth.data[i]) ? "NaN" : "infinite"));
    }
    if (depth.data[i] < 0) depth.data[i] = 0;
  }
  return depth;
}

void WriteDepthMap(const std::filesystem::path& path, const DepthMap& depth) {
  AtomicFile file(path);
  file.Write(std::to_string(depth.width) + "&" + std::to_string(depth.height) + "&1&");
  file.Write(depth.data.data(), depth.data.size() * sizeof(float));
  file.Commit();
}

}  // namespace retint
