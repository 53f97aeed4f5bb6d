// SPDX-License-Identifier: BSD-3-Clause
// The paint of a view in its selection, in figures and as a picture to look at.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "opening/open_scene.h"
#include "scene/image.h"
#include "selection/mask_projector.h"

namespace retint {

// Pixels of a painted view that the painter saw.
struct PaintCounts {
  size_t painted = 0;
  size_t kept = 0;   // painted, and in the view's mask
  size_t added = 0;  // in the mask, and not painted
  size_t left_out() const { return painted - kept; }
  PaintCounts& operator+=(const PaintCounts& other);
  // "all of your paint is in", "93 % of your paint is in, and 4 % beside it". Less than 1 % of the
  // painted pixels is not mentioned. Empty if no pixel is painted.
  std::string Words() const;
};

// All 0 for a mask of another size than the view's.
PaintCounts CountPaint(const PaintedView& view, const Mask& mask);

// The photo in gray; on it, paint in the mask is green, pixels that the mask adds are yellow, and
// paint that it leaves out is red. InputError if the three are not of one size.
Image8 PaintPicture(const Image& photo, const PaintedView& view, const Mask& mask);

struct PaintedPicture {
  std::string view;
  PaintCounts counts;
  Image8 picture;
};
// Of each painted view that has a mask among `masks`, in the order of painting: its photo, or its
// render if it has none. The scene's renderer is left with the original coefficients.
std::vector<PaintedPicture> PicturesOfPaint(OpenScene& scene,
                                            const std::vector<PaintedView>& painted,
                                            const std::map<std::string, Mask>& masks);

}  // namespace retint
