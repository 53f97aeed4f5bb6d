// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cpu/cpu_backend.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

#include <tbb/global_control.h>
#include <tbb/info.h>

#include "base/parallel.h"
#include "kernels/cpu/geometry.h"
#include "kernels/cpu/image_loss.h"
#include "kernels/cpu/mask_projection.h"
#include "kernels/cpu/memory.h"
#include "kernels/cpu/refit.h"
#include "kernels/cpu/solve.h"
#include "kernels/cpu/spherical_harmonics.h"
#include "kernels/cpu/tiles.h"

namespace retint {
namespace {

const CpuModel& CpuModelOf(const Model& model) { return dynamic_cast<const CpuModel&>(model); }

const CpuViewGeometry& CpuViewOf(const ViewGeometry& view) {
  return dynamic_cast<const CpuViewGeometry&>(view);
}

class CpuBackend : public Backend {
 public:
  explicit CpuBackend(const CpuOptions& options)
      : kernels_(options.scalar ? ScalarTileKernels() : SimdTileKernels()),
        loss_kernels_(options.scalar ? ScalarLossKernels() : SimdLossKernels()),
        target_(options.scalar ? "scalar" : std::string(SimdTargetName()) + " (Highway)") {}

  std::string_view Name() const override { return "cpu"; }
  std::string Description() const override {
    const size_t threads =
        tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    return target_ + ", " + std::to_string(threads) + (threads == 1 ? " thread" : " threads");
  }
  bool Supports(Op op) const override { return op != Op::kNeighborDistances; }

  std::shared_ptr<DeviceMemory> AllocateBytes(size_t bytes) override { return AllocateHost(bytes); }
  void CopyToDevice(void* device, const void* host, size_t bytes) override {
    if (bytes > 0) std::memcpy(device, host, bytes);
  }
  void CopyToHost(void* host, const void* device, size_t bytes) override {
    if (bytes > 0) std::memcpy(host, device, bytes);
  }
  void Fill(void* device, int byte, size_t bytes) override {
    if (bytes > 0) std::memset(device, byte, bytes);
  }
  void Synchronize() override {}
  size_t PeakDeviceBytes() const override { return 0; }

  std::unique_ptr<Model> UploadModel(const GaussianArrays& host) override {
    if (host.sh_degree < 0 || host.sh_degree > 3) {
      throw std::invalid_argument("SH degree must be 0 to 3");
    }
    const size_t count = size_t(host.count);
    auto model = std::make_unique<CpuModel>(host.count, host.sh_degree);
    model->means.assign(host.means, host.means + 3 * count);
    model->coefficients = Allocate<float>(3 * count * size_t(model->num_sh_coeffs()));
    CopyToDevice(model->sh(), host.sh, model->coefficients.size() * sizeof(float));
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

  std::shared_ptr<const ViewGeometry> PrepareView(const Model& model,
                                                  const CameraParams& camera) override {
    if (camera.width < 1 || camera.height < 1) {
      throw std::invalid_argument("a view has at least one pixel");
    }
    return PrepareViewOnCpu(CpuModelOf(model), camera);
  }
  std::shared_ptr<const ViewGeometry> Restrict(const ViewGeometry& view, const uint8_t* active,
                                               size_t budget_bytes) override {
    return RestrictOnCpu(kernels_, CpuViewOf(view), active, budget_bytes, 0);
  }
  std::shared_ptr<const ViewGeometry> RestrictCompact(const ViewGeometry& view,
                                                      const uint8_t* active, size_t budget_bytes,
                                                      float min_weight) override {
    return RestrictOnCpu(kernels_, CpuViewOf(view), active, budget_bytes, min_weight);
  }
  void Blend(const ViewGeometry& view, const BlendParams& params) override {
    BlendOnCpu(kernels_, CpuViewOf(view), params);
  }
  void BlendTranspose(const ViewGeometry& view, const BlendTransposeParams& params) override {
    BlendTransposeOnCpu(kernels_, &scratch_, CpuViewOf(view), params);
  }
  void Depth(const ViewGeometry& view, const DepthParams& params) override {
    DepthOnCpu(kernels_, CpuViewOf(view), params);
  }
  void EvalSh(const Model& model, const EvalShParams& params) override {
    EvalShOnCpu(CpuModelOf(model), params);
  }
  void EvalShTranspose(const Model& model, const EvalShTransposeParams& params) override {
    EvalShTransposeOnCpu(CpuModelOf(model), params);
  }
  ImageLossValue ImageLoss(const ImageLossParams& params) override {
    const ImageLossValue value = ImageLossOnCpu(loss_kernels_, params);
    if (!params.loss) return value;
    *params.loss += value.loss;
    return {};
  }
  void Adam(const AdamParams& params) override { AdamOnCpu(params); }
  void AccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) override {
    AccumulateBlocksOnCpu(CpuModelOf(model), params);
  }
  void FactorBlocks(const FactorBlocksParams& params) override { FactorBlocksOnCpu(params); }
  void SolveBlocks(const SolveBlocksParams& params) override { SolveBlocksOnCpu(params); }

