// SPDX-License-Identifier: BSD-3-Clause
// Projects, culls, sorts by (depth, index) and bins into tiles.
#include <stdexcept>
#include <string>

#include "kernels/common/tiles.h"
#include "kernels/cuda/geometry.cuh"
#include "kernels/cuda/ordered_scan.cuh"
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

// Of a CudaModel.
struct Gaussians {
  const float4* mean_opacity;
  const Covariance3* covariances;
  bool compensate;
};

__device__ bool Project(const CameraParams& camera, const Gaussians& model, int64_t g, Splat* splat,
                        Reach* reach) {
  const float4 mean_opacity = model.mean_opacity[g];
  if (!ProjectGaussian(camera, {mean_opacity.x, mean_opacity.y, mean_opacity.z},
                       model.covariances[g], mean_opacity.w, model.compensate, splat)) {
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

// The strips (rows of tiles) that the splats of a warp reach, one splat a lane. A splat of few
// strips is handled by its lane: one(strip, first column, last column). A splat of many strips is
// handled by the whole warp, 32 strips at a time, one a lane. Every lane then calls all(whether the
// splat is this lane's, strip, first, last), with last = first - 1 if the lane has no strip.
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

// Behind every depth, which is positive and finite: invisible Gaussians sort last.
constexpr uint32_t kBehindAll = 0x7fffffff;

// The outputs of CountTilesKernel. For each Gaussian: the number of tiles that it reaches (0: not
// visible), its depth as sortable bits, and its index. Also zeroes the sums of later kernels.
struct Counted {
  uint32_t *tiles, *depths;
  int32_t* indices;
  int2* ranges;  // [grid_tiles] zeroed
  int grid_tiles;
  ScanState scan;  // zeroed
  ViewTotals *totals, *found;
};

__global__ void __launch_bounds__(kThreads)
    CountTilesKernel(int64_t count, CameraParams camera, Gaussians model, Counted out) {
  const int64_t g = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  for (int64_t i = g; i < out.grid_tiles; i += int64_t(gridDim.x) * blockDim.x) {
    out.ranges[i] = {0, 0};
  }
  out.scan.Clear(g);
  Splat splat;
  Reach reach;
  TileRows strips{0, -1, 0, 0};
  if (g < count && Project(camera, model, g, &splat, &reach)) {
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
    out.tiles[g] = number;
    out.depths[g] = number ? __float_as_uint(splat.depth) : kBehindAll;
    out.indices[g] = int32_t(g);
  }
  __shared__ unsigned long long entries;
  if (threadIdx.x == 0) entries = 0;
  const int visible = __syncthreads_count(number > 0);
  const unsigned long long sum = WarpSum(number);
  if (threadIdx.x % 32 == 0 && sum) atomicAdd(&entries, sum);
  __syncthreads();
  if (threadIdx.x > 0) return;
  if (visible) {
    atomicAdd(&out.totals->rows, unsigned(visible));
    atomicAdd(&out.totals->entries, entries);
  }
  __threadfence();
  if (atomicAdd(&out.totals->blocks_done, 1u) + 1 < gridDim.x) return;
  // The last block tells the host and leaves zeroes for the next view.
  out.found->rows = atomicExch(&out.totals->rows, 0u);
  out.found->entries = atomicExch(&out.totals->entries, 0ull);
  out.totals->blocks_done = 0;
  __threadfence_system();
  *static_cast<volatile unsigned*>(&out.found->blocks_done) = 1;
}

// Depths are sorted without their last bits, a pass less. This puts those that only these tell
// apart in order: `order` and `sorted` are stable, so that of equal ones the first index is first.
// It takes time with the square of how many agree in the others: of many Gaussians all bits are
// sorted.
constexpr int kSkippedBits = 7;
constexpr int64_t kMostSettled = int64_t{4} << 20;
__global__ void SettleOrderKernel(int64_t rows, const uint32_t* sorted, const int32_t* order,
                                  int32_t* settled) {
  const int64_t r = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (r >= rows) return;
  const uint32_t depth = sorted[r], leading = depth >> kSkippedBits;
  int64_t to = r;
  for (int64_t i = r; i > 0; --i) {
    const uint32_t before = sorted[i - 1];
    if (before >> kSkippedBits != leading) break;
    if (before > depth) --to;
  }
  for (int64_t i = r + 1; i < rows; ++i) {
    const uint32_t behind = sorted[i];
    if (behind >> kSkippedBits != leading) break;
    if (behind < depth) ++to;
  }
  settled[to] = order[r];
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

// Rows in their final order: the splat of each, and where its entries end.
__global__ void __launch_bounds__(kThreads)
    RowsKernel(int64_t count, CameraParams camera, const int32_t* gaussians, Gaussians model,
               const uint32_t* tiles, ScanState scan, int32_t* rows, Splat* splats,
               uint32_t* ends) {
  const int block = scan.NextBlock();
  const int64_t r = int64_t(block) * kThreads + threadIdx.x;
  unsigned number = 0;
  if (r < count) {
    const int32_t g = gaussians[r];
    Splat splat;
    Reach reach;
    Project(camera, model, g, &splat, &reach);
    rows[r] = g;
    splats[r] = splat;
    number = tiles[g];
  }
  const uint32_t end = scan.InclusiveSum<kThreads>(block, number);
  if (r < count) ends[r] = end;
}

// (tile, row) pairs as keys and values, or as words with the row below: where both fit into 32 bits
// half the memory is moved.
template <typename Key>
struct Pairs {
  Key* keys;
  int32_t* rows;
  __device__ void Write(uint32_t at, int tile, int32_t row) const {
    keys[at] = Key(tile);
    rows[at] = row;
  }
};

struct Words {
  uint32_t* words;
  int row_bits;
  __device__ void Write(uint32_t at, int tile, int32_t row) const {
    words[at] = uint32_t(tile) << row_bits | uint32_t(row);
  }
};

// Writes the (tile, row) pairs of every row at its offset. Neighbours in depth go to different
// warps: those far away are large together.
template <typename Out>
__global__ void __launch_bounds__(kThreads)
    EmitKernel(int64_t count, CameraParams camera, const Splat* splats, const uint32_t* ends,
               Out out) {
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
          out.Write(offset, strip * grid.tiles_x + column, int32_t(r));
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
          out.Write(at, strip * grid.tiles_x + column, row);
        }
        const unsigned total = __shfl_sync(kFullWarp, end, 31);
        if (mine) offset += total;
      });
}

