// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/guided_matte.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <opencv2/imgproc.hpp>

#include "base/parallel.h"

namespace retint {
namespace {

constexpr int kGuide = 4;
constexpr int kPairs = kGuide * (kGuide + 1) / 2;

using Guide = PixelArray<float, kGuide>;
// value = slope . guide + offset: one plane for each coefficient.
using Functions = std::array<cv::Mat, kGuide + 1>;

Eigen::Map<const Eigen::Vector4f> At(const Guide& guide, size_t pixel) {
  return Eigen::Map<const Eigen::Vector4f>(&guide.data[kGuide * pixel]);
}

template <size_t N>
std::array<cv::Mat, N> Planes(int width, int height) {
  std::array<cv::Mat, N> planes;
  for (cv::Mat& plane : planes) plane = cv::Mat::zeros(height, width, CV_32F);
  return planes;
}

// Means over windows.
template <size_t N>
void TakeMeans(std::array<cv::Mat, N>* planes, int radius) {
  ParallelTasks(N, [&](int64_t k) {
    cv::Mat& plane = (*planes)[size_t(k)];
    cv::boxFilter(plane, plane, -1, {2 * radius + 1, 2 * radius + 1}, {-1, -1}, true,
                  cv::BORDER_REPLICATE);
  });
}

// Shared by all mattes of one guide: mean and inverse covariance of the guide in every window.
class GuideWindows {
 public:
  // Only in pixels where `used` is not 0.
  GuideWindows(const Guide& guide, const cv::Mat& used, int radius, double variance)
      : guide_(guide), used_(used), radius_(radius) {
    // Products of the guide with itself lose precision far from 0.
    Eigen::Vector4d center = Eigen::Vector4d::Zero();
    for (size_t p = 0; p < guide.NumPixels(); ++p) center += At(guide, p).cast<double>();
    origin_ = (center / double(std::max<size_t>(1, guide.NumPixels()))).cast<float>();
    means_ = Planes<kGuide>(guide.width, guide.height);
    auto products = Planes<kPairs>(guide.width, guide.height);
    ForPixels([&](size_t p) {
      const Eigen::Vector4f at = At(guide_, p) - origin_;
      size_t k = 0;
      for (int i = 0; i < kGuide; ++i) {
        means_[size_t(i)].ptr<float>()[p] = at[i];
        for (int j = i; j < kGuide; ++j) products[k++].ptr<float>()[p] = at[i] * at[j];
      }
    });
    TakeMeans(&means_, radius);
    TakeMeans(&products, radius);
    inverses_.resize(guide.NumPixels());
    ForPixels([&](size_t p) {
      if (used_.data[p] == 0) return;
      const Eigen::Vector4d mean = Mean(p);
      Eigen::Matrix4d covariance;
      size_t k = 0;
      for (int i = 0; i < kGuide; ++i) {
        for (int j = i; j < kGuide; ++j) {
          const auto product = double(products[k++].ptr<float>()[p]);
          covariance(i, j) = covariance(j, i) = product - mean[i] * mean[j];
        }
      }
      covariance.diagonal().array() += variance;
      inverses_[p] = covariance.ldlt().solve(Eigen::Matrix4d::Identity()).cast<float>();
    });
  }

  // The functions of `values`: for each pixel, the means over all windows that contain it.
  Functions Fit(const ScalarImage& values) const {
    auto functions = Planes<kGuide + 1>(guide_.width, guide_.height);
    auto sums = Planes<kGuide + 1>(guide_.width, guide_.height);  // guide times value, value
    ForPixels([&](size_t p) {
      const Eigen::Vector4f with = (At(guide_, p) - origin_) * values.data[p];
      for (int i = 0; i < kGuide; ++i) sums[size_t(i)].ptr<float>()[p] = with[i];
      sums[kGuide].ptr<float>()[p] = values.data[p];
    });
    TakeMeans(&sums, radius_);
    ForPixels([&](size_t p) {
      if (used_.data[p] == 0) return;
      const Eigen::Vector4d mean = Mean(p);
      const auto value = double(sums[kGuide].ptr<float>()[p]);
      Eigen::Vector4d with;
      for (int i = 0; i < kGuide; ++i)
        with[i] = double(sums[size_t(i)].ptr<float>()[p]) - mean[i] * value;
      const Eigen::Vector4d slope = inverses_[p].cast<double>() * with;
      for (int i = 0; i < kGuide; ++i) functions[size_t(i)].ptr<float>()[p] = float(slope[i]);
      functions[kGuide].ptr<float>()[p] = float(value - slope.dot(mean));
    });
    TakeMeans(&functions, radius_);
    return functions;
  }

