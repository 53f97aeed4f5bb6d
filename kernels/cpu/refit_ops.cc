// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cpu/refit_ops.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "kernels/common/sh.h"

namespace retint::cpu {
namespace {

constexpr int kTilePixels = kTileSize * kTileSize;
constexpr int64_t kChunk = 1 << 14;  // of the sums, so that they do not depend on the threads

// Pixel bounds of tile number `index` of the region's list.
struct TileRect {
  int x0, y0, x1, y1;
};

TileRect RectOf(const ViewGeometry& region, size_t index) {
  const CameraParams& camera = region.camera();
  const int tile = region.tiles()[index];
  const int x0 = tile % region.tiles_x() * kTileSize, y0 = tile / region.tiles_x() * kTileSize;
  return {x0, y0, std::min(x0 + kTileSize, camera.width), std::min(y0 + kTileSize, camera.height)};
}

// function(index, rect) for every tile of the region, in parallel.
template <typename Function>
void ForEachTile(const ViewGeometry& region, Function function) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, region.tiles().size(), 16), [&](auto& range) {
    for (size_t t = range.begin(); t != range.end(); ++t) function(t, RectOf(region, t));
  });
}

// function(first, last) over [0, count) in parallel.
template <typename Function>
void ForRanges(int64_t count, Function function) {
  tbb::parallel_for(tbb::blocked_range<int64_t>(0, count, 1024),
                    [&](auto& range) { function(range.begin(), range.end()); });
}

// mask * (delta y + offset): what the edit adds to a colour.
void EditChange(const ColorMap& map, float mask, const float* color, float* change) {
  for (int c = 0; c < 3; ++c) {
    change[c] = mask * (map.delta[3 * c] * color[0] + map.delta[3 * c + 1] * color[1] +
                        map.delta[3 * c + 2] * color[2] + map.offset[c]);
  }
}

}  // namespace

void RegionTarget(const ViewGeometry& region, const RegionTargetParams& params) {
  const size_t width = size_t(region.camera().width);
  const float* source = params.source ? params.source : params.render;
  const float scale = 1 / params.unit;
  ForEachTile(region, [&](size_t t, const TileRect& rect) {
    int16_t* tile = params.target + t * kTilePixels * 3;
    std::fill_n(tile, kTilePixels * 3, int16_t{0});
    for (int y = rect.y0; y < rect.y1; ++y) {
      int16_t* out = tile + (y - rect.y0) * kTileSize * 3;
      for (int x = rect.x0; x < rect.x1; ++x, out += 3) {
        const size_t p = size_t(y) * width + size_t(x);
        float change[3];
        EditChange(params.map, float(params.mask[p]) * (1.0f / 255), source + 3 * p, change);
        for (int c = 0; c < 3; ++c) {
          const float wanted =
              change[c] + (source[3 * p + size_t(c)] - params.render[3 * p + size_t(c)]);
          out[c] = int16_t(std::lrint(std::clamp(wanted * scale, -32767.0f, 32767.0f)));
        }
      }
    }
  });
}

void RegionResidual(const ViewGeometry& region, const RegionResidualParams& params) {
  const size_t width = size_t(region.camera().width);
  std::vector<double> sums(region.tiles().size());
  ForEachTile(region, [&](size_t t, const TileRect& rect) {
    const int16_t* tile = params.target + t * kTilePixels * 3;
    const int values = 3 * (rect.x1 - rect.x0);
    double sum = 0;
    for (int y = rect.y0; y < rect.y1; ++y) {
      const int16_t* target = tile + (y - rect.y0) * kTileSize * 3;
      const size_t first = (size_t(y) * width + size_t(rect.x0)) * 3;
      const float* image = params.image + first;
      float* residual = params.residual + first;
      float row = 0;
      for (int i = 0; i < values; ++i) {
        const float difference = float(target[i]) * params.unit - image[i];
        residual[i] = difference;
        row += difference * difference;
      }
      sum += double(row);
    }
    sums[t] = sum;
  });
  double sum = 0;
  for (const double tile : sums) sum += tile;
  *params.loss += sum;
}

