// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cpu/stereo_match.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "kernels/cpu/memory.h"

namespace retint {
namespace {

constexpr int kCensusPiece = 32;  // rows
constexpr int kPathRows = 4;      // paths along rows that advance together
constexpr int kPathColumns = 32;  // and along columns

// States of several paths, see StereoStep.
class PathStates {
 public:
  PathStates(int paths, int count)
      : count_(count),
        values_(size_t(paths) * size_t(StereoStateStride(count)), 255),
        least_(size_t(paths)) {
    Start(0, paths);
  }
  uint8_t* values(int path) { return values_.data() + path * StereoStateStride(count_); }
  uint8_t* least(int path) { return least_.data() + path; }
  // At the start of a path there is no previous pixel.
  void Start(int first, int end) {
    for (int p = first; p < end; ++p) {
      std::fill_n(values(p) + kStereoSlack, count_, uint8_t{0});
      *least(p) = 0;
    }
  }
  void Load(int path, const uint8_t* from) {
    std::copy_n(from, count_, values(path) + kStereoSlack);
    *least(path) = *std::min_element(from, from + count_);
  }
  void Save(int path, uint8_t* to) { std::copy_n(values(path) + kStereoSlack, count_, to); }

 private:
  int count_;
  std::vector<uint8_t> values_, least_;
};

class Matcher {
 public:
  Matcher(const StereoKernels& kernels, const StereoMatchParams& params)
      : kernels_(kernels),
        params_(params),
        axes_(AxesOf(params.shifted)),
        width_(axes_.width),
        height_(axes_.height),
        count_(params.count),
        bands_((height_ + kStereoBand - 1) / kStereoBand),
        own_stride_(width_ + kStereoSlack),
        shifted_stride_(width_ + params.lowest + count_ + kStereoSlack) {}

  void Run() {
    const StereoView &reference = params_.reference, &shifted = params_.shifted;
    own_.resize(size_t(height_) * kCensusBytes * size_t(own_stride_));
    shifted_.resize(size_t(height_) * kCensusBytes * size_t(shifted_stride_));
    Transform(reference, shifted.x - reference.x, shifted.y - reference.y, false);
    Transform(shifted, 0, 0, true);
    SweepDown();
    const int rows = std::min(height_, kStereoBand);
    costs_.resize(size_t(rows) * RowSize());
    sums_.resize(size_t(rows) * RowSize());
    PathStates upwards(width_, count_);
    for (int band = bands_ - 1; band >= 0; --band) {
      AlongRows(band);
      AlongColumns(band, upwards);
      Select(band);
    }
  }

 private:
  size_t RowSize() const { return size_t(width_) * size_t(count_); }
  int RowsOf(int band) const { return std::min(kStereoBand, height_ - band * kStereoBand); }
  uint8_t* Checkpoint(int band, int u) {  // of the path from above; none of band 0
    return checkpoints_.data() + size_t(band - 1) * RowSize() + size_t(u) * size_t(count_);
  }

