// SPDX-License-Identifier: BSD-3-Clause
#include "editing/region_edit.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <utility>

namespace retint {
namespace {

// The edit of a region in words, for the history: "Gradient in vase".
std::string LabelOfStep(const Region& before, const ColorEdit& after) {
  const auto& old = before.edit.operations;
  const auto& now = after.operations;
  const std::string& name = before.name;
  if (now == old) return "Change the strength of " + name;
  if (now.size() < old.size()) return "Remove a step of " + name;
  if (now.size() == old.size() && std::ranges::is_permutation(now, old)) {
    return "Reorder the steps of " + name;
  }
  // The first step that differs.
  const auto at = std::ranges::mismatch(now, old).in1;
  if (at->kind == ColorOperationKind::kRecolor) return "Recolor " + name;
  if (const auto tone = Tone::Of(*at)) {
    return (tone->kind == Tone::Kind::kCurve ? "Curves in " : "Levels in ") + name;
  }
  if (at->kind == ColorOperationKind::kLut) return "LUT in " + name;
  std::string step = TypeOf(at->kind).name;
  std::ranges::replace(step, '_', ' ');
  step.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(step.front())));
  return step + " in " + name;
}

struct Labels {
  const Region& region;
  std::string operator()(const SetEdit& one) const { return LabelOfStep(region, one.edit); }
  std::string operator()(const SetVisible& one) const {
    return (one.visible ? "Show " : "Hide ") + region.name;
  }
  std::string operator()(const RenameRegion& one) const { return "Rename " + one.name; }
  std::string operator()(const MoveRegion&) const { return "Move " + region.name; }
  std::string operator()(const RemoveRegion&) const { return "Remove " + region.name; }
};

struct Changes {
  std::vector<Region>& all;
  std::vector<Region>::iterator at;
  void operator()(const SetEdit& one) const {
    at->edit = one.edit;
    at->strength = one.strength;
  }
  void operator()(const SetVisible& one) const { at->visible = one.visible; }
  void operator()(const RenameRegion& one) const { at->name = one.name; }
  void operator()(const MoveRegion& one) const {
    Region region = std::move(*at);
    all.erase(at);
    const size_t position = std::min(one.position, all.size());
    all.insert(all.begin() + std::ptrdiff_t(position), std::move(region));
  }
  void operator()(const RemoveRegion&) const { all.erase(at); }
};

}  // namespace

std::string LabelOf(const RegionEdit& edit, const RegionSet& regions) {
  return std::visit(Labels{*regions.Find(IdOf(edit))}, edit);
}

void Apply(const RegionEdit& edit, RegionSet* regions) {
  const auto at = std::ranges::find(regions->regions, IdOf(edit), &Region::id);
  if (at != regions->regions.end()) std::visit(Changes{regions->regions, at}, edit);
}

}  // namespace retint
