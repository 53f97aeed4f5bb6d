// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "depth/stereo_pairs.h"

namespace retint {
namespace {

constexpr int kWindow = 7;               // pixels, the window of the least squares
constexpr int kBlur = 5;                 // pixels
constexpr int kIterations = 2;           // more follows the renders' own noise
constexpr float kMaxStep = 0.5f;         // pixels an iteration
constexpr float kMaxMove = 1.0f;         // pixels altogether: beyond, the matcher's value is kept
constexpr float kSmooth = 1.5f;          // pixels of disparity across the window: beyond, an edge
constexpr float kGradientFloor = 2e-3f;  // squared gray levels (of 1) a pixel: textureless below

cv::Mat AsMat(const ScalarImage& image) {
  return cv::Mat(image.height, image.width, CV_32F, const_cast<float*>(image.data.data()));
}

// Adds one shifted view's normal equations of the disparity increment.
void Accumulate(const cv::Mat& gray, const ShiftedGray& view, const cv::Mat& disparity,
                cv::Mat& numerator, cv::Mat& denominator) {
  const Motion motion = MotionOf(view.shift);
  const float motion_x = float(motion.x), motion_y = float(motion.y);
  cv::Mat map(gray.size(), CV_32FC2);
  for (int y = 0; y < map.rows; ++y) {
    const float* s = disparity.ptr<float>(y);
    cv::Vec2f* to = map.ptr<cv::Vec2f>(y);
    for (int x = 0; x < map.cols; ++x) {
      const float move = std::max(s[x], 0.0f);
      to[x] = {float(x - view.rect.x) + motion_x * move, float(y - view.rect.y) + motion_y * move};
    }
  }
  cv::Mat warped;
  cv::remap(AsMat(view.gray), warped, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  // d warped / d s is the gradient along the motion, the mean of both images' (Baker & Matthews
  // 2004, the symmetric form).
  cv::Mat mean = 0.5f * (gray + warped), gradient;
  cv::Sobel(mean, gradient, CV_32F, motion.x != 0, motion.y != 0, 3,
            double(motion_x + motion_y) / 8, 0, cv::BORDER_REPLICATE);
  for (int y = 0; y < map.rows; ++y) {
    const float* s = disparity.ptr<float>(y);
    const float* g = gradient.ptr<float>(y);
    const float* a = gray.ptr<float>(y);
    const float* b = warped.ptr<float>(y);
    float* n = numerator.ptr<float>(y);
    float* d = denominator.ptr<float>(y);
    for (int x = 0; x < map.cols; ++x) {
      if (s[x] <= 0) continue;
      const float residual = a[x] - b[x];
      // Robust (Geman-McClure): occluded pixels and highlights count little.
      const float ratio = residual / 0.05f;
      const float weight = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
      n[x] += weight * g[x] * residual;
      d[x] += weight * g[x] * g[x];
    }
  }
}

}  // namespace

void RefineDisparity(const ScalarImage& gray_image, std::span<const ShiftedGray> shifted,
                     ScalarImage& disparity_image) {
  const cv::Mat gray = AsMat(gray_image);
  cv::Mat disparity = AsMat(disparity_image);
  const cv::Mat start = disparity.clone();

  // Windows that hold a depth edge or a hole are left alone.
  cv::Mat highest, lowest;
  const cv::Mat window = cv::Mat::ones(kWindow, kWindow, CV_8U);
  cv::dilate(start, highest, window);
  cv::erode(start, lowest, window);
  const cv::Mat smooth = (highest - lowest < kSmooth) & (lowest > 0);

  for (int iteration = 0; iteration < kIterations; ++iteration) {
    // A step moves a window as one; smoothing first removes the stairs that it would keep.
    cv::Mat blurred;
    cv::blur(disparity, blurred, {kBlur, kBlur}, {-1, -1}, cv::BORDER_REPLICATE);
    blurred.copyTo(disparity, smooth);
    cv::Mat numerator = cv::Mat::zeros(gray.size(), CV_32F);
    cv::Mat denominator = cv::Mat::zeros(gray.size(), CV_32F);
    for (const ShiftedGray& view : shifted) {
      Accumulate(gray, view, disparity, numerator, denominator);
    }
    cv::boxFilter(numerator, numerator, -1, {kWindow, kWindow});
    cv::boxFilter(denominator, denominator, -1, {kWindow, kWindow});
    for (int y = 0; y < gray.rows; ++y) {
      float* s = disparity.ptr<float>(y);
      const float* s0 = start.ptr<float>(y);
      const float* n = numerator.ptr<float>(y);
      const float* d = denominator.ptr<float>(y);
      const uint8_t* ok = smooth.ptr<uint8_t>(y);
      for (int x = 0; x < gray.cols; ++x) {
        if (!ok[x]) continue;
        // The floor damps steps where there is little texture.
        const float step = std::clamp(n[x] / (d[x] + kGradientFloor), -kMaxStep, kMaxStep);
        s[x] = std::clamp(s[x] + step, s0[x] - kMaxMove, s0[x] + kMaxMove);
      }
    }
  }
}

}  // namespace retint
