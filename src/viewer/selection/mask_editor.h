// SPDX-License-Identifier: BSD-3-Clause
// A soft mask for painting with strokes, shapes and operations, each one step of an undo
// history. Does not use Qt. Positions are continuous image coordinates: pixel (x, y) covers [x,
// x+1) × [y, y+1). Every call that changes pixels returns a rectangle around all of them, for
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
  // Drops old steps beyond `history_bytes`, but never the newest.
  explicit MaskEditor(int width = 0, int height = 0, size_t history_bytes = size_t{64} << 20);

  // Starts again without history. `mask` may have another size than before.
  void Reset(Mask mask);
  const Mask& mask() const { return mask_; }
  GridRect Bounds() const { return {0, 0, mask_.width, mask_.height}; }
  bool AnyInside() const;  // a pixel of 128 or more
  size_t CountInside() const;

  // ---- Brush

  // A stroke is one step of the history, from BeginStroke() to EndStroke(). The first dab is set
  // at once. StrokeTo() sweeps the brush along the segment from the last position. Its cost is
  // that of the box around the segment, at any image size. Overlaps within a stroke do not add up.
  // kReplace and kIntersect clear all other pixels when the stroke begins. Any other change ends a
  // stroke.
  GridRect BeginStroke(const Eigen::Vector2d& at, const BrushOptions& brush, Combine combine);
  GridRect StrokeTo(const Eigen::Vector2d& to);
  void EndStroke();
  GridRect CancelStroke();  // as if it had not begun
  bool InStroke() const { return stroke_.has_value(); }

  // ---- Shapes and operations, each one step unless nothing changes

  // Corners in any order. Fills each pixel that the rectangle covers at least half.
  GridRect FillRectangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, Combine combine);
  // Fills pixels with their center inside the closed outline, even-odd; for lasso and polygon. Does
  // nothing with fewer than three points.
  GridRect FillPolygon(std::span<const Eigen::Vector2d> outline, Combine combine);
  // Any shape with coverage in [0, 255]. Does nothing unless it has the mask's size.
  GridRect Fill(const Mask& shape, Combine combine);
  GridRect Grow(int pixels);    // by a disc
  GridRect Shrink(int pixels);  // pixels beyond the image do not count as outside
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
  // A change: old pixels XOR new pixels, so that one array serves undo and redo.
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
  // Records the difference between `before_` and `mask_` within `rect`, and returns its bounds.
  GridRect Record(const GridRect& rect);
  GridRect Toggle(const Step& step);
  void Begin();  // before_ = mask_

  Mask mask_;
  Mask before_;    // at the beginning of the current change
  Mask coverage_;  // of the current stroke; zero between strokes
  std::optional<Stroke> stroke_;
  std::vector<Step> steps_;
  size_t cursor_ = 0;  // steps_[0 .. cursor_) are done
  size_t bytes_ = 0, byte_budget_;
};

}  // namespace retint
