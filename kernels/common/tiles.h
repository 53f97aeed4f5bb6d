// SPDX-License-Identifier: BSD-3-Clause
// Which tiles a splat reaches: exactly those with a pixel centre inside its ellipse alpha >=
// kMinAlpha.
#pragma once

#include <cmath>

#include "kernels/common/macros.h"
#include "kernels/common/projection.h"
#include "kernels/common/types.h"

namespace retint {

struct TileGrid {
  int width, height;  // pixels
  int tiles_x, tiles_y;

  RETINT_HD explicit TileGrid(const CameraParams& camera)
      : width(camera.width),
        height(camera.height),
        tiles_x((camera.width + kTileSize - 1) / kTileSize),
        tiles_y((camera.height + kTileSize - 1) / kTileSize) {}
};

inline constexpr double kTileSlack = 1e-3;  // pixels, for rounding

// Rows of tiles [first, last] and rows of pixels [top, bottom] within the image; none when first >
// last.
struct TileRows {
  int first, last;
  double top, bottom;
};

RETINT_HD TileRows ReachedRows(const TileGrid& grid, const Reach& reach, double y) {
  // Pixel p has its centre at p + 0.5.
  double top = std::ceil(y - reach.half_height - 0.5 - kTileSlack);
  double bottom = std::floor(y + reach.half_height - 0.5 + kTileSlack);
  top = top > 0 ? top : 0;
  bottom = bottom < grid.height - 1 ? bottom : grid.height - 1;
  if (!(top <= bottom)) return {0, -1, 0, -1};
  return {int(top) / kTileSize, int(bottom) / kTileSize, top, bottom};
}

// Columns of tiles [*first, *last] reached in tile row `row`; false if it reaches none.
RETINT_HD bool ReachedColumns(const TileGrid& grid, const Reach& reach, double x, double y,
                              const TileRows& rows, int row, int* first, int* last) {
  const double row_top = row * kTileSize, row_bottom = row * kTileSize + kTileSize - 1;
  const double dy0 = (row_top > rows.top ? row_top : rows.top) + 0.5 - y;
  const double dy1 = (row_bottom < rows.bottom ? row_bottom : rows.bottom) + 0.5 - y;
  double left, right;
  if (!StripExtent(reach, dy0 - kTileSlack, dy1 + kTileSlack, &left, &right)) return false;
  left = std::ceil(x + left - 0.5 - kTileSlack);
  right = std::floor(x + right - 0.5 + kTileSlack);
  left = left > 0 ? left : 0;
  right = right < grid.width - 1 ? right : grid.width - 1;
  if (!(left <= right)) return false;
  *first = int(left) / kTileSize;
  *last = int(right) / kTileSize;
  return true;
}

}  // namespace retint
