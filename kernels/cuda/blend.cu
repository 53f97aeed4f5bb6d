// SPDX-License-Identifier: BSD-3-Clause
// Blend, BlendTranspose and Depth by the tile lists.
#include "kernels/cuda/blend.cuh"

#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/tile_walk.cuh"
#include "kernels/cuda/weights.cuh"

namespace retint::cuda {
namespace {

TileLists ListsOf(const CudaViewGeometry& view) {
  return {view.splats.data(),
          view.entries.data(),
          view.ranges.data(),
          view.is_region() ? view.tile_ids.data() : nullptr,
          view.is_region() ? view.splat_rows.data() : nullptr,
          view.camera().width,
          view.camera().height,
          view.tiles_x(),
          int(view.ranges.size()),
          view.order.size() > 0 ? view.order.data() : nullptr};
}

// The even rows alone, or fewer.
bool IsEverySecondRow(uint16_t pixel_rows) { return (pixel_rows & 0xaaaa) == 0; }

// Of a splat; in a region, one more says whether it is active.
template <int C>
struct Values {
  float of[C];
};

template <int C, bool IsRegion>
__global__ void __launch_bounds__(kTileThreads) BlendKernel(TileLists lists, BlendParams params) {
  constexpr int kSums = IsRegion ? C + 1 : C;
  __shared__ Batch<Values<kSums>> batches[kWarps];
  const int index = lists.Index();
  if (params.keep_outside && lists.ranges[index].x == lists.ranges[index].y) return;
  const Lane lane = LaneOf(lists, lists.tile_ids ? lists.tile_ids[index] : index);
  Pixel pixel0(lane.inside0), pixel1(lane.inside1);
  float sums0[kSums] = {}, sums1[kSums] = {};
  WalkTile(
      lists, index, lane, &batches[threadIdx.x / 32],
      [&](int row, const Splat&, Values<kSums>* out) {
        if constexpr (IsRegion) out->of[C] = row < 0 ? 0.0f : 1.0f;
#pragma unroll
        for (int c = 0; c < C; ++c) {
          out->of[c] = IsRegion && row < 0 ? 0.0f : params.features[int64_t(row) * C + c];
        }
      },
      [&](const Batch<Values<kSums>>& batch, int count) {
#pragma unroll 4
        for (int i = 0; i < count; ++i) {
          const auto item = batch.items[i];
          const float2 exponents = ExponentsOf(item.splat, lane);
          pixel0.template Add<kSums>(exponents.x, item.payload.of, sums0);
          pixel1.template Add<kSums>(exponents.y, item.payload.of, sums1);
        }
      },
      [&] { return pixel0.IsOpen() || pixel1.IsOpen(); });
  const auto store = [&](int y, float left, const float* sums) {
    const int64_t pixel = int64_t(y) * lists.width + lane.x;
#pragma unroll
    for (int c = 0; c < C; ++c) {
      params.image[pixel * C + c] = sums[c] + (params.background ? left * params.background[c] : 0);
    }
    if (params.alpha) params.alpha[pixel] = IsRegion ? sums[kSums - 1] : 1 - left;
  };
  if (lane.inside0) store(lane.y0, pixel0.left, sums0);
  if (lane.inside1) store(lane.y1, pixel1.left, sums1);
}

// A pixel is done when the rest of the list cannot take it over a limit. Shares lie in [0, 1], so
// the pixel gains at most its transmittance, `behind` included.
__global__ void __launch_bounds__(kTileThreads)
    BlendSharesKernel(TileLists lists, BlendSharesParams params) {
  __shared__ Batch<float> batches[kWarps];
  const int index = lists.Index();
  const Lane lane = LaneOf(lists, index);
  Pixel pixel0(lane.inside0), pixel1(lane.inside1);
  float sum0 = 0, sum1 = 0;
  WalkTile(
      lists, index, lane, &batches[threadIdx.x / 32],
      [&](int row, const Splat&, float* share) { *share = params.shares[row]; },
      [&](const Batch<float>& batch, int count) {
#pragma unroll 4
        for (int i = 0; i < count; ++i) {
          const auto item = batch.items[i];
          const float2 exponents = ExponentsOf(item.splat, lane);
          sum0 += pixel0.Blend(exponents.x) * item.payload;
          sum1 += pixel1.Blend(exponents.y) * item.payload;
        }
        const auto end = [&](Pixel* pixel, float sum) {
          if (sum >= params.high || sum + pixel->left <= params.low) pixel->End();
        };
        end(&pixel0, sum0);
        end(&pixel1, sum1);
      },
      [&] { return pixel0.IsOpen() || pixel1.IsOpen(); });
  const auto store = [&](int y, float left, float sum) {
    params.image[int64_t(y) * lists.width + lane.x] = sum + left * params.behind;
  };
  if (lane.inside0) store(lane.y0, pixel0.left, sum0);
  if (lane.inside1) store(lane.y1, pixel1.left, sum1);
}

// With a row step of 2 every second row of pixels is visited, a pixel a lane.
template <int C, int row_step>
__global__ void __launch_bounds__(kTileThreads)
    BlendTransposeKernel(TileLists lists, BlendTransposeParams params, FixedSums to) {
  __shared__ Batch<int> batches[kWarps];
  const int index = lists.Index(), lane_id = threadIdx.x % 32;
  const float per_unit = to.Load().per_unit;
  const Lane lane = LaneOf<row_step>(lists, lists.tile_ids ? lists.tile_ids[index] : index);
  Pixel pixel0(lane.inside0), pixel1(lane.inside1);
  float residual0[C] = {}, residual1[C] = {};
  const auto read = [&](int y, float* residual) {
    const float* from = params.residual + (int64_t(y) * lists.width + lane.x) * C;
#pragma unroll
    for (int c = 0; c < C; ++c) residual[c] = from[c];
  };
  if (lane.inside0) read(lane.y0, residual0);
  if (lane.inside1) read(lane.y1, residual1);
  WalkTile(
      lists, index, lane, &batches[threadIdx.x / 32],
      [&](int row, const Splat&, int* out) { *out = row; },
      [&](const Batch<int>& batch, int count) {
        for (int first = 0; first < count; first += 8) {
          float sums[C][8];
          bool any = false;
#pragma unroll
          for (int i = 0; i < 8; ++i) {
            float w0 = 0, w1 = 0;
            if (first + i < count) {
              const float2 exponents = ExponentsOf(batch.items[first + i].splat, lane);
              w0 = pixel0.Blend(exponents.x);
              if (row_step == 1) w1 = pixel1.Blend(exponents.y);
            }
            any |= w0 > 0 || w1 > 0;
#pragma unroll
            for (int c = 0; c < C; ++c) sums[c][i] = w0 * residual0[c] + w1 * residual1[c];
          }
          if (!__any_sync(kFullWarp, any)) continue;
          const int mine = first + (lane_id >> 2);
          const int row = mine < count ? batch.items[mine].payload : -1;
          to.Add<C, 4>(per_unit, row, [&](int c) { return ReduceEight(sums[c]); });
        }
      },
      [&] { return pixel0.IsOpen() || pixel1.IsOpen(); });
}

// The largest |residual| in the wanted rows of the tiles, a block each.
__global__ void __launch_bounds__(kTileThreads)
    LargestKernel(const int32_t* tile_ids, int tiles_x, int width, int height, uint16_t pixel_rows,
                  const float* residual, int channels, float* largest) {
  const int tile = tile_ids ? tile_ids[blockIdx.x] : int(blockIdx.x);
  const int x0 = tile % tiles_x * kTileSize, y0 = tile / tiles_x * kTileSize;
  const int row_values = min(kTileSize, width - x0) * channels;
  float found = 0;
  for (int y = int(threadIdx.x) / 32; y < min(kTileSize, height - y0); y += kWarps) {
    if (!(pixel_rows >> y & 1)) continue;
    const float* const row = residual + (int64_t(y0 + y) * width + x0) * channels;
    for (int i = int(threadIdx.x) % 32; i < row_values; i += 32) {
      found = LargerMagnitude(found, row[i]);
    }
  }
  RaiseLargest(found, largest);
}

template <int row_step>
__global__ void __launch_bounds__(kTileThreads)
    DepthKernel(TileLists lists, const int32_t* gaussians, DepthParams params) {
  struct Payload {
    float depth;
    bool left_out;
  };
  __shared__ Batch<Payload> batches[kWarps];
  const int index = lists.Index();
  const Lane lane = LaneOf<row_step>(lists, index);
  Pixel pixel0(lane.inside0), pixel1(lane.inside1);
  float sum0 = 0, sum1 = 0, median0 = 0, median1 = 0;
  const auto step = [&](float depth, float exponent, Pixel* pixel, float* sum, float* median) {
    const float before = pixel->left;
    *sum += pixel->Blend(exponent) * depth;
    if (before >= params.threshold && pixel->left < params.threshold) *median = depth;
  };
  WalkTile(
      lists, index, lane, &batches[threadIdx.x / 32],
      [&](int row, const Splat& splat, Payload* out) {
        *out = {splat.depth, params.left_out && params.left_out[gaussians[row]]};
      },
      [&](const Batch<Payload>& batch, int count) {
        for (int i = 0; i < count; ++i) {
          const auto item = batch.items[i];
          if (item.payload.left_out) continue;
          const float2 exponents = ExponentsOf(item.splat, lane);
          step(item.payload.depth, exponents.x, &pixel0, &sum0, &median0);
          if (row_step == 1) step(item.payload.depth, exponents.y, &pixel1, &sum1, &median1);
        }
      },
      [&] { return pixel0.IsOpen() || pixel1.IsOpen(); });
  const auto store = [&](int y, float left, float sum, float median) {
    const int64_t pixel = int64_t(y) * lists.width + lane.x;
    const float alpha = 1 - left;
    if (params.median) params.median[pixel] = median;
    if (params.expected) {
      params.expected[pixel] = alpha > 0 && alpha >= params.min_alpha ? sum / alpha : 0;
    }
    if (params.alpha) params.alpha[pixel] = alpha;
  };
  if (lane.inside0) store(lane.y0, pixel0.left, sum0, median0);
  if (lane.inside1) store(lane.y1, pixel1.left, sum1, median1);
}

}  // namespace

void Blend(const CudaViewGeometry& view, BlendParams params, cudaStream_t stream) {
  const int64_t pixels = int64_t(view.camera().width) * view.camera().height;
  if (view.is_region()) {
    params.background = nullptr;
    if (!params.keep_outside) {
      Check(cudaMemsetAsync(params.image, 0, size_t(pixels) * params.channels * sizeof(float),
                            stream),
            "cudaMemsetAsync");
    }
    if (params.alpha && !params.keep_outside) {
      Check(cudaMemsetAsync(params.alpha, 0, size_t(pixels) * sizeof(float), stream),
            "cudaMemsetAsync");
    }
  }
  if (view.has_weights()) return BlendWeights(view, params, stream);
  TileLists lists = ListsOf(view);
  Scratch<int32_t> wanted;
  if (params.tiles.data()) {
    wanted = Scratch<int32_t>(stream, params.tiles.size());
    Check(cudaMemcpyAsync(wanted.data(), params.tiles.data(), wanted.bytes(),
                          cudaMemcpyHostToDevice, stream),
          "cudaMemcpyAsync");
    lists.order = wanted.data();
    lists.tiles = int(wanted.size());
  }
  WithChannels(params.channels, [&](auto c) {
    if (lists.tiles == 0) return;
    if (view.is_region()) {
      BlendKernel<c(), true><<<lists.tiles, kTileThreads, 0, stream>>>(lists, params);
    } else {
      BlendKernel<c(), false><<<lists.tiles, kTileThreads, 0, stream>>>(lists, params);
    }
    Check(cudaGetLastError(), "BlendKernel");
  });
}

void BlendShares(const CudaViewGeometry& view, const BlendSharesParams& params,
                 cudaStream_t stream) {
  const TileLists lists = ListsOf(view);
  if (lists.tiles == 0) return;
  BlendSharesKernel<<<lists.tiles, kTileThreads, 0, stream>>>(lists, params);
  Check(cudaGetLastError(), "BlendSharesKernel");
}

void LargestOf(const CudaViewGeometry& view, const BlendTransposeParams& params, float* largest,
               cudaStream_t stream) {
  Check(cudaMemsetAsync(largest, 0, sizeof(float), stream), "cudaMemsetAsync");
  const int tiles = int(view.is_region() ? view.tile_ids.size() : view.ranges.size());
  if (tiles == 0) return;
  LargestKernel<<<tiles, kTileThreads, 0, stream>>>(
      view.is_region() ? view.tile_ids.data() : nullptr, view.tiles_x(), view.camera().width,
      view.camera().height, uint16_t(params.pixel_rows & view.pixel_rows()), params.residual,
      params.channels, largest);
  Check(cudaGetLastError(), "LargestKernel");
}

void BlendTranspose(const CudaViewGeometry& view, const BlendTransposeParams& params,
                    const FixedSums& sums, cudaStream_t stream) {
  if (view.has_weights()) return BlendWeightsTranspose(view, params, sums, stream);
  const TileLists lists = ListsOf(view);
  WithChannels(params.channels, [&](auto c) {
    if (lists.tiles == 0) return;
    if (IsEverySecondRow(params.pixel_rows)) {
      BlendTransposeKernel<c(), 2><<<lists.tiles, kTileThreads, 0, stream>>>(lists, params, sums);
    } else {
      BlendTransposeKernel<c(), 1><<<lists.tiles, kTileThreads, 0, stream>>>(lists, params, sums);
    }
    Check(cudaGetLastError(), "BlendTransposeKernel");
  });
}

// For a median along rays, the tile loop finds the number of a row in place of a depth.
Scratch<Splat> NumberedSplats(const CudaViewGeometry& view, cudaStream_t stream) {
  Scratch<Splat> numbered(stream, view.splats.size());
  const Splat* const from = view.splats.data();
  Splat* const to = numbered.data();
  ForEach(int64_t(view.splats.size()), stream, "NumberedSplats", [=] __device__(int64_t row) {
    to[row] = from[row];
    to[row].depth = __uint_as_float(unsigned(row) + kFirstNormal);
  });
  return numbered;
}

// From numbers to depths.
void FindAlongRays(const CudaViewGeometry& view, const DepthParams& params, cudaStream_t stream) {
  const CudaModel& model = Own(*params.along_rays);
  const CameraParams camera = view.camera();
  const int32_t* const gaussians = view.rows();
  const Splat* const splats = view.splats.data();
  const float* const means = model.means.data();
  const Covariance3* const covariances = model.covariances.data();
  float* const median = params.median;
  const uint16_t pixel_rows = params.pixel_rows;
  ForEach(
      int64_t(camera.width) * camera.height, stream, "FindAlongRays", [=] __device__(int64_t p) {
        const int x = int(p % camera.width), y = int(p / camera.width);
        if (!(pixel_rows >> (y % kTileSize) & 1) || median[p] == 0) return;
        const int64_t row = __float_as_uint(median[p]) - kFirstNormal;
        const int64_t g = gaussians[row];
        median[p] = DepthAlongRay(camera, {means[3 * g], means[3 * g + 1], means[3 * g + 2]},
                                  covariances[g], splats[row], float(x) + 0.5f, float(y) + 0.5f);
      });
}

void Depth(const CudaViewGeometry& view, const DepthParams& params, cudaStream_t stream) {
  TileLists lists = ListsOf(view);
  Scratch<Splat> numbered;
  const bool along_rays = params.along_rays && params.median;
  if (along_rays) {
    numbered = NumberedSplats(view, stream);
    lists.splats = numbered.data();
  }
  if (IsEverySecondRow(params.pixel_rows)) {
    DepthKernel<2><<<lists.tiles, kTileThreads, 0, stream>>>(lists, view.rows(), params);
  } else {
    DepthKernel<1><<<lists.tiles, kTileThreads, 0, stream>>>(lists, view.rows(), params);
  }
  Check(cudaGetLastError(), "DepthKernel");
  if (along_rays) FindAlongRays(view, params, stream);
}

}  // namespace retint::cuda
