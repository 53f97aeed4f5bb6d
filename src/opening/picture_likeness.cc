// SPDX-License-Identifier: BSD-3-Clause
#include "opening/picture_likeness.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace retint {
namespace {

// Whether a picture shows a view is judged beside the mask, if that is at least this fraction of
// the picture, and its edges deviate by more than a JPEG's noise.
constexpr double kLeastBeside = 0.1, kFlat = 0.03;

// Sizes of gradients of gray values at a quarter of the size; the strongest count alike.
cv::Mat Edges(const cv::Mat& gray) {
  cv::Mat small, right, down, edges;
  cv::resize(gray, small, {}, 0.25, 0.25, cv::INTER_AREA);
  cv::Sobel(small, right, CV_32F, 1, 0);
  cv::Sobel(small, down, CV_32F, 0, 1);
  cv::magnitude(right, down, edges);
  std::vector<float> sorted(edges.begin<float>(), edges.end<float>());
  const auto strong = sorted.begin() + ptrdiff_t(sorted.size() * 95 / 100);
  std::nth_element(sorted.begin(), strong, sorted.end());
  return cv::min(edges, double(*strong));
}

// 255 beside a mask, in edges at a quarter of the size; `size` is theirs.
cv::Mat EdgesBeside(const Mask& mask, const cv::Size& size) {
  if (mask.Empty()) return {size, CV_8U, cv::Scalar(255)};
  const cv::Mat all(mask.height, mask.width, CV_8U, const_cast<uint8_t*>(mask.data.data()));
  cv::Mat cells;
  cv::resize(all > 0, cells, size, 0, 0, cv::INTER_AREA);
  cv::dilate(cells > 0, cells, cv::Mat());  // a gradient reaches to the next cell
  return cells == 0;
}

}  // namespace

double MeanDifference(const Image8& picture, const Image& view) {
  std::vector<float> differences;
  for (size_t i = 0; i < view.data.size(); i += 7) {
    differences.push_back(std::abs(static_cast<float>(picture.data[i]) / 255 - view.data[i]));
  }
  // The median: painted pixels do not count.
  const auto middle = differences.begin() + static_cast<ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  double sum = 0;
  for (auto it = differences.begin(); it != middle; ++it) sum += static_cast<double>(*it);
  return sum / static_cast<double>(std::max<size_t>(differences.size() / 2, 1));
}

double EdgeCorrelation(const Image8& picture, const Image& view, const Mask& changed) {
  const cv::Size size(view.width, view.height);
  if (size.width < 8 || size.height < 8) return 1;  // too small to tell
  const cv::Mat before(size, CV_32FC3, const_cast<float*>(view.data.data()));
  const cv::Mat after(size, CV_8UC3, const_cast<uint8_t*>(picture.data.data()));
  cv::Mat gray_before, gray_after;
  cv::cvtColor(before, gray_before, cv::COLOR_RGB2GRAY);
  cv::cvtColor(after, gray_after, cv::COLOR_RGB2GRAY);
  const cv::Mat a = Edges(gray_before), b = Edges(gray_after);
  cv::Mat where = EdgesBeside(changed, a.size());
  cv::Scalar mean_a, mean_b, deviation_a, deviation_b;
  cv::meanStdDev(a, mean_a, deviation_a, where);
  if (cv::countNonZero(where) < kLeastBeside * double(a.total()) || deviation_a[0] < kFlat) {
    where.setTo(255);
    cv::meanStdDev(a, mean_a, deviation_a);
  }
  cv::meanStdDev(b, mean_b, deviation_b, where);
  const double both = deviation_a[0] * deviation_b[0];
  if (!(both > 0)) return 1;
  return (cv::mean(a.mul(b), where)[0] - mean_a[0] * mean_b[0]) / both;
}

}  // namespace retint
