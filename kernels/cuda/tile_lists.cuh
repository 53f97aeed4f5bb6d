// SPDX-License-Identifier: BSD-3-Clause
// From projected splats to the lists of tiles. ReachedRows() and ReachedColumns() of
// common/tiles.h in single precision, and the bins of tiles that lists are sorted in.
#pragma once

#include "kernels/common/tiles.h"
#include "kernels/cuda/geometry.cuh"
#include "kernels/cuda/scan.cuh"

namespace retint::cuda {

// The ellipse alpha >= kMinAlpha of a splat, as Reach is, about its centre (x, y). Row dy of it has
// its middle at lean * dy, and is middle * sqrt(1 - (dy / half_height)^2) wide to either side.
struct Ellipse {
  float x, y;  // pixels
  float lean, middle, half_width, half_height;
  float tip;  // dy of the rightmost point; the leftmost is at -tip
};

__device__ inline Ellipse EllipseOf(const Splat& splat) {
  const float room = splat.log2_opacity - kLog2MinAlpha + 1e-3f;
  // Of a needle, both products are nearly the same.
  const double det = 4 * double(splat.a) * double(splat.c) - double(splat.b) * double(splat.b);
  const float ratio = 4 * room / float(det);
  Ellipse out;
  out.x = splat.x, out.y = splat.y;
  out.lean = -0.5f * splat.b / splat.a;
  out.middle = sqrtf(-room / splat.a);
  out.half_width = sqrtf(-splat.c * ratio);
  out.half_height = sqrtf(-splat.a * ratio);
  out.tip = -0.5f * splat.b * out.half_width / splat.c;
  return out;
}

inline constexpr float kTileSlackOfFloats = 2e-3f;  // pixels; more than a coordinate's rounding

// Pixels [first, last] of [0, size) whose centres lie in [low, high]; last < first if none does.
struct Pixels {
  int first, last;
};
__device__ inline Pixels PixelsWithin(float low, float high, int size) {
  return {max(0, __float2int_ru(low - 0.5f - kTileSlackOfFloats)),
          min(size - 1, __float2int_rd(high - 0.5f + kTileSlackOfFloats))};
}

// Columns of pixels that the ellipse reaches in `rows` of pixels.
__device__ inline Pixels ReachedColumns(const TileGrid& grid, const Ellipse& ellipse,
                                        const Pixels& rows) {
  const float top = float(rows.first) + 0.5f - ellipse.y - kTileSlackOfFloats;
  const float bottom = float(rows.last) + 0.5f - ellipse.y + kTileSlackOfFloats;
  const float dy0 = fmaxf(top, -ellipse.half_height), dy1 = fminf(bottom, ellipse.half_height);
  if (!(dy0 <= dy1)) return {0, -1};
  const float of_height = 1 / ellipse.half_height;
  const auto end = [&](float dy, float sign) {
    dy = fminf(fmaxf(dy, dy0), dy1);
    const float part = dy * of_height;
    return ellipse.lean * dy + sign * ellipse.middle * sqrtf(fmaxf(0.0f, 1 - part * part));
  };
  return PixelsWithin(ellipse.x + end(-ellipse.tip, -1), ellipse.x + end(ellipse.tip, 1),
                      grid.width);
}

// Rows of pixels in row `row` of tiles.
__device__ inline Pixels PixelRowsOf(const TileGrid& grid, int row) {
  return {row * kTileSize, min(row * kTileSize + kTileSize, grid.height) - 1};
}

// A bin is 8x4 tiles, a bit or a lane each. Bins are numbered by rows.
inline constexpr int kBinColumns = 8, kBinRows = 4;
static_assert(kBinColumns * kBinRows == 32);

struct BinGrid {
  int columns, rows;
  __host__ __device__ explicit BinGrid(const TileGrid& tiles)
      : columns((tiles.tiles_x + kBinColumns - 1) / kBinColumns),
        rows((tiles.tiles_y + kBinRows - 1) / kBinRows) {}
  __host__ __device__ int count() const { return columns * rows; }
};

// The bins that bound a splat, in a word: columns and rows of the first and the last one.
struct BinBox {
  uint32_t word;

  __device__ int column() const { return int(word & 0xff); }
  __device__ int row() const { return int(word >> 8 & 0xff); }
  __device__ int columns() const { return int(word >> 16 & 0xff) - column() + 1; }
  __device__ int count() const { return columns() * (int(word >> 24) - row() + 1); }
};
inline constexpr int kMostBins = 256;  // across and down

// False if the ellipse reaches no tile.
__device__ inline bool BoundingBins(const TileGrid& grid, const Ellipse& ellipse, BinBox* box) {
  const Pixels rows =
      PixelsWithin(ellipse.y - ellipse.half_height, ellipse.y + ellipse.half_height, grid.height);
  if (rows.last < rows.first) return false;
  const int first_row = rows.first / kTileSize, last_row = rows.last / kTileSize;
  // A small one may lie between the centres of pixels, and then in one row of tiles or two.
  Pixels columns = ReachedColumns(grid, ellipse, rows);
  bool reaches = columns.first <= columns.last;
  if (reaches && last_row <= first_row + 1) {
    const Pixels up = ReachedColumns(grid, ellipse, PixelRowsOf(grid, first_row));
    reaches = up.first <= up.last;
    if (!reaches) {
      const Pixels down = ReachedColumns(grid, ellipse, PixelRowsOf(grid, last_row));
      reaches = down.first <= down.last;
    }
  }
  constexpr int kWidth = kBinColumns * kTileSize;
  box->word = uint32_t(columns.first / kWidth) | uint32_t(first_row / kBinRows) << 8 |
              uint32_t(columns.last / kWidth) << 16 | uint32_t(last_row / kBinRows) << 24;
  return reaches;
}

inline constexpr int kTileClasses = 64;

// What the kernels of a view add to, in device memory; 0 at first.
struct ViewCounts {
  ViewTotals projected, listed;  // entries: of the lists of bins, of the lists of tiles
  int32_t tiles[kTileClasses];   // in each class of lengths
  int32_t placed[kTileClasses];  // of them, in order
};

void Tell(const ViewTotals* totals, const HostWords<ViewTotals>& host, cudaStream_t stream);

// The tile lists of a whole view, whose rows and splats are there. `depth_order`: its rows by
// (depth, index); `boxes` of its rows, with `bin_entries` bins in all.
void MakeTileLists(const int32_t* depth_order, const BinBox* boxes, int64_t bin_entries,
                   ViewCounts* counts, CudaViewGeometry* view, cudaStream_t stream);

}  // namespace retint::cuda
