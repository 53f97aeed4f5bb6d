// SPDX-License-Identifier: BSD-3-Clause
// Real spherical harmonics up to degree 3 in the order and sign of 3DGS (Kerbl et al. 2023, after
// Sloan 2008, "Stupid Spherical Harmonics Tricks", with the Condon-Shortley phase).
#pragma once

#include <cmath>

#include "kernels/common/macros.h"

namespace retint {

inline constexpr float kShC0 = 0.28209479177387814f;  // Y_00
inline constexpr float kShC1 = 0.4886025119029199f;
// Scalars, not arrays: device code may read a constexpr scalar of the host, but not an array.
inline constexpr float kShC2xy = 1.0925484305920792f;
inline constexpr float kShC2zz = 0.31539156525252005f;
inline constexpr float kShC2xx = 0.5462742152960396f;
inline constexpr float kShC3y = -0.5900435899266435f;
inline constexpr float kShC3xyz = 2.890611442640554f;
inline constexpr float kShC3xzz = -0.4570457994644658f;
inline constexpr float kShC3zzz = 0.3731763325901154f;
inline constexpr float kShC3zxx = 1.445305721320277f;

// The first (degree + 1)^2 basis functions at the unit vector (x, y, z), into basis[]. T: float or
// double, or an arithmetic vector type.
template <typename T>
RETINT_HD void ShBasis(int degree, T x, T y, T z, T* basis) {
  basis[0] = T(kShC0);
  if (degree < 1) return;
  basis[1] = T(-kShC1) * y;
  basis[2] = T(kShC1) * z;
  basis[3] = T(-kShC1) * x;
  if (degree < 2) return;
  const T xx = x * x, yy = y * y, zz = z * z;
  basis[4] = T(kShC2xy) * (x * y);
  basis[5] = T(-kShC2xy) * (y * z);
  basis[6] = T(kShC2zz) * (T(2) * zz - xx - yy);
  basis[7] = T(-kShC2xy) * (x * z);
  basis[8] = T(kShC2xx) * (xx - yy);
  if (degree < 3) return;
  basis[9] = T(kShC3y) * y * (T(3) * xx - yy);
  basis[10] = T(kShC3xyz) * (x * y) * z;
  basis[11] = T(kShC3xzz) * y * (T(4) * zz - xx - yy);
  basis[12] = T(kShC3zzz) * z * (T(2) * zz - T(3) * xx - T(3) * yy);
  basis[13] = T(kShC3xzz) * x * (T(4) * zz - xx - yy);
  basis[14] = T(kShC3zxx) * z * (xx - yy);
  basis[15] = T(kShC3y) * x * (xx - T(3) * yy);
}

// The basis in the direction from `center` to `mean`; straight ahead (z) where they coincide.
RETINT_HD void ShBasisTowards(int degree, const float* mean, const float* center, float* basis) {
  float x = mean[0] - center[0], y = mean[1] - center[1], z = mean[2] - center[2];
  const float norm = std::sqrt(x * x + y * y + z * z);
  if (norm > 0) {
    const float inverse = 1 / norm;
    x *= inverse, y *= inverse, z *= inverse;
  } else {
    z = 1;
  }
  ShBasis(degree, x, y, z, basis);
}

}  // namespace retint
