// SPDX-License-Identifier: BSD-3-Clause
// Projects, culls, sorts by (depth, index) and bins into tiles. Every step works on fixed pieces in
// order, so the result does not depend on the number of threads.
#include <algorithm>
#include <bit>
#include <cmath>
#include <new>
#include <utility>

#include <hwy/cache_control.h>

#include "base/parallel.h"
#include "kernels/common/tiles.h"
#include "kernels/cpu/geometry.h"
#include "kernels/cpu/reached_tiles.h"

namespace retint {
namespace {

constexpr int64_t kPiece = 8192;  // Gaussians a task

struct VisibleSplat {
  int32_t gaussian;
  uint32_t first_tile, num_tiles;  // in Piece::tiles
  Splat splat;
};

// The visible Gaussians of one piece of the model and the tiles that each reaches.
struct Piece {
  std::vector<VisibleSplat> visible;
  std::vector<int32_t> tiles;
};

// Finds the tiles with a pixel center inside the ellipse alpha >= kMinAlpha.
class TileFinder {
 public:
  explicit TileFinder(const TileGrid& grid)
      : grid_(grid), first_(size_t(grid.tiles_y + kRowSlack)), last_(first_.size()) {}

  void Append(const Reach& reach, double x, double y, std::vector<int32_t>* tiles) {
    const TileRows rows = ReachedRows(grid_, reach, y);
    if (rows.first > rows.last) return;
    reached_columns_(grid_, reach, x, y, rows, first_.data(), last_.data());
    for (int row = rows.first; row <= rows.last; ++row) {
      const auto i = size_t(row - rows.first);
      for (int column = first_[i]; column <= last_[i]; ++column) {
        tiles->push_back(row * grid_.tiles_x + column);
      }
    }
  }

