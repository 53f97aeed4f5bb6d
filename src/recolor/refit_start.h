// SPDX-License-Identifier: BSD-3-Clause
// The start of a fit: the edit of each active Gaussian's own colors. Internal to recolor.
#pragma once

#include <memory>
#include <span>

#include "recolor/refit_views.h"

namespace retint {

// [active, K, 3]; `shares` are the active Gaussians'.
std::unique_ptr<float[]> FitStart(RefitViews& views, const ColorEdit& edit,
                                  const GaussianPaint* paint, std::span<const float> shares,
                                  Monitor& monitor);

}  // namespace retint
