// SPDX-License-Identifier: BSD-3-Clause
// The part of a view that active Gaussians touch: their tiles only, each list cut after its last
// active entry, or, where memory allows, the active Gaussians' weights themselves.
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <utility>

#include "base/parallel.h"
#include "kernels/common/thinning.h"
#include "kernels/cpu/blend.h"

namespace retint {
namespace {

// The active Gaussians of a view in ascending order, as their coefficients lie in memory; returns
// each one's place by row of the view, -1 for the others.
std::vector<int32_t> ActiveRows(const CpuViewGeometry& view, const uint8_t* active,
                                LargeVector<int32_t>* gaussians) {
  std::vector<std::pair<int32_t, int32_t>> found;  // Gaussian, row of the view
  for (int32_t r = 0; r < int32_t(view.num_rows()); ++r) {
    const int32_t gaussian = view.row_gaussians[size_t(r)];
    if (active[gaussian]) found.emplace_back(gaussian, r);
  }
  std::sort(found.begin(), found.end());
  std::vector<int32_t> row_of(size_t(view.num_rows()), -1);
  gaussians->reserve(found.size());
  for (const auto& [gaussian, row] : found) {
    row_of[size_t(row)] = int32_t(gaussians->size());
    gaussians->push_back(gaussian);
  }
  return row_of;
}

// For every tile of `view`, the number of entries up to and with the last active one.
std::vector<int64_t> CutLists(const CpuViewGeometry& view, const std::vector<int32_t>& row_of) {
  std::vector<int64_t> lengths(view.tile_ids.size(), 0);
  ParallelRanges(int64_t(lengths.size()), 64, [&](int64_t begin, int64_t end) {
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      int64_t last = view.tile_begin[i + 1];
      while (last > view.tile_begin[i] && row_of[size_t(view.entries[size_t(last - 1)])] < 0) {
        --last;
      }
      lengths[i] = last - view.tile_begin[i];
    }
  });
  return lengths;
}

// Assigns slots to the entries of tiles, so that those of a row lie side by side in tile order.
// for_each(tile, visit) calls visit(row, &slot) for the tile's entries. A row of -1 has no slot.
template <typename ForEach>
void AssignSlots(int64_t num_rows, int64_t num_tiles, const ForEach& for_each,
                 LargeVector<int64_t>* row_begin) {
  constexpr int64_t kBlocks = 16;
  const int64_t block = std::max<int64_t>(64, (num_tiles + kBlocks - 1) / kBlocks);
  const int64_t blocks = (num_tiles + block - 1) / block;
  std::vector<std::vector<uint32_t>> cursors(static_cast<size_t>(blocks));
  const auto for_each_of = [&](int64_t b, const auto& visit) {
    for (int64_t i = b * block; i < std::min(num_tiles, (b + 1) * block); ++i) {
      for_each(size_t(i), visit);
    }
  };
  ParallelTasks(blocks, [&](int64_t b) {
    auto& counts = cursors[size_t(b)];
    counts.assign(size_t(num_rows), 0);
    for_each_of(b, [&](int32_t row, uint32_t*) {
      if (row >= 0) ++counts[size_t(row)];
    });
  });
  row_begin->resize(size_t(num_rows) + 1);
  int64_t sum = 0;
  for (size_t row = 0; row < size_t(num_rows); ++row) {
    (*row_begin)[row] = sum;
    for (auto& counts : cursors) sum += std::exchange(counts[row], uint32_t(sum));
  }
  row_begin->back() = sum;
  ParallelTasks(blocks, [&](int64_t b) {
    auto& cursor = cursors[size_t(b)];
    for_each_of(b, [&](int32_t row, uint32_t* slot) {
      *slot = row >= 0 ? cursor[size_t(row)]++ : kNoSlot;
    });
  });
}

// Bits of WeightEntry::half_rows that lie in `pixel_rows`.
uint32_t HalfRowsOf(uint16_t pixel_rows) {
  uint32_t half_rows = 0;
  for (int y = 0; y < kTileSize; ++y) {
    if (pixel_rows >> y & 1) half_rows |= 3u << (2 * y);
  }
  return half_rows;
}

// Explicit weights of tiles of a whole view, one tile at a time.
class WeightSource {
 public:
  WeightSource(const TileKernels& kernels, const CpuViewGeometry& view,
               const std::vector<int64_t>& lengths, const std::vector<int32_t>& row_of,
               const RegionBlend* blend)
      : kernels_(kernels), view_(view), lengths_(lengths), row_of_(row_of), blend_(blend) {}

