// SPDX-License-Identifier: BSD-3-Clause
// Projects, culls, sorts by (depth, index) and bins into tiles; the region of active Gaussians of a
// prepared view.
#include <thrust/iterator/counting_iterator.h>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>

#include <stdexcept>

#include "kernels/common/tiles.h"
#include "kernels/cuda/geometry.cuh"

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

// How many tiles each Gaussian reaches (0: not visible), and its depth as sortable bits.
__global__ void CountTilesKernel(int64_t count, CameraParams camera, const float4* mean_opacity,
                                 const Covariance3* covariances, uint32_t* tiles,
                                 uint32_t* depths) {
  const int64_t g = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (g >= count) return;
  Splat splat;
  Reach reach;
  uint32_t number = 0;
  if (Project(camera, mean_opacity[g], covariances[g], &splat, &reach)) {
    const TileGrid grid(camera);
    const TileRows rows = ReachedRows(grid, reach, splat.y);
    for (int row = rows.first; row <= rows.last; ++row) {
      int first, last;
      if (ReachedColumns(grid, reach, splat.x, splat.y, rows, row, &first, &last)) {
        number += uint32_t(last - first + 1);
      }
    }
    depths[g] = __float_as_uint(splat.depth);
  }
  tiles[g] = number;
}

__global__ void GatherKernel(int64_t count, const int32_t* indices, const uint32_t* from,
                             uint32_t* to) {
  const int64_t i = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < count) to[i] = from[indices[i]];
}

// Rows in their final order: the splat of each and the number of its tiles.
__global__ void RowsKernel(int64_t count, CameraParams camera, const int32_t* gaussians,
                           const float4* mean_opacity, const Covariance3* covariances,
                           const uint32_t* tiles, Splat* splats, uint32_t* counts) {
  const int64_t r = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (r >= count) return;
  const int32_t g = gaussians[r];
  Splat splat;
  Reach reach;
  Project(camera, mean_opacity[g], covariances[g], &splat, &reach);
  splats[r] = splat;
  counts[r] = tiles[g];
}

