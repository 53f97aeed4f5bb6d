// SPDX-License-Identifier: BSD-3-Clause
// The CPU's group of blending operations. The large ones have files of their own: prepare.cc,
// region.cc and blend.cc.
#include <algorithm>
#include <cstring>

#include "base/parallel.h"
#include "kernels/cpu/blend.h"
#include "kernels/cpu/groups.h"

namespace retint {
namespace {

const CpuViewGeometry& CpuViewOf(const ViewGeometry& view) {
  return dynamic_cast<const CpuViewGeometry&>(view);
}

class CpuBlendOps : public BlendOps {
 public:
  explicit CpuBlendOps(const TileKernels& kernels) : kernels_(kernels) {}

 protected:
  std::unique_ptr<Model> DoUploadModel(const GaussianArrays& host) override {
    const size_t count = size_t(host.count);
    auto model = std::make_unique<CpuModel>(host);
    model->means.assign(host.means, host.means + 3 * count);
    const size_t values = 3 * count * size_t(model->num_sh_coeffs());
    model->coefficients = Buffer<float>(AllocateHost(values * sizeof(float)), values);
    if (values > 0) std::memcpy(model->sh(), host.sh, values * sizeof(float));
    model->covariances.resize(count);
    model->opacities.resize(count);
    ParallelRanges(host.count, 4096, [&](int64_t begin, int64_t end) {
      for (size_t g = size_t(begin); g < size_t(end); ++g) {
        model->covariances[g] = CovarianceOf(host.quats_wxyz + 4 * g, host.log_scales + 3 * g);
        model->opacities[g] = Sigmoid(host.opacity_logits[g]);
      }
    });
    return model;
  }

  std::shared_ptr<const ViewGeometry> DoPrepareView(const Model& model,
                                                    const CameraParams& camera) override {
    return PrepareViewOnCpu(CpuModelOf(model), camera);
  }

  std::shared_ptr<const ViewGeometry> DoRestrict(const ViewGeometry& view, const uint8_t* active,
                                                 size_t budget_bytes, float min_weight) override {
    return RestrictOnCpu(kernels_, CpuViewOf(view), active, budget_bytes, min_weight);
  }

  std::shared_ptr<const ViewGeometry> DoRestrictAndBlend(const ViewGeometry& view,
                                                         const uint8_t* active, size_t budget_bytes,
                                                         float min_weight,
                                                         const RegionBlend& blend) override {
    // Only compact weights are found in one pass for good.
    if (min_weight == 0) {
      return BlendOps::DoRestrictAndBlend(view, active, budget_bytes, min_weight, blend);
    }
    auto region =
        RestrictOnCpu(kernels_, CpuViewOf(view), active, budget_bytes, min_weight, &blend);
    if (CpuViewOf(*region).weights.empty()) BlendRegion(view, *region, blend);
    return region;
  }

  std::vector<int32_t> DoTouchedTiles(const ViewGeometry& view, const uint8_t* active) override {
    return TouchedTilesOnCpu(CpuViewOf(view), active);
  }

  void DoBlend(const ViewGeometry& view, const BlendParams& params) override {
    BlendOnCpu(kernels_, CpuViewOf(view), params);
  }

  void DoBlendShares(const ViewGeometry& view, const BlendSharesParams& params) override {
    BlendSharesOnCpu(kernels_, CpuViewOf(view), params);
  }

  void DoBlendTranspose(const ViewGeometry& view, const BlendTransposeParams& params) override {
    BlendTransposeOnCpu(kernels_, &scratch_, CpuViewOf(view), params);
  }

  void DoDepth(const ViewGeometry& view, const DepthParams& params) override {
    DepthOnCpu(kernels_, CpuViewOf(view), params);
  }

  void DoAccumulateShares(const ViewGeometry& view, const uint8_t* mask, double* sums) override {
    const size_t pixels = size_t(view.camera().width) * size_t(view.camera().height);
    auto residual = scratch_.Take(2 * pixels);
    for (size_t p = 0; p < pixels; ++p) {
      residual.data()[2 * p] = float(mask[p]) / 255.0f;
      residual.data()[2 * p + 1] = 1.0f;
    }
    std::vector<float> rows(2 * size_t(view.num_rows()));
    DoBlendTranspose(view, {residual.data(), 2, rows.data()});
    for (size_t r = 0; r < size_t(view.num_rows()); ++r) {
      double* sum = sums + 2 * view.rows()[r];
      sum[0] += double(rows[2 * r]);
      sum[1] += double(rows[2 * r + 1]);
    }
  }

  void DoGatherRows(const ViewGeometry& view, const float* of, int32_t channels,
                    float* values) override {
    const int32_t* const gaussians = view.rows();
    ParallelRanges(view.num_rows(), 8192, [&](int64_t begin, int64_t end) {
      for (int64_t r = begin; r < end; ++r) {
        std::copy_n(of + int64_t(gaussians[r]) * channels, channels, values + r * channels);
      }
    });
  }

  void DoAddRows(const ViewGeometry& view, const float* values, int32_t channels, float* sums,
                 bool and_square) override {
    const int32_t* const gaussians = view.rows();  // distinct
    const int32_t width = channels + (and_square ? 1 : 0);
    ParallelRanges(view.num_rows(), 8192, [&](int64_t begin, int64_t end) {
      for (int64_t r = begin; r < end; ++r) {
        float* const sum = sums + int64_t(gaussians[r]) * width;
        const float* const row = values + r * channels;
        for (int c = 0; c < channels; ++c) sum[c] += row[c];
        if (and_square) sum[channels] += row[channels - 1] * row[channels - 1];
      }
    });
  }

 private:
  const TileKernels& kernels_;
  ScratchPool scratch_;
};

}  // namespace

std::unique_ptr<BlendOps> MakeCpuBlendOps(const TileKernels& kernels) {
  return std::make_unique<CpuBlendOps>(kernels);
}

}  // namespace retint
