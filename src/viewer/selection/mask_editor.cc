// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/mask_editor.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "scene/mask_pixels.h"

namespace retint {
namespace {

cv::Mat Wrap(const Mask& mask) {
  return {mask.height, mask.width, CV_8UC1, const_cast<uint8_t*>(mask.data.data())};
}

uint8_t Combined(uint8_t mask, uint8_t shape, Combine combine) {
  switch (combine) {
    case Combine::kReplace:
      return shape;
    case Combine::kAdd:
      return std::max(mask, shape);
    case Combine::kRemove:
      return std::min<uint8_t>(mask, static_cast<uint8_t>(255 - shape));
    case Combine::kIntersect:
      return std::min(mask, shape);
  }
  return mask;
}

// The coverage of a brush by the distance from its spine: 1 in the hard part, then a smooth fall to
// 0. The fall ends at the radius. For a hard brush it is one pixel wide, and centered on the
// radius.
class BrushProfile {
 public:
  explicit BrushProfile(const BrushOptions& brush) {
    const double radius = std::max(0.5, brush.radius);
    const double fade = std::max(1.0, radius * (1 - std::clamp(brush.hardness, 0.0, 1.0)));
    outer_ = static_cast<float>(radius + 0.5);
    inner_ = std::max(0.0f, static_cast<float>(radius + 0.5 - fade));
  }
  float outer() const { return outer_; }
  uint8_t operator()(float distance_squared) const {
    if (distance_squared >= outer_ * outer_) return 0;
    if (distance_squared <= inner_ * inner_) return 255;
    const float t = (outer_ - std::sqrt(distance_squared)) / (outer_ - inner_);
    return static_cast<uint8_t>(255 * t * t * (3 - 2 * t) + 0.5f);
  }

 private:
  float inner_, outer_;
};

}  // namespace

MaskEditor::MaskEditor(int width, int height, size_t history_bytes) : byte_budget_(history_bytes) {
  Reset(Mask(width, height));
}

void MaskEditor::Reset(Mask mask) {
  mask_ = std::move(mask);
  before_ = mask_;
  coverage_ = Mask(mask_.width, mask_.height);
  stroke_.reset();
  steps_.clear();
  cursor_ = 0;
  bytes_ = 0;
}

bool MaskEditor::AnyInside() const { return retint::AnyInside(mask_); }

size_t MaskEditor::CountInside() const { return retint::CountInside(mask_); }

void MaskEditor::Begin() {
  EndStroke();
  std::copy(mask_.data.begin(), mask_.data.end(), before_.data.begin());
}

// ---- Brush

GridRect MaskEditor::BeginStroke(const Eigen::Vector2d& at, const BrushOptions& brush,
                                 Combine combine) {
  Begin();
  stroke_ = Stroke{brush, combine, at, {}};
  GridRect changed;
  if (combine == Combine::kReplace || combine == Combine::kIntersect) {
    std::fill(mask_.data.begin(), mask_.data.end(), uint8_t{0});
    changed = stroke_->touched = Bounds();
  }
  return changed.United(Dab(at, at));
}

GridRect MaskEditor::StrokeTo(const Eigen::Vector2d& to) {
  if (!stroke_) return {};
  const Eigen::Vector2d from = std::exchange(stroke_->at, to);
  return Dab(from, to);
}

GridRect MaskEditor::Dab(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  if (!from.allFinite() || !to.allFinite()) return {};
  const BrushProfile profile(stroke_->brush);
  const auto clip = [](double value, int size) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(size)));
  };
  const double reach = profile.outer();
  const GridRect box =
      GridRect::Between(clip(std::floor(std::min(from.x(), to.x()) - reach), mask_.width),
                        clip(std::floor(std::min(from.y(), to.y()) - reach), mask_.height),
                        clip(std::ceil(std::max(from.x(), to.x()) + reach), mask_.width),
                        clip(std::ceil(std::max(from.y(), to.y()) + reach), mask_.height));
  if (box.Empty()) return {};
  // Squared distance to the segment, in coordinates about its start.
  const Eigen::Vector2f start = from.cast<float>(), along = (to - from).cast<float>();
  const float length_squared = along.squaredNorm();
  const float inverse = length_squared > 0 ? 1 / length_squared : 0;
  for (int y = box.y; y < box.y1(); ++y) {
    const float dy = static_cast<float>(y) + 0.5f - start.y();
    for (int x = box.x; x < box.x1(); ++x) {
      const float dx = static_cast<float>(x) + 0.5f - start.x();
      const float t = std::clamp((dx * along.x() + dy * along.y()) * inverse, 0.0f, 1.0f);
      const float rx = dx - t * along.x(), ry = dy - t * along.y();
      const uint8_t value = profile(rx * rx + ry * ry);
      const size_t i = mask_.Index(x, y);
      if (value <= coverage_.data[i]) continue;
      coverage_.data[i] = value;
      mask_.data[i] = Combined(before_.data[i], value, stroke_->combine);
    }
  }
  stroke_->touched = stroke_->touched.United(box);
  return box;
}

void MaskEditor::EndStroke() {
  if (!stroke_) return;
  const GridRect touched = stroke_->touched;
  stroke_.reset();
  for (int y = touched.y; y < touched.y1(); ++y) {
    std::fill_n(&coverage_(touched.x, y), touched.width, uint8_t{0});
  }
  Record(touched);
}

GridRect MaskEditor::CancelStroke() {
  if (!stroke_) return {};
  const GridRect touched = stroke_->touched;
  for (int y = touched.y; y < touched.y1(); ++y) {
    std::copy_n(&before_(touched.x, y), touched.width, &mask_(touched.x, y));
    std::fill_n(&coverage_(touched.x, y), touched.width, uint8_t{0});
  }
  stroke_.reset();
  return touched;
}

