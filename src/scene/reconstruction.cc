// SPDX-License-Identifier: BSD-3-Clause
#include "scene/reconstruction.h"

#include <algorithm>
#include <numeric>

namespace retint {
namespace {

int EditDistance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const int substitute = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitute});
    }
  }
  return row.back();
}

}  // namespace

const View* Reconstruction::FindView(std::string_view name) const {
  for (const auto& [id, view] : views) {
    if (view.name == name) return &view;
  }
  return nullptr;
}

std::vector<std::string> Reconstruction::NearestNames(std::string_view name, int count) const {
  std::vector<std::pair<int, std::string>> ranked;
  for (const auto& [id, view] : views)
    ranked.emplace_back(EditDistance(name, view.name), view.name);
  std::sort(ranked.begin(), ranked.end());
  std::vector<std::string> names;
  for (int i = 0; i < count && i < static_cast<int>(ranked.size()); ++i) {
    names.push_back(ranked[static_cast<size_t>(i)].second);
  }
  return names;
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
