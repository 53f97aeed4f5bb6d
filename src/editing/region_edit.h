// SPDX-License-Identifier: BSD-3-Clause
// Changes of regions, as values: the store applies one and writes it into its history; an editor
// applies the same one at once to the copy that it shows.
#pragma once

#include <cstddef>
#include <string>
#include <variant>

#include "editing/region.h"

namespace retint {

struct SetEdit {
  RegionId id = 0;
  ColorEdit edit;
  float strength = 1;
};
struct SetVisible {
  RegionId id = 0;
  bool visible = true;
};
struct RenameRegion {
  RegionId id = 0;
  std::string name;
};
struct MoveRegion {
  RegionId id = 0;
  size_t position = 0;  // 0 is applied first
};
struct RemoveRegion {
  RegionId id = 0;
};
using RegionEdit = std::variant<SetEdit, SetVisible, RenameRegion, MoveRegion, RemoveRegion>;

inline RegionId IdOf(const RegionEdit& edit) {
  return std::visit([](const auto& one) { return one.id; }, edit);
}
// Its name in the history: "Gradient in vase". `regions` are those before it, with its own among
// them.
std::string LabelOf(const RegionEdit& edit, const RegionSet& regions);
// Changes nothing if its region is not among them.
void Apply(const RegionEdit& edit, RegionSet* regions);

}  // namespace retint
