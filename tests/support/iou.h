// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>

#include "selection/mask_score.h"

namespace retint {

// Of two masks that are not both empty; throws otherwise.
inline double IouOf(const Mask& mask, const Mask& truth) { return Iou(mask, truth).value(); }

// Over the views whose truth has at least a hundred pixels.
inline double MeanIou(const std::map<std::string, Mask>& masks,
                      const std::map<std::string, Mask>& truths) {
  double sum = 0;
  int count = 0;
  for (const auto& [name, truth] : truths) {
    if (std::count(truth.data.begin(), truth.data.end(), uint8_t{255}) < 100) continue;
    sum += IouOf(masks.at(name), truth);
    ++count;
  }
  return sum / std::max(1, count);
}

}  // namespace retint
