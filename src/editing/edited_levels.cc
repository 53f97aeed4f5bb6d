// SPDX-License-Identifier: BSD-3-Clause
#include "editing/edited_levels.h"

#include <memory>
#include <utility>

#include "splat_io/streamed_sog.h"

namespace retint {
namespace {

bool IsFitted(const RegionStore& store) {
  const auto& regions = store.regions().regions;
  for (size_t i = 0; i < regions.size(); ++i) {
    const auto& fit = regions[i].fit;
    if (regions[i].visible && fit && fit->key == store.regions().FitKey(i, store.job()))
      return true;
  }
  return false;
}

RegionSet Carried(const RegionSet& regions, RegionStore& level, Monitor& monitor) {
  RegionSet carried;
  for (const Region& old : regions.regions) {
    if (!old.visible) continue;
    Region region = old;
    region.fit = nullptr;
    region.paint = nullptr;  // found again
    auto selection = std::make_shared<RegionSelection>();
    selection->id = old.selection->id;
    selection->masks = old.selection->masks;
    selection->shares = level.SharesOf(selection->masks, monitor);
    region.selection = std::move(selection);
    carried.regions.push_back(std::move(region));
  }
  return carried;
}

}  // namespace

std::vector<GaussianModel> EditedLevels(const EditSession& session, Monitor& monitor) {
  const OpenScene& scene = session.scene();
  std::vector<GaussianModel> levels(1, scene.original());
  levels[0].sh = session.refits().CurrentSh();
  if (levels[0].sh == scene.original().sh) return levels;
  const RegionStore& store = session.store();
  const int count = NumStreamedLevels(scene.original());
  for (int i = 1; i < count; ++i) {
    GaussianModel model = ReadStreamedLevel(scene.original(), i, monitor);
    model.traits = scene.original().traits;  // as they were chosen
    levels.push_back(model);
    if (model.NumGaussians() == 0) continue;
    EditSession level(scene.WithModel(std::move(model), {}));
    level.RestoreRegions(Carried(store.regions(), level.store(), monitor), store.job());
    if (IsFitted(store)) level.refits().Refit(store.job(), monitor);
    levels.back().sh = level.refits().CurrentSh();
  }
  return levels;
}

}  // namespace retint