  // Of the pixel rows asked for.
  void Exact(size_t tile, uint16_t pixel_rows, WeightTile* weights) const {
    alignas(64) float transmittance[kTilePixels];
    kernels_.weights(ListOf(tile, pixel_rows, weights, transmittance), nullptr, weights, nullptr,
                     transmittance);
  }
  // The same, with the blend of RegionBlend.
  void ExactAndBlend(size_t tile, uint16_t pixel_rows, WeightTile* weights) const {
    if (!blend_) return Exact(tile, pixel_rows, weights);
    alignas(64) float transmittance[kTilePixels];
    alignas(64) float sums[3 * kTilePixels] = {};
    TileList list = ListOf(tile, pixel_rows, weights, transmittance);
    list.count = view_.tile_begin[tile + 1] - view_.tile_begin[tile];
    kernels_.weights(list, blend_->colors, weights, sums, transmittance);
    StoreTile(view_, tile, pixel_rows, sums, 3, blend_->image);
  }
  // Which half rows of each entry Compact() keeps of all.
  void FindLarge(const WeightTile& weights, float min_weight,
                 std::vector<uint32_t>* half_rows) const {
    half_rows->resize(weights.entries.size());
    kernels_.large_half_rows(weights, min_weight, half_rows->data());
  }
  void Compact(const WeightTile& weights, const Thinning& thinning, float min_weight,
               WeightTile* compact) const {
    kernels_.compact(weights, thinning.min_weight * min_weight, HalfRowsOf(thinning.pixel_rows),
                     compact);
  }

 private:
  TileList ListOf(size_t tile, uint16_t pixel_rows, WeightTile* weights,
                  float* transmittance) const {
    TileList list = TileListOf(view_, tile);
    list.count = lengths_[tile];
    list.splat_rows = row_of_.data();
    InitTransmittance(view_.camera(), list.x0, list.y0, pixel_rows, transmittance);
    weights->entries.clear();
    weights->weights.clear();
    return list;
  }

  const TileKernels& kernels_;
  const CpuViewGeometry& view_;
  const std::vector<int64_t>& lengths_;
  const std::vector<int32_t>& row_of_;
  const RegionBlend* blend_;
};

// Exact weights of every region tile, or nothing when they exceed the budget (which does not depend
// on the order in which tiles finish).
std::vector<WeightTile> ExactWeights(const WeightSource& source, const std::vector<size_t>& tiles,
                                     size_t budget_bytes) {
  std::vector<WeightTile> weights(tiles.size());
  std::atomic<size_t> used{0};
  ParallelRanges(int64_t(tiles.size()), 4, [&](int64_t begin, int64_t end) {
    WeightTile work;
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      if (used.load(std::memory_order_relaxed) > budget_bytes) return;
      source.Exact(tiles[i], kAllPixelRows, &work);
      weights[i] = work;  // of exact size
      used.fetch_add(weights[i].bytes(), std::memory_order_relaxed);
    }
  });
  if (used.load() > budget_bytes) weights.clear();
  return weights;
}

// 8x8 quarters of a tile that hold any of an entry's half rows.
uint64_t CountQuarters(uint32_t half_rows) {
  constexpr uint32_t kQuarters[] = {0x5555, 0xaaaa, 0x55550000, 0xaaaa0000};
  uint64_t count = 0;
  for (const uint32_t quarter : kQuarters) count += (half_rows & quarter) != 0;
  return count;
}

