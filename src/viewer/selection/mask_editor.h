// SPDX-License-Identifier: BSD-3-Clause
// A soft mask painted with strokes, shapes and operations, each one step of an undo history. Pure
// logic, no Qt. Positions are continuous image coordinates: pixel (x, y) covers [x, x+1) × [y,
// y+1). Every call that changes pixels returns the rectangle that holds all of them, for
// repainting.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "scene/grid_rect.h"
#include "scene/image.h"

namespace retint {

// How a stroke or a shape S with coverage in [0, 255] changes the mask M.
enum class Combine {
  kReplace,    // S
  kAdd,        // max(M, S)
  kRemove,     // min(M, 255 - S)
  kIntersect,  // min(M, S)
};

struct BrushOptions {
  double radius = 12;   // pixels, > 0
  double hardness = 1;  // in [0, 1]: the share of the radius that is fully covered; at 1 the edge
                        // is one pixel of anti-aliasing
};

class MaskEditor {
 public:
  // Steps older than `history_bytes` allows are forgotten; the newest always stays.
  explicit MaskEditor(int width = 0, int height = 0, size_t history_bytes = size_t{64} << 20);

  // Starts anew, without history. `mask` may be of another size than before.
  void Reset(Mask mask);
  const Mask& mask() const { return mask_; }
  GridRect Bounds() const { return {0, 0, mask_.width, mask_.height}; }
  bool AnyInside() const;  // a pixel of 128 or more
  size_t CountInside() const;

  // ---- Brush

  // One step of the history from BeginStroke to EndStroke. The first dab is set at once; StrokeTo
  // covers what a brush swept along the segment from the last position covers. A move costs as much
  // as the box about that segment, whatever the image's size. Overlaps within a stroke do not add
  // up. kReplace and kIntersect clear the pixels outside when the stroke begins. A stroke in
  // progress is ended by any other change.
  GridRect BeginStroke(const Eigen::Vector2d& at, const BrushOptions& brush, Combine combine);
  GridRect StrokeTo(const Eigen::Vector2d& to);
  void EndStroke();
  GridRect CancelStroke();  // as if it had never begun
  bool InStroke() const { return stroke_.has_value(); }

  // ---- Shapes and operations, each one step unless nothing changes

  // Corners in any order, each pixel that the rectangle covers half or more.
  GridRect FillRectangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, Combine combine);
  // Pixels whose center lies within the closed outline, even-odd; lasso and polygon alike. Fewer
  // than three points: nothing.
  GridRect FillPolygon(std::span<const Eigen::Vector2d> outline, Combine combine);
  // Any shape, coverage in [0, 255]. Nothing, unless it is of the mask's size.
  GridRect Fill(const Mask& shape, Combine combine);
  GridRect Grow(int pixels);    // by a disc
  GridRect Shrink(int pixels);  // pixels that the border cuts off do not count as outside
  GridRect Invert();
  GridRect SelectAll();
  GridRect SelectNone();

  // ---- History

  bool CanUndo() const { return cursor_ > 0; }
  bool CanRedo() const { return cursor_ < steps_.size(); }
  GridRect Undo();
  GridRect Redo();
  size_t history_bytes() const { return bytes_; }

 private:
  // The change: the old pixels XOR the new ones, so that the same bytes serve undo and redo.
  struct Step {
    GridRect rect;
    std::vector<uint8_t> delta;  // [height, width] of rect
  };
  struct Stroke {
    BrushOptions brush;
    Combine combine;
    Eigen::Vector2d at;
    GridRect touched;
  };
  GridRect Dab(const Eigen::Vector2d& from, const Eigen::Vector2d& to);
  // Records the difference between `before_` and `mask_` within `rect`. Returns its bounds.
  GridRect Record(const GridRect& rect);
  GridRect Toggle(const Step& step);
  void Begin();  // before_ = mask_

  Mask mask_;
  Mask before_;    // when the change in progress began
  Mask coverage_;  // of the stroke in progress; zero between strokes
  std::optional<Stroke> stroke_;
  std::vector<Step> steps_;
  size_t cursor_ = 0;  // steps_[0 .. cursor_) are done
  size_t bytes_ = 0, byte_budget_;
};

}  // namespace retint
