// SPDX-License-Identifier: BSD-3-Clause
// One pixel's front-to-back blending, the rules of the original 3DGS rasterizer.
#pragma once

#include <cmath>

#include "kernels/common/macros.h"
#include "kernels/common/projection.h"
#include "kernels/common/types.h"

namespace retint {

// log2 of the unclamped alpha at offset (dx, dy) from the splat's centre.
RETINT_HD float SplatExponent(const Splat& splat, float dx, float dy) {
  return splat.a * dx * dx + (splat.b * dy * dx + (splat.c * dy * dy + splat.log2_opacity));
}

// 2^x. On a device the hardware's own, good to 2 ulp for the exponents that count.
RETINT_HD float PowerOfTwo(float x) {
#ifdef __CUDA_ARCH__
  float result;
  asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(result) : "f"(x));
  return result;
#else
  return std::exp2(x);
#endif
}

// Weight alpha * T of a splat at one pixel, updating its transmittance. T < 0 marks a pixel that is
// done; |T| is then its final transmittance. A splat after which T would fall below
// kMinTransmittance is not blended and ends the pixel.
RETINT_HD float BlendStep(float exponent, float* transmittance) {
  if (exponent < kLog2MinAlpha || *transmittance < 0) return 0;
  const float alpha = std::fmin(kMaxAlpha, PowerOfTwo(exponent));
  const float after = *transmittance * (1 - alpha);
  if (after < kMinTransmittance) {
    *transmittance = -*transmittance;
    return 0;
  }
  const float weight = alpha * *transmittance;
  *transmittance = after;
  return weight;
}

}  // namespace retint