// First and end entry of every tile of the grid, zero where it has none; tile_of(e) is ascending.
template <typename TileOf>
__device__ void MarkRange(int64_t e, int64_t count, const TileOf& tile_of, int2* ranges) {
  const auto tile = tile_of(e);
  if (e == 0 || tile_of(e - 1) != tile) ranges[tile].x = int(e);
  if (e + 1 == count || tile_of(e + 1) != tile) ranges[tile].y = int(e + 1);
}

template <typename Key>
__global__ void TileRangesKernel(int64_t count, const Key* keys, int2* ranges) {
  const int64_t e = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (e < count)
    MarkRange(
        e, count, [&](int64_t i) { return keys[i]; }, ranges);
}

__global__ void UnpackKernel(int64_t count, const uint32_t* words, int row_bits, int32_t* entries,
                             int2* ranges) {
  const int64_t e = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (e >= count) return;
  entries[e] = int32_t(words[e] & ((1u << row_bits) - 1));
  MarkRange(
      e, count, [&](int64_t i) { return words[i] >> row_bits; }, ranges);
}

template <typename Out>
void Emit(const CudaViewGeometry& view, const uint32_t* ends, const Out& out, cudaStream_t stream) {
  EmitKernel<<<Blocks(view.num_rows(), kThreads), kThreads, 0, stream>>>(
      view.num_rows(), view.camera(), view.splats.data(), ends, out);
  Check(cudaGetLastError(), "EmitKernel");
}

template <typename Key>
void BinPairs(const uint32_t* ends, int64_t entries, int tile_bits, CudaViewGeometry* view,
              cudaStream_t stream) {
  Scratch<Key> keys(stream, size_t(entries)), sorted_keys(stream, size_t(entries));
  Scratch<int32_t> values(stream, size_t(entries));
  Emit(*view, ends, Pairs<Key>{keys.data(), values.data()}, stream);
  WithTemporary(stream, "cub::DeviceRadixSort", [&](void* memory, size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, keys.data(), sorted_keys.data(),
                                           values.data(), view->entries.data(), entries, 0,
                                           tile_bits, stream);
  });
  TileRangesKernel<Key><<<Blocks(entries, kThreads), kThreads, 0, stream>>>(
      entries, sorted_keys.data(), view->ranges.data());
  Check(cudaGetLastError(), "TileRangesKernel");
}