size_t GuessThinning(const WeightSource& source, const std::vector<size_t>& tiles, float min_weight,
                     size_t rows, size_t budget_bytes) {
  const size_t samples = (tiles.size() + kThinningStride - 1) / kThinningStride;
  std::vector<std::array<uint64_t, kNumRowThinnings>> counts(samples);
  ParallelRanges(int64_t(samples), 4, [&](int64_t begin, int64_t end) {
    WeightTile exact;
    std::vector<uint32_t> large;
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      source.Exact(tiles[i * kThinningStride], kAllPixelRows, &exact);
      source.FindLarge(exact, min_weight, &large);
      counts[i] = {};
      for (size_t level = 0; level < kNumRowThinnings; ++level) {
        const uint32_t half_rows = HalfRowsOf(kThinnings[level].pixel_rows);
        for (const uint32_t of_entry : large) {
          counts[i][level] += CountQuarters(of_entry & half_rows);
        }
      }
    }
  });
  uint64_t sums[kNumRowThinnings] = {};
  for (const auto& sample : counts) {
    for (size_t level = 0; level < kNumRowThinnings; ++level) sums[level] += sample[level];
  }
  return ChooseRowThinning(sums, samples, tiles.size(), rows, budget_bytes);
}

size_t BytesOf(const std::vector<WeightTile>& tiles) {
  size_t bytes = 0;
  for (const WeightTile& tile : tiles) bytes += tile.bytes();
  return bytes;
}

// Compact weights of every region tile, thinned until they fit the budget, or nothing when they
// never do.
std::vector<WeightTile> CompactWeights(const WeightSource& source, const std::vector<size_t>& tiles,
                                       float min_weight, size_t budget_bytes, size_t rows,
                                       uint16_t* pixel_rows) {
  std::vector<WeightTile> weights(tiles.size());
  size_t level = GuessThinning(source, tiles, min_weight, rows, budget_bytes);
  ParallelRanges(int64_t(tiles.size()), 4, [&](int64_t begin, int64_t end) {
    WeightTile work;
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      source.ExactAndBlend(tiles[i], kThinnings[level].pixel_rows, &work);
      source.Compact(work, kThinnings[level], min_weight, &weights[i]);
    }
  });
  while (BytesOf(weights) > budget_bytes) {
    if (++level == kNumThinnings) return {};
    ParallelRanges(int64_t(tiles.size()), 16, [&](int64_t begin, int64_t end) {
      WeightTile thinner;
      for (size_t i = size_t(begin); i < size_t(end); ++i) {
        source.Compact(weights[i], kThinnings[level], min_weight, &thinner);
        std::swap(weights[i], thinner);
      }
    });
  }
  *pixel_rows = kThinnings[level].pixel_rows;
  return weights;
}

void DropEmptyTiles(std::vector<WeightTile>* weights, CpuViewGeometry* region) {
  size_t kept = 0;
  for (size_t i = 0; i < weights->size(); ++i) {
    if ((*weights)[i].entries.empty()) continue;
    region->tile_ids[kept] = region->tile_ids[i];
    if (kept != i) (*weights)[kept] = std::move((*weights)[i]);
    ++kept;
  }
  weights->resize(kept);
  region->tile_ids.resize(kept);
}

void AdoptWeights(std::vector<WeightTile> weights, CpuViewGeometry* region) {
  region->weights = std::move(weights);
  AssignSlots(
      region->num_rows(), int64_t(region->weights.size()),
      [&](size_t i, const auto& visit) {
        for (WeightEntry& entry : region->weights[i].entries) visit(entry.row, &entry.slot);
      },
      &region->row_begin);
}

