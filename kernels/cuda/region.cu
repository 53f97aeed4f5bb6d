// SPDX-License-Identifier: BSD-3-Clause
// The part of a view that active Gaussians touch: their tiles only, each list cut after its last
// active entry, or, where memory allows, the active Gaussians' weights themselves.
#include <array>
#include <bit>
#include <utility>

#include "kernels/cuda/scan.cuh"
#include "kernels/cuda/weights.cuh"

namespace retint::cuda {
namespace {

constexpr int kThreads = 256;

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

// The part of the whole view's list that a region's tile walks.
__global__ void CutRangesKernel(int tiles, const int32_t* tile_ids, const int32_t* lengths,
                                const int2* whole, int2* ranges) {
  const int t = blockIdx.x * blockDim.x + threadIdx.x;
  if (t >= tiles) return;
  const int first = whole[tile_ids[t]].x;
  ranges[t] = {first, first + lengths[tile_ids[t]]};
}

__global__ void RowOfSplatKernel(int64_t rows, const int32_t* flags, const int32_t* ends,
                                 int32_t* row_of) {
  const int64_t r = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (r < rows) row_of[r] = flags[r] ? ends[r] - 1 : -1;
}

__global__ void HasWeightsKernel(int tiles, const uint32_t* counts, uint8_t* flags) {
  const int t = blockIdx.x * blockDim.x + threadIdx.x;
  if (t >= tiles) return;
  uint32_t sum = 0;
  for (int quarter = 0; quarter < kWarps; ++quarter) sum += counts[kWarps * t + quarter];
  flags[t] = sum > 0;
}

// Keeps the tiles `kept` of a region; the dropped ones have no entries, so sums over them stand.
__global__ void KeepTilesKernel(int tiles, const int32_t* kept, const int32_t* old_ids,
                                const int2* old_ranges, const uint32_t* old_ends, int32_t* ids,
                                int2* ranges, uint32_t* ends) {
  const int t = blockIdx.x * blockDim.x + threadIdx.x;
  if (t >= tiles) return;
  const int from = kept[t];
  ids[t] = old_ids[from];
  ranges[t] = old_ranges[from];
  for (int quarter = 0; quarter < kWarps; ++quarter) {
    ends[kWarps * t + quarter] = old_ends[kWarps * from + quarter];
  }
}

__global__ void RegionRangesKernel(int tiles, const int32_t* lengths, const int32_t* tile_ids,
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

// The first results of restricting a view. Arrays over the view's rows, or its grid's tiles.
struct Restriction {
  Scratch<int32_t> flags, row_ends;  // [rows] 1 for active ones and the running sum of it
  Scratch<int32_t> lengths;          // [grid] entries up to the last active one
  int tiles = 0;                     // of the region; their ids are in region->tile_ids
};

Restriction FindTiles(const CudaViewGeometry& view, const uint8_t* active, CudaViewGeometry* region,
                      cudaStream_t stream) {
  const int64_t rows = view.num_rows();
  const int grid_tiles = view.tiles_x() * view.tiles_y();
  Restriction found;
  found.flags = Scratch<int32_t>(stream, size_t(rows));
  found.row_ends = Scratch<int32_t>(stream, size_t(rows));
  ActiveRowsKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(rows, view.rows(), active,
                                                                    found.flags.data());
  Check(cudaGetLastError(), "ActiveRowsKernel");
  InclusiveSum(rows, found.flags.data(), found.row_ends.data(), stream);
  found.lengths = Scratch<int32_t>(stream, size_t(grid_tiles));
  TruncateKernel<<<Blocks(int64_t(grid_tiles) * 32, kThreads), kThreads, 0, stream>>>(
      grid_tiles, view.ranges.data(), view.entries.data(), found.flags.data(),
      found.lengths.data());
  Check(cudaGetLastError(), "TruncateKernel");
  Scratch<int32_t> ids(stream, size_t(grid_tiles)), selected(stream, 1);
  SelectIndices(grid_tiles, found.lengths.data(), ids.data(), selected.data(), stream);
  const auto [active_rows, tiles] =
      ReadBack(stream, found.row_ends.data() + rows - 1, selected.data());
  region->SetShape(view.camera(), active_rows);
  region->gaussians = Scratch<int32_t>(stream, size_t(active_rows));
  GatherRowsKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
      rows, found.flags.data(), found.row_ends.data(), view.rows(), region->gaussians.data());
  Check(cudaGetLastError(), "GatherRowsKernel");
  found.tiles = tiles;
  region->tile_ids = Scratch<int32_t>(stream, size_t(tiles));
  Check(cudaMemcpyAsync(region->tile_ids.data(), ids.data(), region->tile_ids.bytes(),
                        cudaMemcpyDeviceToDevice, stream),
        "cudaMemcpyAsync");
  return found;
}

// The explicit weights, thinned until they fit; false leaves the region as it was.
bool AddWeights(const CudaViewGeometry& view, const Restriction& found, size_t budget_bytes,
                float min_weight, CudaViewGeometry* region, cudaStream_t stream) {
  const int64_t rows = view.num_rows();
  const bool compact = min_weight > 0;
  Scratch<int32_t> row_of(stream, size_t(rows));
  RowOfSplatKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
      rows, found.flags.data(), found.row_ends.data(), row_of.data());
  Check(cudaGetLastError(), "RowOfSplatKernel");
  int tiles = found.tiles;
  Scratch<int2> ranges(stream, size_t(tiles));
  CutRangesKernel<<<Blocks(tiles, kThreads), kThreads, 0, stream>>>(
      tiles, region->tile_ids.data(), found.lengths.data(), view.ranges.data(), ranges.data());
  Check(cudaGetLastError(), "CutRangesKernel");
  TileLists lists{view.splats.data(),
                  view.entries.data(),
                  ranges.data(),
                  region->tile_ids.data(),
                  row_of.data(),
                  view.camera().width,
                  view.camera().height,
                  view.tiles_x(),
                  tiles,
                  nullptr};
  WeightChoice choice{min_weight, 1, compact};
  size_t level = 0;
  if (compact) {
    using Counts = std::array<uint32_t, kNumRowThinnings>;
    Scratch<Counts> counts(stream, 1);
    Check(cudaMemsetAsync(counts.data(), 0, counts.bytes(), stream), "cudaMemsetAsync");
    SampleWeights(lists, min_weight, counts.data()->data(), stream);
    const auto sampled = std::get<0>(ReadBack(stream, counts.data()));
    const std::array<uint64_t, kNumRowThinnings> quarters = {sampled[0], sampled[1], sampled[2],
                                                             sampled[3]};
    level = ChooseRowThinning(quarters.data(), Blocks(tiles, kThinningStride), size_t(tiles),
                              size_t(region->num_rows()), budget_bytes);
  }
  const size_t quarters = size_t(tiles) * kWarps;
  Scratch<float> factors(stream, quarters * kQuarter * kQuarter);
  Scratch<uint32_t> counts(stream, quarters), ends(stream, quarters);
  Scratch<uint8_t> has_weights(stream, size_t(tiles));
  Scratch<int32_t> kept(stream, size_t(tiles)), selected(stream, 1);
  for (; level < kNumThinnings; ++level) {
    const Thinning& thinning = kThinnings[level];
    choice.min_weight = thinning.min_weight * min_weight;
    choice.row_step = kTileSize / std::popcount(thinning.pixel_rows);
    CountWeights(lists, choice, counts.data(), factors.data(), stream);
    InclusiveSum(int64_t(quarters), counts.data(), ends.data(), stream);
    HasWeightsKernel<<<Blocks(tiles, kThreads), kThreads, 0, stream>>>(tiles, counts.data(),
                                                                       has_weights.data());
    Check(cudaGetLastError(), "HasWeightsKernel");
    SelectIndices(tiles, has_weights.data(), kept.data(), selected.data(), stream);
    const auto [total, remaining] = ReadBack(stream, ends.data() + quarters - 1, selected.data());
    const int left = compact ? remaining : tiles;
    const size_t bytes = region->gaussians.bytes() + size_t(left) * sizeof(int32_t) +
                         WeightBytes(left, total, choice);
    if (bytes > budget_bytes) {
      if (!compact) return false;
      continue;
    }
    Scratch<int32_t> ids(stream, size_t(left));
    Scratch<int2> left_ranges(stream, size_t(left));
    Scratch<uint32_t> left_ends(stream, size_t(left) * kWarps);
    if (left < tiles && left > 0) {
      KeepTilesKernel<<<Blocks(left, kThreads), kThreads, 0, stream>>>(
          left, kept.data(), region->tile_ids.data(), ranges.data(), ends.data(), ids.data(),
          left_ranges.data(), left_ends.data());
      Check(cudaGetLastError(), "KeepTilesKernel");
    }
    if (left < tiles) {
      region->tile_ids = std::move(ids);
      ranges = std::move(left_ranges);
      ends = std::move(left_ends);
      lists.tile_ids = region->tile_ids.data();
      lists.ranges = ranges.data();
      lists.tiles = left;
    }
    region->SetPixelRows(thinning.pixel_rows);
    StoreWeights(lists, choice, left < tiles ? kept.data() : nullptr, factors.data(),
                 std::move(ends), total, region, stream);
    return true;
  }
  return false;
}

// Copies the cut lists with the splats that they name.
void CopyLists(const CudaViewGeometry& view, const Restriction& found, CudaViewGeometry* region,
               cudaStream_t stream) {
  const int64_t rows = view.num_rows();
  const int grid_tiles = view.tiles_x() * view.tiles_y(), tiles = found.tiles;
  Scratch<int32_t> ends(stream, size_t(grid_tiles));
  InclusiveSum(grid_tiles, found.lengths.data(), ends.data(), stream);
  const int64_t entries = std::get<0>(ReadBack(stream, ends.data() + grid_tiles - 1));
  region->ranges = Scratch<int2>(stream, size_t(tiles));
  RegionRangesKernel<<<Blocks(tiles, kThreads), kThreads, 0, stream>>>(
      tiles, found.lengths.data(), region->tile_ids.data(), ends.data(), region->ranges.data());
  Check(cudaGetLastError(), "RegionRangesKernel");
  region->entries = Scratch<int32_t>(stream, size_t(entries));
  Scratch<int32_t> used(stream, size_t(rows)), used_ends(stream, size_t(rows));
  Check(cudaMemsetAsync(used.data(), 0, used.bytes(), stream), "cudaMemsetAsync");
  CopyEntriesKernel<<<Blocks(int64_t(tiles) * 32, kThreads), kThreads, 0, stream>>>(
      tiles, region->tile_ids.data(), region->ranges.data(), view.ranges.data(),
      view.entries.data(), region->entries.data(), used.data());
  Check(cudaGetLastError(), "CopyEntriesKernel");
  InclusiveSum(rows, used.data(), used_ends.data(), stream);
  const int64_t splats = std::get<0>(ReadBack(stream, used_ends.data() + rows - 1));
  region->splats = Scratch<Splat>(stream, size_t(splats));
  region->splat_rows = Scratch<int32_t>(stream, size_t(splats));
  CompactSplatsKernel<<<Blocks(rows, kThreads), kThreads, 0, stream>>>(
      rows, used.data(), used_ends.data(), found.flags.data(), found.row_ends.data(),
      view.splats.data(), region->splats.data(), region->splat_rows.data());
  Check(cudaGetLastError(), "CompactSplatsKernel");
  RenameKernel<<<Blocks(entries, kThreads), kThreads, 0, stream>>>(entries, used_ends.data(),
                                                                   region->entries.data());
  Check(cudaGetLastError(), "RenameKernel");
}

}  // namespace

std::shared_ptr<CudaViewGeometry> RestrictTo(const CudaViewGeometry& view, const uint8_t* active,
                                             size_t budget_bytes, float min_weight,
                                             cudaStream_t stream) {
  auto region = std::make_shared<CudaViewGeometry>(stream);
  region->SetRegion();
  region->SetShape(view.camera(), 0);
  if (view.num_rows() == 0) return region;
  const Restriction found = FindTiles(view, active, region.get(), stream);
  if (found.tiles == 0) return region;
  if (budget_bytes == 0 ||
      !AddWeights(view, found, budget_bytes, min_weight, region.get(), stream)) {
    CopyLists(view, found, region.get(), stream);
  }
  return region;
}

std::span<const int32_t> CudaViewGeometry::tiles() const {
  std::call_once(tiles_once_, [&] {
    if (is_region()) {
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
