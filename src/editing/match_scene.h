// SPDX-License-Identifier: BSD-3-Clause
// A splat whose colors drifted, and the photos or the other splat whose colors it should have.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/monitor.h"
#include "editing/edit_session.h"
#include "recolor/color_match.h"
#include "scene/gaussian_model.h"

namespace retint {

// A gray card or a color checker in a photo: [x, y, width, height], or the x and y of its four
// corners in turn, in the photo file's own pixels.
struct CardInPhoto {
  std::string view;
  std::vector<double> place;  // 4 or 8
};
// Of "VIEW:X,Y,W,H" or "VIEW:X1,Y1,...,X4,Y4". OptionError, which names `option`, for other text.
CardInPhoto ParseCard(std::string_view option, std::string_view text);

struct SceneMatchRequest {
  std::optional<MatchMap> map;          // none: chosen
  const GaussianModel* like = nullptr;  // in the splat's frame; null: the photos
  // At most one, without `like`. A checker's corners begin at any patch and go round.
  std::optional<CardInPhoto> gray, checker;
};

struct SceneMatch {
  ColorMatch colors;
  std::optional<CheckerFit> checker;
};

// Compares cells of every view of the scene as it is now (RefitService::CurrentSh()): those where
// at least nine tenths of the pixels are opaque and, of photos, not clipped, of `like`, of the same
// depth within 2 %. InputError if too few views can be compared, or if fewer than a quarter of the
// pixels have the depth of `like`; for a card that lies outside its photo, that is clipped or of
// several colors, and for a checker that is not recognized.
// Stage: "match".
SceneMatch MatchScene(EditSession& session, const SceneMatchRequest& request, Monitor& monitor);

// Adds the map as a region that holds everything. An affine map is exact, as blending and spherical
// harmonics are linear: every Gaussian takes it, and nothing is fitted. A table, and any map of a
// splat whose colors are linear light, is fitted with `job` to the views.
void ApplyMatch(EditSession& session, const ColorMatch& match, const RefitJob& job,
                Monitor& monitor);

}  // namespace retint
