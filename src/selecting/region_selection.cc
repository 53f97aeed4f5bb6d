// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/region_selection.h"

namespace retint {

size_t SelectionSource::Bytes() const {
  size_t bytes = cloud.points.size() * sizeof(SelectionPoint);
  for (const PaintedView& view : painted) {
    bytes += view.mask.data.size() + view.seen.data.size();
  }
  return bytes;
}

size_t RegionSelection::Bytes() const {
  size_t bytes = shares.size() * sizeof(float) + source.Bytes();
  for (const auto& [name, mask] : masks) bytes += mask.data.size();
  return bytes;
}

}  // namespace retint
