// SPDX-License-Identifier: BSD-3-Clause
// The device's group of blending operations. The large ones have files of their own: prepare.cu,
// region.cu and blend.cu.
#include <mutex>

#include "kernels/cuda/blend.cuh"
#include "kernels/cuda/groups.cuh"
#include "kernels/cuda/launch.cuh"

namespace retint::cuda {
namespace {

class BlendOpsOnStream : public CudaBlendOps {
 public:
  explicit BlendOpsOnStream(cudaStream_t stream)
      : stream_(stream), largest_(stream, 1), one_(stream, 1) {
    const float one = 1;
    Check(cudaMemcpyAsync(one_.data(), &one, sizeof(one), cudaMemcpyHostToDevice, stream),
          "cudaMemcpyAsync");
  }

  std::unique_ptr<Model> DoUploadModel(const GaussianArrays& host) override {
    return Upload(host, stream_);
  }

  std::shared_ptr<const ViewGeometry> DoPrepareView(const Model& model,
                                                    const CameraParams& camera) override {
    return Prepare(Own(model), camera, stream_);
  }

  std::shared_ptr<const ViewGeometry> DoRestrict(const ViewGeometry& view, const uint8_t* active,
                                                 size_t budget_bytes, float min_weight) override {
    return RestrictTo(Own(view), active, budget_bytes, min_weight, stream_);
  }

  std::vector<int32_t> DoTouchedTiles(const ViewGeometry& view, const uint8_t* active) override {
    const auto region = RestrictTo(Own(view), active, 0, 0, stream_);
    return {region->tiles().begin(), region->tiles().end()};
  }

  void DoBlend(const ViewGeometry& view, const BlendParams& params) override {
    cuda::Blend(Own(view), params, stream_);
  }

  void DoBlendShares(const ViewGeometry& view, const BlendSharesParams& params) override {
    cuda::BlendShares(Own(view), params, stream_);
  }

  void DoBlendTranspose(const ViewGeometry& view, const BlendTransposeParams& params) override {
    if (view.num_rows() == 0) return;
    const std::lock_guard lock(mutex_);  // both kernels use largest_
    LargestOf(Own(view), params, largest_.data(), stream_);
    Transpose(view, params, largest_.data());
  }

  void BlendTransposeUpTo(const ViewGeometry& view, const BlendTransposeParams& params,
                          const float* largest) override {
    const std::lock_guard lock(mutex_);
    Transpose(view, params, largest);
  }

  void DoDepth(const ViewGeometry& view, const DepthParams& params) override {
    cuda::Depth(Own(view), params, stream_);
  }

  void DoAccumulateShares(const ViewGeometry& view, const uint8_t* mask, double* sums) override {
    const int64_t pixels = int64_t(view.camera().width) * view.camera().height;
    const int64_t rows = view.num_rows();
    if (rows == 0) return;
    Scratch<float2> residual(stream_, size_t(pixels)), of_rows(stream_, size_t(rows));
    float2* to = residual.data();
    ForEach(pixels, stream_, "AccumulateShares", [=] __device__(int64_t p) {
      to[p] = {float(mask[p]) / 255.0f, 1.0f};
    });
    BlendTransposeUpTo(view, {&residual.data()->x, 2, &of_rows.data()->x}, one_.data());
    const int32_t* gaussians = view.rows();
    const float2* from = of_rows.data();
    ForEach(rows, stream_, "AccumulateShares", [=] __device__(int64_t r) {
      double* sum = sums + 2 * int64_t(gaussians[r]);  // rows are distinct
      sum[0] += double(from[r].x);
      sum[1] += double(from[r].y);
    });
  }

  void DoGatherRows(const ViewGeometry& view, const float* of, int32_t channels,
                    float* values) override {
    const int32_t* const gaussians = view.rows();
    ForEach(view.num_rows() * channels, stream_, "GatherRows", [=] __device__(int64_t i) {
      values[i] = of[int64_t(gaussians[i / channels]) * channels + i % channels];
    });
  }

  void DoAddRows(const ViewGeometry& view, const float* values, int32_t channels, float* sums,
                 bool and_square) override {
    const int32_t* const gaussians = view.rows();  // distinct
    const int32_t width = channels + (and_square ? 1 : 0);
    ForEach(view.num_rows() * width, stream_, "AddRows", [=] __device__(int64_t i) {
      const int64_t r = i / width;
      const int32_t c = int32_t(i % width);
      const float last = values[r * channels + channels - 1];
      sums[int64_t(gaussians[r]) * width + c] +=
          c < channels ? values[r * channels + c] : last * last;
    });
  }

 private:
  void Transpose(const ViewGeometry& view, const BlendTransposeParams& params,
                 const float* largest) {
    const int64_t values = view.num_rows() * params.channels;
    if (values == 0) return;
    const int64_t pixels = int64_t(view.camera().width) * view.camera().height;
    const FixedSums sums = sums_.Take(size_t(values), pixels, largest, stream_);
    cuda::BlendTranspose(Own(view), params, sums, stream_);
    MoveSums(sums, values, params.result, stream_);
  }

  cudaStream_t stream_;
  std::mutex mutex_;              // of sums_ and largest_
  FixedSumsMemory sums_;          // of the transpose under way
  Scratch<float> largest_, one_;  // of its residual; 1
};

}  // namespace

std::unique_ptr<CudaBlendOps> MakeBlendOps(cudaStream_t stream) {
  return std::make_unique<BlendOpsOnStream>(stream);
}

}  // namespace retint::cuda
