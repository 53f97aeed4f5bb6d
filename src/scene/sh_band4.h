// SPDX-License-Identifier: BSD-3-Clause
// Spherical harmonics of degree 4, which some files have, but no renderer uses. They stay columns
// of the source (SourceLayout::extras), named as in a .ply of degree 4: f_rest_[24 c + k - 1] for k
// = 16 to 24. They are turned with the scene, and set to 0 in Gaussians whose colors are edited.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "scene/gaussian_model.h"

namespace retint {

using ShBand4 = std::array<float, 27>;  // [9, 3] of one Gaussian

// The nine basis functions at a unit vector, in the order and with the signs that go on from
// kernels/common/sh.h.
void ShBand4Basis(double x, double y, double z, double* basis);

class ShBand4Columns {
 public:
  // Of a model of SH degree 3 that has all of them, as floats or doubles; else absent. Changes the
  // bands that the model holds.
  explicit ShBand4Columns(GaussianModel& model);
  // Adds them to a model that has none: zeros.
  static void AddTo(GaussianModel& model);
  static bool IsName(const std::string& column);
  static std::string Name(size_t k, size_t c);  // k from 16

  bool present() const { return !columns_.empty(); }
  ShBand4 Get(size_t g) const;
  void Set(size_t g, const ShBand4& values);

 private:
  std::vector<ExtraColumn*> columns_;  // [9, 3]
};

// Whether the model has them.
bool HasShBand4(const GaussianModel& model);

}  // namespace retint
