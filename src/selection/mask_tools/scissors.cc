// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/scissors.h"

#include <algorithm>
#include <string>

#include <opencv2/imgproc.hpp>
#include <opencv2/imgproc/segmentation.hpp>

#include "base/error.h"

namespace retint {

Mask CutOut(const Image& color, const std::vector<Eigen::Vector2i>& anchors) {
  CheckOption(anchors.size() >= 3, "scissors need three points at least");
  for (const Eigen::Vector2i& at : anchors) {
    CheckOption(color.Contains(at.x(), at.y()), "point " + std::to_string(at.x()) + "," +
                                                    std::to_string(at.y()) +
                                                    " of the scissors lies outside the view");
  }
  cv::Mat bytes(color.height, color.width, CV_8UC3);
  for (int y = 0; y < color.height; ++y) {
    for (int x = 0; x < color.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const float value = std::clamp(color(x, y, c), 0.0f, 1.0f);
        bytes.at<cv::Vec3b>(y, x)[2 - c] = cv::saturate_cast<uchar>(255 * value);
      }
    }
  }
  cv::segmentation::IntelligentScissorsMB tool;
  tool.setEdgeFeatureCannyParameters(32, 100);
  tool.setGradientMagnitudeMaxLimit(200);
  tool.applyImage(bytes);
  std::vector<cv::Point> outline;
  for (size_t i = 0; i < anchors.size(); ++i) {
    const Eigen::Vector2i& from = anchors[i];
    const Eigen::Vector2i& to = anchors[(i + 1) % anchors.size()];
    if (from == to) continue;
    tool.buildMap({from.x(), from.y()});
    std::vector<cv::Point> piece;
    tool.getContour({to.x(), to.y()}, piece);
    outline.insert(outline.end(), piece.begin(), piece.end());
  }
  CheckOption(!outline.empty(), "the points of the scissors are one");
  Mask mask(color.width, color.height);
  cv::Mat drawn(mask.height, mask.width, CV_8U, mask.data.data());
  cv::fillPoly(drawn, std::vector<std::vector<cv::Point>>{outline}, 255);
  return mask;
}

}  // namespace retint
