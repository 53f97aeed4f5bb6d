// SPDX-License-Identifier: BSD-3-Clause
// Internal to depth: the rendered pairs of Stereo-HV, their matching and their fusion. Disparities
// are in pixels of the horizontal baseline: s = fx beta / z, whichever way a pair was shifted.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "depth/stereo_hv.h"
#include "depth/stereo_matcher.h"
#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

// Where the second camera of a pair stands, along the first one's axes.
enum class Shift { kRight, kLeft, kDown, kUp };

// By which the content of the shifted view moves, per pixel of disparity.
struct Motion {
  int x, y;
};
Motion MotionOf(Shift shift);

// A part of the reference view's pixel grid; may reach beyond the image.
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

// The view that sees `rect` of `view`'s image plane.
PosedCamera CropCamera(const PosedCamera& view, const PixelRect& rect);
PosedCamera ShiftCamera(const PosedCamera& view, Shift shift, double baseline);
// The image grown by a few pixels all round, and by `padding` on the side from which content enters
// the shifted view, so that every pixel of the image can be matched.
PixelRect PairRect(const Camera& camera, Shift shift, int padding);

PixelRect Union(const PixelRect& a, const PixelRect& b);
// The pairs of a view, and what DepthEstimate says of them.
std::vector<Shift> ShiftsOf(const StereoHvOptions& options);
std::string StereoReason(size_t num_pairs, const StereoSearch& search, double valid_fraction);
[[noreturn]] void ThrowNoRoughDepth();

// A pair to match: both images show `rect` of the image plane of a [height, width] view.
struct RenderedPair {
  Shift shift;
  PixelRect rect;
  Image8 reference, shifted;
};

// The disparity [height, width] of the reference; negative where not found or not confirmed by
// matching the other way within `tolerance` pixels.
ScalarImage MatchPair(const StereoMatcher& matcher, const RenderedPair& pair, int width, int height,
                      const DisparityRange& range, double tolerance);

// A shifted view, gray (0 to 1), on the reference's pixel grid from (rect.x, rect.y).
struct ShiftedGray {
  Shift shift;
  PixelRect rect;
  ScalarImage gray;
};

// Rounds the range up to a length that the census matcher takes; false where it is too long.
bool FitCensus(DisparityRange& range);
// The same as MatchPair by the census matcher. `reference` shows `rect`, which holds what `shifted`
// shows.
ScalarImage MatchCensus(const ScalarImage& reference, const PixelRect& rect,
                        const ShiftedGray& shifted, int width, int height,
                        const DisparityRange& range, double tolerance);

// Per pixel, over the pairs: kAgree takes the mean of the largest set that agrees within
// `tolerance` pixels, of two as large the nearer; kMin the nearest of all. Negative where no pair
// has a disparity.
ScalarImage FuseDisparities(std::span<const ScalarImage> pairs, StereoAggregate aggregate,
                            double tolerance);

// Settles where stereo and the Gaussians' own depth, `rough` (disparities too), disagree: whichever
// the colours of the shifted views favour; near depth edges, where flat colour favours neither, the
// rough depth where it continues a confirmed surface. Where they agree, their mean. Returns 255
// where the result was measured in the pairs, 0 where it is the rough depth continued or nothing.
Mask ArbitrateDisparity(std::span<const RenderedPair> pairs, const ScalarImage& rough,
                        ScalarImage& disparity);

// Removes the matcher's sub-pixel bias: Gauss-Newton on the disparity of every pixel against all
// shifted views at once, over a small window, where the disparity is smooth. `gray` is the
// reference [H, W].
void RefineDisparity(const ScalarImage& gray, std::span<const ShiftedGray> shifted,
                     ScalarImage& disparity);

}  // namespace retint