// Writes the (tile, row) pairs of every row at its offset. A splat of many tiles is written by its
// whole warp.
template <typename Key>
__global__ void EmitKernel(int64_t count, CameraParams camera, const Splat* splats,
                           const uint32_t* ends, Key* keys, int32_t* rows) {
  constexpr uint32_t kMany = 24;
  const int64_t r = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  const int lane = threadIdx.x & 31;
  const TileGrid grid(camera);
  uint32_t begin = 0, end = 0;
  if (r < count) {
    begin = r ? ends[r - 1] : 0;
    end = ends[r];
  }
  const bool many = end - begin > kMany;
  const auto write = [&](int64_t row, uint32_t offset, int first_lane, int lanes) {
    const Splat splat = splats[row];
    const Reach reach = ReachOf(splat);
    const TileRows strips = ReachedRows(grid, reach, splat.y);
    for (int strip = strips.first; strip <= strips.last; ++strip) {
      int first, last;
      if (!ReachedColumns(grid, reach, splat.x, splat.y, strips, strip, &first, &last)) continue;
      for (int column = first + first_lane; column <= last; column += lanes) {
        keys[offset + column - first] = Key(strip * grid.tiles_x + column);
        rows[offset + column - first] = int32_t(row);
      }
      offset += last - first + 1;
    }
  };
  if (end > begin && !many) write(r, begin, 0, 1);
  unsigned pending = __ballot_sync(kFullWarp, many);
  while (pending) {
    const int source = __ffs(pending) - 1;
    pending &= pending - 1;
    write(__shfl_sync(kFullWarp, r, source), __shfl_sync(kFullWarp, begin, source), lane, 32);
  }
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

// Runs a CUB algorithm with its temporary memory.
template <typename Call>
void WithTemporary(cudaStream_t stream, const char* name, const Call& call) {
  size_t bytes = 0;
  Check(call(nullptr, bytes), name);
  Scratch<char> memory(stream, bytes);
  Check(call(memory.data(), bytes), name);
}

template <typename T>
T ReadBack(const T* device, cudaStream_t stream) {
  T value;
  Check(cudaMemcpyAsync(&value, device, sizeof(T), cudaMemcpyDeviceToHost, stream),
        "cudaMemcpyAsync");
  Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
  return value;
}

// Indices of the set flags, ascending, and how many there are.
template <typename Flag>
int64_t SelectIndices(int64_t count, const Flag* flags, int32_t* indices, cudaStream_t stream) {
  Scratch<int64_t> selected(stream, 1);
  WithTemporary(stream, "cub::DeviceSelect", [&](void* memory, size_t& bytes) {
    return cub::DeviceSelect::Flagged(memory, bytes, thrust::counting_iterator<int32_t>(0), flags,
                                      indices, selected.data(), count, stream);
  });
  return ReadBack(selected.data(), stream);
}

template <typename T>
void InclusiveSum(int64_t count, const T* from, T* to, cudaStream_t stream) {
  WithTemporary(stream, "cub::DeviceScan", [&](void* memory, size_t& bytes) {
    return cub::DeviceScan::InclusiveSum(memory, bytes, from, to, count, stream);
  });
}

int BitsOf(uint32_t largest) {
  int bits = 1;
  while (largest >> bits) ++bits;
  return bits;
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

  Scratch<uint32_t> tiles(stream, size_t(n)), depths(stream, size_t(n));
  Scratch<int32_t> visible(stream, size_t(n));
  CountTilesKernel<<<Blocks(n, kThreads), kThreads, 0, stream>>>(
      n, camera, model.mean_opacity.data(), model.covariances.data(), tiles.data(), depths.data());
  Check(cudaGetLastError(), "CountTilesKernel");
  const int64_t rows = SelectIndices(n, tiles.data(), visible.data(), stream);
  view->SetShape(camera, rows);
  if (rows == 0) return view;

  Scratch<uint32_t> keys(stream, size_t(rows)), sorted(stream, size_t(rows));
  view->gaussians = Scratch<int32_t>(stream, size_t(rows));
  view->splats = Scratch<Splat>(stream, size_t(rows));
  GatherKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(rows, visible.data(), depths.data(),
                                                                keys.data());
  Check(cudaGetLastError(), "GatherKernel");
  // Depths are > 0, so bit 31 is clear.
  WithTemporary(stream, "cub::DeviceRadixSort", [&](void* memory, size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, keys.data(), sorted.data(),
                                           visible.data(), view->gaussians.data(), rows, 0, 31,
                                           stream);
  });
  Scratch<uint32_t> counts(stream, size_t(rows)), ends(stream, size_t(rows));
  RowsKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
      rows, camera, view->gaussians.data(), model.mean_opacity.data(), model.covariances.data(),
      tiles.data(), view->splats.data(), counts.data());
  Check(cudaGetLastError(), "RowsKernel");
  InclusiveSum(rows, counts.data(), ends.data(), stream);
  const int64_t entries = ReadBack(ends.data() + rows - 1, stream);
  if (grid_tiles <= 65536) {
    BinRows<uint16_t>(camera, ends.data(), rows, entries, grid_tiles, view.get(), stream);
  } else {
    BinRows<uint32_t>(camera, ends.data(), rows, entries, grid_tiles, view.get(), stream);
  }
  return view;
}