  void RegionTarget(const ViewGeometry& view, const RegionTargetParams& params) override {
    RegionTargetOnCpu(view, params);
  }
  void RegionResidual(const ViewGeometry& view, const RegionResidualParams& params) override {
    RegionResidualOnCpu(view, params);
  }
  void RegionAdd(const ViewGeometry& view, float* image, const float* delta) override {
    RegionAddOnCpu(view, image, delta);
  }
  void RegionWeightImage(const ViewGeometry& view, const uint8_t* weights, float* image) override {
    RegionWeightImageOnCpu(view, weights, image);
  }
  void AccumulateShares(const ViewGeometry& view, const uint8_t* mask, double* sums) override {
    AccumulateSharesOnCpu(kernels_, &scratch_, CpuViewOf(view), mask, sums);
  }
  void ShTangent(const Model& model, const ShTangentParams& params) override {
    ShTangentOnCpu(CpuModelOf(model), params);
  }
  void AddRidge(const AddRidgeParams& params) override { AddRidgeOnCpu(params); }
  void ApplyRidge(const ApplyRidgeParams& params) override { ApplyRidgeOnCpu(params); }
  void LinearCombination(const LinearCombinationParams& params) override {
    LinearCombinationOnCpu(params);
  }
  double Dot(const float* x, const float* y, int64_t count) override {
    return DotOnCpu(x, y, count);
  }
  void PackBox(const PackBoxParams& params) override { PackBoxOnCpu(params); }
  void UnpackBox(const PackBoxParams& params) override { UnpackBoxOnCpu(params); }
  void EditImage(const EditImageParams& params) override { EditImageOnCpu(params); }

  void SampleDepth(const SampleDepthParams& params) override { SampleDepthOnCpu(params); }
  void CorrectDepth(const CorrectDepthParams& params) override { CorrectDepthOnCpu(params); }
  void DrawCloud(const DrawCloudParams& params) override { DrawCloudOnCpu(params); }
  void MakeMask(const MakeMaskParams& params) override { MakeMaskOnCpu(params); }
  void MarkSilhouette(const MarkSilhouetteParams& params) override { MarkSilhouetteOnCpu(params); }
  void Evidence(const EvidenceParams& params) override { EvidenceOnCpu(params); }
  void NeighborDistances(const NeighborDistancesParams&) override {
    throw std::logic_error("the CPU has no search of all points: use a tree");
  }
  void GatherRows(const ViewGeometry& view, const float* of, int32_t channels,
                  float* values) override {
    GatherRowsOnCpu(view, of, channels, values);
  }
  void AddRows(const ViewGeometry& view, const float* values, int32_t channels,
               float* sums) override {
    AddRowsOnCpu(view, values, channels, sums);
  }

 private:
  const TileKernels& kernels_;
  const LossKernels& loss_kernels_;
  std::string target_;
  ScratchPool scratch_;
};

}  // namespace

std::shared_ptr<Backend> CreateCpuBackend(const CpuOptions& options) {
  return std::make_shared<CpuBackend>(options);
}

}  // namespace retint
