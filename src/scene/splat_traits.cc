// SPDX-License-Identifier: BSD-3-Clause
#include "scene/splat_traits.h"

#include <array>
#include <cstddef>
#include <span>

#include "base/stage_cache.h"

namespace retint {
namespace {

constexpr std::array<std::string_view, 4> kRenderModels = {"default", "mip", "2dgs", "3dgut"};
constexpr std::array<std::string_view, 4> kColorSpaces = {
    "srgb_rec709_display", "lin_rec709_display", "srgb_rec709_scene", "lin_rec709_scene"};

template <typename Value>
std::optional<Value> Named(std::span<const std::string_view> names, std::string_view name) {
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return static_cast<Value>(i);
  }
  return std::nullopt;
}

}  // namespace

std::string_view NameOf(RenderModel model) { return kRenderModels[static_cast<size_t>(model)]; }

std::optional<RenderModel> RenderModelNamed(std::string_view name) {
  return Named<RenderModel>(kRenderModels, name);
}

std::optional<RenderModel> ChosenRenderModel(std::string_view name) {
  const auto model = RenderModelNamed(name);
  return model == RenderModel::kDefault || model == RenderModel::kMip ? model : std::nullopt;
}

std::string_view NameOf(ColorSpace space) { return kColorSpaces[static_cast<size_t>(space)]; }

std::optional<ColorSpace> ColorSpaceNamed(std::string_view name) {
  return Named<ColorSpace>(kColorSpaces, name);
}

bool IsLinear(ColorSpace space) {
  return space == ColorSpace::kLinearDisplay || space == ColorSpace::kLinearScene;
}

std::shared_ptr<const LightMap> LightMapOf(const SplatTraits& traits) {
  static const auto light = std::make_shared<const LightMap>();
  if (traits.chosen_space) return traits.chosen_space;
  return IsLinear(traits.color_space) ? light : nullptr;
}

void AddTraits(StageKey& key, const SplatTraits& traits) {
  key.AddValue(traits.render_model);
  const auto map = LightMapOf(traits);
  key.AddValue(map != nullptr);
  if (!map) return;
  key.AddValue(map->to_light)
      .Add({reinterpret_cast<const char*>(map->curve.data()), map->curve.size() * sizeof(float)});
}

}  // namespace retint
