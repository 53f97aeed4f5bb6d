// SPDX-License-Identifier: BSD-3-Clause
#include "editing/region.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/checksum.h"
#include "base/parallel.h"
#include "recolor/edit_text.h"

namespace retint {
namespace {

// Bytes of a value, so that equal keys mean equal inputs to the last bit.
template <typename T>
void AppendBits(std::string& key, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  key.append(bytes, sizeof(T));
}

uint64_t TableHash(const ColorTable& table) {
  return Xxh64(
      {reinterpret_cast<const char*>(table.values.data()), table.values.size() * sizeof(float)});
}

void AppendLayers(std::string& key, const PictureEdit& picture) {
  const auto append = [&](const std::vector<uint8_t>& bytes) {
    AppendBits(key, Xxh64({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  };
  for (const PaintLayer& layer : picture.layers) {
    key += layer.view;
    AppendBits(key, layer.x);
    AppendBits(key, layer.y);
    append(layer.color.data);
    append(layer.alpha.data);
  }
}

// Without palettes of which no color has a target yet: measuring one changes no color.
ColorEdit WithoutMeasurements(ColorEdit edit) {
  std::erase_if(edit.operations, [](const ColorOperation& op) {
    if (op.kind != ColorOperationKind::kPalette) return false;
    for (size_t pair = 0; pair < op.values.size(); pair += kPairValues) {
      if (op.values[pair + 3] != kUnset) return false;
    }
    return true;
  });
  return edit;
}

}  // namespace

size_t RegionFit::Bytes() const {
  return indices.size() * sizeof(int32_t) + sh.size() * sizeof(float);
}

void RegionFit::Apply(std::span<float> all, int num_coeffs) const {
  const size_t block = static_cast<size_t>(num_coeffs) * 3;
  constexpr int64_t kGaussians = 1024;  // a task
  ParallelRanges(static_cast<int64_t>(indices.size()), kGaussians, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      std::copy_n(sh.data() + i * block, block,
                  all.data() + static_cast<size_t>(indices[i]) * block);
    }
  });
}

const Region* RegionSet::Find(RegionId id) const {
  const auto found =
      std::find_if(regions.begin(), regions.end(), [&](const Region& r) { return r.id == id; });
  return found == regions.end() ? nullptr : &*found;
}

Region* RegionSet::Find(RegionId id) { return const_cast<Region*>(std::as_const(*this).Find(id)); }

void RefitJob::Describe(OptionList& list) {
  list.push_back(
      {.name = "target",
       .member = ChoiceOf(target, {"render", "photo"}),
       .help =
           "the pictures that become the targets after the edit: render (of the splat) or photo",
       .tier = OptionTier::kOccasional});
  options.Describe(list);
}

std::string RegionSet::FitKey(size_t index, const RefitJob& job) const {
  std::string key = OptionKey(Described(job));
  for (size_t i = 0; i <= index; ++i) {
    const Region& region = regions[i];
    if (!region.visible && i != index) continue;
    AppendBits(key, region.selection->id);
    const ColorEdit edit = WithoutMeasurements(region.edit);
    key += EditToJson(edit, /*with_tables=*/false);
    for (const ColorOperation& op : edit.operations) {
      if (op.table) AppendBits(key, TableHash(*op.table));
      if (op.picture) AppendLayers(key, *op.picture);
    }
    AppendBits(key, region.strength);
  }
  return key;
}

bool RegionSet::SavesLike(const RegionSet& other) const {
  return std::equal(regions.begin(), regions.end(), other.regions.begin(), other.regions.end(),
                    [](const Region& x, const Region& y) {
                      return x.id == y.id && x.name == y.name &&
                             x.selection->id == y.selection->id && x.edit == y.edit &&
                             x.strength == y.strength && x.visible == y.visible;
                    });
}

size_t RegionSet::BytesBeyond(const RegionSet& other) const {
  size_t bytes = 0;
  for (const Region& region : regions) {
    const Region* twin = other.Find(region.id);
    if (region.selection && !(twin && twin->selection == region.selection)) {
      bytes += region.selection->Bytes();
    }
    if (region.fit && !(twin && twin->fit == region.fit)) bytes += region.fit->Bytes();
    if (region.paint && !(twin && twin->paint == region.paint)) bytes += region.paint->Bytes();
    bytes += sizeof(Region) + region.name.size();
  }
  return bytes;
}

}  // namespace retint
