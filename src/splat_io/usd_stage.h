// SPDX-License-Identifier: BSD-3-Clause
// The parts of an OpenUSD layer (openusd.org) that place and describe Gaussians, read from its text
// (usda_reader.h) or its crate (usdc_reader.h).
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

// How the elements of an array lie in the layer.
enum class UsdStorage { kText, kFloats, kHalves, kOther };

struct UsdValue {
  std::string text;                 // of a token or string
  std::vector<std::string> tokens;  // of a token[]
  std::vector<double> numbers;      // of everything small: 1, 3, 4 or 16 of them
  UnsetVector<float> floats;        // of an array of the splat's: [count, components]
  size_t components = 0;            // of an element of an array
  std::string color_space;          // the attribute's own
  bool animated = false;            // has time samples or a spline
  UsdStorage storage = UsdStorage::kOther;
  uint64_t begin = 0, end = 0;  // bytes of the elements in the layer; of text, between the brackets

  bool has_floats() const { return !floats.empty(); }
};

struct UsdPrim {
  std::string name, type;
  int64_t parent = -1;  // into UsdStage::prims; its parent stands before a prim
  bool defined = true;  // by "def", neither by "over" nor by "class"
  bool active = true;
  std::map<std::string, UsdValue, std::less<>> attributes;  // those of IsUsdAttribute
};

struct UsdStage {
  bool z_up = false;
  std::optional<double> meters_per_unit;
  std::vector<UsdPrim> prims;
  bool refers = false;    // to other layers or prims, which are not followed
  bool variants = false;  // which are not looked into
};

// Whether an attribute of a prim of `type` is one that UsdPrim keeps.
bool IsUsdAttribute(std::string_view type, std::string_view name);

// Numbers of an element of the array `name` of a splat; 0 for other attributes.
size_t UsdArrayComponents(std::string_view name);

// Whether the prim and all above it are defined, active and not invisible.
bool IsShown(const UsdStage& stage, const UsdPrim& prim);

// Its own frame in that of the stage: all transforms from it upwards. InputError of `path` for one
// that is animated or of an unknown kind.
Eigen::Matrix4d StageFromPrim(const UsdStage& stage, const UsdPrim& prim,
                              const std::filesystem::path& path);

// More prims than that, or nested deeper, are refused by the readers.
inline constexpr size_t kMostUsdPrims = size_t{1} << 20, kMostUsdDepth = 256;
inline constexpr size_t kMostUsdAttributes = 128;  // of a prim, which are kept

}  // namespace retint
