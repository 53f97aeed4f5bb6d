// SPDX-License-Identifier: BSD-3-Clause
// Projects, culls, sorts by (depth, index) and bins into tiles.
#include <stdexcept>
#include <string>

#include "kernels/common/tiles.h"
#include "kernels/cuda/geometry.cuh"
#include "kernels/cuda/scan.cuh"

namespace retint::cuda {
namespace {

constexpr int kThreads = 256;

__global__ void ActivateKernel(int64_t count, const float* means, const float* quats,
                               const float* log_scales, const float* logits, float4* mean_opacity,
                               Covariance3* covariances) {
  const int64_t g = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (g >= count) return;
  covariances[g] = CovarianceOf(quats + 4 * g, log_scales + 3 * g);
  mean_opacity[g] = {means[3 * g], means[3 * g + 1], means[3 * g + 2], Sigmoid(logits[g])};
}

__device__ bool Project(const CameraParams& camera, const float4& mean_opacity,
                        const Covariance3& covariance, Splat* splat, Reach* reach) {
  if (!ProjectGaussian(camera, {mean_opacity.x, mean_opacity.y, mean_opacity.z}, covariance,
                       mean_opacity.w, splat)) {
    return false;
  }
  *reach = ReachOf(*splat);
  splat->half_height = float(reach->half_height);
  return true;
}

__device__ unsigned WarpSum(unsigned value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_add_sync(kFullWarp, value);
#else
  for (int offset = 16; offset > 0; offset /= 2) value += __shfl_xor_sync(kFullWarp, value, offset);
  return value;
#endif
}

// The strips (rows of tiles) that the splats of a warp reach, a splat a lane. A splat of few strips
// goes alone: one(strip, first column, last column). One of many gets the whole warp, a strip a
// lane and 32 at a time: all(whether the splat is this lane's, strip, first, last) is called by
// every lane, with last = first - 1 where the lane has no strip.
template <typename One, typename All>
__device__ void ForStrips(const CameraParams& camera, const Splat& splat, const Reach& reach,
                          const TileRows& strips, const One& one, const All& all) {
  constexpr int kFew = 4;
  struct Large {
    Reach reach;
    TileRows strips;
    float x, y;
  };
  __shared__ Large shared[kThreads / 32];
  Large& large = shared[threadIdx.x / 32];
  const TileGrid grid(camera);
  const int number = strips.last - strips.first + 1, lane = threadIdx.x % 32;
  int first, last;
  if (number <= kFew) {
    for (int strip = strips.first; strip <= strips.last; ++strip) {
      if (ReachedColumns(grid, reach, splat.x, splat.y, strips, strip, &first, &last)) {
        one(strip, first, last);
      }
    }
  }
  unsigned pending = __ballot_sync(kFullWarp, number > kFew);
  while (pending) {
    const int source = __ffs(pending) - 1;
    pending &= pending - 1;
    if (lane == source) large = {reach, strips, splat.x, splat.y};
    __syncwarp();
    for (int begin = large.strips.first; begin <= large.strips.last; begin += 32) {
      const int strip = begin + lane;
      if (strip > large.strips.last || !ReachedColumns(grid, large.reach, large.x, large.y,
                                                       large.strips, strip, &first, &last)) {
        first = 0, last = -1;
      }
      all(lane == source, strip, first, last);
    }
    __syncwarp();
  }
}

// Behind every depth, which is positive and finite: what is not visible sorts last.
constexpr uint32_t kBehindAll = 0x7fffffff;

// Of a view, found by CountTilesKernel.
struct Totals {
  unsigned rows, padding;
  unsigned long long entries;
};

// How many tiles each Gaussian reaches (0: not visible), its depth as sortable bits, and the sums.
__global__ void __launch_bounds__(kThreads)
    CountTilesKernel(int64_t count, CameraParams camera, const float4* mean_opacity,
                     const Covariance3* covariances, uint32_t* tiles, uint32_t* depths,
                     int32_t* indices, Totals* totals) {
  const int64_t g = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  Splat splat;
  Reach reach;
  TileRows strips{0, -1, 0, 0};
  if (g < count && Project(camera, mean_opacity[g], covariances[g], &splat, &reach)) {
    strips = ReachedRows(TileGrid(camera), reach, splat.y);
  }
  unsigned number = 0;
  ForStrips(
      camera, splat, reach, strips,
      [&](int, int first, int last) { number += unsigned(last - first + 1); },
      [&](bool mine, int, int first, int last) {
        const unsigned sum = WarpSum(unsigned(last - first + 1));
        if (mine) number += sum;
      });
  if (g < count) {
    tiles[g] = number;
    depths[g] = number ? __float_as_uint(splat.depth) : kBehindAll;
    indices[g] = int32_t(g);
  }
  const int visible = __syncthreads_count(number > 0);
  const unsigned long long sum = WarpSum(number);
  if (threadIdx.x % 32 == 0 && sum) atomicAdd(&totals->entries, sum);
  if (threadIdx.x == 0 && visible) atomicAdd(&totals->rows, unsigned(visible));
}

// Blocks start in order: tiles of many splats first leave no block that runs on alone at the end.
constexpr int kOrderThreads = 1024;
__global__ void __launch_bounds__(kOrderThreads)
    OrderTilesKernel(int tiles, const int2* ranges, int32_t* order) {
  constexpr int kClasses = 64, kLength = 64;  // classes of so many splats
  __shared__ int begin[kClasses];
  if (threadIdx.x < kClasses) begin[threadIdx.x] = 0;
  __syncthreads();
  const auto class_of = [&](int tile) {
    const int2 range = ranges[tile];
    const int length = (range.y - range.x + kLength - 1) / kLength;
    return length < kClasses ? kClasses - 1 - length : 0;
  };
  for (int tile = threadIdx.x; tile < tiles; tile += kOrderThreads) {
    atomicAdd(&begin[class_of(tile)], 1);
  }
  __syncthreads();
  if (threadIdx.x == 0) {
    int sum = 0;
    for (int i = 0; i < kClasses; ++i) {
      const int count = begin[i];
      begin[i] = sum;
      sum += count;
    }
  }
  __syncthreads();
  for (int tile = threadIdx.x; tile < tiles; tile += kOrderThreads) {
    order[atomicAdd(&begin[class_of(tile)], 1)] = tile;
  }
}

// Rows in their final order: the splat of each and the number of its tiles.
__global__ void RowsKernel(int64_t count, CameraParams camera, const int32_t* gaussians,
                           const float4* mean_opacity, const Covariance3* covariances,
                           const uint32_t* tiles, int32_t* rows, Splat* splats, uint32_t* counts) {
  const int64_t r = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (r >= count) return;
  const int32_t g = gaussians[r];
  Splat splat;
  Reach reach;
  Project(camera, mean_opacity[g], covariances[g], &splat, &reach);
  rows[r] = g;
  splats[r] = splat;
  counts[r] = tiles[g];
}

// Writes the (tile, row) pairs of every row at its offset. Neighbours in depth go to different
// warps: those far away are large together.
template <typename Key>
__global__ void __launch_bounds__(kThreads)
    EmitKernel(int64_t count, CameraParams camera, const Splat* splats, const uint32_t* ends,
               Key* keys, int32_t* rows) {
  const int64_t thread = int64_t(blockIdx.x) * kThreads + threadIdx.x;
  const int64_t warps = int64_t(gridDim.x) * (kThreads / 32);
  const int lane = threadIdx.x % 32;
  const int64_t r = lane * warps + thread / 32;
  const TileGrid grid(camera);
  uint32_t offset = 0;
  Splat splat;
  Reach reach;
  TileRows strips{0, -1, 0, 0};
  if (r < count) {
    offset = r ? ends[r - 1] : 0;
    splat = splats[r];
    reach = ReachOf(splat);
    strips = ReachedRows(grid, reach, splat.y);
  }
  ForStrips(
      camera, splat, reach, strips,
      [&](int strip, int first, int last) {
        for (int column = first; column <= last; ++column, ++offset) {
          keys[offset] = Key(strip * grid.tiles_x + column);
          rows[offset] = int32_t(r);
        }
      },
      [&](bool mine, int strip, int first, int last) {
        const int source = __ffs(__ballot_sync(kFullWarp, mine)) - 1;
        const auto row = int32_t(__shfl_sync(kFullWarp, r, source));
        const unsigned length = unsigned(last - first + 1);
        unsigned end = length;
        for (int shift = 1; shift < 32; shift *= 2) {
          const unsigned before = __shfl_up_sync(kFullWarp, end, shift);
          if (lane >= shift) end += before;
        }
        uint32_t at = __shfl_sync(kFullWarp, offset, source) + end - length;
        for (int column = first; column <= last; ++column, ++at) {
          keys[at] = Key(strip * grid.tiles_x + column);
          rows[at] = row;
        }
        const unsigned total = __shfl_sync(kFullWarp, end, 31);
        if (mine) offset += total;
      });
}

// First and end entry of every tile of the grid; zero-initialised by the caller.
template <typename Key>
__global__ void TileRangesKernel(int64_t count, const Key* keys, int2* ranges) {
  const int64_t e = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (e >= count) return;
  const Key tile = keys[e];
  if (e == 0 || keys[e - 1] != tile) ranges[tile].x = int(e);
  if (e + 1 == count || keys[e + 1] != tile) ranges[tile].y = int(e + 1);
}

template <typename Key>
void BinRows(const CameraParams& camera, const uint32_t* ends, int64_t rows, int64_t entries,
             int grid_tiles, CudaViewGeometry* view, cudaStream_t stream) {
  Scratch<Key> keys(stream, size_t(entries)), sorted_keys(stream, size_t(entries));
  Scratch<int32_t> values(stream, size_t(entries));
  view->entries = Scratch<int32_t>(stream, size_t(entries));
  EmitKernel<Key><<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
      rows, camera, view->splats.data(), ends, keys.data(), values.data());
  Check(cudaGetLastError(), "EmitKernel");
  WithTemporary(stream, "cub::DeviceRadixSort", [&](void* memory, size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, keys.data(), sorted_keys.data(),
                                           values.data(), view->entries.data(), entries, 0,
                                           BitsOf(uint32_t(grid_tiles - 1)), stream);
  });
  TileRangesKernel<Key><<<Blocks(entries, kThreads), kThreads, 0, stream>>>(
      entries, sorted_keys.data(), view->ranges.data());
  Check(cudaGetLastError(), "TileRangesKernel");
}

}  // namespace

