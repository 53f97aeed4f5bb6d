// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cpu/image_loss.h"

#include <algorithm>
#include <vector>

#include "base/parallel.h"

namespace retint {
namespace {

constexpr int kR = kSsimRadius;

struct Block {
  int x0, y0, x1, y1;
};

struct Sums {
  double l1 = 0, dssim = 0;
};

// Planes of one block. Inputs lie at an offset of (-10, -10), moments of (-5, -5) to the block.
class BlockScratch {
 public:
  BlockScratch() : memory_(size_t(kLossPlane) * kNumPlanes, 0.0f) {
    for (int i = 0; i < kNumPlanes; ++i) planes_[i] = memory_.data() + size_t(i) * kLossPlane;
  }
  float* const* x() { return planes_; }              // 3 channels
  float* const* y() { return planes_ + 3; }          // 3 channels
  float* const* rows() { return planes_ + 6; }       // 5 moments after the horizontal pass
  float* const* moments() { return planes_ + 11; }   // 5
  float* const* gradient() { return planes_ + 16; }  // 3 channels

 private:
  static constexpr int kNumPlanes = 19;
  std::vector<float> memory_;
  float* planes_[kNumPlanes];
};

class BlockLoss {
 public:
  BlockLoss(const LossKernels& kernels, const ImageLossParams& params, const Block& block,
            BlockScratch* scratch)
      : kernels_(kernels),
        params_(params),
        block_(block),
        scratch_(*scratch),
        width_(block.x1 - block.x0),
        height_(block.y1 - block.y0) {}

  Sums Run() {
    Load(params_.image, scratch_.x());
    Load(params_.target, scratch_.y());
    Sums sums;
    for (int channel = 0; channel < 3; ++channel) {
      sums.dssim += ForwardChannel(channel);
      sums.l1 += BackwardChannel(channel);
    }
    for (int y = 0; y < height_; ++y) {
      const float* rows[3];
      for (int c = 0; c < 3; ++c) rows[c] = scratch_.gradient()[c] + y * kLossStride;
      kernels_.interleave(rows, width_, PixelAt(params_.gradient, block_.x0, block_.y0 + y));
    }
    return sums;
  }

 private:
  template <typename T>
  T* PixelAt(T* image, int x, int y) const {
    return image + (size_t(y) * size_t(params_.width) + size_t(x)) * 3;
  }

  // The block and its halo of 10, zero beyond the image.
  void Load(const float* image, float* const* planes) const {
    const int left = block_.x0 - 2 * kR, right = block_.x1 + 2 * kR;
    const int first = std::max(left, 0), last = std::min(right, params_.width);
    for (int row = 0; row < height_ + 4 * kR; ++row) {
      const int y = block_.y0 - 2 * kR + row;
      float* out[3];
      for (int c = 0; c < 3; ++c) {
        float* begin = planes[c] + row * kLossStride;
        if (y < 0 || y >= params_.height || first > left || last < right) {
          std::fill_n(begin, right - left, 0.0f);
        }
        out[c] = begin + (first - left);
      }
      if (y < 0 || y >= params_.height) continue;
      kernels_.deinterleave(PixelAt(image, first, y), last - first, out);
    }
  }

  // Moments and SSIM's derivatives on the block and its halo of 5.
  double ForwardChannel(int channel) {
    const int width = width_ + 2 * kR, height = height_ + 2 * kR;
    for (int row = 0; row < height + 2 * kR; ++row) {
      const int at = row * kLossStride;
      float* out[5];
      for (int i = 0; i < 5; ++i) out[i] = scratch_.rows()[i] + at;
      kernels_.moment_rows(scratch_.x()[channel] + at, scratch_.y()[channel] + at, width, out);
    }
    const LossSpan valid = {std::max(0, kR - block_.x0),
                            std::min(width, params_.width - block_.x0 + kR)};
    double sum = 0;
    for (int row = 0; row < height; ++row) {
      const int y = block_.y0 - kR + row, at = row * kLossStride;
      float* out[5];
      for (int i = 0; i < 5; ++i) out[i] = scratch_.moments()[i] + at;
      if (y < 0 || y >= params_.height) {
        for (int i = 0; i < 3; ++i) std::fill_n(out[i], width, 0.0f);
        continue;
      }
      for (int i = 0; i < 5; ++i) kernels_.blur_column(scratch_.rows()[i] + at, width, out[i]);
      const bool counted = row >= kR && row < kR + height_;
      const LossSpan span = {kR, counted ? kR + width_ : kR};
      sum += kernels_.ssim_row(out, width, valid, span);
    }
    return sum;
  }

  double BackwardChannel(int channel) {
    const double count = double(params_.width) * params_.height * 3;
    const float l1_scale = float((1 - double(params_.lambda)) / count);
    const float ssim_scale = float(-double(params_.lambda) / count);
    for (int row = 0; row < height_ + 2 * kR; ++row) {
      for (int i = 0; i < 3; ++i) {
        const int at = row * kLossStride;
        kernels_.blur_row(scratch_.moments()[i] + at, width_, scratch_.rows()[i] + at);
      }
    }
    double sum = 0;
    for (int row = 0; row < height_; ++row) {
      const int at = row * kLossStride, in = (row + 2 * kR) * kLossStride + 2 * kR;
      const float* back[3];
      for (int i = 0; i < 3; ++i) {
        kernels_.blur_column(scratch_.rows()[i] + at, width_, scratch_.moments()[i] + at);
        back[i] = scratch_.moments()[i] + at;
      }
      sum += kernels_.gradient_row(scratch_.x()[channel] + in, scratch_.y()[channel] + in, back,
                                   width_, l1_scale, ssim_scale, scratch_.gradient()[channel] + at);
    }
    return sum;
  }

  const LossKernels& kernels_;
  const ImageLossParams& params_;
  const Block& block_;
  BlockScratch& scratch_;
  int width_, height_;
};

}  // namespace

ImageLossValue ImageLossOnCpu(const LossKernels& kernels, const ImageLossParams& params) {
  const int x0 = params.roi[0], y0 = params.roi[1], x1 = params.roi[2], y1 = params.roi[3];
  std::vector<Block> blocks;
  for (int y = y0; y < y1; y += kLossBlockHeight) {
    for (int x = x0; x < x1; x += kLossBlockWidth) {
      blocks.push_back(
          {x, y, std::min(x + kLossBlockWidth, x1), std::min(y + kLossBlockHeight, y1)});
    }
  }
  std::vector<Sums> sums(blocks.size());
  ParallelRanges(int64_t(blocks.size()), 1, [&](int64_t begin, int64_t end) {
    BlockScratch scratch;
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      sums[i] = BlockLoss(kernels, params, blocks[i], &scratch).Run();
    }
  });
  Sums total;
  for (const Sums& sum : sums) {
    total.l1 += sum.l1;
    total.dssim += sum.dssim;
  }
  // Pixels outside the region of interest agree: their SSIM is 1.
  const double count = double(params.width) * params.height * 3;
  const double l1 = total.l1 / count, dssim = total.dssim / count, lambda = double(params.lambda);
  return {(1 - lambda) * l1 + lambda * dssim, l1, 1 - dssim};
}

}  // namespace retint