namespace {

__global__ void ActiveRowsKernel(int64_t rows, const int32_t* gaussians, const uint8_t* active,
                                 int32_t* flags) {
  const int64_t r = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (r < rows) flags[r] = active[gaussians[r]] ? 1 : 0;
}

// A warp a tile: how many of its entries remain up to the last active one (0: the tile is not
// visited).
__global__ void TruncateKernel(int tiles, const int2* ranges, const int32_t* entries,
                               const int32_t* row_flags, int32_t* lengths) {
  const int tile = int((int64_t(blockIdx.x) * blockDim.x + threadIdx.x) / 32);
  const int lane = threadIdx.x & 31;
  if (tile >= tiles) return;
  const int2 range = ranges[tile];
  int length = 0;
  for (int end = range.y; end > range.x && length == 0; end -= 32) {
    const int e = end - 32 + lane;
    const bool is_active = e >= range.x && row_flags[entries[e]];
    const unsigned set = __ballot_sync(kFullWarp, is_active);
    if (set) length = end - 32 + (31 - __clz(set)) - range.x + 1;
  }
  if (lane == 0) lengths[tile] = length;
}

__global__ void RegionRangesKernel(int tiles, const int32_t* tile_ids, const int32_t* lengths,
                                   const int32_t* ends, int2* ranges) {
  const int t = blockIdx.x * blockDim.x + threadIdx.x;
  if (t >= tiles) return;
  const int tile = tile_ids[t];
  ranges[t] = {ends[tile] - lengths[tile], ends[tile]};
}

// A warp a tile of the region: copies its entries and marks the splats that they name.
__global__ void CopyEntriesKernel(int tiles, const int32_t* tile_ids, const int2* ranges,
                                  const int2* whole_ranges, const int32_t* whole_entries,
                                  int32_t* entries, int32_t* used) {
  const int t = int((int64_t(blockIdx.x) * blockDim.x + threadIdx.x) / 32);
  if (t >= tiles) return;
  const int2 range = ranges[t];
  const int from = whole_ranges[tile_ids[t]].x - range.x;
  for (int e = range.x + int(threadIdx.x & 31); e < range.y; e += 32) {
    const int row = whole_entries[from + e];
    entries[e] = row;
    used[row] = 1;
  }
}

// Splats in use move to their rank; entries follow.
__global__ void CompactSplatsKernel(int64_t rows, const int32_t* used, const int32_t* used_ends,
                                    const int32_t* row_flags, const int32_t* row_ends,
                                    const Splat* from, Splat* to, int32_t* splat_rows) {
  const int64_t r = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (r >= rows || !used[r]) return;
  to[used_ends[r] - 1] = from[r];
  splat_rows[used_ends[r] - 1] = row_flags[r] ? row_ends[r] - 1 : -1;
}

__global__ void RenameKernel(int64_t entries, const int32_t* used_ends, int32_t* values) {
  const int64_t e = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (e < entries) values[e] = used_ends[values[e]] - 1;
}

__global__ void GatherRowsKernel(int64_t rows, const int32_t* flags, const int32_t* ends,
                                 const int32_t* from, int32_t* to) {
  const int64_t r = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (r < rows && flags[r]) to[ends[r] - 1] = from[r];
}

}  // namespace

