// SPDX-License-Identifier: BSD-3-Clause
// Colors for what is laid over a picture, so that it is told from what lies below.
#pragma once

#include <functional>

#include <QColor>
#include <QImage>

#include "session/region.h"

namespace retint {

// Orange, azure, magenta or green: the first of them that stands out from `under`; `current`, where
// it does, so that an overlay keeps its color while it can.
QColor ContrastingColor(const QColor& under, const QColor& current = {});

// The mean color of the pixels of a picture that `inside` picks, of a large one a part of them;
// invalid where there is none.
QColor MeanColor(const QImage& picture, const std::function<bool(int x, int y)>& inside);

// The mean color of a region as its edit shows it, by its Gaussians' first coefficients.
QColor MeanColor(const Region& region, const GaussianModel& original);

}  // namespace retint
