// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/selection_veil.h"

#include <algorithm>
#include <utility>

#include "scene/mask_pixels.h"

namespace retint {
namespace {

constexpr int kFadeMs = 200;

GridRect InsideOf(const Mask& mask) {
  GridRect inside;
  for (int y = 0; y < mask.height; ++y) {
    const uint8_t* row = mask.data.data() + mask.Index(0, y);
    const auto* first = std::find_if(row, row + mask.width, IsInside);
    if (first == row + mask.width) continue;
    const auto* last = row + mask.width;
    while (!IsInside(last[-1])) --last;
    inside = inside.United(GridRect::Between(int(first - row), y, int(last - row), y + 1));
  }
  return inside;
}

}  // namespace

SelectionVeil::SelectionVeil(QObject* parent) : QObject(parent) {
  fade_.setDuration(kFadeMs);
  fade_.setStartValue(1.0);
  fade_.setEndValue(0.0);
  connect(&fade_, &QVariantAnimation::valueChanged, this, [this] { Q_EMIT changed(inside_); });
  connect(&fade_, &QVariantAnimation::finished, this, &SelectionVeil::Clear);
}

double SelectionVeil::opacity() const {
  return fade_.state() == QAbstractAnimation::Running ? fade_.currentValue().toDouble() : 1;
}

void SelectionVeil::Show(Mask mask) {
  fade_.stop();
  mask_ = std::move(mask);
  const GridRect before = std::exchange(inside_, InsideOf(mask_));
  Q_EMIT changed(before.United(inside_));
}

void SelectionVeil::Fade() {
  if (!mask_.Empty() && fade_.state() != QAbstractAnimation::Running) fade_.start();
}

void SelectionVeil::Clear() { Show({}); }

}  // namespace retint
