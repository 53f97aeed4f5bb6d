// SPDX-License-Identifier: BSD-3-Clause
// The formulas of the operations. operation_table.cc has each operation's name, parameters and
// formula; ColorOperationTypes() (recolor/color_operation.h) is its table.
#pragma once

#include <optional>
#include <vector>

#include "kernels/common/color_ops.h"
#include "recolor/color_edit.h"
#include "recolor/color_operation.h"

namespace retint {

// The operation at full strength, where it is affine on the encoded values.
std::optional<AffineColor> FullAffine(const ColorOperation& op);
// The operation for the kernels; appends its table, if it has one, to `tables`. OptionError for a
// color that was not measured.
ColorOp Compile(const ColorOperation& op, std::vector<float>& tables);

}  // namespace retint
