// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/main_color.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/median.h"
#include "kernels/common/color_spaces.h"

namespace retint {
namespace {

constexpr float kDark = 0.05f;  // OKLab lightness below which hue is noise
constexpr float kReach = 1.0f;  // |a| / lightness stays below this for colors in gamut
constexpr int kBins = 100;      // a side, over [-kReach, kReach]
constexpr float kBandwidth = 0.08f;
constexpr int kRounds = 10;
constexpr double kLit = 0.7, kFullLight = 0.95;  // quantiles of the lightness of its pixels

struct Sample {
  float lightness, a, b;  // a and b over the lightness
};

std::vector<Sample> Samples(std::span<const float> pixels) {
  std::vector<Sample> samples;
  samples.reserve(pixels.size() / 3);
  for (size_t i = 0; i + 2 < pixels.size(); i += 3) {
    float rgb[3];
    for (size_t c = 0; c < 3; ++c) rgb[c] = std::clamp(pixels[i + c], 0.0f, 1.0f);
    const OkLab lab = OkLabFromSrgb(rgb);
    const float scale = 1 / std::max(lab.lightness, kDark);
    samples.push_back({lab.lightness, lab.a * scale, lab.b * scale});
  }
  return samples;
}

int Bin(float x) {
  return std::clamp(int((x + kReach) / (2 * kReach) * float(kBins)), 1, kBins - 2);
}

// The middle of the fullest 3 x 3 bins; a sample counts by its lightness.
Sample FullestBin(const std::vector<Sample>& samples) {
  std::vector<double> bins(size_t(kBins) * kBins, 0.0);
  for (const Sample& s : samples) {
    bins[size_t(Bin(s.b)) * kBins + size_t(Bin(s.a))] += double(s.lightness) + 1e-3;
  }
  double most = -1;
  Sample best{};
  for (int y = 1; y + 1 < kBins; ++y) {
    for (int x = 1; x + 1 < kBins; ++x) {
      double sum = 0;
      for (int j = y - 1; j <= y + 1; ++j) {
        for (int i = x - 1; i <= x + 1; ++i) sum += bins[size_t(j) * kBins + size_t(i)];
      }
      if (sum <= most) continue;
      most = sum;
      const auto middle = [](int bin) { return (float(bin) + 0.5f) * 2 * kReach / kBins - kReach; };
      best = {0, middle(x), middle(y)};
    }
  }
  return best;
}

bool IsNear(const Sample& s, const Sample& center) {
  return std::hypot(s.a - center.a, s.b - center.b) <= kBandwidth;
}

}  // namespace

std::optional<MainColor> FindMainColor(std::span<const float> pixels,
                                       std::span<const float> elsewhere) {
  const std::vector<Sample> samples = Samples(pixels);
  if (samples.empty()) return std::nullopt;
  Sample center = FullestBin(samples);
  for (int round = 0; round < kRounds; ++round) {  // mean shift
    double a = 0, b = 0, weight = 0;
    for (const Sample& s : samples) {
      if (!IsNear(s, center)) continue;
      const double w = double(s.lightness) + 1e-3;
      a += w * double(s.a), b += w * double(s.b), weight += w;
    }
    if (weight > 0) center = {0, float(a / weight), float(b / weight)};
  }
  std::vector<float> lights;
  for (const Sample& s : samples) {
    if (IsNear(s, center)) lights.push_back(s.lightness);
  }
  if (lights.empty()) {
    for (const Sample& s : samples) lights.push_back(s.lightness);
  }
  const float lightness = Quantile(lights, kLit);
  float full = Quantile(lights, kFullLight);
  lights.clear();
  for (const Sample& s : Samples(elsewhere)) {
    if (IsNear(s, center)) lights.push_back(s.lightness);
  }
  if (!lights.empty()) full = std::max(full, Quantile(lights, kFullLight));
  MainColor main;
  SrgbFromOkLab({lightness, center.a * lightness, center.b * lightness}, main.rgb.data());
  for (float& value : main.rgb) value = std::clamp(value, 0.0f, 1.0f);
  // OKLab's lightness is the cube root of light.
  const float ratio = full / std::max(lightness, 1e-3f);
  main.brightest = std::clamp(ratio * ratio * ratio, 1.0f, 100.0f);
  return main;
}

}  // namespace retint
