// SPDX-License-Identifier: BSD-3-Clause
// The parts of an OpenUSD layer (openusd.org) that place and describe Gaussians. Readers exist for
// its text (usda_reader.h) and its crate (usdc_reader.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/memory.h"

namespace retint {

inline constexpr std::string_view kUsdSplatType = "ParticleField3DGaussianSplat";

// How the layer stores the elements of an array.
enum class UsdStorage { kText, kFloats, kHalves, kOther };

struct UsdValue {
  std::string text;                 // of a token or string
  std::vector<std::string> tokens;  // of a token[]
  std::vector<double> numbers;      // of a small value: 1, 3, 4 or 16
  UnsetVector<float> floats;        // of a splat's array: [count, components]
  size_t components = 0;            // per element of an array
  std::string color_space;          // the attribute's own
  bool animated = false;            // has time samples or a spline
  UsdStorage storage = UsdStorage::kOther;
  uint64_t begin = 0, end = 0;  // bytes of the elements in the layer; of text, between the brackets

  bool has_floats() const { return !floats.empty(); }
};

struct UsdPrim {
  std::string name, type;
  int64_t parent = -1;  // into UsdStage::prims; parents come before their children
  bool defined = true;  // by "def", not by "over" or "class"
  bool active = true;
  std::map<std::string, UsdValue, std::less<>> attributes;  // those of IsUsdAttribute
};

struct UsdStage {
  bool z_up = false;
  std::optional<double> meters_per_unit;
  std::vector<UsdPrim> prims;
  bool refers = false;    // to other layers or prims, which Retint does not follow
  bool variants = false;  // which Retint does not read
};

// Whether UsdPrim keeps an attribute of a prim of `type`.
bool IsUsdAttribute(std::string_view type, std::string_view name);

// Numbers per element of the array `name` of a splat; 0 for other attributes.
size_t UsdArrayComponents(std::string_view name);

// Whether the prim and its ancestors are all defined, active and not invisible.
bool IsShown(const UsdStage& stage, const UsdPrim& prim);

// From the prim's frame to the stage's: all transforms from the prim upward. InputError of `path`
// if one is animated or of an unknown kind.
Eigen::Matrix4d StageFromPrim(const UsdStage& stage, const UsdPrim& prim,
                              const std::filesystem::path& path);

// Readers reject more prims than this, or deeper nesting.
inline constexpr size_t kMostUsdPrims = size_t{1} << 20, kMostUsdDepth = 256;
inline constexpr size_t kMostUsdAttributes = 128;  // kept per prim

}  // namespace retint
