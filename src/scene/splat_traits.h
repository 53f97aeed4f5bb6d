// SPDX-License-Identifier: BSD-3-Clause
// How the values of a splat are meant: the rules that it was trained for, and the space of its
// colors. Files say it in their own ways (docs/formats.md).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace retint {

class StageKey;

// kDefault: the original 3DGS rasterizer. kMip: the opacity is multiplied by
// sqrt(det S / det(S + 0.3 I)), S the 2D covariance (Mip-Splatting, Yu et al. 2024; "antialiased"
// in gsplat). The other two are rendered as kDefault, which is not exact. k2dgs has discs (Huang
// et al. 2024), and k3dgut projects by an unscented transform (Wu et al. 2025).
enum class RenderModel { kDefault, kMip, k2dgs, k3dgut };

// "default", "mip", "2dgs", "3dgut"
std::string_view NameOf(RenderModel model);
std::optional<RenderModel> RenderModelNamed(std::string_view name);
// Of those that a user may choose: "default" or "mip".
std::optional<RenderModel> ChosenRenderModel(std::string_view name);

// Rec. 709 primaries; the names are those of OpenUSD and glTF.
enum class ColorSpace { kSrgbDisplay, kLinearDisplay, kSrgbScene, kLinearScene };

// "srgb_rec709_display", "lin_rec709_display", "srgb_rec709_scene", "lin_rec709_scene"
std::string_view NameOf(ColorSpace space);
std::optional<ColorSpace> ColorSpaceNamed(std::string_view name);
// Whether a splat's blended colors are light, not values for a screen.
bool IsLinear(ColorSpace space);

// A color space of an OpenColorIO config, as a user names it.
struct OcioSpace {
  std::string config;  // a file or ocio://NAME; empty: that of the environment variable OCIO
  std::string name;    // empty: none is named
  bool operator==(const OcioSpace&) const = default;
};

// How colors become linear light of Rec. 709, of which sRGB is the encoding: a curve for each
// channel, then a matrix. Exact for the spaces of cameras, logarithms and light.
struct LightMap {
  std::string name;          // of the space, for people
  std::vector<float> curve;  // see kernels/common/color_ops.h; empty: the identity
  std::array<float, 9> to_light = {1, 0, 0, 0, 1, 0, 0, 0, 1}, from_light = to_light;  // row-major
};

struct SplatTraits {
  RenderModel render_model = RenderModel::kDefault;
  std::string render_model_reason;  // where it is said, for people; empty: nowhere
  ColorSpace color_space = ColorSpace::kSrgbDisplay;  // of the blended colors, as its file says
  std::shared_ptr<const LightMap> chosen_space;       // instead of color_space, if not null
};

// Of the blended colors; null if they are sRGB.
std::shared_ptr<const LightMap> LightMapOf(const SplatTraits& traits);

// All that changes renders.
void AddTraits(StageKey& key, const SplatTraits& traits);

}  // namespace retint
