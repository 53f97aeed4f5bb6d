// SPDX-License-Identifier: BSD-3-Clause
// The method once more, in double precision, pixel by pixel, without tiles, vectors or shared code.
// Tests compare the kernels with it.
#pragma once

#include <functional>
#include <vector>

#include "tests/kernels/test_scene.h"

namespace retint {

// One pair of Gaussian and pixel with its blending weight alpha * T.
struct ReferenceWeight {
  int gaussian;
  int pixel;
  double weight, transmittance_before, depth;
  double depth_along_ray;  // the mean of z under the condition of the pixel
};

// W of a view: every pair, front to back.
std::vector<ReferenceWeight> ReferenceWeights(const TestModel& model, const CameraParams& camera);

// Real SH basis of 3DGS, written as associated Legendre functions times cos and sin.
std::vector<double> ReferenceShBasis(int degree, double x, double y, double z);
// max(0, 0.5 + Y sh) of Gaussian g for coefficients [K, 3].
std::vector<double> ReferenceColor(const TestModel& model, const std::vector<double>& sh, int g,
                                   const CameraParams& camera);

struct ReferenceLoss {
  double loss, l1, ssim;
};
// Images [H, W, 3]; mean over the whole image.
ReferenceLoss ReferenceImageLoss(const std::vector<double>& image,
                                 const std::vector<double>& target, int width, int height,
                                 double lambda);

}  // namespace retint
