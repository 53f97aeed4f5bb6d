// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/spz_rows.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/sh_rotation.h"

namespace retint {
namespace {

constexpr float kColorScale = 0.15f;
constexpr size_t kShValues = 45;  // above degree 0 and up to degree 3

// A quarter turn about x, from a turned file's axes to the usual ones, or back.
const Eigen::Quaterniond& QuarterTurn(bool back) {
  static const double half = std::sqrt(0.5);
  static const Eigen::Quaterniond there(half, -half, 0, 0), back_again(half, half, 0, 0);
  return back ? back_again : there;
}
const ShRotation& ShQuarterTurn(bool back) {
  static const ShRotation there(QuarterTurn(false)), back_again(QuarterTurn(true));
  return back ? back_again : there;
}

void TurnMean(float* mean, bool back) {
  std::swap(mean[1], mean[2]);
  mean[back ? 1 : 2] *= -1;
}

void TurnQuat(float* wxyz, bool back) {
  const Eigen::Quaterniond turned =
      QuarterTurn(back) * Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  wxyz[0] = static_cast<float>(turned.w());
  for (int i = 0; i < 3; ++i) wxyz[i + 1] = static_cast<float>(turned.vec()[i]);
}

uint8_t ByteOf(const char* from) { return static_cast<uint8_t>(*from); }

// ---- From the bytes of a Gaussian in a section to values of the model

void UnpackPosition(const SpzData& data, const char* from, float* to) {
  for (size_t i = 0; i < 3; ++i) {
    if (data.header.version == 1) {
      to[i] = HalfToFloat(LoadAs<uint16_t>(from + 2 * i));
    } else {
      // Shifted into the upper three bytes, to get the sign.
      const auto bits = static_cast<int32_t>(uint32_t{ByteOf(from + 3 * i)} << 8 |
                                             uint32_t{ByteOf(from + 3 * i + 1)} << 16 |
                                             uint32_t{ByteOf(from + 3 * i + 2)} << 24);
      const float step = 1.0f / static_cast<float>(1u << data.header.fractional_bits);
      to[i] = static_cast<float>(bits >> 8) * step;
    }
  }
  if (data.turned) TurnMean(to, /*back=*/false);
  for (size_t i = 0; i < 3; ++i) to[i] *= data.axes[i];
}

void UnpackColor(const char* from, float* to) {
  static const std::array<float, 256> colors = [] {
    std::array<float, 256> table;
    for (size_t i = 0; i < table.size(); ++i) {
      table[i] = (static_cast<float>(i) / 255 - 0.5f) / kColorScale;
    }
    return table;
  }();
  for (size_t i = 0; i < 3; ++i) to[i] = colors[ByteOf(from + i)];
}

void UnpackScale(const char* from, float* to) {
  for (size_t i = 0; i < 3; ++i) to[i] = static_cast<float>(ByteOf(from + i)) / 16 - 10;
}

// A component of version 3: sign and magnitude.
double UnpackTen(uint32_t ten) {
  static const std::array<double, 1024> values = [] {
    std::array<double, 1024> table;
    for (uint32_t i = 0; i < table.size(); ++i) {
      table[i] = (i & 512u ? -1 : 1) * std::sqrt(0.5) * (i & 511u) / 511;
    }
    return table;
  }();
  return values[ten & 1023u];
}

void UnpackRotation(const SpzData& data, const char* from, float* to) {
  std::array<double, 4> xyzw;
  if (data.header.version < 3) {
    double left = 1;
    for (size_t i = 0; i < 3; ++i) {
      xyzw[i] = ByteOf(from + i) / 127.5 - 1;
      left -= xyzw[i] * xyzw[i];
    }
    xyzw[3] = std::sqrt(std::max(0.0, left));
  } else {
    const auto word = LoadAs<uint32_t>(from);
    SmallestThree packed;
    packed.largest = static_cast<int>(word >> 30);
    for (size_t i = 0; i < 3; ++i) packed.rest[i] = UnpackTen(word >> (20 - 10 * i));
    xyzw = UnpackSmallestThree(packed);
  }
  to[0] = static_cast<float>(xyzw[3]);
  for (size_t i = 0; i < 3; ++i) to[i + 1] = static_cast<float>(xyzw[i]);
  if (data.turned) TurnQuat(to, /*back=*/false);
  FlipQuat(to, data.axes);
}

// The degree that fits into a row.
int SpzDegree(const SpzData& data) { return std::min<int>(data.header.sh_degree, 3); }

float UnpackSh(char byte) { return static_cast<float>(static_cast<uint8_t>(byte)) / 128 - 1; }

std::array<float, kShValues> ShSigns(const AxisSigns& axes) {
  std::array<float, kShValues> signs;
  for (size_t i = 0; i < kShValues; ++i) signs[i] = ShSign(i / 3 + 1, axes);
  return signs;
}

// ---- Back to bytes, in the file's axes

// False if a value needs more than 24 bits.
bool PackPosition(const std::array<float, 3>& position, int fractional_bits, char* to) {
  for (size_t i = 0; i < 3; ++i) {
    const double fixed = std::round(std::ldexp(double{position[i]}, fractional_bits));
    if (std::abs(fixed) > kSpzFixedMost) return false;
    const auto bits = static_cast<uint32_t>(static_cast<int32_t>(fixed));
    for (size_t b = 0; b < 3; ++b) to[3 * i + b] = static_cast<char>(bits >> (8 * b));
  }
  return true;
}

void PackRotation(const SpzHeader& header, const std::array<float, 4>& quat_wxyz, char* to) {
  const std::array<double, 4> q = Normalized(quat_wxyz);
  if (header.version < 3) {
    for (size_t i = 0; i < 3; ++i) {
      const double positive = q[0] < 0 ? -q[i + 1] : q[i + 1];
      to[i] = static_cast<char>(RoundTo((positive + 1) * 127.5, 255));
    }
    return;
  }
  const SmallestThree packed = PackSmallestThree({q[1], q[2], q[3], q[0]});
  auto word = static_cast<uint32_t>(packed.largest);
  for (const double value : packed.rest) {
    const uint32_t magnitude = RoundTo(std::abs(value) / std::sqrt(0.5) * 511, 511);
    word = word << 10 | (value < 0 ? 512u : 0u) | magnitude;
  }
  StoreAs(to, word);
}

// Keeps 5 bits at degree 1 and 4 above, as the reference does. `k` starts at 1.
char PackSh(float sh, size_t k) {
  const int bucket = k < 4 ? 8 : 16;
  const int fine = static_cast<int>(std::lround(std::clamp(sh, -2.0f, 2.0f) * 128)) + 128;
  const int coarse = (std::max(fine, 0) + bucket / 2) / bucket * bucket;
  return static_cast<char>(std::min(coarse, 255));
}

// Sign of a value of degree 4 in the model's axes. Parity of the functions in x, y and z: bits 0,
// 1, 2.
float Band4Sign(const AxisSigns& axes, size_t value) {
  static constexpr std::array<int, 9> kParity = {3, 6, 3, 6, 0, 5, 0, 5, 0};
  float sign = 1;
  for (size_t i = 0; i < 3; ++i) {
    if (kParity[value / 3] >> i & 1) sign *= axes[i];
  }
  return sign;
}

}  // namespace

std::array<size_t, SpzData::kSections> SpzData::Widths() const {
  const size_t side = size_t{header.sh_degree} + 1;
  const size_t position = header.version == 1 ? 6 : 9, rotation = header.version < 3 ? 3 : 4;
  return {position, 1, 3, 3, rotation, 3 * (side * side - 1)};
}

size_t SpzData::SectionAt(size_t section) const {
  const auto widths = Widths();
  return kSpzHeaderBytes +
         header.count * std::accumulate(widths.begin(), widths.begin() + section, size_t{0});
}

SplatRow DecodeSpzRow(const SpzData& data, size_t g) {
  SplatRow row;
  UnpackPosition(data, data.At(SpzData::kPositions, g), row.mean.data());
  row.opacity_logit = LogitOfByte(ByteOf(data.At(SpzData::kOpacities, g)));
  UnpackColor(data.At(SpzData::kColors, g), row.sh.data());
  UnpackScale(data.At(SpzData::kScales, g), row.log_scale.data());
  UnpackRotation(data, data.At(SpzData::kRotations, g), row.quat_wxyz.data());
  const size_t values = std::min(data.Widths()[SpzData::kSh], kShValues);
  const char* sh = data.At(SpzData::kSh, g);
  for (size_t i = 0; i < values; ++i) row.sh[3 + i] = UnpackSh(sh[i]);
  if (data.turned) ShQuarterTurn(/*back=*/false).Apply(SpzDegree(data), row.sh.data());
  for (size_t i = 0; i < values; ++i) row.sh[3 + i] *= ShSign(i / 3 + 1, data.axes);
  return row;
}

void DecodeSpzSection(const SpzData& data, SpzData::Section section, size_t begin, size_t end,
                      GaussianModel& model) {
  const size_t width = data.Widths()[section];
  const auto sh_width = 3 * static_cast<size_t>(model.NumShCoeffs());
  const char* from = data.At(section, begin);
  const auto each = [&](const auto& unpack) {
    for (size_t g = begin; g < end; ++g, from += width) unpack(g);
  };
  switch (section) {
    case SpzData::kPositions:
      return each([&](size_t g) { UnpackPosition(data, from, &model.means[3 * g]); });
    case SpzData::kOpacities:
      return each([&](size_t g) { model.opacity_logits[g] = LogitOfByte(ByteOf(from)); });
    case SpzData::kColors:
      return each([&](size_t g) { UnpackColor(from, &model.sh[sh_width * g]); });
    case SpzData::kScales:
      return each([&](size_t g) { UnpackScale(from, &model.log_scales[3 * g]); });
    case SpzData::kRotations:
      return each([&](size_t g) { UnpackRotation(data, from, &model.quats_wxyz[4 * g]); });
    default: {
      const size_t values = std::min(width, kShValues);
      const std::array<float, kShValues> signs = ShSigns(data.axes);
      return each([&](size_t g) {
        float* to = model.sh.data() + sh_width * g + 3;
        for (size_t i = 0; i < values; ++i) to[i] = UnpackSh(from[i]);
        if (data.turned) ShQuarterTurn(/*back=*/false).Apply(model.sh_degree, to - 3);
        for (size_t i = 0; i < values; ++i) to[i] *= signs[i];
      });
    }
  }
}

bool EncodeSpzRow(SpzData& data, size_t g, const SplatRow& model_row, const SplatRow* was) {
  SplatRow row = FlipAxes(model_row, data.axes);
  if (data.turned) {
    TurnMean(row.mean.data(), /*back=*/true);
    TurnQuat(row.quat_wxyz.data(), /*back=*/true);
    ShQuarterTurn(/*back=*/true).Apply(SpzDegree(data), row.sh.data());
  }
  const SpzHeader& header = data.header;
  if ((!was || model_row.mean != was->mean) &&
      !PackPosition(row.mean, header.fractional_bits, data.At(SpzData::kPositions, g))) {
    return false;
  }
  if (!was || model_row.quat_wxyz != was->quat_wxyz) {
    PackRotation(header, row.quat_wxyz, data.At(SpzData::kRotations, g));
  }
  if (!was || model_row.opacity_logit != was->opacity_logit) {
    *data.At(SpzData::kOpacities, g) =
        static_cast<char>(RoundTo(255 * Sigmoid(row.opacity_logit), 255));
  }
  for (size_t i = 0; i < 3; ++i) {
    if (!was || model_row.log_scale[i] != was->log_scale[i]) {
      data.At(SpzData::kScales, g)[i] =
          static_cast<char>(RoundTo((double{row.log_scale[i]} + 10) * 16, 255));
    }
    if (!was || model_row.sh[i] != was->sh[i]) {
      data.At(SpzData::kColors, g)[i] =
          static_cast<char>(RoundTo(255 * (0.5 + double{kColorScale} * row.sh[i]), 255));
    }
  }
  const size_t values = std::min(data.Widths()[SpzData::kSh], kShValues);
  const auto same = [&](size_t i) { return was && model_row.sh[i] == was->sh[i]; };
  bool all_same = true;  // a rotation mixes the values
  for (size_t i = 0; i < values; ++i) all_same = all_same && same(3 + i);
  for (size_t i = 0; i < values; ++i) {
    if (data.turned ? all_same : same(3 + i)) continue;
    data.At(SpzData::kSh, g)[i] = PackSh(row.sh[3 + i], i / 3 + 1);
  }
  return true;
}

ShBand4 DecodeSpzBand4(const SpzData& data, size_t g) {
  ShBand4 values;
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = UnpackSh(data.At(SpzData::kSh, g)[kShValues + i]);
  }
  if (data.turned) ShQuarterTurn(/*back=*/false).ApplyToBand4(values.data());
  for (size_t i = 0; i < values.size(); ++i) values[i] *= Band4Sign(data.axes, i);
  return values;
}

void EncodeSpzBand4(SpzData& data, size_t g, const ShBand4& values, const ShBand4* was) {
  if (was && values == *was) return;
  ShBand4 in_file = values;
  for (size_t i = 0; i < values.size(); ++i) in_file[i] *= Band4Sign(data.axes, i);
  if (data.turned) ShQuarterTurn(/*back=*/true).ApplyToBand4(in_file.data());
  for (size_t i = 0; i < values.size(); ++i) {
    if (was && !data.turned && values[i] == (*was)[i]) continue;
    data.At(SpzData::kSh, g)[kShValues + i] = PackSh(in_file[i], 16);
  }
}

}  // namespace retint