// Copies the cut lists with the splats that they name.
void CopyLists(const CpuViewGeometry& view, const std::vector<size_t>& tiles,
               const std::vector<int64_t>& lengths, const std::vector<int32_t>& row_of,
               CpuViewGeometry* region) {
  std::vector<int32_t> new_index(view.splats.size(), -1);
  int64_t total = 0;
  for (const size_t tile : tiles) {
    for (int64_t i = 0; i < lengths[tile]; ++i) {
      new_index[size_t(view.entries[size_t(view.tile_begin[tile] + i)])] = 0;
    }
    total += lengths[tile];
  }
  int32_t used = 0;
  for (size_t s = 0; s < new_index.size(); ++s) {
    if (new_index[s] < 0) continue;
    new_index[s] = used++;
    region->splats.push_back(view.splats[s]);
    region->splat_rows.push_back(row_of[s]);
  }
  region->splats.shrink_to_fit();
  region->splat_rows.shrink_to_fit();
  region->entries.reserve(size_t(total));
  region->tile_begin.push_back(0);
  for (const size_t tile : tiles) {
    for (int64_t i = 0; i < lengths[tile]; ++i) {
      region->entries.push_back(new_index[size_t(view.entries[size_t(view.tile_begin[tile] + i)])]);
    }
    region->tile_begin.push_back(int64_t(region->entries.size()));
  }
  region->slots.resize(size_t(total));
  AssignSlots(
      region->num_rows(), int64_t(tiles.size()),
      [&](size_t i, const auto& visit) {
        for (auto e = size_t(region->tile_begin[i]); e < size_t(region->tile_begin[i + 1]); ++e) {
          visit(region->splat_rows[size_t(region->entries[e])], &region->slots[e]);
        }
      },
      &region->row_begin);
}

}  // namespace

std::shared_ptr<const ViewGeometry> RestrictOnCpu(const TileKernels& kernels,
                                                  const CpuViewGeometry& view,
                                                  const uint8_t* active, size_t budget_bytes,
                                                  float min_weight, const RegionBlend* blend) {
  auto region = std::make_shared<CpuViewGeometry>();
  region->SetRegion();
  const std::vector<int32_t> row_of = ActiveRows(view, active, &region->row_gaussians);
  region->SetShape(view.camera(), int64_t(region->row_gaussians.size()));

  const std::vector<int64_t> lengths = CutLists(view, row_of);
  std::vector<size_t> tiles;
  for (size_t i = 0; i < lengths.size(); ++i) {
    if (lengths[i] == 0) continue;
    tiles.push_back(i);
    region->tile_ids.push_back(view.tile_ids[i]);
  }
  region->tile_ids.shrink_to_fit();
  uint16_t pixel_rows = kAllPixelRows;
  const WeightSource source(kernels, view, lengths, row_of, blend);
  auto weights = min_weight > 0 ? CompactWeights(source, tiles, min_weight, budget_bytes,
                                                 size_t(region->num_rows()), &pixel_rows)
                                : ExactWeights(source, tiles, budget_bytes);
  if (!weights.empty()) {
    region->SetPixelRows(pixel_rows);
    if (min_weight > 0) DropEmptyTiles(&weights, region.get());
    AdoptWeights(std::move(weights), region.get());
  } else {
    CopyLists(view, tiles, lengths, row_of, region.get());
  }
  return region;
}

std::vector<int32_t> TouchedTilesOnCpu(const CpuViewGeometry& view, const uint8_t* active) {
  std::vector<uint8_t> touched(view.tile_ids.size());
  ParallelRanges(int64_t(touched.size()), 64, [&](int64_t begin, int64_t end) {
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      const auto first = view.entries.begin() + view.tile_begin[i];
      const auto last = view.entries.begin() + view.tile_begin[i + 1];
      touched[i] = std::any_of(
          first, last, [&](int32_t row) { return active[view.row_gaussians[size_t(row)]] != 0; });
    }
  });
  std::vector<int32_t> tiles;
  for (size_t i = 0; i < touched.size(); ++i) {
    if (touched[i]) tiles.push_back(view.tile_ids[i]);
  }
  return tiles;
}

}  // namespace retint
