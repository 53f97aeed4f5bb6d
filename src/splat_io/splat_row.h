// SPDX-License-Identifier: BSD-3-Clause
// Shared by the codecs of packed formats: one Gaussian at a time, activations and their inverses,
// and the check that each of them owes to GaussianModel::Validate().
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
  std::array<float, 48> sh{};  // [K, 3], the first 3 K values; the rest is zero
};

// The place of one Gaussian's values: in a model, or in a row.
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

// Opacities of 8 bits hold 0 and 1, whose logits are infinite: they are kept off both ends.
inline float Logit(double opacity) {
  const double kept = std::clamp(opacity, 1e-6, 1 - 1e-6);
  return static_cast<float>(std::log(kept / (1 - kept)));
}
// The same of i / 255, for every i.
const std::array<float, 256>& LogitsOfBytes();
inline float LogitOfByte(uint8_t opacity) { return LogitsOfBytes()[opacity]; }
inline double Sigmoid(double logit) { return 1 / (1 + std::exp(-logit)); }

// Linear scales may have underflowed to 0, whose logarithm is the least normal float's here.
inline float LogScale(float scale) { return std::log(scale == 0 ? 1.17549435e-38f : scale); }

// The integer nearest to x within [0, most].
inline uint32_t RoundTo(double x, uint32_t most) {
  return static_cast<uint32_t>(std::lround(std::clamp(x, 0.0, static_cast<double>(most))));
}

// IEEE 754 binary16.
float HalfToFloat(uint16_t half);

// The unit quaternion of the same rotation; a zero one means no rotation (docs/conventions.md).
std::array<double, 4> Normalized(const std::array<float, 4>& quat_wxyz);

// A rotation packed as the three smaller components of its unit quaternion, each in
// [-1/sqrt(2), 1/sqrt(2)], and the index of the largest, which is made positive and left out.
struct SmallestThree {
  int largest = 0;               // index into the quaternion as it was given
  std::array<double, 3> rest{};  // the others in their order
};
SmallestThree PackSmallestThree(const std::array<double, 4>& unit);
inline std::array<double, 4> UnpackSmallestThree(const SmallestThree& packed) {
  std::array<double, 4> unit{};
  double left = 1;
  const auto largest = static_cast<size_t>(packed.largest);
  for (size_t i = 0; i < 3; ++i) {
    // Without a branch, which no processor foresees.
    unit[i + (i >= largest ? 1 : 0)] = packed.rest[i];
    left -= packed.rest[i] * packed.rest[i];
  }
  unit[largest] = std::sqrt(std::max(0.0, left));
  return unit;
}

// GaussianModel::Validate() naming the file that the model was read from; nothing where bad rows
// are to be dropped.
void ValidateRead(const GaussianModel& model, const std::filesystem::path& path, BadRows bad);
// Before a write: RunError naming `path` for a model that is empty, inconsistent or not finite.
void ValidateWrite(const GaussianModel& model, const std::filesystem::path& path);

// What `format` (a codec's name) loses, which holds no higher degree and none of the columns that
// only a .ply holds; one sentence each. It says these render models besides kDefault, and these
// color spaces besides kSrgbDisplay.
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
