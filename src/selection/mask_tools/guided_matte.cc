// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/guided_matte.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <opencv2/imgproc.hpp>

#include "base/parallel.h"

namespace retint {
namespace {

template <int C>
cv::Mat View(const PixelArray<float, C>& image) {
  return {image.height, image.width, CV_32FC(C), const_cast<float*>(image.data.data())};
}

template <int C>
PixelArray<float, C> Resize(const PixelArray<float, C>& image, int width, int height) {
  if (width == image.width && height == image.height) return image;
  PixelArray<float, C> resized(width, height);
  cv::Mat to = View(resized);
  const bool smaller = width <= image.width && height <= image.height;
  cv::resize(View(image), to, to.size(), 0, 0, smaller ? cv::INTER_AREA : cv::INTER_LINEAR);
  return resized;
}

// Means over windows, of as many channels as there are.
cv::Mat Means(const cv::Mat& values, int radius) {
  cv::Mat means;
  cv::boxFilter(values, means, -1, {2 * radius + 1, 2 * radius + 1}, {-1, -1}, true,
                cv::BORDER_REPLICATE);
  return means;
}

constexpr int kGuide = 4;
constexpr int kPairs = kGuide * (kGuide + 1) / 2;
constexpr int kSums = kGuide + kPairs + 1 + kGuide;  // I, I I^T, p, I p

}  // namespace

ScalarImage Resized(const ScalarImage& image, int width, int height) {
  return Resize(image, width, height);
}

PixelArray<float, 4> Resized(const PixelArray<float, 4>& image, int width, int height) {
  return Resize(image, width, height);
}

ScalarImage GuidedMatte(const ScalarImage& values, const PixelArray<float, 4>& guide, int radius,
                        double variance) {
  const int width = values.width, height = values.height;
  const PixelArray<float, 4> small = Resized(guide, width, height);
  // Products of the guide with itself lose digits far from 0.
  Eigen::Vector4d center = Eigen::Vector4d::Zero();
  for (size_t p = 0; p < small.NumPixels(); ++p) {
    center += Eigen::Map<const Eigen::Vector4f>(&small.data[kGuide * p]).cast<double>();
  }
  center /= double(std::max<size_t>(1, small.NumPixels()));
  const Eigen::Vector4f origin = center.cast<float>();

  std::vector<cv::Mat> planes(kSums);
  for (cv::Mat& plane : planes) plane.create(height, width, CV_32F);
  ParallelRanges(height, 16, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < width; ++x) {
        const Eigen::Vector4f at = Eigen::Map<const Eigen::Vector4f>(&small(x, y)) - origin;
        const float p = values(x, y);
        int k = 0;
        for (int i = 0; i < kGuide; ++i) planes[size_t(k++)].at<float>(y, x) = at[i];
        for (int i = 0; i < kGuide; ++i) {
          for (int j = i; j < kGuide; ++j) planes[size_t(k++)].at<float>(y, x) = at[i] * at[j];
        }
        planes[size_t(k++)].at<float>(y, x) = p;
        for (int i = 0; i < kGuide; ++i) planes[size_t(k++)].at<float>(y, x) = at[i] * p;
      }
    }
  });
  ParallelTasks(kSums, [&](int64_t k) {
    cv::Mat& plane = planes[size_t(k)];
    plane = Means(plane, radius);
  });

  // value = slope . guide + offset of every window.
  std::vector<cv::Mat> functions(kGuide + 1);
  for (cv::Mat& plane : functions) plane.create(height, width, CV_32F);
  ParallelRanges(height, 16, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < width; ++x) {
        int k = 0;
        const auto next = [&] { return double(planes[size_t(k++)].at<float>(y, x)); };
        Eigen::Vector4d mean, with;
        Eigen::Matrix4d covariance;
        for (int i = 0; i < kGuide; ++i) mean[i] = next();
        for (int i = 0; i < kGuide; ++i) {
          for (int j = i; j < kGuide; ++j) {
            covariance(i, j) = covariance(j, i) = next() - mean[i] * mean[j];
          }
        }
        const double p = next();
        for (int i = 0; i < kGuide; ++i) with[i] = next() - mean[i] * p;
        covariance.diagonal().array() += variance;
        const Eigen::Vector4d slope = covariance.ldlt().solve(with);
        for (int i = 0; i < kGuide; ++i) functions[size_t(i)].at<float>(y, x) = float(slope[i]);
        functions[kGuide].at<float>(y, x) = float(p - slope.dot(mean));
      }
    }
  });
  ScalarImage matte(guide.width, guide.height);
  ParallelTasks(int64_t(functions.size()), [&](int64_t k) {
    cv::Mat& plane = functions[size_t(k)];
    cv::resize(Means(plane, radius), plane, {guide.width, guide.height}, 0, 0, cv::INTER_LINEAR);
  });
  ParallelRanges(guide.height, 16, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < guide.width; ++x) {
        float value = functions[kGuide].at<float>(y, x);
        for (int i = 0; i < kGuide; ++i) {
          value += functions[size_t(i)].at<float>(y, x) * (guide(x, y, i) - origin[i]);
        }
        matte(x, y) = std::clamp(value, 0.0f, 1.0f);
      }
    }
  });
  return matte;
}

}  // namespace retint
