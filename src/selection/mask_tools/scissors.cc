// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/scissors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <string>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "base/error.h"

namespace retint {
namespace {

// Weights of the parts of a step's cost, as in Mortensen and Barrett.
constexpr double kNoEdge = 0.43, kAcross = 0.43, kFlat = 0.14;
constexpr double kLeastCost = 1e-3;
constexpr double kStrong = 200;  // from this Sobel gradient of 8-bit values on, no step is flat
// How far a piece may be from its straight line, and the extra cost of a step there.
constexpr double kReach = 1 / 3.0, kLeastReach = 8;  // of the line's length; pixels
constexpr double kAside = 0.2;

struct Edges {
  cv::Mat on;     // 8 bits, 0: none
  cv::Mat along;  // two floats: the edge's direction, scaled by its gradient over kStrong
};

Edges FindEdges(const Image& color) {
  cv::Mat bytes(color.height, color.width, CV_8UC3);
  for (int y = 0; y < color.height; ++y) {
    for (int x = 0; x < color.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const float value = std::clamp(color(x, y, c), 0.0f, 1.0f);
        bytes.at<cv::Vec3b>(y, x)[2 - c] = cv::saturate_cast<uchar>(255 * value);
      }
    }
  }
  Edges edges;
  cv::Canny(bytes, edges.on, 32, 100);
  cv::Mat right, down;
  cv::Sobel(bytes, right, CV_32F, 1, 0);
  cv::Sobel(bytes, down, CV_32F, 0, 1);
  edges.along.create(bytes.size(), CV_32FC2);
  for (int y = 0; y < color.height; ++y) {
    for (int x = 0; x < color.width; ++x) {
      cv::Vec2f steepest(0, 0);
      for (int c = 0; c < 3; ++c) {
        const cv::Vec2f one(-down.at<cv::Vec3f>(y, x)[c], right.at<cv::Vec3f>(y, x)[c]);
        if (one.dot(one) > steepest.dot(steepest)) steepest = one;
      }
      const double length = cv::norm(steepest);
      const double shorter = length > 0 ? std::min(1.0, length / kStrong) / length : 0;
      edges.along.at<cv::Vec2f>(y, x) = steepest * float(shorter);
    }
  }
  return edges;
}

// The cheapest way of pixels from `from` to `to` that stays near the straight line (Dijkstra 1959).
// It follows edges if there are some, otherwise the line.
class Piece {
 public:
  Piece(const Edges& edges, const cv::Point& from, const cv::Point& to)
      : edges_(edges), from_(from), line_(to - from), length_(cv::norm(line_)) {
    reach_ = std::max(kLeastReach, kReach * length_);
    const int margin = int(std::ceil(reach_));
    box_ = cv::Rect(std::min(from.x, to.x) - margin, std::min(from.y, to.y) - margin,
                    std::abs(line_.x) + 2 * margin + 1, std::abs(line_.y) + 2 * margin + 1) &
           cv::Rect({0, 0}, edges.on.size());
    cost_.assign(size_t(box_.area()), std::numeric_limits<double>::infinity());
    before_.assign(cost_.size(), -1);
  }

  std::vector<cv::Point> Find() {
    const int start = Index(from_), end = Index(from_ + line_);
    cost_[size_t(start)] = 0;
    open_.emplace(0, start);
    while (!open_.empty()) {
      const auto [cost, at] = open_.top();
      open_.pop();
      if (at == end) break;
      if (cost <= cost_[size_t(at)]) Visit(at);
    }
    std::vector<cv::Point> way;
    for (int at = end; at >= 0; at = before_[size_t(at)]) way.push_back(Pixel(at));
    std::reverse(way.begin(), way.end());
    return way;
  }

 private:
  using Entry = std::pair<double, int>;

  int Index(const cv::Point& p) const { return (p.y - box_.y) * box_.width + p.x - box_.x; }
  cv::Point Pixel(int index) const {
    return {box_.x + index % box_.width, box_.y + index / box_.width};
  }

  // Distance from the straight line, over the largest allowed one.
  double Aside(const cv::Point& p) const {
    const cv::Point2d away = p - from_, line = line_;
    const double along = std::clamp(away.dot(line) / (length_ * length_), 0.0, 1.0);
    return cv::norm(away - along * line) / reach_;
  }

  void Visit(int index) {
    const cv::Point at = Pixel(index);
    for (int k = 0; k < 9; ++k) {
      const cv::Point step(k % 3 - 1, k / 3 - 1), next = at + step;
      if (k == 4 || !box_.contains(next)) continue;
      const double aside = Aside(next);
      if (aside > 1) continue;
      const double length = k % 2 == 1 ? 1 : std::numbers::sqrt2;
      const double cost = cost_[size_t(index)] +
                          length * Local(at, next, cv::Point2d(step) / length) +
                          kAside * aside * aside;
      const int to = Index(next);
      if (cost >= cost_[size_t(to)]) continue;
      cost_[size_t(to)] = cost;
      before_[size_t(to)] = index;
      open_.emplace(cost, to);
    }
  }

  // Cost of a step: 0 along a strong edge, 1 on a plain surface.
  double Local(const cv::Point& at, const cv::Point& next, const cv::Point2d& unit) const {
    const auto along = [&](const cv::Point& p) {
      const auto edge = edges_.along.at<cv::Vec2f>(p);
      const double length = cv::norm(edge);
      return length > 0 ? std::abs(edge[0] * unit.x + edge[1] * unit.y) / length : 0;
    };
    const double no_edge = edges_.on.at<uchar>(next) ? 0 : 1;
    const double across = 1 - (along(at) + along(next)) / 2;
    const double flat = 1 - cv::norm(edges_.along.at<cv::Vec2f>(next));
    // Above 0 even after rounding, so that no way goes round in circles.
    return std::max(kLeastCost, kNoEdge * no_edge + kAcross * across + kFlat * flat);
  }

  const Edges& edges_;
  cv::Point from_, line_;
  double length_, reach_ = 0;
  cv::Rect box_;
  std::vector<double> cost_;
  std::vector<int> before_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
};

}  // namespace

Mask CutOut(const Image& color, const std::vector<Eigen::Vector2i>& anchors) {
  CheckOption(anchors.size() >= 3, "scissors need three points at least");
  for (const Eigen::Vector2i& at : anchors) {
    CheckOption(color.Contains(at.x(), at.y()), "point " + std::to_string(at.x()) + "," +
                                                    std::to_string(at.y()) +
                                                    " of the scissors lies outside the view");
  }
  const Edges edges = FindEdges(color);
  std::vector<cv::Point> outline;
  for (size_t i = 0; i < anchors.size(); ++i) {
    const Eigen::Vector2i& from = anchors[i];
    const Eigen::Vector2i& to = anchors[(i + 1) % anchors.size()];
    if (from == to) continue;
    const std::vector<cv::Point> piece =
        Piece(edges, {from.x(), from.y()}, {to.x(), to.y()}).Find();
    outline.insert(outline.end(), piece.begin(), piece.end());
  }
  CheckOption(!outline.empty(), "the points of the scissors are one");
  Mask mask(color.width, color.height);
  cv::Mat drawn(mask.height, mask.width, CV_8U, mask.data.data());
  cv::fillPoly(drawn, std::vector<std::vector<cv::Point>>{outline}, 255);
  return mask;
}

}  // namespace retint