std::unique_ptr<CudaModel> Upload(const GaussianArrays& host, cudaStream_t stream) {
  auto model = std::make_unique<CudaModel>(host.count, host.sh_degree);
  const size_t n = size_t(host.count), k = size_t(model->num_sh_coeffs());
  const auto copy = [&](const float* from, size_t count) {
    Scratch<float> to(stream, count);
    Check(cudaMemcpyAsync(to.data(), from, count * sizeof(float), cudaMemcpyHostToDevice, stream),
          "cudaMemcpyAsync");
    return to;
  };
  model->means = copy(host.means, 3 * n);
  model->coefficients = copy(host.sh, 3 * k * n);
  const auto quats = copy(host.quats_wxyz, 4 * n), scales = copy(host.log_scales, 3 * n);
  const auto logits = copy(host.opacity_logits, n);
  model->mean_opacity = Scratch<float4>(stream, n);
  model->covariances = Scratch<Covariance3>(stream, n);
  if (n > 0) {
    ActivateKernel<<<Blocks(host.count, kThreads), kThreads, 0, stream>>>(
        host.count, model->means.data(), quats.data(), scales.data(), logits.data(),
        model->mean_opacity.data(), model->covariances.data());
    Check(cudaGetLastError(), "ActivateKernel");
  }
  Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
  return model;
}

