// SPDX-License-Identifier: BSD-3-Clause
#include "editing/picture_changes.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <opencv2/imgproc.hpp>

#include "base/color_difference.h"
#include "base/median.h"

namespace retint {
namespace {

constexpr float kSeen = 2, kMostNoise = 6;  // DeltaE00
constexpr float kOverNoise = 5.5f;          // times the median of the noise
constexpr int kNeighbors = 4;     // of nine, itself among them, that a changed pixel needs
constexpr double kAround = 0.03;  // of the smaller side
constexpr double kGap = 0.01;     // of the smaller side: half the width of a gap that is paint too
constexpr int kMixed = 1;  // pixels: so near to the selection's end they show the surface beyond
constexpr int kExtension = 2;  // pixels
constexpr double kRim = 0.01;  // of the smaller side, four pixels at least
constexpr double kBeside =
    0.015;  // of the smaller side: the margin of a selection beside its paint

cv::Mat Pixels(Mask& mask) { return {mask.height, mask.width, CV_8U, mask.data.data()}; }

cv::Mat Disk(int reach) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * reach + 1, 2 * reach + 1});
}

void CloseGaps(Mask& paint) {
  const int reach = int(std::lround(kGap * std::min(paint.width, paint.height)));
  cv::morphologyEx(Pixels(paint), Pixels(paint), cv::MORPH_CLOSE, Disk(reach));
}

// Calls visit(x, y) of the neighbors that are known.
template <typename Visit>
void VisitKnown(const Mask& known, int x, int y, const Visit& visit) {
  for (int i = 0; i < 9; ++i) {
    const int px = x + i % 3 - 1, py = y + i / 3 - 1;
    if (known.Contains(px, py) && known(px, py)) visit(px, py);
  }
}

// Goes on with the paint beyond `inside`, ring by ring, each pixel in the mean of its neighbors
// that are known.
void Extend(const Mask& inside, Image8& picture, Mask& paint) {
  Mask known(inside);
  cv::Mat pixels = Pixels(known);
  cv::erode(pixels, pixels, Disk(kMixed));
  cv::bitwise_and(pixels, Pixels(paint), pixels);
  const cv::Rect box = cv::boundingRect(Pixels(paint)) + cv::Size(2 * kExtension, 2 * kExtension) -
                       cv::Point(kExtension, kExtension);
  const cv::Rect reach = box & cv::Rect(0, 0, paint.width, paint.height);
  Image8 colors = picture;
  for (int ring = 0; ring < kMixed + kExtension; ++ring) {
    const Mask last = known;
    for (int y = reach.y; y < reach.br().y; ++y) {
      for (int x = reach.x; x < reach.br().x; ++x) {
        if (last(x, y) || (inside(x, y) && !paint(x, y))) continue;
        int sum[3] = {0, 0, 0}, count = 0;
        VisitKnown(last, x, y, [&](int px, int py) {
          for (int c = 0; c < 3; ++c) sum[c] += colors(px, py, c);
          ++count;
        });
        if (count == 0) continue;
        for (int c = 0; c < 3; ++c) colors(x, y, c) = uint8_t((sum[c] + count / 2) / count);
        known(x, y) = 255;
      }
    }
  }
  for (size_t p = 0; p < known.data.size(); ++p) {
    if (!known.data[p] || inside.data[p]) continue;
    paint.data[p] = 255;
    std::copy_n(&colors.data[3 * p], 3, &picture.data[3 * p]);
  }
}

}  // namespace

float LeastChange(const Image8& picture, const Image& view) {
  // A change is smooth, or has few edges; noise differs from pixel to pixel.
  constexpr int kApart = 2;             // pixels
  constexpr double kNone = 0.05;        // DeltaE00
  constexpr double kLeastNoisy = 0.25;  // of the samples
  size_t samples = 0;
  std::vector<double> noise;
  const auto change = [&](int x, int y) {
    float color[3];
    for (int c = 0; c < 3; ++c) color[c] = float(picture(x, y, c)) / 255;
    const CieLab after = CieLabFromSrgb(color),
                 before = CieLabFromSrgb(&view.data[view.Index(x, y)]);
    // DeltaE00 counts differences of chroma about half.
    return Eigen::Vector3d(after.lightness - before.lightness, (after.a - before.a) / 2,
                           (after.b - before.b) / 2);
  };
  for (int y = kApart; y + kApart < view.height; y += kApart + 1) {
    for (int x = kApart; x + kApart < view.width; x += kApart + 1) {
      const Eigen::Vector3d about = change(x - kApart, y - kApart) + change(x + kApart, y + kApart);
      const double one = (change(x, y) - about / 2).norm();
      ++samples;
      if (one > kNone) noise.push_back(one);
    }
  }
  // Flat parts of a JPEG have none. If most of the picture has none, pixels that have some are
  // paint.
  if (double(noise.size()) < kLeastNoisy * double(samples)) return kSeen;
  return std::clamp(kOverNoise * float(Median(std::move(noise))), kSeen, kMostNoise);
}

