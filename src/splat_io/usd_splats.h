// SPDX-License-Identifier: BSD-3-Clause
// The Gaussians of an OpenUSD stage, and edits of them written back into its layer.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "splat_io/placement.h"
#include "splat_io/splat_io.h"
#include "splat_io/usd_stage.h"

namespace retint {

// Which attribute of a prim holds an array of the splat; its order is that of ArrayOf().
enum class UsdArray { kMeans, kQuats, kScales, kOpacities, kColors };
inline constexpr size_t kUsdArrays = 5;

struct UsdSplat {
  const UsdPrim* prim;
  std::string names[kUsdArrays];            // of the attribute, with h for halves
  const UsdValue* arrays[kUsdArrays] = {};  // nullptr where it is missing: it has its fallback
  size_t count = 0;
  int degree = 0;           // of the file; up to 3 are used
  std::string color_space;  // empty: nothing says it
  Sim3d frame_from_prim;    // right-up-back
};

class UsdSplats {
 public:
  // InputError of `path` where there are no Gaussians, arrays disagree, or a prim is stretched.
  // `stage` must outlive this.
  UsdSplats(const UsdStage& stage, const std::filesystem::path& path);

  const std::vector<UsdSplat>& splats() const { return splats_; }
  // All of them, one after the other, in Retint's frame, with notes.
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
  std::string others_;  // names of prims that are no Gaussians or are not shown, a few
  size_t num_others_ = 0, hidden_ = 0;
};

// The layer `bytes` of `path` with the values of `model` where they differ from `was`, which was
// loaded from it; everything else keeps its bytes. False where the layer cannot take them: another
// number of Gaussians or degree, or values that it stores compressed or not at all.
bool EditUsdLayer(const UsdSplats& splats, const GaussianModel& was, const GaussianModel& model,
                  const std::filesystem::path& path, std::string& bytes);

// The values of `array` for a row in a prim's own frame, as text has them: 1, 3 or 4 numbers, of
// colors 3 for each coefficient.
std::vector<float> UsdValues(UsdArray array, const SplatRow& row, int degree);

uint16_t FloatToHalf(float value);

}  // namespace retint
