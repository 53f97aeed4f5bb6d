// SPDX-License-Identifier: BSD-3-Clause
// The lists of tiles by way of bins, which are 8x4 tiles: a splat enters a few bins, bins are
// sorted, and the list of each bin is dealt out to its tiles. Every step is stable.
#include "kernels/cuda/tile_lists.cuh"

#include <stdexcept>
#include <string>

#include <thrust/iterator/transform_iterator.h>
#include <cub/block/block_scan.cuh>

namespace retint::cuda {
namespace {

constexpr int kThreads = 256;

// How many bins the row of an order bounds.
struct BinsOf {
  const BinBox* boxes;
  __device__ uint32_t operator()(int32_t row) const { return uint32_t(boxes[row].count()); }
};

// The last of `count` ascending numbers that is at most `value`; the first one is. By a warp.
__device__ int LastUpTo(const uint32_t* numbers, int count, uint32_t value) {
  const int lane = threadIdx.x % 32;
  int low = 0;
  for (int span = count; span > 1;) {
    const int step = (span + 31) / 32;
    const bool is_up_to = lane * step < span && numbers[low + lane * step] <= value;
    low += (31 - __clz(__ballot_sync(kFullWarp, is_up_to))) * step;
    span = min(step, count - low);
  }
  return low;
}

// Writes the bins of the rows in the order of depths, `begins` saying where those of each begin. A
// block has so many entries, not rows: one row may have one entry and the next a thousand.
constexpr int kEmitted = 1024;
__global__ void __launch_bounds__(kThreads)
    EmitKernel(int rows, uint32_t entries, const int32_t* order, const uint32_t* begins,
               const BinBox* boxes, int bin_columns, uint16_t* bins, int32_t* bin_rows) {
  __shared__ uint32_t begin_of[kEmitted];
  __shared__ BinBox box_of[kEmitted];
  __shared__ int32_t row_of[kEmitted];
  const uint32_t first = blockIdx.x * kEmitted, end = min(first + kEmitted, entries);
  const int first_row = LastUpTo(begins, rows, first);
#pragma unroll
  for (int i = threadIdx.x; i < kEmitted; i += kThreads) {
    const uint32_t begin = first_row + i < rows ? begins[first_row + i] : entries;
    begin_of[i] = begin;
    if (begin < end) {
      row_of[i] = order[first_row + i];
      box_of[i] = boxes[row_of[i]];
    }
  }
  __syncthreads();
  for (uint32_t at = first + threadIdx.x; at < end; at += kThreads) {
    int source = 0;  // the last that begins here or before
#pragma unroll
    for (int step = kEmitted / 2; step > 0; step /= 2) {
      if (begin_of[source + step] <= at) source += step;
    }
    const BinBox box = box_of[source];
    const int n = int(at - begin_of[source]), columns = box.columns(), row = n / columns;
    bins[at] = uint16_t((box.row() + row) * bin_columns + box.column() + n - row * columns);
    bin_rows[at] = row_of[source];
  }
}

// A bin's list is handled in segments of so many entries, a block each. Segments are numbered bin
// after bin.
constexpr int kSegment = kThreads, kSegmentWarps = kSegment / 32;

// The lists of bins: bin b's entries end before begins[b + 1], its segments before
// first_segments[b + 1].
struct BinLists {
  int count, columns;
  uint32_t* begins;          // [count + 1]
  uint32_t* first_segments;  // [count + 1]
  const int32_t* rows;       // [entries]
};

constexpr int kBinThreads = 1024;
__global__ void __launch_bounds__(kBinThreads)
    BinListsKernel(uint32_t entries, const uint16_t* bins, BinLists out) {
  using Scan = cub::BlockScan<uint32_t, kBinThreads>;
  __shared__ typename Scan::TempStorage storage;
  __shared__ uint32_t begins[kBinThreads + 1];
  // The first entry of a bin, by three looks at a time.
  const auto begin_of = [&](int bin) {
    uint32_t low = 0, high = entries;
    while (low < high) {
      const uint32_t quarter = (high - low) / 4;
      const uint32_t at[3] = {low + quarter, low + 2 * quarter, low + 3 * quarter};
      bool is_before[3];
#pragma unroll
      for (int i = 0; i < 3; ++i) is_before[i] = int(bins[at[i]]) < bin;
#pragma unroll
      for (int i = 2; i >= 0; --i) {
        if (!is_before[i]) high = at[i];
      }
#pragma unroll
      for (int i = 0; i < 3; ++i) {
        if (is_before[i]) low = at[i] + 1;
      }
    }
    return low;
  };
  uint32_t before = 0;
  for (int first = 0; first <= out.count; first += kBinThreads) {
    const int bin = first + int(threadIdx.x);
    begins[threadIdx.x] = begin_of(bin);
    if (threadIdx.x == 0) begins[kBinThreads] = begin_of(first + kBinThreads);
    __syncthreads();
    uint32_t segments = (begins[threadIdx.x + 1] - begins[threadIdx.x] + kSegment - 1) / kSegment,
             sum;
    Scan(storage).ExclusiveSum(segments, segments, sum);
    if (bin <= out.count) {
      out.begins[bin] = begins[threadIdx.x];
      out.first_segments[bin] = before + segments;
    }
    before += sum;
    __syncthreads();
  }
}

// The segment of a block.
struct Segment {
  int bin;
  uint32_t number, of;  // among the segments of the bin
  uint32_t first, end;  // entries
  // Where a number of tile `lane` of the bin stands: tile after tile, segment after segment.
  uint32_t first_slot;
  __device__ uint32_t Slot(int lane) const { return first_slot + uint32_t(lane) * of + number; }
};

// False behind the last segment. Every warp calls it.
__device__ bool FindSegment(const BinLists& lists, uint32_t block, Segment* out) {
  if (block >= lists.first_segments[lists.count]) return false;
  const int low = LastUpTo(lists.first_segments, lists.count, block);
  const uint32_t first = lists.first_segments[low];
  out->bin = low;
  out->number = block - first;
  out->of = lists.first_segments[low + 1] - first;
  out->first = lists.begins[low] + out->number * kSegment;
  out->end = min(lists.begins[low + 1], out->first + kSegment);
  out->first_slot = 32 * first;
  return true;
}

// Bit i of lane j to bit j of lane i ("Hacker's Delight", 7-3, with lanes for words).
__device__ uint32_t Transposed(uint32_t bits) {
  const int lane = threadIdx.x % 32;
  uint32_t mask = 0x0000ffff;
#pragma unroll
  for (int j = 16; j > 0; j /= 2, mask ^= mask << j) {
    const uint32_t other = __shfl_xor_sync(kFullWarp, bits, j);
    bits = lane & j ? (bits & ~mask) | (other >> j & mask) : (bits & mask) | (other & mask) << j;
  }
  return bits;
}

// The tiles of a bin that the splat reaches: bit kBinColumns * row + column.
__device__ uint32_t ReachedTiles(const TileGrid& grid, const Splat& splat, int bin_column,
                                 int bin_row) {
  const Ellipse ellipse = EllipseOf(splat);
  const int x0 = bin_column * kBinColumns, y0 = bin_row * kBinRows;
  const Pixels rows =
      PixelsWithin(splat.y - ellipse.half_height, splat.y + ellipse.half_height, grid.height);
  const int last_row = min(rows.last / kTileSize, y0 + kBinRows - 1);
  uint32_t tiles = 0;
  for (int row = max(rows.first / kTileSize, y0); row <= last_row; ++row) {
    const Pixels columns = ReachedColumns(grid, ellipse, PixelRowsOf(grid, row));
    const int first = max(columns.first / kTileSize - x0, 0);
    const int last = min(columns.last / kTileSize - x0, kBinColumns - 1);
    if (columns.first <= columns.last && first <= last) {
      tiles |= ((2u << (last - first)) - 1) << (first + kBinColumns * (row - y0));
    }
  }
  return tiles;
}

// The tiles that each entry of a bin reaches, and how many entries of each segment reach a tile.
__global__ void __launch_bounds__(kSegment)
    TilesOfBinsKernel(TileGrid grid, BinLists lists, const Splat* splats, uint32_t* tiles,
                      uint32_t* counts) {
  __shared__ uint32_t words[kSegmentWarps][32];
  Segment segment;
  if (!FindSegment(lists, blockIdx.x, &segment)) return;
  const uint32_t e = segment.first + threadIdx.x;
  uint32_t reached = 0;
  if (e < segment.end) {
    const float4* const from = reinterpret_cast<const float4*>(splats + lists.rows[e]);
    Splat splat;
    *reinterpret_cast<float4*>(&splat) = __ldg(from);
    *(reinterpret_cast<float4*>(&splat) + 1) = __ldg(from + 1);
    reached = ReachedTiles(grid, splat, segment.bin % lists.columns, segment.bin / lists.columns);
    tiles[e] = reached;
  }
  const int warp = threadIdx.x / 32, lane = threadIdx.x % 32;
  words[warp][lane] = Transposed(reached);
  __syncthreads();
  if (warp > 0) return;
  uint32_t count = 0;
#pragma unroll
  for (int w = 0; w < kSegmentWarps; ++w) count += __popc(words[w][lane]);
  counts[segment.Slot(lane)] = count;
}

// Writes the lists of tiles, through shared memory so that a tile's part is written side by side.
__global__ void __launch_bounds__(kSegment)
    TileListsKernel(BinLists lists, const uint32_t* tiles, const uint32_t* offsets,
                    int32_t* entries) {
  __shared__ uint32_t counts[kSegmentWarps][32], begins[kSegmentWarps][32], ends[32], to[32];
  __shared__ int32_t row_of[kSegment], of_tiles[kSegment * 32];
  Segment segment;
  if (!FindSegment(lists, blockIdx.x, &segment)) return;
  const uint32_t e = segment.first + threadIdx.x;
  const int warp = threadIdx.x / 32, lane = threadIdx.x % 32;
  if (e < segment.end) row_of[threadIdx.x] = lists.rows[e];
  const uint32_t entries_of_tile = Transposed(e < segment.end ? tiles[e] : 0);
  counts[warp][lane] = __popc(entries_of_tile);
  if (warp == 0) to[lane] = offsets[segment.Slot(lane)];
  __syncthreads();
  if (warp == 0) {
    uint32_t sum = 0;
#pragma unroll
    for (int w = 0; w < kSegmentWarps; ++w) sum += counts[w][lane];
    uint32_t end = sum;
    for (int shift = 1; shift < 32; shift *= 2) {
      const uint32_t before = __shfl_up_sync(kFullWarp, end, shift);
      if (lane >= shift) end += before;
    }
    ends[lane] = end;
    end -= sum;
#pragma unroll
    for (int w = 0; w < kSegmentWarps; ++w) {
      begins[w][lane] = end;
      end += counts[w][lane];
    }
  }
  __syncthreads();
  uint32_t at = begins[warp][lane];
  for (uint32_t left = entries_of_tile; left; left &= left - 1) {
    of_tiles[at++] = row_of[32 * warp + __ffs(left) - 1];
  }
  __syncthreads();
  for (int tile = warp; tile < 32; tile += kSegmentWarps) {
    const uint32_t begin = begins[0][tile], length = ends[tile] - begin;
    for (uint32_t i = lane; i < length; i += 32) entries[to[tile] + i] = of_tiles[begin + i];
  }
}

// Blocks start in order: tiles of many splats first leave no block that runs on alone at the end.
// They are sorted by classes of so many splats.
constexpr int kClasses = kTileClasses, kClassLength = 64;
__device__ int ClassOf(int2 range) {
  const int length = (range.y - range.x + kClassLength - 1) / kClassLength;
  return length < kClasses ? kClasses - 1 - length : 0;
}

// The list of every tile of the grid, their classes counted, and the number of their entries.
__global__ void __launch_bounds__(kThreads)
    TileRangesKernel(TileGrid grid, BinLists lists, const uint32_t* offsets, int2* ranges,
                     ViewCounts* counts) {
  __shared__ int32_t of_block[kClasses];
  if (threadIdx.x < kClasses) of_block[threadIdx.x] = 0;
  __syncthreads();
  const int tile = int(blockIdx.x * kThreads + threadIdx.x);
  uint32_t length = 0;
  if (tile < grid.tiles_x * grid.tiles_y) {
    const int x = tile % grid.tiles_x, y = tile / grid.tiles_x;
    const int bin = y / kBinRows * lists.columns + x / kBinColumns;
    const uint32_t first = lists.first_segments[bin], of = lists.first_segments[bin + 1] - first;
    const uint32_t* const begin =
        offsets + 32 * first + uint32_t(y % kBinRows * kBinColumns + x % kBinColumns) * of;
    length = begin[of] - begin[0];
    const int2 range = {int(begin[0]), int(begin[of])};
    ranges[tile] = range;
    atomicAdd(&of_block[ClassOf(range)], 1);
  }
  counts->listed.AddFromBlock(0, length);
  __syncthreads();
  if (threadIdx.x < kClasses && of_block[threadIdx.x]) {
    atomicAdd(counts->tiles + threadIdx.x, of_block[threadIdx.x]);
  }
}

__global__ void __launch_bounds__(kThreads)
    OrderTilesKernel(int tiles, const int2* ranges, ViewCounts* all, int32_t* order) {
  __shared__ int32_t counts[kClasses], begins[kClasses];
  if (threadIdx.x < kClasses) counts[threadIdx.x] = 0;
  __syncthreads();
  const int tile = int(blockIdx.x * kThreads + threadIdx.x);
  int of = 0, number = 0;
  if (tile < tiles) {
    of = ClassOf(ranges[tile]);
    number = atomicAdd(&counts[of], 1);
  }
  __syncthreads();
  if (threadIdx.x < kClasses) {
    int32_t begin = atomicAdd(all->placed + threadIdx.x, counts[threadIdx.x]);
    for (int i = 0; i < int(threadIdx.x); ++i) begin += all->tiles[i];
    begins[threadIdx.x] = begin;
  }
  __syncthreads();
  if (tile < tiles) order[begins[of] + number] = tile;
}

}  // namespace

void MakeTileLists(const int32_t* depth_order, const BinBox* boxes, int64_t bin_entries,
                   ViewCounts* counts, CudaViewGeometry* view, cudaStream_t stream) {
  const TileGrid grid(view->camera());
  const BinGrid bins(grid);
  const int tiles = grid.tiles_x * grid.tiles_y;
  const int64_t number_of_rows = view->num_rows();
  const size_t number = size_t(bin_entries);
  const Scratch<uint16_t> keys(stream, 2 * number);
  uint16_t* const sorted = keys.data() + number;
  const Scratch<int32_t> values(stream, 3 * number);
  int32_t* const rows = values.data() + number;
  auto* const reached = reinterpret_cast<uint32_t*>(rows + number);
  {
    const Scratch<uint32_t> begins(stream, size_t(number_of_rows));
    WithTemporary(stream, "cub::DeviceScan", [&](void* memory, size_t& bytes) {
      return cub::DeviceScan::ExclusiveSum(
          memory, bytes, thrust::make_transform_iterator(depth_order, BinsOf{boxes}), begins.data(),
          number_of_rows, stream);
    });
    EmitKernel<<<Blocks(bin_entries, kEmitted), kThreads, 0, stream>>>(
        int(number_of_rows), uint32_t(bin_entries), depth_order, begins.data(), boxes, bins.columns,
        keys.data(), values.data());
    Check(cudaGetLastError(), "EmitKernel");
  }
  WithTemporary(stream, "cub::DeviceRadixSort", [&](void* memory, size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, keys.data(), sorted, values.data(), rows,
                                           bin_entries, 0, BitsOf(uint32_t(bins.count() - 1)),
                                           stream);
  });
  const unsigned most_segments = Blocks(bin_entries, kSegment) + unsigned(bins.count());
  const size_t slots = size_t(most_segments) * 32 + 1;  // one more, for the end of the last list
  const size_t ends = size_t(bins.count()) + 1;
  const Scratch<uint32_t> numbers(stream, 2 * ends + 2 * slots);
  const BinLists lists{bins.count(), bins.columns, numbers.data(), numbers.data() + ends, rows};
  uint32_t* const lengths = numbers.data() + 2 * ends;
  uint32_t* const offsets = lengths + slots;
  BinListsKernel<<<1, kBinThreads, 0, stream>>>(uint32_t(bin_entries), sorted, lists);
  Check(cudaGetLastError(), "BinListsKernel");
  TilesOfBinsKernel<<<most_segments, kSegment, 0, stream>>>(grid, lists, view->splats.data(),
                                                            reached, lengths);
  Check(cudaGetLastError(), "TilesOfBinsKernel");
  WithTemporary(stream, "cub::DeviceScan", [&](void* memory, size_t& bytes) {
    return cub::DeviceScan::ExclusiveSum(memory, bytes, lengths, offsets, int64_t(slots), stream);
  });
  TileRangesKernel<<<Blocks(tiles, kThreads), kThreads, 0, stream>>>(grid, lists, offsets,
                                                                     view->ranges.data(), counts);
  Check(cudaGetLastError(), "TileRangesKernel");
  const HostWords<ViewTotals> found;
  Tell(&counts->listed, found, stream);
  view->order = Scratch<int32_t>(stream, size_t(tiles));
  OrderTilesKernel<<<Blocks(tiles, kThreads), kThreads, 0, stream>>>(tiles, view->ranges.data(),
                                                                     counts, view->order.data());
  Check(cudaGetLastError(), "OrderTilesKernel");
  const auto entries = int64_t(found.Wait(stream, &ViewTotals::told).entries);
  if (entries > INT32_MAX) {
    throw std::length_error("the view's tile lists have " + std::to_string(entries) +
                            " entries, more than 2^31");
  }
  view->entries = Scratch<int32_t>(stream, size_t(entries));
  TileListsKernel<<<most_segments, kSegment, 0, stream>>>(lists, reached, offsets,
                                                          view->entries.data());
  Check(cudaGetLastError(), "TileListsKernel");
}

}  // namespace retint::cuda
