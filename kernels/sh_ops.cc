// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/sh_ops.h"

#include "kernels/check.h"

namespace retint {

void ShOps::EvalSh(const Model& model, const EvalShParams& params) {
  RequireCount(params.count);
  Require(params.stride >= 3, "colors are at least 3 values apart");
  DoEvalSh(model, params);
}

void ShOps::EvalShTranspose(const Model& model, const EvalShTransposeParams& params) {
  RequireCount(params.count);
  DoEvalShTranspose(model, params);
}

void ShOps::AccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) {
  RequireCount(params.count);
  DoAccumulateBlocks(model, params);
}

void ShOps::EditSh(const EditShParams& params) {
  RequireCount(params.count);
  Require(params.k == 1 || params.k == 4 || params.k == 9 || params.k == 16,
          "spherical harmonics have 1, 4, 9 or 16 coefficients");
  const bool fits = params.basis && params.fit && params.directions >= 1 &&
                    params.directions <= kMaxEditDirections;
  Require(!params.map.program || fits, "an edit that is not affine needs its directions");
  DoEditSh(params);
}

}  // namespace retint
