// SPDX-License-Identifier: BSD-3-Clause
// The part of a view that active Gaussians touch: their tiles only, each list cut after its last
// active entry, or, where memory allows, the active Gaussians' weights themselves.
#include <algorithm>
#include <atomic>
#include <bit>
#include <utility>

#include "kernels/cpu/parallel.h"
#include "kernels/cpu/tiles.h"

namespace retint {
namespace {

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

// Slots for the entries for which row(e) >= 0, so that those of a row lie side by side.
template <typename RowOf, typename SlotOf>
void AssignSlots(int64_t num_rows, int64_t count, const RowOf& row_of, const SlotOf& slot_of,
                 std::vector<int64_t>* row_begin) {
  row_begin->assign(size_t(num_rows) + 1, 0);
  for (int64_t e = 0; e < count; ++e) {
    const int32_t row = row_of(e);
    if (row >= 0) ++(*row_begin)[size_t(row) + 1];
  }
  for (size_t r = 1; r < row_begin->size(); ++r) (*row_begin)[r] += (*row_begin)[r - 1];
  std::vector<int64_t> next(row_begin->begin(), row_begin->end() - 1);
  for (int64_t e = 0; e < count; ++e) {
    const int32_t row = row_of(e);
    slot_of(e) = row >= 0 ? uint32_t(next[size_t(row)]++) : kNoSlot;
  }
}

// What is given up, in turn, until compact weights fit the budget: pixel rows, then small weights.
struct Thinning {
  uint16_t pixel_rows;
  float min_weight;  // in units of the one asked for
};
constexpr Thinning kThinnings[] = {{0xffff, 1}, {0x5555, 1}, {0x1111, 1}, {0x1111, 2}, {0x1111, 4}};
// Compact weights of up to this many times the budget are worth an attempt to thin them.
constexpr size_t kThinnable = 6;

// Bits of WeightEntry::half_rows that lie in `pixel_rows`.
uint32_t HalfRowsOf(uint16_t pixel_rows) {
  uint32_t half_rows = 0;
  for (int y = 0; y < kTileSize; ++y) {
    if (pixel_rows >> y & 1) half_rows |= 3u << (2 * y);
  }
  return half_rows;
}

// body(half row, its 8 steps) for the entry's half rows; returns where the next entry's steps
// begin.
template <typename Step, typename Body>
const Step* ForEachHalfRow(const WeightEntry& entry, const Step* steps, const Body& body) {
  for (uint32_t left = entry.half_rows; left != 0; left &= left - 1, steps += 8) {
    body(std::countr_zero(left), steps);
  }
  return steps;
}

// A pixel's kept weights take over those left out beside them, up to this factor.
constexpr float kMostTakenOver = 4;

// Of the half rows `wanted`, leaves out those whose weights are all below `min_weight`; keeps 8
// bits of the others, which take over what was left out, so that a pixel's weights still sum to
// what they did.
template <typename Step>
WeightTile Compact(const WeightTile& tile, const std::vector<Step>& steps, float min_weight,
                   uint32_t wanted) {
  alignas(64) float all[kTilePixels] = {}, kept[kTilePixels] = {};
  const auto is_kept = [&](const WeightEntry& entry, int half, const Step* from) {
    return (wanted >> half & 1) &&
           float(*std::max_element(from, from + 8)) * entry.scale >= min_weight;
  };
  size_t count = 0;
  const Step* at = steps.data();
  for (const WeightEntry& entry : tile.entries) {
    at = ForEachHalfRow(entry, at, [&](int half, const Step* from) {
      const bool keep = is_kept(entry, half, from);
      count += keep;
      for (int i = 0; i < 8; ++i) {
        const float weight = float(from[i]) * entry.scale;
        all[8 * half + i] += weight;
        if (keep) kept[8 * half + i] += weight;
      }
    });
  }
  WeightTile compact;
  if (count == 0) return compact;
  float* factor = kept;
  for (int p = 0; p < kTilePixels; ++p) {
    factor[p] = kept[p] > 0 ? std::min(all[p] / kept[p], kMostTakenOver) : 1.0f;
  }
  compact.compact.reserve(8 * count);
  at = steps.data();
  for (const WeightEntry& entry : tile.entries) {
    const Step* const first = at;
    WeightEntry out = entry;
    out.half_rows = 0;
    float largest = 0;
    at = ForEachHalfRow(entry, at, [&](int half, const Step* from) {
      if (!is_kept(entry, half, from)) return;
      out.half_rows |= 1u << half;
      for (int i = 0; i < 8; ++i) {
        largest = std::max(largest, float(from[i]) * factor[8 * half + i]);
      }
    });
    if (out.half_rows == 0) continue;
    out.scale = entry.scale * largest / 255;
    ForEachHalfRow(entry, first, [&](int half, const Step* from) {
      if (!(out.half_rows >> half & 1)) return;
      for (int i = 0; i < 8; ++i) {
        const float weight = float(from[i]) * factor[8 * half + i];
        compact.compact.push_back(uint8_t(weight * (255 / largest) + 0.5f));
      }
    });
    compact.entries.push_back(out);
  }
  compact.entries.shrink_to_fit();
  return compact;
}

// Gives up rows and small weights until the tiles fit the budget. False when they never do.
bool ThinToFit(std::vector<WeightTile>* tiles, float min_weight, size_t budget_bytes,
               uint16_t* pixel_rows) {
  for (const Thinning& thinning : kThinnings) {
    if (&thinning != kThinnings) {
      ParallelRanges(int64_t(tiles->size()), 16, [&](int64_t begin, int64_t end) {
        for (size_t i = size_t(begin); i < size_t(end); ++i) {
          (*tiles)[i] = Compact((*tiles)[i], (*tiles)[i].compact, thinning.min_weight * min_weight,
                                HalfRowsOf(thinning.pixel_rows));
        }
      });
    }
    *pixel_rows = thinning.pixel_rows;
    size_t used = 0;
    for (const WeightTile& tile : *tiles) used += tile.bytes();
    if (used <= budget_bytes) return true;
  }
  return false;
}

// Weights of every region tile, or nothing when they exceed the budget (which does not depend on
// the order in which tiles finish).
std::vector<WeightTile> ComputeWeights(const TileKernels& kernels, const CpuViewGeometry& view,
                                       const std::vector<size_t>& tiles,
                                       const std::vector<int64_t>& lengths,
                                       const std::vector<int32_t>& row_of, size_t budget_bytes,
                                       float min_weight, uint16_t* pixel_rows) {
  std::vector<WeightTile> weights(tiles.size());
  std::atomic<size_t> used{0};
  const size_t limit = min_weight > 0 ? kThinnable * budget_bytes : budget_bytes;
  ParallelRanges(int64_t(tiles.size()), 4, [&](int64_t begin, int64_t end) {
    alignas(64) float transmittance[kTilePixels];
    WeightTile work;
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      if (used.load(std::memory_order_relaxed) > limit) return;
      TileList list = TileListOf(view, tiles[i]);
      list.count = lengths[tiles[i]];
      list.splat_rows = row_of.data();
      InitTransmittance(view.camera(), list.x0, list.y0, transmittance);
      work.entries.clear();
      work.weights.clear();
      kernels.weights(list, &work, transmittance);
      weights[i] = min_weight > 0 ? Compact(work, work.weights, min_weight, ~0u)
                                  : work;  // copies are of exact size
      used.fetch_add(weights[i].bytes(), std::memory_order_relaxed);
    }
  });
  if (used.load() > limit ||
      (min_weight > 0 && !ThinToFit(&weights, min_weight, budget_bytes, pixel_rows))) {
    weights.clear();
  }
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
  std::vector<WeightEntry*> entries;
  for (WeightTile& tile : region->weights) {
    for (WeightEntry& entry : tile.entries) entries.push_back(&entry);
  }
  AssignSlots(
      region->num_rows(), int64_t(entries.size()),
      [&](int64_t e) { return entries[size_t(e)]->row; },
      [&](int64_t e) -> uint32_t& { return entries[size_t(e)]->slot; }, &region->row_begin);
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
      region->num_rows(), total,
      [&](int64_t e) { return region->splat_rows[size_t(region->entries[size_t(e)])]; },
      [&](int64_t e) -> uint32_t& { return region->slots[size_t(e)]; }, &region->row_begin);
}

}  // namespace

