// SPDX-License-Identifier: BSD-3-Clause
// A splat whose colors drifted, and the photos or the other splat whose colors it should have.
#pragma once

#include <filesystem>
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

// A match as people ask for it: on the command line, in a job, in Python.
struct MatchRecipe {
  std::string map = "auto";    // or the name of a MatchMap but "none"
  std::filesystem::path like;  // a splat in the same frame; empty: the photos
  std::string gray, checker;   // ParseCard(); at most one of them and `like`
  void Check() const;          // OptionError
};

struct SceneMatchRequest {
  std::optional<MatchMap> map;          // none: chosen
  const GaussianModel* like = nullptr;  // in the splat's frame; null: the photos
  // At most one, without `like`. A checker's corners begin at any patch and go round.
  std::optional<CardInPhoto> gray, checker;
  std::string target = "the photos";  // the name of those colors in sentences
};

struct SceneMatch {
  ColorMatch colors;
  std::optional<CheckerFit> checker;
  std::vector<std::string> sentences;  // SentencesOf()
  std::string warning;                 // of views that do not count; empty: all do
};

// Compares cells of every view of the scene as it is now (RefitService::CurrentSh()): those where
// at least nine tenths of the pixels are opaque and, of photos, not clipped, of `like`, of the same
// depth within 2 %. InputError if too few views can be compared, or if fewer than a quarter of the
// pixels have the depth of `like`; for a card that lies outside its photo, that is clipped or of
// several colors, and for a checker that is not recognized. If the scene holds out no view, every
// fourth is held out here.
// Stage: "match".
SceneMatch MatchScene(EditSession& session, const SceneMatchRequest& request, Monitor& monitor);
SceneMatch MatchByRecipe(EditSession& session, const MatchRecipe& recipe, Monitor& monitor);

// Adds the map as a region that holds every Gaussian and every pixel. An affine map is exact then,
// and RefitService fits nothing. A table, and any map of a splat whose colors are linear light, is
// for the caller to fit.
RegionId ApplyMatch(EditSession& session, const ColorMatch& match, const std::string& name,
                    Monitor& monitor);

}  // namespace retint
