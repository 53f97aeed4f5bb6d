// SPDX-License-Identifier: BSD-3-Clause
// Arbitration on the CPU, by the rules of kernels/common/stereo.h. Colors are rounded to 8 bits,
// and warped views are sampled at 32nds of a pixel, as OpenCV does.
#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/parallel.h"
#include "kernels/common/quantize.h"
#include "kernels/common/stereo.h"
#include "kernels/cpu/stereo.h"

namespace retint {
namespace {

using namespace arbitration;

// The colors of a view in bytes.
cv::Mat Quantize(const StereoView& view) {
  cv::Mat out(view.height, view.width, CV_8UC3);
  ParallelRanges(view.height, 64, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      const float* from = view.rgb + y * view.width * 3;
      uint8_t* to = out.ptr<uint8_t>(int(y));
      std::transform(from, from + view.width * 3, to, ColorToByte);
    }
  });
  return out;
}

// A shifted view and its colors.
struct Plate {
  StereoView view;
  cv::Mat colors;
};

// Color difference of one pair when every pixel has the given disparity, averaged over a window.
cv::Mat PairCost(const cv::Mat& own, const Plate& plate, const float* disparity) {
  const int width = own.cols, height = own.rows;
  const float along_x = float(plate.view.dx), along_y = float(plate.view.dy);
  cv::Mat map(height, width, CV_32FC2), warped, cost(height, width, CV_32F);
  for (int y = 0; y < height; ++y) {
    const float* from = disparity + int64_t(y) * width;
    cv::Vec2f* to = map.ptr<cv::Vec2f>(y);
    for (int x = 0; x < width; ++x) {
      const float s = std::max(from[x], 0.0f);
      to[x] = {float(x - plate.view.x) + along_x * s, float(y - plate.view.y) + along_y * s};
    }
  }
  cv::remap(plate.colors, warped, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  for (int y = 0; y < height; ++y) {
    const cv::Vec3b* a = own.ptr<cv::Vec3b>(y);
    const cv::Vec3b* b = warped.ptr<cv::Vec3b>(y);
    float* c = cost.ptr<float>(y);
    for (int x = 0; x < width; ++x) {
      int sum = 0;
      for (int i = 0; i < 3; ++i) sum += std::abs(int(a[x][i]) - int(b[x][i]));
      c[x] = std::min(float(sum), kCostCap);
    }
  }
  constexpr int kSide = 2 * kCostRadius + 1;
  cv::blur(cost, cost, {kSide, kSide});
  return cost;
}

cv::Mat PhotoCost(const cv::Mat& own, const std::vector<Plate>& plates, const float* disparity) {
  std::vector<cv::Mat> costs(plates.size());
  ParallelTasks(int64_t(plates.size()),
                [&](size_t k) { costs[k] = PairCost(own, plates[k], disparity); });
  cv::Mat best(own.rows, own.cols, CV_32F);
  for (int y = 0; y < best.rows; ++y) {
    for (int x = 0; x < best.cols; ++x) {
      BestTwo two;
      for (const cv::Mat& cost : costs) two.Add(cost.at<float>(y, x));
      best.at<float>(y, x) = two.Mean();
    }
  }
  return best;
}

// Pixels with a disparity jump within reach.
cv::Mat NearEdges(const StereoArbitrateParams& params) {
  const cv::Mat map(params.height, params.width, CV_32F, params.disparity);
  const cv::Mat window = cv::Mat::ones(2 * kEdgeReach + 1, 2 * kEdgeReach + 1, CV_8U);
  cv::Mat high, low;
  cv::dilate(map, high, window);
  cv::erode(map, low, window);
  return high - low > kEdgeJump;
}

// Gives ties to the rough depth where it continues, without a step, a surface that was confirmed.
void ContinueSurfaces(const float* rough, cv::Mat& verdicts) {
  std::vector<std::pair<int, int>> front, next;
  const auto verdict = [&](int x, int y) -> uint8_t& { return verdicts.at<uint8_t>(y, x); };
  const auto rough_at = [&](int x, int y) { return rough[int64_t(y) * verdicts.cols + x]; };
  for (int y = 0; y < verdicts.rows; ++y) {
    for (int x = 0; x < verdicts.cols; ++x) {
      if (Confirms(Verdict(verdict(x, y)))) front.emplace_back(x, y);
    }
  }
  constexpr std::array<std::pair<int, int>, 4> kSteps = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  for (int round = 0; round < kMaxGrowth && !front.empty(); ++round) {
    next.clear();
    for (const auto& [x, y] : front) {
      for (const auto& [dx, dy] : kSteps) {
        const int nx = x + dx, ny = y + dy;
        if (nx < 0 || ny < 0 || nx >= verdicts.cols || ny >= verdicts.rows) continue;
        if (verdict(nx, ny) != kTie || !IsSameSurface(rough_at(nx, ny), rough_at(x, y))) continue;
        verdict(nx, ny) = kContinued;
        next.emplace_back(nx, ny);
      }
    }
    std::swap(front, next);
  }
}

}  // namespace

void ArbitrateStereoOnCpu(const StereoArbitrateParams& params) {
  const int width = params.width, height = params.height;
  const cv::Mat own =
      Quantize(params.reference)(cv::Rect(-params.reference.x, -params.reference.y, width, height));
  std::vector<Plate> plates;
  for (int k = 0; k < params.num_shifted; ++k) {
    plates.push_back({params.shifted[k], Quantize(params.shifted[k])});
  }
  const cv::Mat stereo_cost = PhotoCost(own, plates, params.disparity);
  const cv::Mat rough_cost = PhotoCost(own, plates, params.rough);
  const cv::Mat near_edges = NearEdges(params);

  cv::Mat verdicts(height, width, CV_8U);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int64_t i = int64_t(y) * width + x;
      verdicts.at<uint8_t>(y, x) =
          VerdictOf(params.disparity[i], params.rough[i], stereo_cost.at<float>(y, x),
                    rough_cost.at<float>(y, x), near_edges.at<uint8_t>(y, x) != 0);
    }
  }
  ContinueSurfaces(params.rough, verdicts);

  for (int64_t i = 0; i < int64_t(width) * height; ++i) {
    const auto verdict = Verdict(verdicts.data[i]);
    float& s = params.disparity[i];
    params.measured[i] = IsMeasured(verdict, s) ? 255 : 0;
    s = Settled(verdict, s, params.rough[i]);
  }
}

}  // namespace retint
