// SPDX-License-Identifier: BSD-3-Clause
// Refinement on the CPU, by the rules of kernels/common/stereo.h. Warped views are sampled by cubic
// convolution at 32nds of a pixel, as OpenCV does.
#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "kernels/common/stereo.h"
#include "kernels/cpu/stereo.h"

namespace retint {
namespace {

using namespace refinement;

// A view over memory that is only read: cv::Mat takes no const data.
cv::Mat GrayOf(const StereoView& view) {
  return cv::Mat(view.height, view.width, CV_32F, const_cast<float*>(view.gray));
}

// Adds one shifted view's normal equations of the disparity increment.
void Accumulate(const cv::Mat& gray, const StereoView& view, const cv::Mat& disparity,
                cv::Mat& numerator, cv::Mat& denominator) {
  const float motion_x = float(view.dx), motion_y = float(view.dy);
  cv::Mat map(gray.size(), CV_32FC2);
  for (int y = 0; y < map.rows; ++y) {
    const float* s = disparity.ptr<float>(y);
    cv::Vec2f* to = map.ptr<cv::Vec2f>(y);
    for (int x = 0; x < map.cols; ++x) {
      const float move = std::max(s[x], 0.0f);
      to[x] = {float(x - view.x) + motion_x * move, float(y - view.y) + motion_y * move};
    }
  }
  cv::Mat warped;
  cv::remap(GrayOf(view), warped, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  const cv::Mat mean = 0.5f * (gray + warped);
  cv::Mat gradient;
  cv::Sobel(mean, gradient, CV_32F, view.dx != 0, view.dy != 0, 3, double(motion_x + motion_y) / 8,
            0, cv::BORDER_REPLICATE);
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
      const float weight = WeightOf(residual);
      n[x] += weight * g[x] * residual;
      d[x] += weight * g[x] * g[x];
    }
  }
}

// Where IsSmooth() holds over the window.
cv::Mat SmoothWindows(const cv::Mat& disparity) {
  const cv::Mat window = cv::Mat::ones(2 * kRadius + 1, 2 * kRadius + 1, CV_8U);
  cv::Mat highest, lowest, smooth(disparity.size(), CV_8U);
  cv::dilate(disparity, highest, window);
  cv::erode(disparity, lowest, window);
  for (int y = 0; y < smooth.rows; ++y) {
    for (int x = 0; x < smooth.cols; ++x) {
      const bool is_smooth = IsSmooth(lowest.at<float>(y, x), highest.at<float>(y, x));
      smooth.at<uint8_t>(y, x) = is_smooth ? 255 : 0;
    }
  }
  return smooth;
}

}  // namespace

void RefineStereoOnCpu(const StereoRefineParams& params) {
  const cv::Mat gray = GrayOf(params.reference)(
      cv::Rect(-params.reference.x, -params.reference.y, params.width, params.height));
  cv::Mat disparity(params.height, params.width, CV_32F, params.disparity);
  const cv::Mat start = disparity.clone(), smooth = SmoothWindows(start);

  constexpr int kBlur = 2 * kBlurRadius + 1, kWindow = 2 * kRadius + 1;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    // A step moves a window as one; smoothing first removes the stairs that it would keep.
    cv::Mat blurred;
    cv::blur(disparity, blurred, {kBlur, kBlur}, {-1, -1}, cv::BORDER_REPLICATE);
    blurred.copyTo(disparity, smooth);
    cv::Mat numerator = cv::Mat::zeros(gray.size(), CV_32F);
    cv::Mat denominator = cv::Mat::zeros(gray.size(), CV_32F);
    for (int k = 0; k < params.num_shifted; ++k) {
      Accumulate(gray, params.shifted[k], disparity, numerator, denominator);
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
        if (ok[x]) s[x] = Stepped(s[x], s0[x], n[x], d[x]);
      }
    }
  }
}

}  // namespace retint
