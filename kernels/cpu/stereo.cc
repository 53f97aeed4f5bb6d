// SPDX-License-Identifier: BSD-3-Clause
// The CPU's group of stereo operations. The large ones have files of their own: stereo_match.cc,
// stereo_arbitrate.cc and stereo_refine.cc.
#include "kernels/cpu/stereo.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "base/parallel.h"
#include "kernels/common/stereo.h"
#include "kernels/cpu/groups.h"
#include "kernels/cpu/stereo_match.h"

namespace retint {
namespace {

constexpr int64_t kPiece = 1 << 14;  // pixels a task

// body(i) for i in [0, count).
template <typename Body>
void ForPixels(int64_t count, const Body& body) {
  ParallelRanges(count, kPiece, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) body(i);
  });
}

class CpuStereoOps : public StereoOps {
 public:
  explicit CpuStereoOps(const StereoKernels& kernels) : kernels_(kernels) {}

 protected:
  std::vector<float> DoPositiveQuantiles(const float* values, int64_t count,
                                         std::span<const double> fractions) override {
    std::vector<float> positive;
    positive.reserve(size_t(count));
    std::copy_if(values, values + count, std::back_inserter(positive),
                 [](float value) { return value > 0; });
    if (positive.empty()) return {};
    std::vector<float> found;
    for (const double fraction : fractions) {
      const auto nth = positive.begin() + ptrdiff_t(fraction * double(positive.size() - 1));
      std::nth_element(positive.begin(), nth, positive.end());
      found.push_back(*nth);
    }
    return found;
  }

  void DoGray(const float* rgb, int64_t pixels, float* gray) override {
    ForPixels(pixels, [&](int64_t i) { gray[i] = Luma(rgb + 3 * i); });
  }

  void DoInvert(const float* values, const float* otherwise, int64_t count, float scale,
                float* out) override {
    ForPixels(count, [&](int64_t i) { out[i] = Inverted(values, otherwise, i, scale); });
  }

  void DoMatch(const StereoMatchParams& params) override { MatchStereoOnCpu(kernels_, params); }

  void DoFuse(const StereoFuseParams& params) override {
    ForPixels(params.pixels, [&](int64_t i) {
      params.disparity[i] =
          FusedDisparity(params.pairs, params.num_pairs, params.tolerance, params.nearest, i);
    });
  }

  void DoArbitrate(const StereoArbitrateParams& params) override { ArbitrateStereoOnCpu(params); }
  void DoRefine(const StereoRefineParams& params) override { RefineStereoOnCpu(params); }

 private:
  const StereoKernels& kernels_;
};

}  // namespace

std::unique_ptr<StereoOps> MakeCpuStereoOps(const StereoKernels& kernels) {
  return std::make_unique<CpuStereoOps>(kernels);
}

}  // namespace retint
