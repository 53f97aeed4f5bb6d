// SPDX-License-Identifier: BSD-3-Clause
// The small stages of stereo: luma, quantiles, inverses and the fusion of pairs.
#include "kernels/cuda/stereo.cuh"

#include <algorithm>

#include "kernels/common/stereo.h"
#include "kernels/cuda/groups.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/scan.cuh"

namespace retint::cuda {
namespace {

struct Fractions {
  double value[kMaxQuantiles];
  int count;
};
struct Quantiles {
  float value[kMaxQuantiles];
};
struct QuantileResult {
  Quantiles values;
  int64_t positive;
};

// `sorted` descends as unsigned bits, so that the positive floats come first among those that are
// kept: the others were made 0.
__global__ void PickQuantilesKernel(const uint32_t* sorted, int64_t count, Fractions fractions,
                                    QuantileResult* result) {
  int64_t low = 0, high = count;  // the first 0 lies in [low, high]
  while (low < high) {
    const int64_t middle = (low + high) / 2;
    if (sorted[middle] > 0) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  result->positive = low;
  for (int i = 0; i < fractions.count; ++i) {
    const int64_t ascending = int64_t(fractions.value[i] * double(low - 1));
    result->values.value[i] = low > 0 ? __uint_as_float(sorted[low - 1 - ascending]) : 0.0f;
  }
}

class CudaStereoOps : public StereoOps {
 public:
  explicit CudaStereoOps(cudaStream_t stream) : stream_(stream) {}

  std::vector<float> DoPositiveQuantiles(const float* values, int64_t count,
                                         std::span<const double> fractions) override {
    Fractions wanted{{}, int(fractions.size())};
    std::copy(fractions.begin(), fractions.end(), wanted.value);
    Scratch<uint32_t> bits(stream_, size_t(count)), sorted(stream_, size_t(count));
    uint32_t* const to = bits.data();
    ForEach(count, stream_, "PositiveBits",
            [=] __device__(int64_t i) { to[i] = values[i] > 0 ? __float_as_uint(values[i]) : 0; });
    WithTemporary(stream_, "cub::DeviceRadixSort", [&](void* memory, size_t& bytes) {
      return cub::DeviceRadixSort::SortKeysDescending(memory, bytes, bits.data(), sorted.data(),
                                                      count, 0, 31, stream_);
    });
    Scratch<QuantileResult> result(stream_, 1);
    PickQuantilesKernel<<<1, 1, 0, stream_>>>(sorted.data(), count, wanted, result.data());
    Check(cudaGetLastError(), "PickQuantilesKernel");
    const auto [found] = ReadBack(stream_, result.data());
    if (found.positive == 0) return {};
    return {found.values.value, found.values.value + fractions.size()};
  }

  void DoGray(const float* rgb, int64_t pixels, float* gray) override {
    ForEach(pixels, stream_, "Gray", [=] __device__(int64_t i) { gray[i] = Luma(rgb + 3 * i); });
  }

  void DoInvert(const float* values, const float* otherwise, int64_t count, float scale,
                float* out) override {
    ForEach(count, stream_, "Invert",
            [=] __device__(int64_t i) { out[i] = Inverted(values, otherwise, i, scale); });
  }

  void DoMatch(const StereoMatchParams& params) override { MatchStereo(params, stream_); }

  void DoFuse(const StereoFuseParams& params) override {
    ForEach(params.pixels, stream_, "Fuse", [=] __device__(int64_t i) {
      params.disparity[i] =
          FusedDisparity(params.pairs, params.num_pairs, params.tolerance, params.nearest, i);
    });
  }

  void DoArbitrate(const StereoArbitrateParams& params) override {
    ArbitrateStereo(params, stream_);
  }
  void DoRefine(const StereoRefineParams& params) override { RefineStereo(params, stream_); }

 private:
  cudaStream_t stream_;
};

}  // namespace

std::unique_ptr<StereoOps> MakeStereoOps(cudaStream_t stream) {
  return std::make_unique<CudaStereoOps>(stream);
}

}  // namespace retint::cuda
