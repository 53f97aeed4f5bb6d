// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cpu/blend.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "base/parallel.h"

namespace retint {
namespace {

struct alignas(64) TileScratch {
  float values[kMaxChannels * kTilePixels];
  float median[kTilePixels];
  float transmittance[kTilePixels];
};

struct TileRect {
  int x0, y0, width, height;  // clipped to the image
};

TileRect RectOf(const ViewGeometry& view, int tile) {
  const int x0 = tile % view.tiles_x() * kTileSize, y0 = tile / view.tiles_x() * kTileSize;
  return {x0, y0, std::min(kTileSize, view.camera().width - x0),
          std::min(kTileSize, view.camera().height - y0)};
}

// Calls copy(C) with the usual numbers of channels as compile-time constants: a compiler unrolls
// the copies of a tile then.
template <typename Copy>
void WithChannels(int channels, const Copy& copy) {
  static_assert(kMaxChannels == 8);
  switch (channels) {
    case 1:
      return copy(std::integral_constant<int, 1>());
    case 2:
      return copy(std::integral_constant<int, 2>());
    case 3:
      return copy(std::integral_constant<int, 3>());
    case 6:
      return copy(std::integral_constant<int, 6>());
    default:
      return copy(channels);
  }
}

// Planar tile -> interleaved image, the pixel rows that are wanted.
void StoreTile(const TileRect& rect, uint16_t pixel_rows, const float* planes, int channels,
               int image_width, float* image) {
  WithChannels(channels, [&](auto count) {
    for (int y = 0; y < rect.height; ++y) {
      if (!(pixel_rows >> y & 1)) continue;
      float* const out =
          image + (size_t(rect.y0 + y) * size_t(image_width) + size_t(rect.x0)) * size_t(count);
      const float* const in = planes + y * kTileSize;
      for (int x = 0; x < rect.width; ++x) {
        for (int c = 0; c < count; ++c) out[x * count + c] = in[c * kTilePixels + x];
      }
    }
  });
}

// Interleaved image -> planar tile, zero beyond the image; other pixel rows are left alone.
void LoadTile(const TileRect& rect, uint16_t pixel_rows, const float* image, int channels,
              int image_width, float* planes) {
  if (rect.width < kTileSize || rect.height < kTileSize) {
    std::fill_n(planes, channels * kTilePixels, 0.0f);
  }
  WithChannels(channels, [&](auto count) {
    for (int y = 0; y < rect.height; ++y) {
      if (!(pixel_rows >> y & 1)) continue;
      const float* const in =
          image + (size_t(rect.y0 + y) * size_t(image_width) + size_t(rect.x0)) * size_t(count);
      float* const out = planes + y * kTileSize;
      for (int x = 0; x < rect.width; ++x) {
        for (int c = 0; c < count; ++c) out[c * kTilePixels + x] = in[x * count + c];
      }
    }
  });
}

// Values of the pixels that no tile of the view covers; only in the tiles that are wanted, where
// `wanted` is not null.
void FillOutside(const ViewGeometry& view, int channels, const float* background, float* image,
                 std::span<const int32_t> wanted = {}) {
  const auto tiles = view.tiles();
  const int num_tiles = view.tiles_x() * view.tiles_y();
  if (int(tiles.size()) == num_tiles) return;
  std::vector<uint8_t> is_left(size_t(num_tiles), wanted.data() ? 0 : 1);
  for (const int32_t tile : wanted) is_left[size_t(tile)] = 1;
  for (const int32_t tile : tiles) is_left[size_t(tile)] = 0;
  alignas(64) float planes[kMaxChannels * kTilePixels] = {};
  for (int c = 0; background && c < channels; ++c) {
    std::fill_n(planes + c * kTilePixels, kTilePixels, background[c]);
  }
  ParallelRanges(num_tiles, 256, [&](int64_t begin, int64_t end) {
    for (int tile = int(begin); tile < int(end); ++tile) {
      if (!is_left[size_t(tile)]) continue;
      StoreTile(RectOf(view, tile), kAllPixelRows, planes, channels, view.camera().width, image);
    }
  });
}

// Where the wanted tiles stand among those of the view; both ascend.
std::vector<size_t> PlacesOf(std::span<const int32_t> wanted, const CpuViewGeometry& view) {
  std::vector<size_t> places;
  size_t at = 0;
  for (const int32_t tile : wanted) {
    while (at < view.tile_ids.size() && view.tile_ids[at] < tile) ++at;
    if (at < view.tile_ids.size() && view.tile_ids[at] == tile) places.push_back(at);
  }
  return places;
}

// body(i, rect, scratch) for every visited tile, with the transmittance ready where weights are not
// explicit; only for those that
// are wanted, where `wanted` is not null.
template <typename Body>
void ForEachTile(const CpuViewGeometry& view, uint16_t pixel_rows, std::span<const int32_t> wanted,
                 const Body& body) {
  const bool some = wanted.data() != nullptr;
  const std::vector<size_t> places = some ? PlacesOf(wanted, view) : std::vector<size_t>();
  const size_t count = some ? places.size() : view.tile_ids.size();
  ParallelRanges(int64_t(count), 4, [&](int64_t begin, int64_t end) {
    TileScratch scratch;
    for (size_t t = size_t(begin); t < size_t(end); ++t) {
      const size_t i = some ? places[t] : t;
      const TileRect rect = RectOf(view, view.tile_ids[i]);
      if (view.weights.empty()) {
        InitTransmittance(view.camera(), rect.x0, rect.y0, pixel_rows, scratch.transmittance);
      }
      body(i, rect, scratch);
    }
  });
}

// Cuts the entries behind the last one with a nonzero feature: they add nothing to sums.
TileList CutAfterLastFeature(TileList list, const float* features, int channels) {
  const auto has_feature = [&](int64_t entry) {
    const int32_t splat = list.entries[entry];
    const int32_t row = list.splat_rows ? list.splat_rows[splat] : splat;
    const float* const from = features + int64_t(row) * channels;
    return row >= 0 && std::any_of(from, from + channels, [](float value) { return value != 0; });
  };
  while (list.count > 0 && !has_feature(list.count - 1)) --list.count;
  return list;
}

// The shares' values of one tile. For most tiles a few rows are enough to decide about the others.
void BlendTileShares(const TileKernels& kernels, const TileList& list, const TileRect& rect,
                     const CameraParams& camera, const BlendSharesParams& params,
                     TileScratch& scratch) {
  constexpr uint16_t kProbed = 1 << 0 | 1 << 5 | 1 << 10 | 1 << 15;
  const auto blend = [&](uint16_t pixel_rows) {
    InitTransmittance(camera, rect.x0, rect.y0, pixel_rows, scratch.transmittance);
    kernels.blend_between(list, params.shares, params.low, params.high, scratch.values,
                          scratch.transmittance);
    if (params.behind == 0) return;
    for (int p = 0; p < kTilePixels; ++p) {
      if (!(pixel_rows >> (p / kTileSize) & 1)) continue;
      scratch.values[p] += params.behind * std::fabs(scratch.transmittance[p]);
    }
  };
  blend(kProbed);
  float least = std::numeric_limits<float>::infinity(), most = -least;
  for (int y = 0; y < rect.height; ++y) {
    if (!(kProbed >> y & 1)) continue;
    const float* const row = scratch.values + y * kTileSize;
    const auto [smallest, largest] = std::minmax_element(row, row + rect.width);
    least = std::min(least, *smallest);
    most = std::max(most, *largest);
  }
  if (least <= most && (most <= params.low || least >= params.high)) {
    std::fill_n(scratch.values, kTilePixels, least);
  } else {
    blend(uint16_t(~kProbed));
  }
}

}  // namespace

ScratchPool::Lease ScratchPool::Take(size_t count) {
  LargeVector<float> array;
  {
    const std::lock_guard lock(mutex_);
    if (!free_.empty()) {
      array = std::move(free_.back());
      free_.pop_back();
    }
  }
  if (array.size() < count) {
    array = {};
    array.resize(count);
  }
  return Lease(this, std::move(array));
}

void ScratchPool::Return(LargeVector<float> array) {
  const std::lock_guard lock(mutex_);
  free_.push_back(std::move(array));
}

TileList TileListOf(const CpuViewGeometry& view, size_t i) {
  const TileRect rect = RectOf(view, view.tile_ids[i]);
  const int64_t begin = view.tile_begin[i];
  return {view.splats.data(),
          view.entries.data() + begin,
          view.is_region() ? view.splat_rows.data() : nullptr,
          view.slots.data() + begin,
          view.tile_begin[i + 1] - begin,
          rect.x0,
          rect.y0};
}

void InitTransmittance(const CameraParams& camera, int x0, int y0, uint16_t pixel_rows,
                       float* transmittance) {
  const int width = std::min(kTileSize, camera.width - x0);
  for (int y = 0; y < kTileSize; ++y) {
    float* const row = transmittance + y * kTileSize;
    const int inside = y0 + y < camera.height && (pixel_rows >> y & 1) ? width : 0;
    std::fill_n(row, inside, 1.0f);
    std::fill_n(row + inside, kTileSize - inside, -1.0f);
  }
}

void BlendOnCpu(const TileKernels& kernels, const CpuViewGeometry& view,
                const BlendParams& params) {
  const int channels = params.channels, width = view.camera().width;
  const float* background = view.is_region() ? nullptr : params.background;
  if (!params.keep_outside) {
    FillOutside(view, channels, background, params.image, params.tiles);
    if (params.alpha) FillOutside(view, 1, nullptr, params.alpha, params.tiles);
  }
  const bool explicit_weights = !view.weights.empty();
  const bool needs_transmittance = background || (params.alpha && !view.is_region());
  const auto stored_rows =
      uint16_t(params.keep_outside ? params.pixel_rows & view.pixel_rows() : params.pixel_rows);
  const auto blend = [&](size_t i, const TileRect& rect, TileScratch& scratch) {
    std::fill_n(scratch.values, channels * kTilePixels, 0.0f);
    if (explicit_weights) {
      kernels.blend_weights(view.weights[i], params.features, channels, scratch.values);
    } else {
      TileList list = TileListOf(view, i);
      if (!needs_transmittance) list = CutAfterLastFeature(list, params.features, channels);
      kernels.blend(list, params.features, channels, scratch.values, scratch.transmittance);
    }
    for (int c = 0; background && c < channels; ++c) {
      for (int p = 0; p < kTilePixels; ++p) {
        scratch.values[c * kTilePixels + p] += std::fabs(scratch.transmittance[p]) * background[c];
      }
    }
    StoreTile(rect, stored_rows, scratch.values, channels, width, params.image);
    if (!params.alpha || view.is_region()) return;
    for (int p = 0; p < kTilePixels; ++p) {
      scratch.values[p] = 1 - std::fabs(scratch.transmittance[p]);
    }
    StoreTile(rect, params.pixel_rows, scratch.values, 1, width, params.alpha);
  };
  ForEachTile(view, params.pixel_rows, params.tiles, blend);
  if (!params.alpha || !view.is_region()) return;
  const std::vector<float> ones(size_t(view.num_rows()), 1.0f);
  BlendOnCpu(kernels, view, {ones.data(), 1, nullptr, params.alpha, nullptr, params.keep_outside});
}

void BlendSharesOnCpu(const TileKernels& kernels, const CpuViewGeometry& view,
                      const BlendSharesParams& params) {
  FillOutside(view, 1, nullptr, params.image);
  const auto blend = [&](size_t i, const TileRect& rect, TileScratch& scratch) {
    std::fill_n(scratch.values, kTilePixels, 0.0f);
    TileList list = TileListOf(view, i);
    const TileList cut = CutAfterLastFeature(list, params.shares, 1);
    if (params.behind == 0 || cut.count == 0) list = cut;
    BlendTileShares(kernels, list, rect, view.camera(), params, scratch);
    StoreTile(rect, kAllPixelRows, scratch.values, 1, view.camera().width, params.image);
  };
  ForEachTile(view, kAllPixelRows, {}, blend);
}

void BlendTransposeOnCpu(const TileKernels& kernels, ScratchPool* pool, const CpuViewGeometry& view,
                         const BlendTransposeParams& params) {
  const int channels = params.channels, width = view.camera().width;
  auto partials = pool->Take(size_t(view.num_slots()) * size_t(channels));
  const bool explicit_weights = !view.weights.empty();
  // No other row has a weight.
  const uint16_t pixel_rows = explicit_weights ? view.pixel_rows() : params.pixel_rows;
  const auto transpose = [&](size_t i, const TileRect& rect, TileScratch& scratch) {
    // Rows that are not wanted take part with weights of 0, and not a number times 0 is none.
    if (!explicit_weights && pixel_rows != kAllPixelRows) {
      std::fill_n(scratch.values, channels * kTilePixels, 0.0f);
    }
    LoadTile(rect, pixel_rows, params.residual, channels, width, scratch.values);
    if (explicit_weights) {
      kernels.transpose_weights(view.weights[i], scratch.values, channels, partials.data());
    } else {
      kernels.transpose(TileListOf(view, i), scratch.values, channels, partials.data(),
                        scratch.transmittance);
    }
  };
  ForEachTile(view, params.pixel_rows, {}, transpose);
  SumPartials(view, partials.data(), channels, params.result);
}

void SumPartials(const CpuViewGeometry& view, const float* partials, int channels, float* result) {
  WithChannels(channels, [&](auto count) {
    ParallelRanges(view.num_rows(), 4096, [&](int64_t begin, int64_t end) {
      for (int64_t row = begin; row < end; ++row) {
        float sums[kMaxChannels] = {};
        for (int64_t slot = view.row_begin[size_t(row)]; slot < view.row_begin[size_t(row) + 1];
             ++slot) {
          for (int c = 0; c < count; ++c) sums[c] += partials[slot * count + c];
        }
        std::copy_n(sums, int(count), result + row * count);
      }
    });
  });
}

void StoreTile(const CpuViewGeometry& view, size_t i, uint16_t pixel_rows, const float* planes,
               int channels, float* image) {
  StoreTile(RectOf(view, view.tile_ids[i]), pixel_rows, planes, channels, view.camera().width,
            image);
}

// A row's number, which the tile loops find as if it was a depth.
float DepthOfRow(size_t row) { return std::bit_cast<float>(uint32_t(row) + kFirstNormal); }
size_t RowOfDepth(float depth) { return std::bit_cast<uint32_t>(depth) - kFirstNormal; }

// The view's splats, those left out too faint to show; for a median along rays, with DepthOfRow.
LargeVector<Splat> SplatsForDepth(const CpuViewGeometry& view, const DepthParams& params) {
  constexpr float kInvisible = -100;  // of log2_opacity
  LargeVector<Splat> splats(view.splats);
  ParallelRanges(view.num_rows(), 8192, [&](int64_t begin, int64_t end) {
    for (auto row = size_t(begin); row < size_t(end); ++row) {
      const bool left_out = params.left_out && params.left_out[view.row_gaussians[row]];
      if (left_out) splats[row].log2_opacity = kInvisible;
      if (params.along_rays) splats[row].depth = DepthOfRow(row);
    }
  });
  return splats;
}

// From rows to depths.
void FindAlongRays(const CpuViewGeometry& view, const CpuModel& model, const DepthParams& params) {
  const CameraParams& camera = view.camera();
  ParallelTasks(camera.height, [&](int64_t y) {
    if (!(params.pixel_rows >> (y % kTileSize) & 1)) return;
    for (int x = 0; x < camera.width; ++x) {
      float& pixel = params.median[y * camera.width + x];
      if (pixel == 0) continue;
      const size_t row = RowOfDepth(pixel);
      const auto g = size_t(view.row_gaussians[row]);
      const float* mean = &model.means[3 * g];
      pixel = DepthAlongRay(camera, {mean[0], mean[1], mean[2]}, model.covariances[g],
                            view.splats[row], float(x) + 0.5f, float(y) + 0.5f);
    }
  });
}

void DepthOnCpu(const TileKernels& kernels, const CpuViewGeometry& view,
                const DepthParams& params) {
  const int width = view.camera().width;
  for (float* image : {params.median, params.expected, params.alpha}) {
    if (image) FillOutside(view, 1, nullptr, image);
  }
  LargeVector<Splat> splats;
  if (params.left_out || params.along_rays) splats = SplatsForDepth(view, params);
  const auto find = [&](size_t i, const TileRect& rect, TileScratch& scratch) {
    TileList list = TileListOf(view, i);
    if (!splats.empty()) list.splats = splats.data();
    std::fill_n(scratch.values, kTilePixels, 0.0f);
    if (params.median) std::fill_n(scratch.median, kTilePixels, 0.0f);
    kernels.depth(list, params.threshold, scratch.values, params.median ? scratch.median : nullptr,
                  scratch.transmittance);
    const auto store = [&](const float* plane, float* image) {
      if (image) StoreTile(rect, params.pixel_rows, plane, 1, width, image);
    };
    store(scratch.median, params.median);
    for (int p = 0; p < kTilePixels; ++p) {
      const float alpha = 1 - std::fabs(scratch.transmittance[p]);
      scratch.values[p] = alpha > 0 && alpha >= params.min_alpha ? scratch.values[p] / alpha : 0;
      scratch.transmittance[p] = alpha;
    }
    store(scratch.values, params.expected);
    store(scratch.transmittance, params.alpha);
  };
  ForEachTile(view, params.pixel_rows, {}, find);
  if (params.along_rays && params.median) {
    FindAlongRays(view, dynamic_cast<const CpuModel&>(*params.along_rays), params);
  }
}

}  // namespace retint
