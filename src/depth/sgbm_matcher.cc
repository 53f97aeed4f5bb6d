// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <limits>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "depth/stereo_matcher.h"

namespace retint {
namespace {

cv::Mat Gray(const Image8& image) {
  // cv::Mat takes no const data; it is only read here.
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.data.data()));
  cv::Mat gray;
  cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
  return gray;
}

class SgbmMatcher : public StereoMatcher {
 public:
  explicit SgbmMatcher(const SgbmOptions& options) : options_(options) { options_.Check(); }

  StereoMatch Match(const Image8& left, const Image8& right, const DisparityRange& range,
                    const Monitor&) const override {
    CheckOption(left.width == right.width && left.height == right.height && !left.Empty(),
                "a stereo pair must be two images of one size");
    CheckOption(range.lowest >= 0 && range.count > 0 && range.count % 16 == 0,
                "a disparity range must start at 0 or above and count a multiple of 16");
    StereoMatch match;
    match.disparity = ScalarImage(left.width, left.height, -1.0f);
    if (left.width <= range.lowest + range.count) return match;  // nothing can be matched

    const int area = options_.block_size * options_.block_size;
    const auto sgbm = cv::StereoSGBM::create(
        range.lowest, range.count, options_.block_size, options_.smoothness * area,
        options_.jump * area, options_.left_right_tolerance, /*preFilterCap=*/31,
        options_.uniqueness_percent, options_.speckle_pixels, /*speckleRange=*/2,
        options_.all_paths ? cv::StereoSGBM::MODE_HH : cv::StereoSGBM::MODE_SGBM_3WAY);
    cv::Mat fixed;
    sgbm->compute(Gray(left), Gray(right), fixed);
    const int invalid = (range.lowest - 1) * cv::StereoMatcher::DISP_SCALE;
    for (int y = 0; y < left.height; ++y) {
      const int16_t* row = fixed.ptr<int16_t>(y);
      for (int x = 0; x < left.width; ++x) {
        if (row[x] > invalid) {
          match.disparity(x, y) = float(row[x]) / float(cv::StereoMatcher::DISP_SCALE);
        }
      }
    }
    return match;
  }

  // OpenCV's are 16 bits of sixteenths of a pixel.
  int MostDisparity() const override {
    return std::numeric_limits<int16_t>::max() / cv::StereoMatcher::DISP_SCALE;
  }

 private:
  SgbmOptions options_;
};

}  // namespace

std::unique_ptr<StereoMatcher> MakeSgbmMatcher(const SgbmOptions& options) {
  return std::make_unique<SgbmMatcher>(options);
}

}  // namespace retint
