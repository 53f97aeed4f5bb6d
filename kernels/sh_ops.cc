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

}  // namespace retint