// ---- Shapes and operations

GridRect MaskEditor::Fill(const Mask& shape, Combine combine) {
  if (shape.width != mask_.width || shape.height != mask_.height) return {};
  Begin();
  for (size_t i = 0; i < mask_.data.size(); ++i) {
    mask_.data[i] = Combined(mask_.data[i], shape.data[i], combine);
  }
  return Record(Bounds());
}

GridRect MaskEditor::FillRectangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                   Combine combine) {
  if (!a.allFinite() || !b.allFinite()) return {};
  const auto edge = [](double value, int size) {
    return static_cast<int>(std::lround(std::clamp(value, 0.0, static_cast<double>(size))));
  };
  const int x0 = edge(std::min(a.x(), b.x()), mask_.width);
  const int x1 = edge(std::max(a.x(), b.x()), mask_.width);
  const int y0 = edge(std::min(a.y(), b.y()), mask_.height);
  const int y1 = edge(std::max(a.y(), b.y()), mask_.height);
  Mask shape(mask_.width, mask_.height);
  for (int y = y0; x0 < x1 && y < y1; ++y) std::fill_n(&shape(x0, y), x1 - x0, uint8_t{255});
  return Fill(shape, combine);
}

GridRect MaskEditor::FillPolygon(std::span<const Eigen::Vector2d> outline, Combine combine) {
  if (outline.size() < 3) return {};
  for (const Eigen::Vector2d& point : outline) {
    if (!point.allFinite()) return {};
  }
  // Fills each row between pairs of crossings. OpenCV's fillPoly would add the outline's own
  // pixels.
  Mask shape(mask_.width, mask_.height);
  std::vector<double> crossings;
  for (int y = 0; y < shape.height; ++y) {
    const double row = y + 0.5;
    crossings.clear();
    for (size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
      if ((a.y() > row) == (b.y() > row)) continue;
      const double x = a.x() + (row - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      crossings.push_back(std::clamp(x - 0.5, 0.0, static_cast<double>(shape.width)));
    }
    std::sort(crossings.begin(), crossings.end());
    for (size_t i = 0; i + 1 < crossings.size(); i += 2) {
      const int x0 = static_cast<int>(std::ceil(crossings[i]));
      const int x1 = static_cast<int>(std::ceil(crossings[i + 1]));
      if (x0 < x1) std::fill_n(&shape(x0, y), x1 - x0, uint8_t{255});
    }
  }
  return Fill(shape, combine);
}

GridRect MaskEditor::Grow(int pixels) {
  if (pixels <= 0 || mask_.Empty()) return {};
  Begin();
  const int side = 2 * pixels + 1;
  cv::Mat wrapped = Wrap(mask_);
  cv::dilate(wrapped, wrapped, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  return Record(Bounds());
}

GridRect MaskEditor::Shrink(int pixels) {
  if (pixels <= 0 || mask_.Empty()) return {};
  Begin();
  const int side = 2 * pixels + 1;
  cv::Mat wrapped = Wrap(mask_);
  cv::erode(wrapped, wrapped, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  return Record(Bounds());
}

GridRect MaskEditor::Invert() {
  Begin();
  for (uint8_t& value : mask_.data) value = static_cast<uint8_t>(255 - value);
  return Record(Bounds());
}

GridRect MaskEditor::SelectAll() {
  return Fill(Mask(mask_.width, mask_.height, 255), Combine::kReplace);
}

GridRect MaskEditor::SelectNone() {
  return Fill(Mask(mask_.width, mask_.height), Combine::kReplace);
}

// ---- History

GridRect MaskEditor::Record(const GridRect& rect) {
  GridRect changed;
  for (int y = rect.y; y < rect.y1(); ++y) {
    const uint8_t* now = &mask_(rect.x, y);
    const uint8_t* then = &before_(rect.x, y);
    const auto [first, unused] = std::mismatch(now, now + rect.width, then);
    if (first == now + rect.width) continue;
    int last = rect.width - 1;
    while (now[last] == then[last]) --last;
    const int x0 = rect.x + static_cast<int>(first - now);
    changed = changed.United(GridRect::Between(x0, y, rect.x + last + 1, y + 1));
  }
  if (changed.Empty()) return {};
  while (steps_.size() > cursor_) {  // drop undone steps
    bytes_ -= steps_.back().delta.size();
    steps_.pop_back();
  }
  Step step{changed, {}};
  step.delta.reserve(static_cast<size_t>(changed.width) * static_cast<size_t>(changed.height));
  for (int y = changed.y; y < changed.y1(); ++y) {
    for (int x = changed.x; x < changed.x1(); ++x) {
      step.delta.push_back(static_cast<uint8_t>(mask_(x, y) ^ before_(x, y)));
    }
  }
  bytes_ += step.delta.size();
  steps_.push_back(std::move(step));
  while (bytes_ > byte_budget_ && steps_.size() > 1) {
    bytes_ -= steps_.front().delta.size();
    steps_.erase(steps_.begin());
  }
  cursor_ = steps_.size();
  return changed;
}

GridRect MaskEditor::Toggle(const Step& step) {
  size_t i = 0;
  for (int y = step.rect.y; y < step.rect.y1(); ++y) {
    for (int x = step.rect.x; x < step.rect.x1(); ++x) mask_(x, y) ^= step.delta[i++];
  }
  return step.rect;
}

GridRect MaskEditor::Undo() {
  EndStroke();
  return CanUndo() ? Toggle(steps_[--cursor_]) : GridRect{};
}

GridRect MaskEditor::Redo() {
  EndStroke();
  return CanRedo() ? Toggle(steps_[cursor_++]) : GridRect{};
}

}  // namespace retint
