// SPDX-License-Identifier: BSD-3-Clause
// The coefficients of a scene whose regions change their colors, again and again: fitted regions as
// fitted, the rest in closed form. Only the Gaussians that some region touches are computed and
// written, into arrays that are used again, so that a change of color costs next to nothing.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "editing/region.h"
#include "kernels/backend.h"
#include "scene/gaussian_model.h"

namespace retint {

class ColorPreview {
 public:
  struct Colors {
    std::shared_ptr<const FloatArray> sh;                // [N, K, 3]
    std::shared_ptr<const std::vector<int32_t>> active;  // where it may differ from the original
  };

  // Closed forms are computed by `backend`.
  ColorPreview(std::shared_ptr<const GaussianModel> original, std::shared_ptr<Backend> backend);
  ~ColorPreview();
  const std::shared_ptr<const GaussianModel>& original() const { return original_; }

  // `job` is the one that the regions' fits are of. The arrays of Colors that nobody holds any more
  // are used again. Quick where the selections and fits are those of the call before.
  Colors Compose(const RegionSet& regions, const RefitJob& job);
  // Makes one more array, for the calls to come; false: there are enough, or they are too large.
  bool MakeReady();

 private:
  class Touched;
  class Arrays;
  const std::shared_ptr<const GaussianModel> original_;
  const std::shared_ptr<Backend> backend_;
  std::unique_ptr<Touched> touched_;
  std::shared_ptr<Arrays> arrays_;
};

}  // namespace retint