  // Census of `view`, which holds the matched image from (offset_x, offset_y) on.
  void Transform(const StereoView& view, int offset_x, int offset_y, bool is_shifted) {
    ParallelTasks((height_ + kCensusPiece - 1) / kCensusPiece, [&](int64_t piece) {
      const int v0 = int(piece) * kCensusPiece, v1 = std::min(v0 + kCensusPiece, height_);
      const size_t stride = size_t(width_ + 2 * kCensusU + kStereoSlack);
      std::vector<float> gray(stride * size_t(v1 - v0 + 2 * kCensusV));
      for (int v = v0 - kCensusV; v < v1 + kCensusV; ++v) {
        float* to = &gray[stride * size_t(v - v0 + kCensusV)];
        for (int u = -kCensusU; u < width_ + kCensusU; ++u) {
          const auto pixel = axes_.At(std::clamp(u, 0, width_ - 1), std::clamp(v, 0, height_ - 1));
          *to++ = view.gray[int64_t(pixel.y + offset_y) * view.width + pixel.x + offset_x];
        }
      }
      std::vector<uint8_t> planes(is_shifted ? size_t(kCensusBytes) * size_t(own_stride_) : 0);
      for (int v = v0; v < v1; ++v) {
        const float* rows[2 * kCensusV + 1];
        for (int j = 0; j <= 2 * kCensusV; ++j) rows[j] = &gray[stride * size_t(v - v0 + j)];
        uint8_t* to = is_shifted ? planes.data() : OwnCensus(v);
        kernels_.census_row(rows, width_, to, own_stride_);
        for (int j = 0; j < kCensusBytes && is_shifted; ++j) {
          std::reverse_copy(to + j * own_stride_, to + j * own_stride_ + width_,
                            ShiftedCensus(v) + j * shifted_stride_);
        }
      }
    });
  }
  uint8_t* OwnCensus(int v) { return own_.data() + int64_t(v) * kCensusBytes * own_stride_; }
  uint8_t* ShiftedCensus(int v) {
    return shifted_.data() + int64_t(v) * kCensusBytes * shifted_stride_;
  }

  void CostRow(int v, int u0, int u1, uint8_t* costs) {
    kernels_.cost_row({OwnCensus(v), ShiftedCensus(v), own_stride_, shifted_stride_, u0, u1, width_,
                       params_.lowest, count_},
                      costs);
  }
  StereoStep MakeStep(int paths, ptrdiff_t stride) const {
    return {nullptr,
            nullptr,
            nullptr,
            nullptr,
            stride,
            false,
            paths,
            count_,
            uint8_t(params_.p1),
            uint8_t(params_.p2)};
  }

  void SweepDown() {
    checkpoints_.resize(size_t(bands_ - 1) * RowSize());
    const int last = (bands_ - 1) * kStereoBand;
    ParallelTasks((width_ + kPathColumns - 1) / kPathColumns, [&](int64_t block) {
      const int u0 = int(block) * kPathColumns, u1 = std::min(u0 + kPathColumns, width_);
      std::vector<uint8_t> costs(size_t(u1 - u0) * size_t(count_));
      PathStates states(u1 - u0, count_);
      StereoStep step = MakeStep(u1 - u0, count_);
      step.costs = costs.data();
      step.states = states.values(0);
      step.least = states.least(0);
      for (int v = 0; v < last; ++v) {
        CostRow(v, u0, u1, costs.data());
        kernels_.step(step);
        if ((v + 1) % kStereoBand != 0) continue;
        for (int u = u0; u < u1; ++u) states.Save(u - u0, Checkpoint((v + 1) / kStereoBand, u));
      }
    });
  }

  // Costs of a band, and the paths from the left and the right.
  void AlongRows(int band) {
    const int rows = RowsOf(band);
    ParallelTasks((rows + kPathRows - 1) / kPathRows, [&](int64_t piece) {
      const int v0 = int(piece) * kPathRows, v1 = std::min(v0 + kPathRows, rows);
      uint8_t* costs = costs_.data() + size_t(v0) * RowSize();
      uint16_t* sums = sums_.data() + size_t(v0) * RowSize();
      for (int v = v0; v < v1; ++v) {
        CostRow(band * kStereoBand + v, 0, width_, costs + size_t(v - v0) * RowSize());
      }
      PathStates states(v1 - v0, count_);
      StereoStep step = MakeStep(v1 - v0, ptrdiff_t(RowSize()));
      step.states = states.values(0);
      step.least = states.least(0);
      for (const bool from_left : {true, false}) {
        step.first = from_left;
        states.Start(0, v1 - v0);
        for (int i = 0; i < width_; ++i) {
          const ptrdiff_t at = ptrdiff_t(from_left ? i : width_ - 1 - i) * count_;
          step.costs = costs + at;
          step.sums = sums + at;
          kernels_.step(step);
        }
      }
    });
  }