 private:
  const TileGrid& grid_;
  const ReachedColumnsFunction reached_columns_ = ReachedColumnsOfTarget();
  std::vector<int32_t> first_, last_;  // of a splat's rows
};

Piece ProjectPiece(const CpuModel& model, const CameraParams& camera, const TileGrid& grid,
                   int64_t begin, int64_t end) {
  Piece piece;
  TileFinder finder(grid);
  for (int64_t g = begin; g < end; ++g) {
    const float* mean = &model.means[size_t(g) * 3];
    VisibleSplat visible{};
    Splat& splat = visible.splat;
    if (!ProjectGaussian(camera, {mean[0], mean[1], mean[2]}, model.covariances[size_t(g)],
                         model.opacities[size_t(g)], model.compensate(), &splat)) {
      continue;
    }
    const Reach reach = ReachOf(splat);
    splat.half_height = float(reach.half_height);
    const size_t first = piece.tiles.size();
    finder.Append(reach, splat.x, splat.y, &piece.tiles);
    if (piece.tiles.size() == first) continue;
    visible.gaussian = int32_t(g);
    visible.first_tile = uint32_t(first);
    visible.num_tiles = uint32_t(piece.tiles.size() - first);
    piece.visible.push_back(visible);
  }
  return piece;
}

// Sorts (key, value) pairs by key, stably: least significant digit first, 11 bits at a time.
void RadixSort(std::vector<std::pair<uint32_t, uint32_t>>* items) {
  std::vector<std::pair<uint32_t, uint32_t>> other(items->size());
  for (int shift = 0; shift < 32; shift += 11) {
    uint32_t begin[2048] = {};
    for (const auto& item : *items) ++begin[item.first >> shift & 2047];
    uint32_t sum = 0;
    for (uint32_t& count : begin) sum += std::exchange(count, sum);
    for (const auto& item : *items) other[begin[item.first >> shift & 2047]++] = item;
    items->swap(other);
  }
}

// Where each visible splat lies.
struct Located {
  const VisibleSplat* splat;
  const int32_t* tiles;
  uint32_t num_tiles;
};

// In order of depth splats lie anywhere in memory.
constexpr int64_t kAhead = 8;  // rows

void PrefetchRow(const std::vector<Located>& rows, int64_t row) {
  if (row + kAhead < int64_t(rows.size())) hwy::Prefetch(rows[size_t(row + kAhead)].tiles);
}

std::vector<Located> SortedByDepth(const std::vector<Piece>& pieces) {
  std::vector<Located> located;
  std::vector<std::pair<uint32_t, uint32_t>> keys;
  for (const Piece& piece : pieces) {
    for (const VisibleSplat& visible : piece.visible) {
      // The bits of positive floats sort as the floats do.
      keys.emplace_back(std::bit_cast<uint32_t>(visible.splat.depth), uint32_t(located.size()));
      located.push_back({&visible, piece.tiles.data() + visible.first_tile, visible.num_tiles});
    }
  }
  RadixSort(&keys);
  std::vector<Located> sorted(located.size());
  for (size_t i = 0; i < keys.size(); ++i) sorted[i] = located[keys[i].second];
  return sorted;
}

// A stable counting sort of (row, tile) pairs by tile, in blocks of rows.
void BinRows(const std::vector<Located>& rows, int num_tiles, CpuViewGeometry* view) {
  const int64_t num_rows = int64_t(rows.size());
  view->row_begin.resize(size_t(num_rows) + 1);
  int64_t total = 0;
  for (int64_t r = 0; r < num_rows; ++r) {
    view->row_begin[size_t(r)] = total;
    total += rows[size_t(r)].num_tiles;
  }
  view->row_begin[size_t(num_rows)] = total;
  if (total >= int64_t(kNoSlot)) throw std::bad_alloc();

  const int64_t block = std::max<int64_t>(kPiece, (num_rows + 31) / 32);
  const int64_t blocks = (num_rows + block - 1) / block;
  std::vector<std::vector<uint32_t>> cursors(static_cast<size_t>(blocks));
  ParallelTasks(blocks, [&](int64_t b) {
    auto& counts = cursors[size_t(b)];
    counts.assign(size_t(num_tiles), 0);
    for (int64_t r = b * block; r < std::min(num_rows, (b + 1) * block); ++r) {
      const Located& row = rows[size_t(r)];
      PrefetchRow(rows, r);
      for (uint32_t i = 0; i < row.num_tiles; ++i) ++counts[size_t(row.tiles[i])];
    }
  });
  uint32_t sum = 0;
  view->tile_begin.push_back(0);
  for (int tile = 0; tile < num_tiles; ++tile) {
    const uint32_t before = sum;
    for (auto& counts : cursors) sum += std::exchange(counts[size_t(tile)], sum);
    if (sum == before) continue;
    view->tile_ids.push_back(tile);
    view->tile_begin.push_back(int64_t(sum));
  }
  view->entries.resize(size_t(total));
  view->slots.resize(size_t(total));
  ParallelTasks(blocks, [&](int64_t b) {
    auto& cursor = cursors[size_t(b)];
    for (int64_t r = b * block; r < std::min(num_rows, (b + 1) * block); ++r) {
      const Located& row = rows[size_t(r)];
      PrefetchRow(rows, r);
      uint32_t slot = uint32_t(view->row_begin[size_t(r)]);
      for (uint32_t i = 0; i < row.num_tiles; ++i) {
        const uint32_t entry = cursor[size_t(row.tiles[i])]++;
        view->entries[entry] = int32_t(r);
        view->slots[entry] = slot++;
      }
    }
  });
}

}  // namespace

size_t CpuViewGeometry::bytes() const {
  const auto size = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  size_t total = sizeof(*this) + size(row_gaussians) + size(splats) + size(splat_rows) +
                 size(tile_ids) + size(tile_begin) + size(entries) + size(slots) + size(row_begin);
  for (const WeightTile& tile : weights) total += tile.bytes();
  return total;
}

std::shared_ptr<const ViewGeometry> PrepareViewOnCpu(const CpuModel& model,
                                                     const CameraParams& camera) {
  auto view = std::make_shared<CpuViewGeometry>();
  view->SetShape(camera, 0);
  const TileGrid grid(camera);
  const int64_t num_pieces = (model.count() + kPiece - 1) / kPiece;
  std::vector<Piece> pieces(static_cast<size_t>(num_pieces));
  ParallelTasks(num_pieces, [&](int64_t i) {
    pieces[size_t(i)] =
        ProjectPiece(model, camera, grid, i * kPiece, std::min(model.count(), (i + 1) * kPiece));
  });
  const std::vector<Located> sorted = SortedByDepth(pieces);
  view->SetShape(camera, int64_t(sorted.size()));
  view->row_gaussians.resize(sorted.size());
  view->splats.resize(sorted.size());
  ParallelRanges(int64_t(sorted.size()), kPiece, [&](int64_t begin, int64_t end) {
    for (size_t r = size_t(begin); r < size_t(end); ++r) {
      if (r + kAhead < sorted.size()) hwy::Prefetch(sorted[r + kAhead].splat);
      view->row_gaussians[r] = sorted[r].splat->gaussian;
      view->splats[r] = sorted[r].splat->splat;
    }
  });
  BinRows(sorted, grid.tiles_x * grid.tiles_y, view.get());
  return view;
}

}  // namespace retint
