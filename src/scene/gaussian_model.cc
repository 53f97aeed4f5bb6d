// SPDX-License-Identifier: BSD-3-Clause
#include "scene/gaussian_model.h"

#include <cmath>

#include "base/error.h"

namespace retint {
namespace {

void CheckFinite(const std::vector<float>& values, size_t count, size_t width, const char* field) {
  if (values.size() != count * width) {
    throw InputError(std::string("Gaussians: ") + field + " has " + std::to_string(values.size()) +
                     " values, expected " + std::to_string(count * width));
  }
  for (size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      throw InputError("Gaussian " + std::to_string(i / width) + ": " + field +
                       (std::isnan(values[i]) ? " is NaN" : " is infinite"));
    }
  }
}

}  // namespace

void GaussianModel::Resize(size_t count, int degree) {
  sh_degree = degree;
  means.resize(count * 3);
  quats_wxyz.resize(count * 4);
  log_scales.resize(count * 3);
  opacity_logits.resize(count);
  sh.resize(count * static_cast<size_t>(NumShCoeffs()) * 3);
}

void GaussianModel::Validate() const {
  const size_t count = NumGaussians();
  CheckFinite(means, count, 3, "mean");
  CheckFinite(quats_wxyz, count, 4, "rotation");
  CheckFinite(log_scales, count, 3, "scale");
  CheckFinite(opacity_logits, count, 1, "opacity");
  CheckFinite(sh, count, static_cast<size_t>(NumShCoeffs()) * 3, "spherical harmonics");
}

}  // namespace retint
