// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include "base/parallel.h"
#include "kernels/common/mask_projection.h"
#include "kernels/cpu/groups.h"

namespace retint {
namespace {

constexpr int kBandRows = 16;

// The splats of a cloud by the bands of rows that they reach.
struct Bands {
  std::vector<std::vector<CloudSplat>> pieces;
  std::vector<std::vector<const CloudSplat*>> splats;  // of each band
};

Bands ProjectCloud(const DrawCloudParams& params) {
  constexpr int64_t kPiece = 4096;
  Bands bands;
  bands.pieces.resize(size_t((params.count + kPiece - 1) / kPiece));
  ParallelTasks(int64_t(bands.pieces.size()), [&](int64_t piece) {
    std::vector<CloudSplat>& splats = bands.pieces[size_t(piece)];
    const int64_t begin = piece * kPiece, end = std::min(params.count, begin + kPiece);
    splats.reserve(size_t(end - begin));
    for (int64_t i = begin; i < end; ++i) {
      CloudSplat splat;
      if (ProjectCloudPoint(params.camera, params.points[i], params.square_pixels,
                            params.disc_scale, &splat)) {
        splats.push_back(splat);
      }
    }
  });
  bands.splats.resize(size_t((params.camera.height + kBandRows - 1) / kBandRows));
  for (const auto& splats : bands.pieces) {
    for (const CloudSplat& splat : splats) {
      const int last = (splat.y1 - 1) / kBandRows;
      for (int band = splat.y0 / kBandRows; band <= last; ++band) {
        bands.splats[size_t(band)].push_back(&splat);
      }
    }
  }
  return bands;
}

// out = the extreme of `in` over a disc, inside the image; skip(y, dy): row y + dy changes nothing
// in row y.
template <typename Extreme, typename Skip>
void OverDisc(const uint8_t* in, int width, int height, int radius, const Extreme& extreme,
              const Skip& skip, uint8_t* out) {
  ParallelRanges(height, 32, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      uint8_t* const to = out + int64_t(y) * width;
      std::copy_n(in + int64_t(y) * width, width, to);
      for (int dy = std::max(-radius, -y); dy <= std::min(radius, height - 1 - y); ++dy) {
        if (skip(y, dy)) continue;
        const uint8_t* const from = in + int64_t(y + dy) * width;
        const int reach = DiscReach(radius, dy);
        for (int dx = -reach; dx <= reach; ++dx) {
          const int last = std::min(width, width - dx);
          for (int x = std::max(0, -dx); x < last; ++x) to[x] = extreme(to[x], from[x + dx]);
        }
      }
    }
  });
}

// `used[y]` is 0 where row y of the mask is 0 throughout.
void Close(const MakeMaskParams& params, const std::vector<uint8_t>& used) {
  const int width = params.width, height = params.height, radius = params.close_radius;
  std::vector<uint8_t> dilated(size_t(width) * size_t(height)), reached(size_t(height), 0);
  for (int y = 0; y < height; ++y) {
    if (!used[size_t(y)]) continue;
    const auto begin = reached.begin();
    std::fill(begin + std::max(0, y - radius), begin + std::min(height, y + radius + 1),
              uint8_t(1));
  }
  OverDisc(
      params.mask, width, height, radius, [](uint8_t a, uint8_t b) { return a > b ? a : b; },
      [&](int y, int dy) { return !used[size_t(y + dy)]; }, dilated.data());
  OverDisc(
      dilated.data(), width, height, radius, [](uint8_t a, uint8_t b) { return a < b ? a : b; },
      [&](int y, int) { return !reached[size_t(y)]; }, params.mask);
}

class CpuMaskOps : public MaskOps {
 protected:
  void DoSampleDepth(const SampleDepthParams& params) override;
  void DoCorrectDepth(const CorrectDepthParams& params) override;
  void DoDrawCloud(const DrawCloudParams& params) override;
  void DoMakeMask(const MakeMaskParams& params) override;
  void DoDropFaint(const DropFaintParams& params) override;
  void DoMarkSilhouette(const MarkSilhouetteParams& params) override;
  void DoEvidence(const EvidenceParams& params) override;
};

void CpuMaskOps::DoSampleDepth(const SampleDepthParams& params) {
  ParallelRanges(params.count, 1024, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      params.samples[i] =
          SampleDepthAt(params.depth, params.width, params.height, params.pixel_rows,
                        params.pixels[2 * i], params.pixels[2 * i + 1], params.max_spread);
    }
  });
}

void CpuMaskOps::DoCorrectDepth(const CorrectDepthParams& params) {
  const int64_t width = params.width;
  ParallelRanges(params.height, 64, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      if (!IsWantedRow(params.pixel_rows, y)) continue;
      float* const row = params.depth + y * width;
      for (int64_t x = 0; x < width; ++x) row[x] = CorrectedDepth(row[x], params.a, params.b);
    }
  });
}

