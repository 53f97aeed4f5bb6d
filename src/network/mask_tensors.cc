// SPDX-License-Identifier: BSD-3-Clause
#include "network/mask_tensors.h"

namespace retint {

cv::Mat MatOf(const Image8& image) {
  // cv::Mat takes no const data.
  return {image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.data.data())};
}

Tensor PictureTensor(const cv::Mat& rgb, cv::Size size, PixelValues values, bool channels_last) {
  Tensor tensor;
  tensor.shape = {1, 3, size.height, size.width};
  if (channels_last) tensor.shape = {size.height, size.width, 3};
  const auto width = size_t(size.width), pixels = width * size_t(size.height);
  tensor.values.resize(3 * pixels);
  for (int y = 0; y < rgb.rows; ++y) {
    const uint8_t* row = rgb.ptr(y);
    for (int x = 0; x < rgb.cols; ++x) {
      const size_t pixel = size_t(y) * width + size_t(x);
      for (size_t c = 0; c < 3; ++c) {
        tensor.values[channels_last ? 3 * pixel + c : c * pixels + pixel] =
            ToNetwork(values, row[3 * size_t(x) + c], c);
      }
    }
  }
  return tensor;
}

bool IsSide(int64_t side) {
  constexpr int64_t kMostSide = 1 << 14;
  return side != 0 && side <= kMostSide;
}

void MakeSure(cv::Mat* mask) {
  double least = 0, most = 0;
  cv::minMaxLoc(*mask, &least, &most);
  constexpr double kSlack = 0.01;  // of half floats
  if (least >= -kSlack && most <= 1 + kSlack) return;
  cv::exp(-*mask, *mask);
  *mask = 1 / (1 + *mask);
}

}  // namespace retint
