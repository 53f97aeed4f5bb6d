// SPDX-License-Identifier: BSD-3-Clause
// The selection of a region: masks and shares of Gaussians, and the paint that they came from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "scene/image.h"
#include "selecting/select_options.h"
#include "selection/mask_projector.h"
#include "selection/registration.h"
#include "selection/selection_cloud.h"

namespace retint {

// Of one painted view.
struct PaintedReport {
  std::string view, outlined_by;  // of its PaintedView
  std::string depth_method, depth_reason;
  double valid_fraction = 0;
  CloudSummary cloud;
  RegistrationSummary registration;
};

// One round of painting in one view.
struct PaintRound {
  PaintedView view;  // its mask: the whole selection as it should be seen there, empty or not
  Mask before;       // the mask when painting began; no pixels: none
};

// The recipe of a selection: its painted views, its options, and the resulting cloud. Later rounds
// of painting continue from there, and missing parts can be recomputed. A painted view need not be
// one of the workspace's: its camera is its own.
struct SelectionSource {
  std::vector<PaintedView> painted;  // in the order of the rounds, each name once
  SelectOptions select;              // those of the newest round
  ProjectorOptions projector;
  SelectionCloud cloud;
  std::vector<PaintedReport> reports;  // the result of the newest paint of a view
  size_t Bytes() const;
};

// The places to which an edit applies. Immutable once it is part of a region.
struct RegionSelection {
  uint64_t id = 0;                    // unique in the session; part of a fit's key
  std::map<std::string, Mask> masks;  // by image name, soft
  std::vector<float> shares;          // [N] m_g in [0, 1]
  SelectionSource source;             // may be empty: masks from elsewhere
  size_t Bytes() const;
};

}  // namespace retint
