// SPDX-License-Identifier: BSD-3-Clause
#include "scene/reconstruction.h"

#include <algorithm>

#include "base/edit_distance.h"

namespace retint {

const View* Reconstruction::FindView(std::string_view name) const {
  for (const auto& [id, view] : views) {
    if (view.name == name) return &view;
  }
  return nullptr;
}

std::vector<std::string> Reconstruction::NearestNames(std::string_view name, int count) const {
  std::vector<std::string> names;
  for (const auto& [id, view] : views) names.push_back(view.name);
  return retint::NearestNames(name, names, static_cast<size_t>(count));
}

PosedCamera Reconstruction::Posed(const View& view) const {
  return {cameras.at(view.camera_id), view.cam_from_world};
}

std::vector<const View*> Reconstruction::ViewsByName() const {
  std::vector<const View*> sorted;
  for (const auto& [id, view] : views) sorted.push_back(&view);
  std::sort(sorted.begin(), sorted.end(),
            [](const View* a, const View* b) { return a->name < b->name; });
  return sorted;
}

}  // namespace retint