void RegionAdd(const ViewGeometry& region, float* image, const float* delta) {
  const size_t width = size_t(region.camera().width);
  ForEachTile(region, [&](size_t, const TileRect& rect) {
    for (int y = rect.y0; y < rect.y1; ++y) {
      const size_t first = (size_t(y) * width + size_t(rect.x0)) * 3;
      for (int i = 0; i < 3 * (rect.x1 - rect.x0); ++i)
        image[first + size_t(i)] += delta[first + size_t(i)];
    }
  });
}

void AddRidge(const AddRidgeParams& params) {
  const int64_t packed = int64_t{params.k} * (params.k + 1) / 2;
  ForRanges(params.count, [&](int64_t first, int64_t last) {
    for (int64_t g = first; g < last; ++g) {
      float* block = params.blocks + g * packed;
      const float weight = block[0] / (kSh0 * kSh0);
      params.weights[g] = weight;
      for (int k = 0; k < params.k; ++k) block[k * (k + 1) / 2 + k] += params.ridge[k] * weight;
    }
  });
}

void ApplyRidge(const ApplyRidgeParams& params) {
  ForRanges(params.count, [&](int64_t first, int64_t last) {
    for (int64_t g = first; g < last; ++g) {
      for (int k = 0; k < params.k; ++k) {
        const float factor = params.scale * params.ridge[k] * params.weights[g];
        const int64_t i = (g * params.k + k) * 3;
        for (int c = 0; c < 3; ++c) params.out[i + c] += factor * params.x[i + c];
      }
    }
  });
}

void LinearCombination(const LinearCombinationParams& params) {
  ForRanges(params.count, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      params.out[i] = params.a * params.x[i] + params.b * params.y[i];
    }
  });
}

double Dot(const float* x, const float* y, int64_t count) {
  std::vector<double> sums(size_t((count + kChunk - 1) / kChunk));
  tbb::parallel_for(size_t{0}, sums.size(), [&](size_t chunk) {
    const int64_t first = int64_t(chunk) * kChunk, last = std::min(first + kChunk, count);
    double sum[4] = {};
    int64_t i = first;
    for (; i + 4 <= last; i += 4) {
      for (int lane = 0; lane < 4; ++lane) sum[lane] += double(x[i + lane]) * double(y[i + lane]);
    }
    for (; i < last; ++i) sum[0] += double(x[i]) * double(y[i]);
    sums[chunk] = (sum[0] + sum[1]) + (sum[2] + sum[3]);
  });
  double sum = 0;
  for (const double chunk : sums) sum += chunk;
  return sum;
}

void PackBox(const PackBoxParams& params) {
  const int64_t values = int64_t{params.box[2] - params.box[0]} * 3;
  const float scale = 1 / params.unit;
  tbb::parallel_for(params.box[1], params.box[3], [&](int y) {
    const float* row = params.image + (int64_t{y} * params.width + params.box[0]) * 3;
    uint16_t* out = params.packed + (y - params.box[1]) * values;
    for (int64_t i = 0; i < values; ++i) {
      out[i] = uint16_t(std::clamp(row[i] * scale + 0.5f, 0.0f, 65535.0f));
    }
  });
}

void UnpackBox(const PackBoxParams& params) {
  const int64_t values = int64_t{params.box[2] - params.box[0]} * 3;
  tbb::parallel_for(params.box[1], params.box[3], [&](int y) {
    float* row = params.image + (int64_t{y} * params.width + params.box[0]) * 3;
    const uint16_t* packed = params.packed + (y - params.box[1]) * values;
    for (int64_t i = 0; i < values; ++i) row[i] = float(packed[i]) * params.unit;
  });
}

void EditImage(const EditImageParams& params) {
  tbb::parallel_for(params.box[1], params.box[3], [&](int y) {
    for (int x = params.box[0]; x < params.box[2]; ++x) {
      const int64_t p = int64_t{y} * params.width + x;
      float change[3];
      EditChange(params.map, float(params.mask[p]) * (1.0f / 255), params.image + 3 * p, change);
      for (int c = 0; c < 3; ++c) params.out[3 * p + c] = params.image[3 * p + c] + change[c];
    }
  });
}

}  // namespace retint::cpu