size_t CountDifferent(const ScalarImage& residuals, const ScalarImage& least) {
  size_t count = 0;
  for (size_t p = 0; p < residuals.data.size(); ++p) {
    count += residuals.data[p] > least.data[p] ? 1 : 0;
  }
  return count;
}

Mask ChangedPixels(const ScalarImage& difference, const ScalarImage& least) {
  Mask steady(difference.width, difference.height), mask(difference.width, difference.height);
  const auto count = [&](int x, int y, const auto& holds) {
    int found = 0;
    for (int i = 0; i < 9; ++i) {
      const int px = x + i % 3 - 1, py = y + i / 3 - 1;
      found += difference.Contains(px, py) && holds(px, py) ? 1 : 0;
    }
    return found;
  };
  const auto differs = [&](int x, int y) { return difference(x, y) > least(x, y); };
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      steady(x, y) = differs(x, y) && count(x, y, differs) >= kNeighbors ? 1 : 0;
    }
  }
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      mask(x, y) = count(x, y, [&](int px, int py) { return steady(px, py) != 0; }) > 0 ? 255 : 0;
    }
  }
  return mask;
}

Mask Surroundings(const Mask& mask) {
  const int reach = std::max(1, int(std::lround(kAround * std::min(mask.width, mask.height))));
  Mask around(mask);
  cv::Mat pixels = Pixels(around);
  cv::dilate(pixels, pixels, Disk(reach));
  for (size_t p = 0; p < around.data.size(); ++p) {
    if (mask.data[p] > 0) around.data[p] = 0;
  }
  return around;
}

