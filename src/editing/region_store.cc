// SPDX-License-Identifier: BSD-3-Clause
#include "editing/region_store.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "base/error.h"
#include "editing/compare_pictures.h"
#include "editing/main_colors.h"
#include "editing/refit_chain.h"
#include "scene/image_checks.h"

namespace retint {
namespace {

[[noreturn]] void FailUnknown(RegionId id) {
  throw OptionError("there is no region " + std::to_string(id));
}

Region& Editable(RegionSet& state, RegionId id) {
  Region* region = state.Find(id);
  if (!region) FailUnknown(id);
  return *region;
}

}  // namespace

void RegionStore::CheckMasks(const std::map<std::string, Mask>& masks) const {
  bool any = false;
  for (const auto& [name, mask] : masks) {
    const View& view = scene_.workspace().RequireView(name);
    RequireSize("mask of view " + name, mask, scene_.reconstruction().Posed(view).camera);
    any = any || AnySet(mask);
  }
  if (!any) throw InputError("no view's mask has a selected pixel");
}

std::shared_ptr<RegionSelection> RegionStore::MakeSelection(const std::string& name,
                                                            std::map<std::string, Mask> masks,
                                                            std::vector<float> shares,
                                                            SelectionSource source,
                                                            Monitor& monitor) {
  CheckMasks(masks);
  auto selection = std::make_shared<RegionSelection>();
  selection->id = next_selection_++;
  selection->masks = std::move(masks);
  selection->source = std::move(source);
  if (shares.empty()) shares = SharesOf(selection->masks, monitor);
  if (shares.size() != scene_.original().NumGaussians()) {
    throw InputError("shares of region " + name + ": " + std::to_string(shares.size()) +
                     " values for " + std::to_string(scene_.original().NumGaussians()) +
                     " Gaussians");
  }
  selection->shares = std::move(shares);
  return selection;
}

RegionId RegionStore::Add(std::string name, std::map<std::string, Mask> masks,
                          std::vector<float> shares, const ColorEdit& edit, Monitor& monitor,
                          SelectionSource source) {
  edit.Check();
  auto selection =
      MakeSelection(name, std::move(masks), std::move(shares), std::move(source), monitor);
  RegionSet state = regions();
  Region region;
  region.id = next_region_++;
  region.name = std::move(name);
  region.selection = std::move(selection);
  region.edit = Completed(edit, state, state.regions.size(), *region.selection);
  FindPaint(region);
  state.regions.push_back(region);
  history_.Push("Add " + region.name, std::move(state));
  return region.id;
}

void RegionStore::SetSelection(RegionId id, std::map<std::string, Mask> masks,
                               std::vector<float> shares, Monitor& monitor,
                               SelectionSource source) {
  RegionSet state = regions();
  Region& region = Editable(state, id);
  region.selection =
      MakeSelection(region.name, std::move(masks), std::move(shares), std::move(source), monitor);
  history_.Push("Select " + region.name, std::move(state));
}

RegionId RegionStore::Duplicate(RegionId id) {
  RegionSet state = regions();
  Region copy = Editable(state, id);
  const std::string label = "Duplicate " + copy.name;
  copy.id = next_region_++;
  copy.name += " copy";
  copy.fit = nullptr;  // it starts from the result of the first, so its fit is another
  const auto at = std::find_if(state.regions.begin(), state.regions.end(),
                               [&](const Region& region) { return region.id == id; });
  const RegionId copied = copy.id;
  state.regions.insert(at + 1, std::move(copy));
  history_.Push(label, std::move(state));
  return copied;
}

void RegionStore::CheckRegion(const Region& region) const {
  const std::string name = "region " + region.name + ": ";
  if (region.id == 0 || !region.selection || region.selection->id == 0) {
    throw InputError(name + "has no id or no selection");
  }
  CheckMasks(region.selection->masks);
  if (region.selection->shares.size() != scene_.original().NumGaussians()) {
    throw InputError(name + std::to_string(region.selection->shares.size()) + " shares for " +
                     std::to_string(scene_.original().NumGaussians()) + " Gaussians");
  }
  if (!(region.strength >= 0 && region.strength <= 1)) {
    throw InputError(name + "strength is not between 0 and 1");
  }
  try {
    region.edit.Check();
    CheckOption(!region.edit.NeedsMainColor(), "the edit's colors were not measured");
  } catch (const OptionError& error) {
    throw InputError(name + error.what());
  }
  if (!region.fit) return;
  const RegionFit& fit = *region.fit;
  const size_t block = static_cast<size_t>(scene_.original().NumShCoeffs()) * 3;
  const auto count = static_cast<int64_t>(scene_.original().NumGaussians());
  const bool ascending =
      std::is_sorted(fit.indices.begin(), fit.indices.end(), std::less_equal<>());
  if (fit.sh.size() != fit.indices.size() * block || !ascending ||
      (!fit.indices.empty() && (fit.indices.front() < 0 || fit.indices.back() >= count))) {
    throw InputError(name + "its fit is of another scene");
  }
}

void RegionStore::Restore(RegionSet restored, const RefitJob& job) {
  RegionId next_region = next_region_;
  uint64_t next_selection = next_selection_;
  for (size_t i = 0; i < restored.regions.size(); ++i) {
    Region& region = restored.regions[i];
    CheckRegion(region);
    FindPaint(region);
    if (restored.Find(region.id) != &region) {
      throw InputError("region " + region.name + ": its id comes twice");
    }
    next_region = std::max(next_region, region.id + 1);
    next_selection = std::max(next_selection, region.selection->id + 1);
  }
  history_.Restart(std::move(restored));
  job_ = job;
  next_region_ = next_region;
  next_selection_ = next_selection;
}

void RegionStore::Do(RegionEdit edit, std::string_view merge_key) {
  const Region& before = Require(IdOf(edit));
  const auto* show = std::get_if<SetVisible>(&edit);
  if (show && show->visible == before.visible) return;
  auto* set = std::get_if<SetEdit>(&edit);
  if (set) {
    set->edit.Check();
    CheckOption(set->strength >= 0 && set->strength <= 1, "strength must be between 0 and 1");
    const auto index = static_cast<size_t>(&before - regions().regions.data());
    set->edit = Completed(set->edit, regions(), index, *before.selection);
  }
  RegionSet state = regions();
  Apply(edit, &state);
  if (set) FindPaint(*state.Find(set->id));
  std::string label = LabelOf(edit, regions());
  history_.Push(std::move(label), std::move(state), merge_key);
}

FloatArray RegionStore::ShAfter(const RegionSet& state, size_t count) const {
  const GaussianModel& original = scene_.original();
  return ComposeSh(scene_.renderer().backend(), state, job_, 0, count, original.sh, original);
}

ColorEdit RegionStore::Completed(const ColorEdit& edit, const RegionSet& state, size_t index,
                                 const RegionSelection& selection) {
  if (!edit.NeedsMainColor()) return edit;
  return WithMainColors(edit, selection, scene_, ShAfter(state, index));
}

void RegionStore::FindPaint(Region& region) const {
  for (const ColorOperation& op : region.edit.operations) {
    if (!op.picture || op.picture->layers.empty()) continue;
    if (region.paint && region.paint->IsOf(*op.picture)) continue;
    region.paint = std::make_shared<const GaussianPaint>(
        FindGaussianPaint(scene_.renderer(), scene_.original(), op.picture,
                          LayerCameras(region.edit, scene_.workspace())));
  }
}

std::vector<float> RegionStore::SharesOf(const std::map<std::string, Mask>& masks,
                                         Monitor& monitor) {
  const auto targets = RenderTargets(scene_.reconstruction(), masks, scene_.train_views());
  return MaskShares(scene_.renderer(), targets, monitor);
}

std::vector<float> RegionStore::MeasurePixels(RegionId id) {
  const Region& region = Require(id);
  const auto index = static_cast<size_t>(&region - regions().regions.data());
  return PixelsOfSelection(*region.selection, scene_.workspace(), scene_.renderer(),
                           ShAfter(regions(), index));
}

ColorEdit RegionStore::MeasureEdit(RegionId id, const ColorEdit& edit) {
  const Region& region = Require(id);
  const auto index = static_cast<size_t>(&region - regions().regions.data());
  return Completed(edit, regions(), index, *region.selection);
}

std::vector<PaletteColor> RegionStore::MeasurePalette(RegionId id, int count) {
  return FindPalette(MeasurePixels(id), count);
}

std::vector<PaletteColor> RegionStore::MeasurePalette(const RegionSelection& selection, int count) {
  return FindPalette(
      PixelsOfSelection(selection, scene_.workspace(), scene_.renderer(), scene_.original().sh),
      count);
}

const Region& RegionStore::Require(RegionId id) const {
  const Region* region = regions().Find(id);
  if (!region) FailUnknown(id);
  return *region;
}

std::vector<RefitTarget> RenderTargets(const Reconstruction& reconstruction,
                                       const std::map<std::string, Mask>& masks,
                                       const std::vector<const View*>& views) {
  std::vector<RefitTarget> targets;
  for (const View* view : views) {
    const auto mask = masks.find(view->name);
    if (mask == masks.end()) continue;
    targets.push_back({view->name, reconstruction.Posed(*view), &mask->second, nullptr});
  }
  return targets;
}

}  // namespace retint
