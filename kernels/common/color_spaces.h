// SPDX-License-Identifier: BSD-3-Clause
// sRGB (IEC 61966-2-1), OKLab (B. Ottosson 2020) and a camera's tone curve, extended to values
// below 0 as odd functions.
#pragma once

#include <cmath>

#include "kernels/common/macros.h"

namespace retint {

using Real = float;
using Truth = bool;
RETINT_HD float Select(bool condition, float yes, float no) { return condition ? yes : no; }
RETINT_HD bool Any(bool condition) { return condition; }

#include "kernels/common/color_spaces-inl.h"

}  // namespace retint