std::shared_ptr<const ViewGeometry> RestrictOnCpu(const TileKernels& kernels,
                                                  const CpuViewGeometry& view,
                                                  const uint8_t* active, size_t budget_bytes,
                                                  float min_weight) {
  if (view.is_region) throw std::invalid_argument("a region cannot be restricted again");
  auto region = std::make_shared<CpuViewGeometry>();
  region->is_region = true;
  std::vector<int32_t> row_of(size_t(view.num_rows()), -1);
  for (size_t r = 0; r < row_of.size(); ++r) {
    if (!active[view.row_gaussians[r]]) continue;
    row_of[r] = int32_t(region->row_gaussians.size());
    region->row_gaussians.push_back(view.row_gaussians[r]);
  }
  region->row_gaussians.shrink_to_fit();
  region->SetShape(view.camera(), int64_t(region->row_gaussians.size()));

  const std::vector<int64_t> lengths = CutLists(view, row_of);
  std::vector<size_t> tiles;
  for (size_t i = 0; i < lengths.size(); ++i) {
    if (lengths[i] == 0) continue;
    tiles.push_back(i);
    region->tile_ids.push_back(view.tile_ids[i]);
  }
  region->tile_ids.shrink_to_fit();
  uint16_t pixel_rows = 0xffff;
  auto weights =
      ComputeWeights(kernels, view, tiles, lengths, row_of, budget_bytes, min_weight, &pixel_rows);
  if (!weights.empty()) {
    region->SetPixelRows(pixel_rows);
    if (min_weight > 0) DropEmptyTiles(&weights, region.get());
    AdoptWeights(std::move(weights), region.get());
  } else {
    CopyLists(view, tiles, lengths, row_of, region.get());
  }
  return region;
}

}  // namespace retint