std::shared_ptr<CudaViewGeometry> RestrictTo(const CudaViewGeometry& view, const uint8_t* active,
                                             cudaStream_t stream) {
  if (view.is_region) throw std::invalid_argument("a region cannot be restricted again");
  auto region = std::make_shared<CudaViewGeometry>(stream);
  region->is_region = true;
  region->SetShape(view.camera(), 0);
  const int64_t rows = view.num_rows();
  if (rows == 0) return region;
  const int grid_tiles = view.tiles_x() * view.tiles_y();

  Scratch<int32_t> flags(stream, size_t(rows)), row_ends(stream, size_t(rows));
  ActiveRowsKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(rows, view.rows(), active,
                                                                    flags.data());
  Check(cudaGetLastError(), "ActiveRowsKernel");
  InclusiveSum(rows, flags.data(), row_ends.data(), stream);
  Scratch<int32_t> lengths(stream, size_t(grid_tiles)), ends(stream, size_t(grid_tiles));
  Scratch<int32_t> tile_ids(stream, size_t(grid_tiles));
  TruncateKernel<<<Blocks(int64_t(grid_tiles) * 32, kThreads), kThreads, 0, stream>>>(
      grid_tiles, view.ranges.data(), view.entries.data(), flags.data(), lengths.data());
  Check(cudaGetLastError(), "TruncateKernel");
  InclusiveSum(grid_tiles, lengths.data(), ends.data(), stream);
  const int tiles = int(SelectIndices(grid_tiles, lengths.data(), tile_ids.data(), stream));
  const int64_t entries = ReadBack(ends.data() + grid_tiles - 1, stream);
  region->SetShape(view.camera(), ReadBack(row_ends.data() + rows - 1, stream));
  region->gaussians = Scratch<int32_t>(stream, size_t(region->num_rows()));
  GatherRowsKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
      rows, flags.data(), row_ends.data(), view.rows(), region->gaussians.data());
  Check(cudaGetLastError(), "GatherRowsKernel");
  if (tiles == 0) return region;

  region->tile_ids = Scratch<int32_t>(stream, size_t(tiles));
  Check(cudaMemcpyAsync(region->tile_ids.data(), tile_ids.data(), region->tile_ids.bytes(),
                        cudaMemcpyDeviceToDevice, stream),
        "cudaMemcpyAsync");
  region->ranges = Scratch<int2>(stream, size_t(tiles));
  RegionRangesKernel<<<Blocks(tiles, kThreads), kThreads, 0, stream>>>(
      tiles, tile_ids.data(), lengths.data(), ends.data(), region->ranges.data());
  Check(cudaGetLastError(), "RegionRangesKernel");
  region->entries = Scratch<int32_t>(stream, size_t(entries));
  Scratch<int32_t> used(stream, size_t(rows)), used_ends(stream, size_t(rows));
  Check(cudaMemsetAsync(used.data(), 0, used.bytes(), stream), "cudaMemsetAsync");
  CopyEntriesKernel<<<Blocks(int64_t(tiles) * 32, kThreads), kThreads, 0, stream>>>(
      tiles, tile_ids.data(), region->ranges.data(), view.ranges.data(), view.entries.data(),
      region->entries.data(), used.data());
  Check(cudaGetLastError(), "CopyEntriesKernel");
  InclusiveSum(rows, used.data(), used_ends.data(), stream);
  const int64_t splats = ReadBack(used_ends.data() + rows - 1, stream);
  region->splats = Scratch<Splat>(stream, size_t(splats));
  region->splat_rows = Scratch<int32_t>(stream, size_t(splats));
  CompactSplatsKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
      rows, used.data(), used_ends.data(), flags.data(), row_ends.data(), view.splats.data(),
      region->splats.data(), region->splat_rows.data());
  Check(cudaGetLastError(), "CompactSplatsKernel");
  RenameKernel<<<Blocks(entries, kThreads), kThreads, 0, stream>>>(entries, used_ends.data(),
                                                                   region->entries.data());
  Check(cudaGetLastError(), "RenameKernel");
  return region;
}

std::span<const int32_t> CudaViewGeometry::tiles() const {
  std::call_once(tiles_once_, [&] {
    if (is_region) {
      host_tiles_.resize(tile_ids.size());
      Check(cudaMemcpyAsync(host_tiles_.data(), tile_ids.data(), tile_ids.bytes(),
                            cudaMemcpyDeviceToHost, stream_),
            "cudaMemcpyAsync");
      Check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
      return;
    }
    std::vector<int2> host(ranges.size());
    Check(cudaMemcpyAsync(host.data(), ranges.data(), ranges.bytes(), cudaMemcpyDeviceToHost,
                          stream_),
          "cudaMemcpyAsync");
    Check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    for (size_t t = 0; t < host.size(); ++t) {
      if (host[t].y > host[t].x) host_tiles_.push_back(int32_t(t));
    }
  });
  return host_tiles_;
}

}  // namespace retint::cuda
