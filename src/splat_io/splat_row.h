// SPDX-License-Identifier: BSD-3-Clause
// Shared by codecs of packed formats: one Gaussian at a time, activations and their inverses, and
// the validation that each codec must do.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "kernels/common/sh.h"  // color = 0.5 + kShC0 * sh_0
#include "scene/gaussian_model.h"
#include "splat_io/splat_io.h"

namespace retint {

// One Gaussian with the raw values of GaussianModel.
struct SplatRow {
  std::array<float, 3> mean{};
  std::array<float, 4> quat_wxyz{};
  std::array<float, 3> log_scale{};
  float opacity_logit = 0;
  std::array<float, 48> sh{};  // [K, 3]; the rest is zero
};

// Pointers to one Gaussian's values, in a model or in a row.
struct RowPlaces {
  float *mean, *quat_wxyz, *log_scale, *opacity_logit, *sh;

  explicit RowPlaces(SplatRow& row)
      : mean(row.mean.data()),
        quat_wxyz(row.quat_wxyz.data()),
        log_scale(row.log_scale.data()),
        opacity_logit(&row.opacity_logit),
        sh(row.sh.data()) {}
  RowPlaces(GaussianModel& model, size_t g)
      : mean(&model.means[3 * g]),
        quat_wxyz(&model.quats_wxyz[4 * g]),
        log_scale(&model.log_scales[3 * g]),
        opacity_logit(&model.opacity_logits[g]),
        sh(&model.sh[3 * static_cast<size_t>(model.NumShCoeffs()) * g]) {}
};

SplatRow GetRow(const GaussianModel& model, size_t g);
void SetRow(GaussianModel& model, size_t g, const SplatRow& row);

// 8-bit opacities include 0 and 1, whose logits are infinite: they are clamped.
inline float Logit(double opacity) {
  const double kept = std::clamp(opacity, 1e-6, 1 - 1e-6);
  return static_cast<float>(std::log(kept / (1 - kept)));
}
// Logit(i / 255) for every i.
const std::array<float, 256>& LogitsOfBytes();
inline float LogitOfByte(uint8_t opacity) { return LogitsOfBytes()[opacity]; }
inline double Sigmoid(double logit) { return 1 / (1 + std::exp(-logit)); }

// Linear scales may underflow to 0; the smallest normal float replaces it.
inline float LogScale(float scale) { return std::log(scale == 0 ? 1.17549435e-38f : scale); }

// The integer nearest to x within [0, most].
inline uint32_t RoundTo(double x, uint32_t most) {
  return static_cast<uint32_t>(std::lround(std::clamp(x, 0.0, static_cast<double>(most))));
}

// IEEE 754 binary16.
float HalfToFloat(uint16_t half);

// The unit quaternion of the same rotation; 0 means no rotation (docs/conventions.md).
std::array<double, 4> Normalized(const std::array<float, 4>& quat_wxyz);

// A rotation as the three smaller components of its unit quaternion, each in [-1/sqrt(2),
// 1/sqrt(2)], and the index of the largest, which is made positive and not stored.
struct SmallestThree {
  int largest = 0;               // index into the quaternion
  std::array<double, 3> rest{};  // the others in their order
};
SmallestThree PackSmallestThree(const std::array<double, 4>& unit);
inline std::array<double, 4> UnpackSmallestThree(const SmallestThree& packed) {
  std::array<double, 4> unit{};
  double left = 1;
  const auto largest = static_cast<size_t>(packed.largest);
  for (size_t i = 0; i < 3; ++i) {
    // Branchless: a branch here would be unpredictable.
    unit[i + (i >= largest ? 1 : 0)] = packed.rest[i];
    left -= packed.rest[i] * packed.rest[i];
  }
  unit[largest] = std::sqrt(std::max(0.0, left));
  return unit;
}

// GaussianModel::Validate(), with the path of the model's file. Does nothing if bad rows are to be
// dropped.
void ValidateRead(const GaussianModel& model, const std::filesystem::path& path, BadRows bad);
// Before a write: RunError with `path` for a model that is empty, inconsistent or not finite.
void ValidateWrite(const GaussianModel& model, const std::filesystem::path& path);

// One sentence for each loss in `format` (a codec's name). It holds SH up to `max_sh_degree` and no
// columns that only a .ply holds. It can store `render_models` besides kDefault, and `color_spaces`
// besides kSrgbDisplay.
std::vector<std::string> CommonLosses(const GaussianModel& model, int max_sh_degree,
                                      std::string_view format,
                                      std::span<const RenderModel> render_models = {},
                                      std::span<const ColorSpace> color_spaces = {});

template <typename T>
T LoadAs(const char* from) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}
template <typename T>
void StoreAs(char* to, T value) {
  std::memcpy(to, &value, sizeof(T));
}

}  // namespace retint
