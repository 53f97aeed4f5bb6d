// SPDX-License-Identifier: BSD-3-Clause
// The Gaussians of an OpenUSD stage, and edited values written back to its layer.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "splat_io/placement.h"
#include "splat_io/splat_io.h"
#include "splat_io/usd_stage.h"

namespace retint {

// The array of the splat that an attribute of a prim holds, in the order of ArrayOf().
enum class UsdArray { kMeans, kQuats, kScales, kOpacities, kColors };
inline constexpr size_t kUsdArrays = 5;

struct UsdSplat {
  const UsdPrim* prim;
  std::string names[kUsdArrays];            // of the attribute; a suffix h means halves
  const UsdValue* arrays[kUsdArrays] = {};  // nullptr: missing, use its fallback
  size_t count = 0;
  int degree = 0;           // of the file; up to 3 are used
  std::string color_space;  // empty: unspecified
  Sim3d frame_from_prim;    // right-up-back
};

class UsdSplats {
 public:
  // InputError of `path` if there are no Gaussians, if arrays disagree, or if a prim is stretched.
  // `stage` must outlive this.
  UsdSplats(const UsdStage& stage, const std::filesystem::path& path);

  const std::vector<UsdSplat>& splats() const { return splats_; }
  // All Gaussians, prim after prim, in Retint's frame, with notes.
  GaussianModel Load(Monitor& monitor) const;

 private:
  void Add(const UsdPrim& prim);
  void SetDegree(UsdSplat& splat) const;
  void AddNotes(GaussianModel& model) const;
  void LoadPrim(const UsdSplat& splat, size_t first, GaussianModel& model, Monitor& monitor) const;
  [[noreturn]] void Fail(const std::string& fault) const;

  const UsdStage& stage_;
  const std::filesystem::path& path_;
  std::vector<UsdSplat> splats_;
  std::string others_;  // a few names of prims without Gaussians, or invisible ones
  size_t num_others_ = 0, hidden_ = 0;
};

// Edits `bytes`, the layer of `path`: writes the values of `model` that differ from `was`, the
// model that was loaded from it. All other bytes stay. False if the layer cannot hold them: the
// number of Gaussians or the degree differs, or it stores values compressed or not at all.
bool EditUsdLayer(const UsdSplats& splats, const GaussianModel& was, const GaussianModel& model,
                  const std::filesystem::path& path, std::string& bytes);

// The values of `array` for a row in a prim's own frame, in the order of the text: 1, 3 or 4
// numbers, for colors 3 per coefficient.
std::vector<float> UsdValues(UsdArray array, const SplatRow& row, int degree);

uint16_t FloatToHalf(float value);

}  // namespace retint
