// SPDX-License-Identifier: BSD-3-Clause
// The image is cut into blocks; each computes the SSIM moments on a halo of 5 pixels around it from
// the inputs on a halo of 10, so that no intermediate image leaves the cache.
#include "kernels/cpu/image_loss.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "kernels/common/loss.h"
#include "kernels/cpu/parallel.h"

namespace retint {
namespace {

constexpr int kBlockWidth = 128, kBlockHeight = 64;
constexpr int kR = kSsimRadius;
constexpr int kInWidth = kBlockWidth + 4 * kR, kInHeight = kBlockHeight + 4 * kR;
constexpr int kMidWidth = kBlockWidth + 2 * kR, kMidHeight = kBlockHeight + 2 * kR;

struct Block {
  int x0, y0, x1, y1, channel;
};

struct Sums {
  double l1 = 0, ssim = 0;
};

struct Scratch {
  std::vector<float> x = std::vector<float>(kInWidth * kInHeight);
  std::vector<float> y = x;
  std::vector<float> product = x;
  std::vector<float> rows = x;  // after the horizontal pass
  std::vector<float> moments[5];
  std::vector<float> back[3];
  Scratch() {
    for (auto& m : moments) m.resize(kMidWidth * kMidHeight);
    for (auto& b : back) b.resize(kBlockWidth * kBlockHeight);
  }
};

// out[h - 10, w - 10] = window * in[h, w], rows of `stride` and `out_stride`.
void Convolve(const float* in, int stride, int width, int height, float* rows, float* out,
              int out_stride) {
  const int out_width = width - 2 * kR, out_height = height - 2 * kR;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < out_width; ++x) {
      float sum = 0;
      for (int i = 0; i <= 2 * kR; ++i) sum += kSsimWindow[i] * in[y * stride + x + i];
      rows[y * stride + x] = sum;
    }
  }
  for (int y = 0; y < out_height; ++y) {
    for (int x = 0; x < out_width; ++x) {
      float sum = 0;
      for (int i = 0; i <= 2 * kR; ++i) sum += kSsimWindow[i] * rows[(y + i) * stride + x];
      out[y * out_stride + x] = sum;
    }
  }
}

void Load(const float* image, const ImageLossParams& params, const Block& block, float* out) {
  for (int y = block.y0 - 2 * kR; y < block.y1 + 2 * kR; ++y) {
    float* row = out + (y - block.y0 + 2 * kR) * kInWidth;
    const int x0 = block.x0 - 2 * kR, x1 = block.x1 + 2 * kR;
    std::fill_n(row, x1 - x0, 0.0f);
    if (y < 0 || y >= params.height) continue;
    for (int x = std::max(x0, 0); x < std::min(x1, params.width); ++x) {
      row[x - x0] =
          image[(size_t(y) * size_t(params.width) + size_t(x)) * 3 + size_t(block.channel)];
    }
  }
}

