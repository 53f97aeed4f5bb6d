// SPDX-License-Identifier: BSD-3-Clause
// Whether a splat and a workspace belong together: do the renders show what the photos show?
#pragma once

#include <string>
#include <vector>

#include "base/monitor.h"
#include "session/edit_session.h"

namespace retint {

struct SceneCheckOptions {
  int max_views = 4;          // rendered and compared, evenly spread
  int longest_side = 400;     // pixels; larger views are compared this small
  double min_psnr = 15;       // dB, median of the compared views
  double min_coverage = 0.5;  // mean opacity, median of the compared views
};

struct SceneCheck {
  std::vector<std::string> missing_photos;  // view names
  int views = 0;                            // in the workspace
  int compared = 0;                         // with a photo
  double median_psnr = 0;                   // NaN where no view has a photo
  double median_coverage = 0;               // of the renders' opacity
  std::vector<std::string> warnings;        // one line each, for the user
};

// Leaves the original's coefficients in session.renderer(). Photos that cannot be read count as
// missing. Stage: "check".
SceneCheck CheckScene(EditSession& session, Monitor& monitor,
                      const SceneCheckOptions& options = {});

}  // namespace retint
