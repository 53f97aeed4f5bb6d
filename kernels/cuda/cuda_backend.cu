// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cuda/cuda_backend.h"

#include <algorithm>
#include <stdexcept>

#include "kernels/cuda/blend.cuh"
#include "kernels/cuda/ops.cuh"
#include "kernels/cuda/projection.cuh"
#include "kernels/cuda/stereo.cuh"

namespace retint {
namespace cuda {
namespace {

// Freed in stream order, so that work in flight still has it.
class PoolMemory : public DeviceMemory {
 public:
  PoolMemory(cudaStream_t stream, size_t bytes) : DeviceMemory(nullptr, bytes), stream_(stream) {
    if (bytes == 0) return;
    data_ = TakeMemory(bytes, stream);
    Check(cudaMemsetAsync(data_, 0, bytes, stream), "cudaMemsetAsync");
  }
  ~PoolMemory() override {
    if (data_) cudaFreeAsync(data_, stream_);
  }

 private:
  cudaStream_t stream_;
};

const CudaModel& Own(const Model& model) { return dynamic_cast<const CudaModel&>(model); }
const CudaViewGeometry& Own(const ViewGeometry& view) {
  return dynamic_cast<const CudaViewGeometry&>(view);
}

class CudaBackend : public Backend {
 public:
  CudaBackend() {
    std::string reason;
    if (!CudaAvailable(&reason)) throw std::invalid_argument("backend \"cuda\": " + reason);
    Check(cudaGetDevice(&device_), "cudaGetDevice");
    Check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate");
    // Memory given back stays in the pool: allocation is then free of calls to the driver.
    Check(cudaDeviceGetDefaultMemPool(&pool_, device_), "cudaDeviceGetDefaultMemPool");
    uint64_t keep = UINT64_MAX;
    Check(cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &keep),
          "cudaMemPoolSetAttribute");
    stereo_ = MakeStereoOps(stream_);
  }
  ~CudaBackend() override { cudaStreamDestroy(stream_); }
  CudaBackend(const CudaBackend&) = delete;
  CudaBackend& operator=(const CudaBackend&) = delete;

  std::string_view Name() const override { return "cuda"; }
  std::string Description() const override {
    cudaDeviceProp properties{};
    Check(cudaGetDeviceProperties(&properties, device_), "cudaGetDeviceProperties");
    return std::string(properties.name) + ", " + std::to_string(properties.totalGlobalMem >> 20) +
           " MiB";
  }
  bool Supports(Op) const override { return true; }

  std::shared_ptr<DeviceMemory> AllocateBytes(size_t bytes) override {
    return std::make_shared<PoolMemory>(stream_, bytes);
  }
  void CopyToDevice(void* device, const void* host, size_t bytes) override {
    if (bytes == 0) return;
    Check(cudaMemcpyAsync(device, host, bytes, cudaMemcpyHostToDevice, stream_), "cudaMemcpyAsync");
  }
  void CopyToHost(void* host, const void* device, size_t bytes) override {
    if (bytes == 0) return;
    Check(cudaMemcpyAsync(host, device, bytes, cudaMemcpyDeviceToHost, stream_), "cudaMemcpyAsync");
    Synchronize();
  }
  void Fill(void* device, int byte, size_t bytes) override {
    if (bytes == 0) return;
    Check(cudaMemsetAsync(device, byte, bytes, stream_), "cudaMemsetAsync");
  }
  void Synchronize() override { Check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize"); }
  size_t PeakDeviceBytes() const override {
    uint64_t peak = 0;
    Check(cudaMemPoolGetAttribute(pool_, cudaMemPoolAttrUsedMemHigh, &peak),
          "cudaMemPoolGetAttribute");
    return size_t(peak);
  }

  std::unique_ptr<Model> UploadModel(const GaussianArrays& host) override {
    if (host.sh_degree < 0 || host.sh_degree > 3) {
      throw std::invalid_argument("SH degree must be 0 to 3");
    }
    return cuda::Upload(host, stream_);
  }
  std::shared_ptr<const ViewGeometry> PrepareView(const Model& model,
                                                  const CameraParams& camera) override {
    if (camera.width < 1 || camera.height < 1) {
      throw std::invalid_argument("a view has at least one pixel");
    }
    return Prepare(Own(model), camera, stream_);
  }
  std::shared_ptr<const ViewGeometry> Restrict(const ViewGeometry& view, const uint8_t* active,
                                               size_t budget_bytes) override {
    return RestrictTo(Own(view), active, budget_bytes, 0, stream_);
  }
  std::shared_ptr<const ViewGeometry> RestrictCompact(const ViewGeometry& view,
                                                      const uint8_t* active, size_t budget_bytes,
                                                      float min_weight) override {
    return RestrictTo(Own(view), active, budget_bytes, min_weight, stream_);
  }
  void Blend(const ViewGeometry& view, const BlendParams& params) override {
    cuda::Blend(Own(view), params, stream_);
  }
  void BlendTranspose(const ViewGeometry& view, const BlendTransposeParams& params) override {
    cuda::BlendTranspose(Own(view), params, stream_);
  }
  void Depth(const ViewGeometry& view, const DepthParams& params) override {
    cuda::Depth(Own(view), params, stream_);
  }
  void EvalSh(const Model& model, const EvalShParams& params) override {
    cuda::EvalSh(Own(model), params, stream_);
  }
  void EvalShTranspose(const Model& model, const EvalShTransposeParams& params) override {
    cuda::EvalShTranspose(Own(model), params, stream_);
  }
  ImageLossValue ImageLoss(const ImageLossParams& params) override {
    Scratch<double> sums(stream_, 2);
    Fill(sums.data(), 0, sums.bytes());
    cuda::ImageLoss(params, sums.data(), stream_);
    const bool whole = !params.roi[0] && !params.roi[1] && !params.roi[2] && !params.roi[3];
    const double count = double(params.width) * params.height * 3;
    const double pixels = whole ? count
                                : double(std::max(0, params.roi[2] - params.roi[0])) *
                                      std::max(0, params.roi[3] - params.roi[1]) * 3;
    if (params.loss) {
      AddImageLoss(params, sums.data(), pixels, stream_);
      return {};
    }
    double host[2];
    CopyToHost(host, sums.data(), sizeof(host));
    // Pixels outside the region of interest agree: their SSIM is 1.
    ImageLossValue value{0, host[0] / count, (count - pixels + host[1]) / count};
    value.loss =
        (1 - double(params.lambda)) * value.l1 + double(params.lambda) * (pixels - host[1]) / count;
    return value;
  }
  void Adam(const AdamParams& params) override { cuda::Adam(params, stream_); }
  void AccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) override {
    cuda::AccumulateBlocks(Own(model), params, stream_);
  }
  void FactorBlocks(const FactorBlocksParams& params) override {
    cuda::FactorBlocks(params, stream_);
  }
  void SolveBlocks(const SolveBlocksParams& params) override { cuda::SolveBlocks(params, stream_); }

