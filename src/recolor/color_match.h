// SPDX-License-Identifier: BSD-3-Clause
// One color map from the colors of a splat to those that it should have: from pairs of colors in
// many views, some of which are wrong.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "recolor/color_edit.h"

namespace retint {

// From the plainest to the freest. All but the table are affine maps of display-encoded colors:
// sRGB above its short straight part is y = 1.055 L^(1/2.4) - 0.055, so that light times g is
//     y + 0.055 -> g^(1/2.4) (y + 0.055).
// kExposure: one g. kBalance: a g for each channel. kMatrix: 3x3 and an offset. kTable:
// FitColorTable() of the colors that a matrix leaves.
enum class MatchMap { kNone, kExposure, kBalance, kMatrix, kTable };
std::string_view NameOf(MatchMap map);  // "none", "exposure", "balance", "matrix", "table"
std::optional<MatchMap> MatchMapNamed(std::string_view name);

// Colors of the same places, display-encoded: mean colors of small cells of a view.
struct MatchView {
  std::string name;
  bool heldout = false;
  std::vector<float> from, to;  // [N, 3]
};

// Whose colors are right, if some are more so than the others': after
// light -> correction * light those of the view `view` are.
struct MatchReference {
  std::string view;
  Eigen::Matrix3d correction = Eigen::Matrix3d::Identity();  // of linear sRGB
};

struct MatchOptions {
  std::optional<MatchMap> map;  // none: chosen
  std::optional<MatchReference> reference;
};

struct MatchTrial {
  MatchMap map = MatchMap::kNone;
  double error = 0;  // DeltaE00 of held-out views, mean of their better nine tenths of cells
};

struct ViewMatch {
  std::string name;
  bool heldout = false;
  // How much light it shows beside the others, red, green, blue in stops.
  Eigen::Vector3d stops = Eigen::Vector3d::Zero();
  double before = 0, after = 0;  // as MatchTrial::error, of this view
};

struct ColorMatch {
  MatchMap map = MatchMap::kNone;
  ColorEdit edit;                  // no operation: kNone
  std::vector<MatchTrial> trials;  // in the order of MatchMap
  double before = 0, after = 0;    // their errors, of kNone and of `map`
  std::vector<ViewMatch> views;    // that have enough pairs
  int heldout = 0;  // of them; 0: the maps were compared in the views that they were fitted to
  // A mid gray's change by the map, red, green, blue in stops of light.
  Eigen::Vector3d gray_stops = Eigen::Vector3d::Zero();
  double spread = 0;  // of the views' stops: robust standard deviation
  // They differ by more than noise. Then each view's own difference was taken off first, and the
  // map is that to the median view, or to the reference's.
  bool exposures_differ = false;
};

// The map that takes `from` to `to`, fitted to the views that are not held out. Pairs that
// contradict most others, such as a moved object, do not count (Geman and McClure 1987, by iterated
// least squares). Of the affine maps the plainest is chosen that comes close to their least error
// in the held-out views. A table must be better by 0.25. InputError if fewer than two views have 50
// pairs, or the reference has fewer.
ColorMatch MatchColors(std::span<const MatchView> views, const MatchOptions& options);

// What is found, a sentence each. `target`: "the photos".
std::vector<std::string> SentencesOf(const ColorMatch& match, std::string_view target);

// light -> correction * light that makes `gray`, display-encoded, neutral and keeps its luminance.
Eigen::Matrix3d CorrectionOfGray(const Eigen::Vector3d& gray);

// The 24 patches of a ColorChecker Classic, row by row from dark skin to black, [24, 3], as sRGB.
std::span<const float> CheckerColors();
struct CheckerFit {
  Eigen::Matrix3d correction = Eigen::Matrix3d::Identity();  // of linear sRGB
  double before = 0, after = 0;                              // mean DeltaE00 of the patches
};
// From the same patches as a photo shows them. Patches with a channel above 0.98 do not count;
// nullopt where fewer than 12 are left.
std::optional<CheckerFit> FitChecker(std::span<const float> patches);

}  // namespace retint