void BinWords(const uint32_t* ends, int64_t entries, int tile_bits, int row_bits,
              CudaViewGeometry* view, cudaStream_t stream) {
  Scratch<uint32_t> words(stream, size_t(entries)), sorted(stream, size_t(entries));
  Emit(*view, ends, Words{words.data(), row_bits}, stream);
  WithTemporary(stream, "cub::DeviceRadixSort", [&](void* memory, size_t& bytes) {
    return cub::DeviceRadixSort::SortKeys(memory, bytes, words.data(), sorted.data(), entries,
                                          row_bits, row_bits + tile_bits, stream);
  });
  UnpackKernel<<<Blocks(entries, kThreads), kThreads, 0, stream>>>(
      entries, sorted.data(), row_bits, view->entries.data(), view->ranges.data());
  Check(cudaGetLastError(), "UnpackKernel");
}

// The tile lists of a view whose entries end where `ends` says: stable, so in order of rows.
void BinRows(const uint32_t* ends, int64_t entries, CudaViewGeometry* view, cudaStream_t stream) {
  const int tile_bits = BitsOf(uint32_t(view->tiles_x() * view->tiles_y() - 1));
  const int row_bits = BitsOf(uint32_t(view->num_rows() - 1));
  view->entries = Scratch<int32_t>(stream, size_t(entries));
  if (tile_bits + row_bits <= 32) {
    BinWords(ends, entries, tile_bits, row_bits, view, stream);
  } else if (tile_bits <= 16) {
    BinPairs<uint16_t>(ends, entries, tile_bits, view, stream);
  } else {
    BinPairs<uint32_t>(ends, entries, tile_bits, view, stream);
  }
}

}  // namespace

std::unique_ptr<CudaModel> Upload(const GaussianArrays& host, cudaStream_t stream) {
  auto model = std::make_unique<CudaModel>(host);
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
  model->totals = Scratch<ViewTotals>(stream, 1);
  Check(cudaMemsetAsync(model->totals.data(), 0, sizeof(ViewTotals), stream), "cudaMemsetAsync");
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
  const int64_t n = model.count();
  if (n == 0) {
    Check(cudaMemsetAsync(view->ranges.data(), 0, view->ranges.bytes(), stream), "cudaMemsetAsync");
    return view;
  }

  Scratch<uint32_t> tiles(stream, size_t(n)), depths(stream, size_t(n)), sorted(stream, size_t(n));
  Scratch<int32_t> indices(stream, size_t(n)), order(stream, size_t(n));
  const Scratch<unsigned long long> scan_words(stream, ScanState::Words(Blocks(n, kThreads)));
  const ScanState scan(scan_words.data(), Blocks(n, kThreads));
  HostWords<ViewTotals> totals;
  const Gaussians gaussians{model.mean_opacity.data(), model.covariances.data(),
                            model.compensate()};
  CountTilesKernel<<<Blocks(n, kThreads), kThreads, 0, stream>>>(
      n, camera, gaussians,
      {tiles.data(), depths.data(), indices.data(), view->ranges.data(), grid_tiles, scan,
       model.totals.data(), totals.device()});
  Check(cudaGetLastError(), "CountTilesKernel");
  const bool settles = n <= kMostSettled;
  // All are sorted, so that the host need not wait for the number of visible ones first.
  WithTemporary(stream, "cub::DeviceRadixSort", [&](void* memory, size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, depths.data(), sorted.data(),
                                           indices.data(), order.data(), n,
                                           settles ? kSkippedBits : 0, 31, stream);
  });
  const ViewTotals found = totals.Wait(stream, &ViewTotals::blocks_done);
  const int64_t rows = found.rows, entries = int64_t(found.entries);
  view->SetShape(camera, rows);
  if (rows == 0) return view;
  if (entries > INT32_MAX) {
    throw std::length_error("the view's tile lists have " + std::to_string(entries) +
                            " entries, more than 2^31");
  }
  view->gaussians = Scratch<int32_t>(stream, size_t(rows));
  view->splats = Scratch<Splat>(stream, size_t(rows));
  Scratch<uint32_t> ends(stream, size_t(rows));
  if (settles) {
    SettleOrderKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
        rows, sorted.data(), order.data(), indices.data());
    Check(cudaGetLastError(), "SettleOrderKernel");
  }
  RowsKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
      rows, camera, settles ? indices.data() : order.data(), gaussians, tiles.data(), scan,
      view->gaussians.data(), view->splats.data(), ends.data());
  Check(cudaGetLastError(), "RowsKernel");
  BinRows(ends.data(), entries, view.get(), stream);
  view->order = Scratch<int32_t>(stream, size_t(grid_tiles));
  OrderTilesKernel<<<1, kOrderThreads, 0, stream>>>(grid_tiles, view->ranges.data(),
                                                    view->order.data());
  Check(cudaGetLastError(), "OrderTilesKernel");
  return view;
}

}  // namespace retint::cuda
