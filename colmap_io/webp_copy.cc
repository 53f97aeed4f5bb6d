// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/webp_copy.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace retint {
namespace {

uint32_t Little32(std::string_view bytes) {
  uint32_t value = 0;
  for (size_t i = 4; i-- > 0;) value = value << 8 | static_cast<uint8_t>(bytes[i]);
  return value;
}

}  // namespace

// RIFF (https://developers.google.com/speed/webp/docs/riff_container): chunks of a name, a size and
// so many bytes, padded to an even number.
bool IsLossyWebp(std::string_view file) {
  constexpr size_t kHead = 8;  // of a chunk
  if (!file.starts_with("RIFF") || file.substr(0, 12).substr(8) != "WEBP") return false;
  file.remove_prefix(12);
  while (file.size() >= kHead) {
    if (file.starts_with("VP8 ")) return true;
    const size_t size = Little32(file.substr(4, 4));
    const size_t whole = kHead + size + size % 2;
    if (whole > file.size()) return false;
    file.remove_prefix(whole);
  }
  return false;
}

std::vector<uint8_t> EncodeWebp(const Image8& picture, int quality) {
  const cv::Mat rgb(picture.height, picture.width, CV_8UC3,
                    const_cast<uint8_t*>(picture.data.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<uint8_t> bytes;
  cv::imencode(".webp", bgr, bytes, {cv::IMWRITE_WEBP_QUALITY, quality});
  return bytes;
}

int WebpQuality(const Image8& picture, size_t bytes) {
  int low = 1, high = 100;
  while (low < high) {  // the least whose file is as large
    const int middle = (low + high) / 2;
    if (EncodeWebp(picture, middle).size() < bytes) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

Image8 AsWebpHolds(const Image8& picture, int quality) {
  const cv::Mat bgr = cv::imdecode(EncodeWebp(picture, quality), cv::IMREAD_COLOR);
  Image8 held(bgr.cols, bgr.rows);
  cv::Mat rgb(held.height, held.width, CV_8UC3, held.data.data());
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return held;
}

}  // namespace retint