  const Eigen::Vector4f& origin() const { return origin_; }

 private:
  template <typename Body>
  void ForPixels(const Body& body) const {
    ParallelRanges(int64_t(guide_.NumPixels()), 4096, [&](int64_t begin, int64_t end) {
      for (auto p = size_t(begin); p < size_t(end); ++p) body(p);
    });
  }
  Eigen::Vector4d Mean(size_t p) const {
    Eigen::Vector4d mean;
    for (int i = 0; i < kGuide; ++i) mean[i] = double(means_[size_t(i)].ptr<float>()[p]);
    return mean;
  }

  const Guide& guide_;
  const cv::Mat used_;
  const int radius_;
  Eigen::Vector4f origin_;
  std::array<cv::Mat, kGuide> means_;
  std::vector<Eigen::Matrix4f> inverses_;
};

// The small pixels that wanted pixels of the large picture need: all windows that contain a
// neighbor of a wanted pixel.
cv::Mat UsedOf(const Mask& wanted, int width, int height, int radius) {
  cv::Mat used = cv::Mat::zeros(height, width, CV_8U);
  for (int y = 0; y < wanted.height; ++y) {
    for (int x = 0; x < wanted.width; ++x) {
      if (wanted(x, y) == 0) continue;
      const int64_t i = int64_t(x) * width / wanted.width;
      const int64_t j = int64_t(y) * height / wanted.height;
      used.at<uint8_t>(int(j), int(i)) = 255;
    }
  }
  cv::dilate(used, used, cv::Mat::ones(2 * radius + 3, 2 * radius + 3, CV_8U));
  return used;
}

// The position of a pixel's center among the centers of `to` pixels along the same length.
struct Between {
  int first, second;
  float part;  // of the second
};

float Mix(float first, float second, float part) { return first + part * (second - first); }

Between Locate(int at, int from, int to) {
  const float middle = (float(at) + 0.5f) * float(to) / float(from) - 0.5f;
  const float inside = std::clamp(middle, 0.0f, float(to - 1));
  const int first = int(inside);
  return {first, std::min(first + 1, to - 1), inside - float(first)};
}

ScalarImage Apply(const Functions& functions, const Eigen::Vector4f& origin, const Guide& guide,
                  const Mask& wanted) {
  const int width = functions[0].cols, height = functions[0].rows;
  ScalarImage matte(guide.width, guide.height);
  ParallelRanges(guide.height, 16, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      const Between row = Locate(y, guide.height, height);
      for (int x = 0; x < guide.width; ++x) {
        if (wanted(x, y) == 0) continue;
        const Between column = Locate(x, guide.width, width);
        const auto sample = [&](const cv::Mat& plane) {
          const float* const above = plane.ptr<float>(row.first);
          const float* const below = plane.ptr<float>(row.second);
          const float top = Mix(above[column.first], above[column.second], column.part);
          const float bottom = Mix(below[column.first], below[column.second], column.part);
          return Mix(top, bottom, row.part);
        };
        float value = sample(functions[kGuide]);
        for (int i = 0; i < kGuide; ++i)
          value += sample(functions[size_t(i)]) * (guide(x, y, i) - origin[i]);
        matte(x, y) = std::clamp(value, 0.0f, 1.0f);
      }
    }
  });
  return matte;
}

}  // namespace

PixelArray<float, 4> Resized(const PixelArray<float, 4>& image, int width, int height) {
  if (width == image.width && height == image.height) return image;
  PixelArray<float, 4> resized(width, height);
  const cv::Mat from(image.height, image.width, CV_32FC4, const_cast<float*>(image.data.data()));
  cv::Mat to(height, width, CV_32FC4, resized.data.data());
  const bool smaller = width <= image.width && height <= image.height;
  cv::resize(from, to, to.size(), 0, 0, smaller ? cv::INTER_AREA : cv::INTER_LINEAR);
  return resized;
}

std::vector<ScalarImage> GuidedMattes(std::span<const ScalarImage> values, const Guide& small,
                                      const Guide& guide, const Mask& wanted, int radius,
                                      double variance) {
  const GuideWindows windows(small, UsedOf(wanted, small.width, small.height, radius), radius,
                             variance);
  std::vector<ScalarImage> mattes(values.size());
  ParallelTasks(int64_t(values.size()), [&](int64_t i) {
    mattes[size_t(i)] = Apply(windows.Fit(values[size_t(i)]), windows.origin(), guide, wanted);
  });
  return mattes;
}

}  // namespace retint