  // The path from above, from the band's top on, and that from below, which goes on above.
  void AlongColumns(int band, PathStates& upwards) {
    const int rows = RowsOf(band);
    ParallelTasks((width_ + kPathColumns - 1) / kPathColumns, [&](int64_t block) {
      const int u0 = int(block) * kPathColumns, u1 = std::min(u0 + kPathColumns, width_);
      PathStates downwards(u1 - u0, count_);
      for (int u = u0; u < u1 && band > 0; ++u) downwards.Load(u - u0, Checkpoint(band, u));
      StereoStep step = MakeStep(u1 - u0, count_);
      const auto advance = [&](int v) {
        const size_t at = size_t(v) * RowSize() + size_t(u0) * size_t(count_);
        step.costs = costs_.data() + at;
        step.sums = sums_.data() + at;
        kernels_.step(step);
      };
      step.states = downwards.values(0);
      step.least = downwards.least(0);
      for (int v = 0; v < rows; ++v) advance(v);
      step.states = upwards.values(u0);
      step.least = upwards.least(u0);
      for (int v = rows - 1; v >= 0; --v) advance(v);
    });
  }

  // The best disparity of each pixel, where that of the pixel it leads to leads back.
  void Select(int band) {
    ParallelTasks(RowsOf(band), [&](int64_t row) {
      const size_t other_size = size_t(width_ + params_.lowest + count_);
      std::vector<StereoBest> best(static_cast<size_t>(width_));
      std::vector<uint16_t> other_sum(other_size, 0xffff), other_index(other_size);
      kernels_.select_row({sums_.data() + size_t(row) * RowSize(), width_, params_.lowest, count_,
                           best.data(), other_sum.data(), other_index.data()});
      const int v = band * kStereoBand + int(row);
      for (int u = 0; u < width_; ++u) {
        const auto pixel = axes_.At(u, v);
        const int x = pixel.x + params_.shifted.x, y = pixel.y + params_.shifted.y;
        if (x < 0 || y < 0 || x >= params_.width || y >= params_.height) continue;
        params_.disparity[int64_t(y) * params_.width + x] =
            Disparity(u, best[size_t(u)], other_sum.data(), other_index.data());
      }
    });
  }
  float Disparity(int u, const StereoBest& best, const uint16_t* other_sum,
                  const uint16_t* other_index) const {
    const int whole = params_.lowest + best.index;
    if (u < whole || !IsUnique(best.least, best.second, params_.uniqueness_percent)) return -1.0f;
    float s = float(whole);
    if (best.index > 0 && best.index < count_ - 1) {
      s += SubPixelOffset(best.below, best.least, best.above);
    }
    const int there = u - int(s + 0.5f), from_end = width_ - 1 - there;
    if (there < 0 || other_sum[from_end] == 0xffff) return -1.0f;
    const float back = float(params_.lowest + other_index[from_end]);
    return std::fabs(back - s) > params_.tolerance ? -1.0f : s;
  }

  const StereoKernels& kernels_;
  const StereoMatchParams& params_;
  const MatcherAxes axes_;
  const int width_, height_, count_, bands_;
  const ptrdiff_t own_stride_, shifted_stride_;
  LargeVector<uint8_t> own_, shifted_;  // census [height, kCensusBytes, stride]
  LargeVector<uint8_t> checkpoints_;    // [bands - 1, width, count]
  LargeVector<uint8_t> costs_;          // of a band [rows, width, count]
  LargeVector<uint16_t> sums_;
};

}  // namespace

void MatchStereoOnCpu(const StereoKernels& kernels, const StereoMatchParams& params) {
  const MatcherAxes axes = AxesOf(params.shifted);
  if (params.lowest >= axes.width) {  // nothing can be seen in both
    std::fill_n(params.disparity, int64_t(params.width) * params.height, -1.0f);
    return;
  }
  Matcher(kernels, params).Run();
}

}  // namespace retint