std::shared_ptr<CudaViewGeometry> Prepare(const CudaModel& model, const CameraParams& camera,
                                          cudaStream_t stream) {
  auto view = std::make_shared<CudaViewGeometry>(stream);
  view->SetShape(camera, 0);
  const int grid_tiles = view->tiles_x() * view->tiles_y();
  view->ranges = Scratch<int2>(stream, size_t(grid_tiles));
  Check(cudaMemsetAsync(view->ranges.data(), 0, view->ranges.bytes(), stream), "cudaMemsetAsync");
  const int64_t n = model.count();
  if (n == 0) return view;

  Scratch<uint32_t> tiles(stream, size_t(n)), depths(stream, size_t(n)), sorted(stream, size_t(n));
  Scratch<int32_t> indices(stream, size_t(n)), order(stream, size_t(n));
  Scratch<Totals> totals(stream, 1);
  Check(cudaMemsetAsync(totals.data(), 0, sizeof(Totals), stream), "cudaMemsetAsync");
  CountTilesKernel<<<Blocks(n, kThreads), kThreads, 0, stream>>>(
      n, camera, model.mean_opacity.data(), model.covariances.data(), tiles.data(), depths.data(),
      indices.data(), totals.data());
  Check(cudaGetLastError(), "CountTilesKernel");
  // All are sorted, so that the host need not wait for the number of visible ones first.
  const PendingReadBack<Totals> pending(stream, totals.data());
  WithTemporary(stream, "cub::DeviceRadixSort", [&](void* memory, size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, depths.data(), sorted.data(),
                                           indices.data(), order.data(), n, 0, 31, stream);
  });
  const Totals found = pending.Wait();
  const int64_t rows = found.rows, entries = int64_t(found.entries);
  view->SetShape(camera, rows);
  if (rows == 0) return view;
  if (entries > INT32_MAX) {
    throw std::length_error("the view's tile lists have " + std::to_string(entries) +
                            " entries, more than 2^31");
  }
  view->gaussians = Scratch<int32_t>(stream, size_t(rows));
  view->splats = Scratch<Splat>(stream, size_t(rows));
  Scratch<uint32_t> counts(stream, size_t(rows)), ends(stream, size_t(rows));
  RowsKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
      rows, camera, order.data(), model.mean_opacity.data(), model.covariances.data(), tiles.data(),
      view->gaussians.data(), view->splats.data(), counts.data());
  Check(cudaGetLastError(), "RowsKernel");
  InclusiveSum(rows, counts.data(), ends.data(), stream);
  if (grid_tiles <= 65536) {
    BinRows<uint16_t>(camera, ends.data(), rows, entries, grid_tiles, view.get(), stream);
  } else {
    BinRows<uint32_t>(camera, ends.data(), rows, entries, grid_tiles, view.get(), stream);
  }
  view->order = Scratch<int32_t>(stream, size_t(grid_tiles));
  OrderTilesKernel<<<1, kOrderThreads, 0, stream>>>(grid_tiles, view->ranges.data(),
                                                    view->order.data());
  Check(cudaGetLastError(), "OrderTilesKernel");
  return view;
}

}  // namespace retint::cuda
