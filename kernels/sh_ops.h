// SPDX-License-Identifier: BSD-3-Clause
// Operations on the spherical harmonics of Gaussians in the direction from which a view sees them.
// `rows` maps an entry to its Gaussian (null: identity). `slots` maps it to the block of
// coefficients that is read or added to, for compact arrays of active Gaussians (null: the
// Gaussian's index). Entries with slot < 0 have no block.
#pragma once

#include <cstdint>

#include "kernels/blend_ops.h"
#include "kernels/common/color_ops.h"

namespace retint {

// Color of `count` Gaussians seen from `center`: f = max(0, 0.5 + sum_k Y_k(d) sh_k), d =
// normalised (mean - center). Entries without a block give 0.
struct EvalShParams {
  const int32_t* rows = nullptr;   // [count] or null
  const int32_t* slots = nullptr;  // [count] or null
  int64_t count;
  const float* sh;  // [*, K, 3]
  float center[3];  // camera center, world
  float* colors;    // [count, stride], of which the first 3 are written
  int32_t stride = 3;
};

// Transpose of EvalSh for a fixed view: gradient[slot, k, :] += Y_k(d) * color_gradient[entry, :].
// Channels whose color is clamped at 0 (read from `colors`, null: no gate) pass nothing. Slots are
// distinct.
struct EvalShTransposeParams {
  const int32_t* rows = nullptr;   // [count] or null
  const int32_t* slots = nullptr;  // [count] or null
  int64_t count;
  const float* color_gradients;   // [count, 3]
  const float* colors = nullptr;  // [count, 3] or null
  float center[3];
  float* gradient;  // [*, K, 3], accumulated
};

// Block normal matrices of the SH fit: block[slot] += weight[entry] * y y^T with y = Y(d) of
// Gaussian rows[entry] seen from `center`. Packed lower triangles, row by row: K (K + 1) / 2 floats
// a block. Slots are distinct.
struct AccumulateBlocksParams {
  const int32_t* rows = nullptr;   // [count] or null
  const int32_t* slots = nullptr;  // [count] or null
  int64_t count;
  const float* weights;  // [count]
  float center[3];
  float* blocks;  // [slots, K (K + 1) / 2]
};

// A color edit of separate Gaussians, [count]. An affine map is exact (common/sh_edit.h). Any other
// map is applied to the visible colors max(0, 0.5 + B C) in `directions` directions. The
// coefficients then change by a least-squares fit F of the required color changes: C += F change.
// If the change is 0, no bit changes.
struct EditShParams {
  float* sh;            // [count, k, 3], C of each
  const float* shares;  // [count] how much of the edit it takes
  double threshold;     // those of a share not above stay as they are
  int64_t count;
  int32_t k;  // coefficients: 1, 4, 9 or 16
  ColorMap map;
  // Of a map with a program; backend memory.
  const float* basis = nullptr;  // B [directions, k]
  const float* fit = nullptr;    // F [k, directions]
  int32_t directions = 0;        // kMaxEditDirections at most
};
inline constexpr int kMaxEditDirections = 4 * kMaxShCoeffs;

class ShOps {
 public:
  virtual ~ShOps() = default;

  void EvalSh(const Model& model, const EvalShParams& params);
  void EvalShTranspose(const Model& model, const EvalShTransposeParams& params);
  void AccumulateBlocks(const Model& model, const AccumulateBlocksParams& params);
  void EditSh(const EditShParams& params);

 protected:
  virtual void DoEvalSh(const Model& model, const EvalShParams& params) = 0;
  virtual void DoEvalShTranspose(const Model& model, const EvalShTransposeParams& params) = 0;
  virtual void DoAccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) = 0;
  virtual void DoEditSh(const EditShParams& params) = 0;
};

}  // namespace retint
