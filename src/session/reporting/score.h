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

// How a folder of true masks is laid out, and the masks to measure beside it.
enum class TruthLayout {
  // TRUTH/<image name>.png, MASKS/<image name>.png.
  kViews,
  // NVOS (Ren et al. 2022): TRUTH/masks/<scene>/<image>_mask.png, one of each scene.
  // MASKS/<scene>/<image name>.png.
  kNvos,
  // The multiview segmentation set of SPIn-NeRF (Mirzaei et al. 2023): TRUTH/<scene>/<image>.png
  // beside <image>_pseudo.png and <image>_cutout.png, which are not read. MASKS/<scene>/<image
  // name>.png, where "orchids" stands for "orchids (llff)" as well. <image> is the photo's name
  // without its extension; or that after "0_" or "1_"; or imageNNN, the NNN-th of all masks by name
  // from 0. The first image of a scene is what methods are given and is not scored.
  kSpinNerf,
};

struct ScoreRequest {
  TruthLayout layout = TruthLayout::kViews;
  std::filesystem::path truth;
  std::filesystem::path masks;  // to measure; may be empty where pictures are
  // Pictures <image name>.png before and after an edit; layout kViews only. May be empty.
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
  std::string scene;  // empty in layout kViews
  std::string view;   // image name, or its part that the layout has
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
  std::string name;  // "all", "within 50 degrees", a scene, "scenes" (mean over the scenes' means)
  int views = 0;
  std::vector<ScoreFigure> figures;  // those that any view has
};

struct ScoreReport {
  std::vector<ViewScore> views;  // by scene, then by name
  std::vector<ScoreGroup> groups;
  std::vector<std::string> warnings;  // scenes that were left out
};

// OptionError for nothing to measure; InputError for folders without a true mask, a view without
// its mask, and pictures that are not of one size (in the layouts of others, masks are resized to
// the truth). A true mask without a value of 128 and more counts from 1 on, as 0 and 1 are written
// by some. Stage: "score".
ScoreReport Score(const ScoreRequest& request, Monitor& monitor);

std::string ToJson(const ScoreReport& report);
std::string ToText(const ScoreReport& report);  // lines for people, the last without its end

}  // namespace retint
