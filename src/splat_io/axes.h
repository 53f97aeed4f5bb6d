// SPDX-License-Identifier: BSD-3-Clause
// Formats with other axes than the 3DGS .ply: changes the values of a Gaussian as the signs of axes
// change.
#pragma once

#include <array>

#include "splat_io/splat_row.h"

namespace retint {

// Signs of x, y and z, each 1 or -1. Its own inverse.
using AxisSigns = std::array<float, 3>;

// right-down-front (.ply) <-> right-up-back (SPZ), and <-> left-up-front (glTF).
inline constexpr AxisSigns kRightUpBack = {1, -1, -1};
inline constexpr AxisSigns kLeftUpFront = {-1, -1, 1};

// Each term of a basis function Y_k of SH has the same parity in each axis. So its coefficient
// keeps its value or changes sign.
inline float ShSign(size_t k, const AxisSigns& signs) {
  // Parity of Y_k in x, y, z: bits 0, 1, 2 (docs/conventions.md).
  static constexpr std::array<int, 16> kParity = {0, 2, 4, 1, 3, 6, 0, 5, 0, 2, 7, 2, 4, 1, 4, 1};
  float sign = 1;
  for (size_t i = 0; i < 3; ++i) {
    if (kParity[k] >> i & 1) sign *= signs[i];
  }
  return sign;
}

// A mirrored covariance is that of a rotation about the mirrored axis.
inline void FlipQuat(float* wxyz, const AxisSigns& signs) {
  wxyz[1] *= signs[1] * signs[2];
  wxyz[2] *= signs[0] * signs[2];
  wxyz[3] *= signs[0] * signs[1];
}

// The Gaussian that looks the same in axes with other signs.
inline SplatRow FlipAxes(const SplatRow& row, const AxisSigns& signs) {
  SplatRow flipped = row;
  for (size_t i = 0; i < 3; ++i) flipped.mean[i] *= signs[i];
  FlipQuat(flipped.quat_wxyz.data(), signs);
  for (size_t k = 1; 3 * k < flipped.sh.size(); ++k) {
    const float sign = ShSign(k, signs);
    for (size_t c = 0; c < 3; ++c) flipped.sh[3 * k + c] *= sign;
  }
  return flipped;
}

}  // namespace retint
