// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/mask_ops.h"

#include "kernels/check.h"

namespace retint {
namespace {

void RequireFirstRow(uint16_t pixel_rows) {
  Require(pixel_rows & 1, "the first row of a tile must be wanted");
}

}  // namespace

void MaskOps::SampleDepth(const SampleDepthParams& params) {
  RequireImage(params.width, params.height);
  RequireCount(params.count);
  RequireFirstRow(params.pixel_rows);
  DoSampleDepth(params);
}

void MaskOps::CorrectDepth(const CorrectDepthParams& params) {
  RequireImage(params.width, params.height);
  RequireFirstRow(params.pixel_rows);
  DoCorrectDepth(params);
}

void MaskOps::DrawCloud(const DrawCloudParams& params) {
  RequireImage(params.camera.width, params.camera.height);
  RequireCount(params.count);
  RequireFirstRow(params.pixel_rows);
  DoDrawCloud(params);
}

void MaskOps::MakeMask(const MakeMaskParams& params) {
  RequireImage(params.width, params.height);
  Require(params.close_radius >= 0, "the radius of a closing must not be negative");
  DoMakeMask(params);
}

void MaskOps::DropFaint(const DropFaintParams& params) {
  RequireImage(params.width, params.height);
  Require(params.reach >= 0, "the reach of a mask's border must not be negative");
  DoDropFaint(params);
}

void MaskOps::MarkSilhouette(const MarkSilhouetteParams& params) {
  RequireImage(params.width, params.height);
  DoMarkSilhouette(params);
}

void MaskOps::Evidence(const EvidenceParams& params) {
  RequireImage(params.camera.width, params.camera.height);
  Require(params.visible >= 0, "the visibility of a pixel must not be negative");
  DoEvidence(params);
}

}  // namespace retint
