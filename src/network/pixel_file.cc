// SPDX-License-Identifier: BSD-3-Clause
#include "network/pixel_file.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/error.h"
#include "base/files.h"
#include "base/printable.h"
#include "colmap_io/image_io.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// Numbers of a file, least significant byte first unless `swapped`.
template <typename T>
void Convert(std::string_view bytes, bool swapped, std::vector<float>& out) {
  for (size_t i = 0; i < out.size(); ++i) {
    char value[sizeof(T)];
    std::memcpy(value, bytes.data() + i * sizeof(T), sizeof(T));
    if (swapped) std::reverse(value, value + sizeof(T));
    out[i] = float(std::bit_cast<T>(value));
  }
}
template <>
void Convert<Eigen::half>(std::string_view bytes, bool swapped, std::vector<float>& out) {
  std::vector<float> bits(out.size());
  Convert<uint16_t>(bytes, swapped, bits);  // exact
  for (size_t i = 0; i < out.size(); ++i) {
    out[i] = float(Eigen::numext::bit_cast<Eigen::half>(uint16_t(bits[i])));
  }
}

struct NpyType {
  std::string_view name;  // without the byte order
  size_t bytes;
  void (*convert)(std::string_view, bool, std::vector<float>&);
};
const NpyType kNpyTypes[] = {
    {"b1", 1, Convert<uint8_t>},  {"u1", 1, Convert<uint8_t>},     {"i1", 1, Convert<int8_t>},
    {"u2", 2, Convert<uint16_t>}, {"i2", 2, Convert<int16_t>},     {"u4", 4, Convert<uint32_t>},
    {"i4", 4, Convert<int32_t>},  {"f2", 2, Convert<Eigen::half>}, {"f4", 4, Convert<float>},
    {"f8", 8, Convert<double>},
};

// Of numbers that take `bytes` each, if the file has `available` bytes of them.
ScalarImage ImageOf(const fs::path& path, int64_t width, int64_t height, size_t bytes,
                    size_t available) {
  if (width <= 0 || height <= 0 || width > kMostPixels / height) {
    throw InputError(path, "has no pixels, or more than a picture has");
  }
  if (available != size_t(width * height) * bytes) {
    throw InputError(path, "does not hold as many numbers as its header says");
  }
  return {int(width), int(height)};
}

// The text after `key` in the header's dictionary.
std::string_view After(const fs::path& path, std::string_view header, std::string_view key) {
  const size_t at = header.find(key);
  if (at == std::string_view::npos)
    throw InputError(path, "is not an .npy file: no " + std::string(key));
  header.remove_prefix(at + key.size());
  header.remove_prefix(std::min(header.find_first_not_of(": "), header.size()));
  return header;
}

// "(1, 480, 640)" without lengths of 1.
std::vector<int64_t> NpyShape(const fs::path& path, std::string_view text) {
  text = text.substr(0, text.find(')'));
  std::vector<int64_t> shape;
  while (!text.empty()) {
    const size_t digit = text.find_first_of("0123456789");
    if (digit == std::string_view::npos) break;
    text.remove_prefix(digit);
    int64_t length = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
    if (error != std::errc()) throw InputError(path, "has a shape that cannot be read");
    text.remove_prefix(size_t(end - text.data()));
    if (length != 1) shape.push_back(length);
  }
  return shape;
}

ScalarImage ReadNpy(const fs::path& path) {
  const std::string file = ReadFile(path);
  constexpr std::string_view kMagic = "\x93NUMPY";
  constexpr size_t kShortHead = 10, kLongHead = 12;
  if (!file.starts_with(kMagic) || file.size() < kLongHead)
    throw InputError(path, "is not an .npy file");
  const auto byte = [&](size_t i) { return size_t(uint8_t(file[i])); };
  const bool is_long = byte(6) > 1;
  const size_t head = is_long ? kLongHead : kShortHead;
  size_t length = byte(8) + (byte(9) << 8);
  if (is_long) length += (byte(10) << 16) + (byte(11) << 24);
  if (length > file.size() - head) throw InputError(path, "is cut off");
  const std::string_view header = std::string_view(file).substr(head, length);
  const std::string_view bytes = std::string_view(file).substr(head + length);
  if (!After(path, header, "'fortran_order'").starts_with("False")) {
    throw InputError(path, "is in Fortran's order: save numpy.ascontiguousarray() of it");
  }
  std::string_view type = After(path, header, "'descr'");
  const auto shape = NpyShape(path, After(path, header, "'shape'"));
  if (shape.size() != 2) throw InputError(path, "is not an array [height, width]");
  if (type.size() < 4) throw InputError(path, "is cut off");
  type.remove_prefix(1);  // the quote
  const bool swapped = type[0] == '>';
  const auto found = std::ranges::find(kNpyTypes, type.substr(1, 2), &NpyType::name);
  if (found == std::end(kNpyTypes)) {
    throw InputError(path,
                     "has numbers of type " + Printable(type.substr(0, 3)) + ": save float32");
  }
  ScalarImage image = ImageOf(path, shape[1], shape[0], found->bytes, bytes.size());
  found->convert(bytes, swapped, image.data);
  return image;
}

// "Pf", width, height and scale, each ended by one space or newline; below 0 the scale means
// that the least significant byte comes first. Rows from the bottom.
ScalarImage ReadPfm(const fs::path& path) {
  const std::string file = ReadFile(path);
  std::string_view rest = file;
  const auto word = [&] {
    const size_t end = rest.find_first_of(" \t\r\n");
    if (end == std::string_view::npos) throw InputError(path, "is not a .pfm file");
    const std::string_view found = rest.substr(0, end);
    rest.remove_prefix(end + 1);
    return found;
  };
  const auto number = [&](auto value) {
    const std::string_view text = word();
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc()) throw InputError(path, "is not a .pfm file");
    return value;
  };
  if (word() != "Pf") throw InputError(path, "is not a .pfm file of one channel");
  const int width = number(0), height = number(0);
  const double scale = number(0.0);
  ScalarImage image = ImageOf(path, width, height, sizeof(float), rest.size());
  std::vector<float> values(image.data.size());
  Convert<float>(rest, /*swapped=*/scale > 0, values);
  for (int y = 0; y < height; ++y) {
    std::copy_n(&values[size_t(height - 1 - y) * size_t(width)], width, &image(0, y));
  }
  return image;
}

ScalarImage ReadGrayPng(const fs::path& path) {
  const Image colors = ReadImage(path);
  constexpr size_t kDepthAt = 24;  // of the header's first chunk
  const std::string file = ReadFile(path);
  const bool is_deep = file.size() > kDepthAt && file[kDepthAt] == 16;
  ScalarImage image(colors.width, colors.height);
  for (size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = colors.data[3 * i] * (is_deep ? 65535.0f / 256 : 255.0f);
  }
  return image;
}

}  // namespace

ScalarImage ReadPixels(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".npy") return ReadNpy(path);
  if (extension == ".pfm") return ReadPfm(path);
  return ReadGrayPng(path);
}

}  // namespace retint
