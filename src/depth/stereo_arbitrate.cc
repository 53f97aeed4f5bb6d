// SPDX-License-Identifier: BSD-3-Clause
// Stereo is right on surfaces and fattens silhouettes; the Gaussians' median depth has crisp
// silhouettes and is wrong behind flat colours. Where the two disagree, colour decides first, then
// continuity.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/parallel.h"
#include "depth/stereo_pairs.h"

namespace retint {
namespace {

constexpr float kAgree = 1;           // pixels of disparity
constexpr int kCostWindow = 5;        // pixels
constexpr float kCostCap = 60;        // levels of 255, the three channels summed
constexpr float kBetter = 0.8f;       // the better cost must be below this share of the other ...
constexpr float kMargin = 1;          // ... less this many levels
constexpr int kEdgeReach = 16;        // pixels: how far silhouettes are fattened
constexpr float kEdgeJump = 3;        // pixels of disparity that make an edge
constexpr float kSameSurface = 0.5f;  // pixels of disparity between neighbours
constexpr int kMaxGrowth = 40;        // pixels by which confirmed rough depth is continued

// A view over memory that is only read: cv::Mat takes no const data.
cv::Mat AsMat(const Image8& image) {
  return cv::Mat(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.data.data()));
}

// Colour difference of one pair when every pixel has the given disparity, averaged over a window.
cv::Mat PairCost(const RenderedPair& pair, const ScalarImage& disparity) {
  const int width = disparity.width, height = disparity.height;
  const Motion motion = MotionOf(pair.shift);
  const float along_x = float(motion.x), along_y = float(motion.y);
  cv::Mat map(height, width, CV_32FC2), warped, cost(height, width, CV_32F);
  for (int y = 0; y < height; ++y) {
    cv::Vec2f* to = map.ptr<cv::Vec2f>(y);
    for (int x = 0; x < width; ++x) {
      const float s = std::max(disparity(x, y), 0.0f);
      to[x] = {float(x - pair.rect.x) + along_x * s, float(y - pair.rect.y) + along_y * s};
    }
  }
  cv::remap(AsMat(pair.shifted), warped, map, cv::noArray(), cv::INTER_LINEAR,
            cv::BORDER_REPLICATE);
  const cv::Mat own = AsMat(pair.reference)(cv::Rect(-pair.rect.x, -pair.rect.y, width, height));
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
  cv::blur(cost, cost, {kCostWindow, kCostWindow});
  return cost;
}

// The mean over the two shifted views that agree best: what one side hides the other shows.
ScalarImage PhotoCost(std::span<const RenderedPair> pairs, const ScalarImage& disparity) {
  std::vector<cv::Mat> costs(pairs.size());
  ParallelTasks(int64_t(pairs.size()), [&](size_t k) { costs[k] = PairCost(pairs[k], disparity); });
  ScalarImage best(disparity.width, disparity.height);
  for (int y = 0; y < best.height; ++y) {
    for (int x = 0; x < best.width; ++x) {
      float first = kCostCap, second = kCostCap;
      for (const cv::Mat& cost : costs) {
        const float c = cost.at<float>(y, x);
        second = std::min(second, std::max(first, c));
        first = std::min(first, c);
      }
      best(x, y) = 0.5f * (first + second);
    }
  }
  return best;
}

// Pixels with a disparity jump within reach.
cv::Mat NearEdges(ScalarImage& disparity) {
  const cv::Mat map(disparity.height, disparity.width, CV_32F, disparity.data.data());
  const cv::Mat window = cv::Mat::ones(2 * kEdgeReach + 1, 2 * kEdgeReach + 1, CV_8U);
  cv::Mat high, low;
  cv::dilate(map, high, window);
  cv::erode(map, low, window);
  return high - low > kEdgeJump;
}

enum class Verdict : uint8_t { kStereo, kRough, kContinued, kTie, kBoth };

// Gives ties to the rough depth where it continues, without a step, a surface that was confirmed.
void ContinueSurfaces(const ScalarImage& rough, PixelArray<Verdict, 1>& verdicts) {
  std::vector<std::pair<int, int>> front, next;
  for (int y = 0; y < rough.height; ++y) {
    for (int x = 0; x < rough.width; ++x) {
      if (verdicts(x, y) == Verdict::kRough || verdicts(x, y) == Verdict::kBoth) {
        front.emplace_back(x, y);
      }
    }
  }
  constexpr std::array<std::pair<int, int>, 4> kSteps = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  for (int round = 0; round < kMaxGrowth && !front.empty(); ++round) {
    next.clear();
    for (const auto& [x, y] : front) {
      for (const auto& [dx, dy] : kSteps) {
        const int nx = x + dx, ny = y + dy;
        if (!rough.Contains(nx, ny) || verdicts(nx, ny) != Verdict::kTie) continue;
        if (std::abs(rough(nx, ny) - rough(x, y)) > kSameSurface) continue;
        verdicts(nx, ny) = Verdict::kContinued;
        next.emplace_back(nx, ny);
      }
    }
    std::swap(front, next);
  }
}

}  // namespace

Mask ArbitrateDisparity(std::span<const RenderedPair> pairs, const ScalarImage& rough,
                        ScalarImage& disparity) {
  const int width = disparity.width, height = disparity.height;
  const ScalarImage stereo_cost = PhotoCost(pairs, disparity), rough_cost = PhotoCost(pairs, rough);
  const cv::Mat near_edges = NearEdges(disparity);

  PixelArray<Verdict, 1> verdicts(width, height, Verdict::kStereo);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float s = disparity(x, y), r = rough(x, y);
      if (!(r > 0)) continue;
      const float of_stereo = stereo_cost(x, y), of_rough = rough_cost(x, y);
      Verdict& verdict = verdicts(x, y);
      if (!(s > 0)) {
        verdict = Verdict::kTie;
      } else if (std::abs(s - r) <= kAgree) {
        verdict = Verdict::kBoth;
      } else if (of_rough < kBetter * of_stereo - kMargin) {
        verdict = Verdict::kRough;
      } else if (of_stereo >= kBetter * of_rough - kMargin && near_edges.at<uint8_t>(y, x)) {
        verdict = Verdict::kTie;
      }
    }
  }
  ContinueSurfaces(rough, verdicts);

  Mask measured(width, height, 0);
  for (size_t i = 0; i < verdicts.data.size(); ++i) {
    float& s = disparity.data[i];
    const Verdict verdict = verdicts.data[i];
    if (s > 0 && verdict != Verdict::kContinued) measured.data[i] = 255;
    // Two independent measurements that agree: their mean.
    if (verdict == Verdict::kBoth) s = 0.5f * (s + rough.data[i]);
    if (verdict == Verdict::kRough || verdict == Verdict::kContinued) s = rough.data[i];
  }
  return measured;
}

}  // namespace retint