void CpuMaskOps::DoDrawCloud(const DrawCloudParams& params) {
  const int width = params.camera.width, height = params.camera.height;
  const PixelRays rays = RaysOf(params.camera);
  const Bands bands = ProjectCloud(params);
  // The maximum does not depend on the points' order.
  ParallelTasks(int64_t(bands.splats.size()), [&](int64_t band) {
    const int top = int(band) * kBandRows, bottom = std::min(height, top + kBandRows);
    std::fill(params.coverage + int64_t(top) * width, params.coverage + int64_t(bottom) * width,
              0.0f);
    for (const CloudSplat* const splat : bands.splats[size_t(band)]) {
      for (int y = std::max(top, splat->y0); y < std::min(bottom, splat->y1); ++y) {
        if (!IsWantedRow(params.pixel_rows, y)) continue;
        for (int x = splat->x0; x < splat->x1; ++x) {
          const int64_t pixel = int64_t(y) * width + x;
          float& covered = params.coverage[pixel];
          if (covered >= splat->coverage) continue;
          covered = std::max(
              covered, CoverageAt(rays, *splat, x, y, params.depth[pixel], params.depth_tolerance));
        }
      }
    }
  });
}

void CpuMaskOps::DoMakeMask(const MakeMaskParams& params) {
  const int64_t width = params.width;
  std::vector<uint8_t> used(size_t(params.height), 0);
  ParallelRanges(params.height, 32, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      const float* const from = params.image + y * width;
      uint8_t* const to = params.mask + y * width;
      if (std::all_of(from, from + width, [](float value) { return value == 0; })) {
        std::fill_n(to, width, ToByte(params.offset));  // most rows of most views
        used[size_t(y)] = to[0];
        continue;
      }
      uint8_t any = 0;
      for (int64_t x = 0; x < width; ++x) {
        to[x] = ToByte(params.scale * double(from[x]) + params.offset);
        any |= to[x];
      }
      used[size_t(y)] = any;
    }
  });
  if (params.close_radius > 0) Close(params, used);
}

void CpuMaskOps::DoDropFaint(const DropFaintParams& params) {
  const int width = params.width, height = params.height, reach = params.reach;
  // Whether a pixel has a firm one beside it in its row; of rows without a firm one nothing.
  std::vector<uint8_t> beside(size_t(width) * size_t(height), 0);
  std::vector<uint8_t> has_firm(size_t(height), 0), has_faint(size_t(height), 0);
  ParallelRanges(height, 32, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      const uint8_t* const row = params.mask + y * width;
      uint8_t firm = 0, faint = 0;
      for (int x = 0; x < width; ++x) {
        firm |= row[x] & 128;
        faint |= row[x] < 128 ? row[x] : 0;
      }
      has_firm[size_t(y)] = firm;
      has_faint[size_t(y)] = faint;
      if (!firm) continue;
      uint8_t* const to = beside.data() + y * width;
      for (int dx = -std::min(reach, width - 1); dx <= std::min(reach, width - 1); ++dx) {
        const int last = std::min(width, width - dx);
        for (int x = std::max(0, -dx); x < last; ++x) to[x] |= row[x + dx] & 128;
      }
    }
  });
  ParallelRanges(height, 32, [&](int64_t begin, int64_t end) {
    std::vector<uint8_t> near(static_cast<size_t>(width));
    for (int y = int(begin); y < int(end); ++y) {
      if (!has_faint[size_t(y)]) continue;
      std::fill(near.begin(), near.end(), uint8_t(0));
      for (int other = std::max(0, y - reach); other <= std::min(height - 1, y + reach); ++other) {
        if (!has_firm[size_t(other)]) continue;
        const uint8_t* const from = beside.data() + int64_t(other) * width;
        for (int x = 0; x < width; ++x) near[size_t(x)] |= from[x];
      }
      uint8_t* const row = params.mask + int64_t(y) * width;
      for (int x = 0; x < width; ++x) {
        if (!near[size_t(x)]) row[x] = 0;  // a firm pixel is near itself
      }
    }
  });
}

// In place: painted pixels are read and not written, and of the others only a pixel's own.
void CpuMaskOps::DoMarkSilhouette(const MarkSilhouetteParams& params) {
  ParallelRanges(params.height, 32, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < params.width; ++x) {
        if (IsBesideSilhouette(params.mask, params.depth, params.width, params.height, params.jump,
                               x, y)) {
          params.depth[int64_t(y) * params.width + x] = kNoEvidence;
        }
      }
    }
  });
}

void CpuMaskOps::DoEvidence(const EvidenceParams& params) {
  const PixelRays rays = RaysOf(params.camera);
  const int64_t width = params.camera.width, channels = params.visible > 0 ? 4 : 2;
  ParallelRanges(params.camera.height, 8, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      float* out = params.residual + channels * y * width;
      if (!IsWantedRow(params.pixel_rows, y)) {
        std::fill_n(out, channels * width, 0.0f);
        continue;
      }
      const float* const depth = params.depth ? params.depth + y * width : nullptr;
      const uint8_t* const coverage = params.coverage ? params.coverage + y * width : nullptr;
      for (int x = 0; x < int(width); ++x, out += channels) {
        const glm::vec2 evidence = EvidenceAt(
            rays, x, y, depth ? depth[x] : 0, params.painted.data(), int(params.painted.size()),
            params.tolerance, params.unknown_weight, coverage ? coverage[x] : uint8_t(0));
        out[0] = params.scale * evidence.x;
        out[1] = params.scale * evidence.y;
        if (channels == 4) out[2] = params.visible * evidence.y, out[3] = params.visible;
      }
    }
  });
}

}  // namespace

std::unique_ptr<MaskOps> MakeCpuMaskOps() { return std::make_unique<CpuMaskOps>(); }

}  // namespace retint
