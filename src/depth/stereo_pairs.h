// SPDX-License-Identifier: BSD-3-Clause
// Internal to depth: the rendered pairs of Stereo-HV, and their matching on the host. Disparities
// are in pixels of the horizontal baseline: s = fx beta / z, whichever way a pair was shifted.
#pragma once

#include <string>
#include <vector>

#include "depth/stereo_hv.h"
#include "depth/stereo_matcher.h"
#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

// The place of a pair's second camera, along the first one's axes.
enum class Shift { kRight, kLeft, kDown, kUp };

// By which the content of the shifted view moves, per pixel of disparity.
struct Motion {
  int x, y;
};
Motion MotionOf(Shift shift);

// The view that sees `rect` of `view`'s image plane; it may reach beyond the image.
PosedCamera CropCamera(const PosedCamera& view, const GridRect& rect);
PosedCamera ShiftCamera(const PosedCamera& view, Shift shift, double baseline);
// The image plus a few pixels all round, plus `padding` on the side from which content enters the
// shifted view. So every pixel of the image can be matched.
GridRect PairRect(const Camera& camera, Shift shift, int padding);

GridRect Union(const GridRect& a, const GridRect& b);
// The pairs of a view, and their part of DepthEstimate.
std::vector<Shift> ShiftsOf(const StereoHvOptions& options);
std::string StereoReason(size_t num_pairs, const StereoSearch& search, double valid_fraction,
                         const std::string& matcher);

// A pair to match: both images show `rect` of the image plane of a [height, width] view.
struct RenderedPair {
  Shift shift;
  GridRect rect;
  Image8 reference, shifted;
};

// The disparity [height, width] of the reference; negative where not found or not confirmed by
// matching the other way within `tolerance` pixels.
ScalarImage MatchPair(const StereoMatcher& matcher, const RenderedPair& pair, int width, int height,
                      const DisparityRange& range, double tolerance, const Monitor& monitor);

// Rounds the range up to a length that the census matcher takes; false where it is too long.
bool FitCensus(DisparityRange& range);

}  // namespace retint
