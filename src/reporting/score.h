// SPDX-License-Identifier: BSD-3-Clause
// Folders of masks, or of recolored pictures, measured against folders of true masks.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "recolor/color_edit.h"
#include "scene/reconstruction.h"
#include "selection/mask_score.h"

namespace retint {

struct ScoreRequest {
  std::filesystem::path truth;  // <image name>.png
  std::filesystem::path masks;  // <image name>.png to measure; may be empty if `before` is not
  // Pictures <image name>.png before and after an edit. May be empty.
  std::filesystem::path before, after;
  ColorEdit edit;
  int border = 2;  // pixels, of EditScore
  // Image names that were painted: their scores are in no group.
  std::vector<std::string> painted;
  // With it, views whose viewing directions are at most `within_degrees` from that of a painted one
  // are a group of their own.
  const Reconstruction* model = nullptr;
  double within_degrees = 50;
};

struct ViewScore {
  std::string view;  // image name
  bool painted = false;
  std::optional<double> degrees;  // to the nearest painted view's direction
  MaskScore mask;
  EditScore edit;
};

// One figure over a group of views.
struct ScoreFigure {
  std::string name;  // "iou", "hit", ...
  int count = 0;     // views that have it
  double mean = 0, median = 0, worst = 0;
  std::string worst_view;
};

struct ScoreGroup {
  std::string name;  // "all", "within 50 degrees"
  int views = 0;
  std::vector<ScoreFigure> figures;  // those that any view has
};

struct ScoreReport {
  std::vector<ViewScore> views;  // by name
  std::vector<ScoreGroup> groups;
  std::vector<std::string> warnings;
};

// OptionError for nothing to measure; InputError for folders without a true mask, a view without
// its mask, and pictures that are not of one size. A true mask without a value of 128 and more
// counts from 1 on, because some programs write masks of 0 and 1. Stage: "score".
ScoreReport Score(const ScoreRequest& request, Monitor& monitor);

std::string ToJson(const ScoreReport& report);
std::vector<std::string> ToLines(const ScoreReport& report);  // for people, without line ends

}  // namespace retint