  void RegionTarget(const ViewGeometry& view, const RegionTargetParams& params) override {
    cuda::RegionTarget(Own(view), params, stream_);
  }
  void RegionResidual(const ViewGeometry& view, const RegionResidualParams& params) override {
    cuda::RegionResidual(Own(view), params, stream_);
  }
  void RegionAdd(const ViewGeometry& view, float* image, const float* delta) override {
    cuda::RegionAdd(Own(view), image, delta, stream_);
  }
  void RegionWeightImage(const ViewGeometry& view, const uint8_t* weights, float* image) override {
    cuda::RegionWeightImage(Own(view), weights, image, stream_);
  }
  void AccumulateShares(const ViewGeometry& view, const uint8_t* mask, double* sums) override {
    cuda::AccumulateShares(Own(view), mask, sums, stream_);
  }
  void ShTangent(const Model& model, const ShTangentParams& params) override {
    cuda::ShTangent(Own(model), params, stream_);
  }
  void AddRidge(const AddRidgeParams& params) override { cuda::AddRidge(params, stream_); }
  void ApplyRidge(const ApplyRidgeParams& params) override { cuda::ApplyRidge(params, stream_); }
  void LinearCombination(const LinearCombinationParams& params) override {
    cuda::LinearCombination(params, stream_);
  }
  double Dot(const float* x, const float* y, int64_t count) override {
    Scratch<double> sum(stream_, 1);
    Fill(sum.data(), 0, sum.bytes());
    cuda::Dot(x, y, count, sum.data(), stream_);
    double host;
    CopyToHost(&host, sum.data(), sizeof(host));
    return host;
  }
  void PackBox(const PackBoxParams& params) override { cuda::PackBox(params, stream_); }
  void UnpackBox(const PackBoxParams& params) override { cuda::UnpackBox(params, stream_); }
  void EditImage(const EditImageParams& params) override { cuda::EditImage(params, stream_); }

  void SampleDepth(const SampleDepthParams& params) override { cuda::SampleDepth(params, stream_); }
  void CorrectDepth(const CorrectDepthParams& params) override {
    cuda::CorrectDepth(params, stream_);
  }
  void DrawCloud(const DrawCloudParams& params) override { cuda::DrawCloud(params, stream_); }
  void MakeMask(const MakeMaskParams& params) override { cuda::MakeMask(params, stream_); }
  void MarkSilhouette(const MarkSilhouetteParams& params) override {
    cuda::MarkSilhouette(params, stream_);
  }
  void Evidence(const EvidenceParams& params) override { cuda::Evidence(params, stream_); }
  void GatherRows(const ViewGeometry& view, const float* of, int32_t channels,
                  float* values) override {
    cuda::GatherRows(Own(view), of, channels, values, stream_);
  }
  void AddRows(const ViewGeometry& view, const float* values, int32_t channels,
               float* sums) override {
    cuda::AddRows(Own(view), values, channels, sums, stream_);
  }
  void NeighborDistances(const NeighborDistancesParams& params) override {
    cuda::NeighborDistances(params, stream_);
  }
  StereoOps* Stereo() override { return stereo_.get(); }

 private:
  int device_ = 0;
  cudaStream_t stream_ = nullptr;
  cudaMemPool_t pool_ = nullptr;
  std::unique_ptr<StereoOps> stereo_;
};

}  // namespace
}  // namespace cuda

std::shared_ptr<Backend> CreateCudaBackend() { return std::make_shared<cuda::CudaBackend>(); }

}  // namespace retint