Sums LossOfBlock(const ImageLossParams& params, const Block& block, Scratch* s) {
  const int width = block.x1 - block.x0, height = block.y1 - block.y0;
  Load(params.image, params, block, s->x.data());
  Load(params.target, params, block, s->y.data());
  const int in_width = width + 4 * kR, in_height = height + 4 * kR;
  const auto moment = [&](const float* in, int i) {
    Convolve(in, kInWidth, in_width, in_height, s->rows.data(), s->moments[i].data(), kMidWidth);
  };
  const auto product = [&](const std::vector<float>& a, const std::vector<float>& b, int i) {
    for (int y = 0; y < in_height; ++y) {
      for (int j = y * kInWidth; j < y * kInWidth + in_width; ++j) {
        s->product[size_t(j)] = a[size_t(j)] * b[size_t(j)];
      }
    }
    moment(s->product.data(), i);
  };
  moment(s->x.data(), 0);
  moment(s->y.data(), 1);
  product(s->x, s->x, 2);
  product(s->y, s->y, 3);
  product(s->x, s->y, 4);

  Sums sums;
  for (int y = 0; y < height + 2 * kR; ++y) {
    const int image_y = block.y0 - kR + y;
    for (int x = 0; x < width + 2 * kR; ++x) {
      const int image_x = block.x0 - kR + x;
      const size_t at = size_t(y * kMidWidth + x);
      SsimPoint<float> point{0, 0, 0, 0};
      if (image_x >= 0 && image_y >= 0 && image_x < params.width && image_y < params.height) {
        point = Ssim<float>({s->moments[0][at], s->moments[1][at], s->moments[2][at],
                             s->moments[3][at], s->moments[4][at]},
                            1.0f, kSsimC1, kSsimC2);
        const bool inside = x >= kR && y >= kR && x < width + kR && y < height + kR;
        if (inside) sums.ssim += double(point.value);
      }
      s->moments[0][at] = point.d_x;
      s->moments[1][at] = point.d_xx;
      s->moments[2][at] = point.d_xy;
    }
  }
  for (int i = 0; i < 3; ++i) {
    Convolve(s->moments[i].data(), kMidWidth, width + 2 * kR, height + 2 * kR, s->rows.data(),
             s->back[i].data(), kBlockWidth);
  }
  const double count = double(params.width) * params.height * 3;
  const float l1_scale = float((1 - params.lambda) / count);
  const float ssim_scale = float(-params.lambda / count);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t at = size_t((y + 2 * kR) * kInWidth + x + 2 * kR);
      const float vx = s->x[at], vy = s->y[at], difference = vx - vy;
      sums.l1 += double(std::fabs(difference));
      const float sign = float(difference > 0) - float(difference < 0);
      const size_t b = size_t(y * kBlockWidth + x);
      const float d_ssim = s->back[0][b] + 2 * vx * s->back[1][b] + vy * s->back[2][b];
      params.gradient[(size_t(block.y0 + y) * size_t(params.width) + size_t(block.x0 + x)) * 3 +
                      size_t(block.channel)] = l1_scale * sign + ssim_scale * d_ssim;
    }
  }
  return sums;
}

}  // namespace

ImageLossValue ImageLossOnCpu(const ImageLossParams& params) {
  int x0 = params.roi[0], y0 = params.roi[1], x1 = params.roi[2], y1 = params.roi[3];
  if (x0 == 0 && y0 == 0 && x1 == 0 && y1 == 0) x1 = params.width, y1 = params.height;
  if (x0 < 0 || y0 < 0 || x1 > params.width || y1 > params.height) {
    throw std::invalid_argument("the region of interest lies outside the image");
  }
  std::vector<Block> blocks;
  for (int y = y0; y < y1; y += kBlockHeight) {
    for (int x = x0; x < x1; x += kBlockWidth) {
      for (int c = 0; c < 3; ++c) {
        blocks.push_back({x, y, std::min(x + kBlockWidth, x1), std::min(y + kBlockHeight, y1), c});
      }
    }
  }
  std::vector<Sums> sums(blocks.size());
  ParallelRanges(int64_t(blocks.size()), 1, [&](int64_t begin, int64_t end) {
    Scratch scratch;
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      sums[i] = LossOfBlock(params, blocks[i], &scratch);
    }
  });
  const double count = double(params.width) * params.height * 3;
  const double pixels = double(std::max(0, x1 - x0)) * std::max(0, y1 - y0) * 3;
  ImageLossValue value{0, 0, 0};
  double d_ssim = pixels;
  for (const Sums& sum : sums) {
    value.l1 += sum.l1;
    value.ssim += sum.ssim;
    d_ssim -= sum.ssim;
  }
  value.l1 /= count;
  // Pixels outside the region of interest agree: their SSIM is 1.
  value.ssim = (count - pixels + value.ssim) / count;
  value.loss = (1 - double(params.lambda)) * value.l1 + double(params.lambda) * d_ssim / count;
  return value;
}

}  // namespace retint
