// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/refit_ops.h"

#include "kernels/check.h"

namespace retint {
namespace {

void RequireUnit(float unit) { Require(unit > 0, "the unit of quantized values must be positive"); }

}  // namespace

void RefitOps::RegionTarget(const ViewGeometry& region, const RegionTargetParams& params) {
  RequireRegion(region);
  RequireUnit(params.unit);
  DoRegionTarget(region, params);
}

void RefitOps::RegionResidual(const ViewGeometry& region, const RegionResidualParams& params) {
  RequireRegion(region);
  RequireUnit(params.unit);
  DoRegionResidual(region, params);
}

void RefitOps::RegionSweep(const ViewGeometry& region, const RegionSweepParams& params) {
  RequireRegion(region);
  RequireUnit(params.unit);
  Require(params.weights != nullptr, "a sweep needs the weights of the pixels");
  DoRegionSweep(region, params);
}

void RefitOps::DoRegionSweep(const ViewGeometry& region, const RegionSweepParams& params) {
  blend_.Blend(
      region,
      {.features = params.change, .channels = 3, .image = params.image, .keep_outside = true});
  DoRegionResidual(region, {.target = params.target,
                            .unit = params.unit,
                            .image = params.image,
                            .residual = params.image,
                            .loss = params.loss,
                            .weights = params.weights,
                            .stay = params.stay});
  if (!params.result) return;
  blend_.BlendTranspose(region, {.residual = params.image, .channels = 3, .result = params.result});
}

void RefitOps::RegionAdd(const ViewGeometry& region, float* image, const float* delta) {
  RequireRegion(region);
  DoRegionAdd(region, image, delta);
}

void RefitOps::RegionWeightImage(const ViewGeometry& region, const uint8_t* weights, float* image) {
  RequireRegion(region);
  DoRegionWeightImage(region, weights, image);
}

void RefitOps::MarkRows(const ViewGeometry& view, uint8_t* seen) { DoMarkRows(view, seen); }

void RefitOps::NumberRows(const ViewGeometry& view, const int32_t* number_of, int32_t* numbers) {
  DoNumberRows(view, number_of, numbers);
}

ImageLossValue RefitOps::ImageLoss(const ImageLossParams& params) {
  ImageLossParams checked = params;
  int32_t* const roi = checked.roi;
  if (!roi[0] && !roi[1] && !roi[2] && !roi[3]) roi[2] = params.width, roi[3] = params.height;
  RequireBox(roi, params.width, params.height);
  if (roi[0] < roi[2] && roi[1] < roi[3]) return DoImageLoss(checked);
  return params.loss ? ImageLossValue{} : ImageLossValue{0, 0, 1};  // nothing differs
}

void RefitOps::PackBox(const PackBoxParams& params) {
  RequireBox(params.box, params.width, params.height);
  RequireUnit(params.unit);
  DoPackBox(params);
}

void RefitOps::UnpackBox(const PackBoxParams& params) {
  RequireBox(params.box, params.width, params.height);
  RequireUnit(params.unit);
  DoUnpackBox(params);
}

void RefitOps::EditImage(const EditImageParams& params) {
  RequireBox(params.box, params.width, params.height);
  DoEditImage(params);
}

}  // namespace retint
