// SPDX-License-Identifier: BSD-3-Clause
// What one painted view gives, and its way to the other ranks. Internal to session.
#pragma once

#include <string>
#include <vector>

#include "selecting/selection_pipeline.h"

namespace retint {

struct PaintedPart {
  DepthEstimate depth;
  SelectionCloud cloud, raw;  // filtered and registered; every sampled pixel, where it is kept
  PaintedReport report;
};

// Collective (base/ranks.h). Completes `parts`, of which owners[i] has the i-th, on every rank.
void SharePainted(const std::vector<int>& owners, std::vector<PaintedPart>* parts);

}  // namespace retint