void DropRim(ScalarImage& difference, const ScalarImage& least, const Mask& inside) {
  Mask paint = ChangedPixels(difference, least), ends = inside;
  const int reach = std::max(4, int(std::lround(kRim * std::min(paint.width, paint.height))));
  cv::Mat distance, deep;
  cv::threshold(Pixels(ends), Pixels(ends), 127, 255, cv::THRESH_BINARY);
  cv::distanceTransform(Pixels(ends), distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::bitwise_and(Pixels(paint), distance > reach, deep);
  cv::dilate(deep, deep, Disk(reach + 1));
  for (int y = 0; y < paint.height; ++y) {
    for (int x = 0; x < paint.width; ++x) {
      if (deep.at<uint8_t>(y, x) == 0 && distance.at<float>(y, x) <= float(reach)) {
        difference(x, y) = 0;
      }
    }
  }
}

void DropStray(ScalarImage& difference, const ScalarImage& least) {
  constexpr float kStrong = 10, kOverLeast = 2;  // DeltaE00, and times `least`
  constexpr int kFewest = 16;                    // strong pixels of a piece
  constexpr double kMuch = 0.25;                 // of its different pixels
  Mask paint = ChangedPixels(difference, least), together = paint;
  CloseGaps(together);  // the letters of a word
  cv::Mat pieces;
  const int count = cv::connectedComponents(Pixels(together), pieces, 8, CV_32S);
  std::vector<int> strong(size_t(count), 0), all(size_t(count), 0);
  const auto piece = [&](int x, int y) { return size_t(pieces.at<int>(y, x)); };
  for (int y = 0; y < paint.height; ++y) {
    for (int x = 0; x < paint.width; ++x) {
      if (!paint(x, y)) continue;
      const float bound = std::max(kStrong, kOverLeast * least(x, y));
      strong[piece(x, y)] += difference(x, y) > bound ? 1 : 0;
      all[piece(x, y)] += difference(x, y) > least(x, y) ? 1 : 0;
    }
  }
  for (int y = 0; y < paint.height; ++y) {
    for (int x = 0; x < paint.width; ++x) {
      const size_t i = piece(x, y);
      if (i == 0 || strong[i] < kFewest || strong[i] < kMuch * all[i]) difference(x, y) = 0;
    }
  }
}

Mask WithoutSpill(Mask mask, const DepthMap& depth) {
  constexpr float kJump = 0.025F;  // of the depth, from pixel to pixel: a ball's limb has less
  const int reach = std::max(6, int(std::lround(kBeside * std::min(mask.width, mask.height))));
  cv::threshold(Pixels(mask), Pixels(mask), 127, 255, cv::THRESH_BINARY);
  // The pixels that the surfaces painted deep inside reach without a jump, straight on: a table
  // that a ball lies on is not followed around the ball.
  Mask kept = mask;
  cv::erode(Pixels(kept), Pixels(kept), Disk(reach), {-1, -1}, 1, cv::BORDER_CONSTANT, 255);
  std::vector<cv::Point> front, next;
  cv::findNonZero(Pixels(kept), front);
  for (int step = 0; step < reach * 3 / 2 && !front.empty(); ++step, front.swap(next)) {
    next.clear();
    for (const cv::Point& at : front) {
      for (const cv::Point side : {cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const int x = at.x + side.x, y = at.y + side.y;
        if (!mask.Contains(x, y) || !mask(x, y) || kept(x, y)) continue;
        const float here = depth(at.x, at.y), there = depth(x, y);
        if (std::abs(here - there) > kJump * std::min(here, there)) continue;
        kept(x, y) = 255;
        next.push_back({x, y});
      }
    }
  }
  // The nearest depth that is kept so close by.
  cv::Mat nearest(mask.height, mask.width, CV_32F, cv::Scalar(1e30));
  cv::Mat(mask.height, mask.width, CV_32F, const_cast<float*>(depth.data.data()))
      .copyTo(nearest, Pixels(kept));
  cv::erode(nearest, nearest, Disk(reach + 1));
  cv::Mat rest, parts, sizes, centers;
  cv::subtract(Pixels(mask), Pixels(kept), rest);
  const int count = cv::connectedComponentsWithStats(rest, parts, sizes, centers, 8, CV_32S);
  std::vector<int> behind(size_t(count), 0);
  const auto visit_rest = [&](const auto& visit) {
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        if (const int part = parts.at<int>(y, x)) visit(x, y, part);
      }
    }
  };
  visit_rest([&](int x, int y, int part) {
    const float before = nearest.at<float>(y, x), z = depth(x, y);
    behind[size_t(part)] += before < 1e30F && !(z > 0 && z < (1 + kJump) * before) ? 1 : 0;
  });
  constexpr double kNearlyAll = 0.9;
  visit_rest([&](int x, int y, int part) {
    const int size = sizes.at<int>(part, cv::CC_STAT_AREA);
    if (behind[size_t(part)] >= kNearlyAll * size) mask(x, y) = 0;
  });
  return mask;
}

Mask Widened(Mask mask) {
  const int reach = std::max(2, int(std::lround(kBeside * std::min(mask.width, mask.height))));
  cv::dilate(Pixels(mask), Pixels(mask), Disk(reach));
  return mask;
}

std::optional<PaintLayer> PaintedLayer(const std::string& view, Image8 picture,
                                       const ScalarImage& difference, const ScalarImage& least,
                                       const Mask& inside) {
  Mask paint = ChangedPixels(difference, least);
  CloseGaps(paint);
  for (size_t p = 0; p < paint.data.size(); ++p) {
    if (inside.data[p] == 0) paint.data[p] = 0;
  }
  Extend(inside, picture, paint);
  const cv::Rect box = cv::boundingRect(Pixels(paint));
  if (box.empty()) return std::nullopt;
  PaintLayer layer{view, box.x, box.y, Image8(box.width, box.height), Mask(box.width, box.height)};
  for (int y = 0; y < box.height; ++y) {
    for (int x = 0; x < box.width; ++x) {
      layer.alpha(x, y) = paint(box.x + x, box.y + y);
      for (int c = 0; c < 3 && layer.alpha(x, y); ++c) {
        layer.color(x, y, c) = picture(box.x + x, box.y + y, c);
      }
    }
  }
  return layer;
}

}  // namespace retint
