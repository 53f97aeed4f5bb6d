// SPDX-License-Identifier: BSD-3-Clause
// The results of one painted view, and their way to the other processes. Internal.
#pragma once

#include <string>
#include <vector>

#include "render/view_reducer.h"
#include "selecting/selection_pipeline.h"

namespace retint {

struct PaintedPart {
  DepthEstimate depth;
  SelectionCloud cloud, raw;  // filtered and registered; every sampled pixel, where it is kept
  PaintedReport report;
};

// Collective. Completes `parts`, of which the owner of view i has the i-th, in every process.
void SharePainted(ViewReducer& views, std::vector<PaintedPart>* parts);

}  // namespace retint
