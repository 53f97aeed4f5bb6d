// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/usd_splats.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "base/printable.h"
#include "scene/transform.h"
#include "splat_io/axes.h"
#include "splat_io/parallel_rows.h"

namespace retint {
namespace {

constexpr const char* kArrayNames[kUsdArrays] = {"positions", "orientations", "scales", "opacities",
                                                 "radiance:sphericalHarmonicsCoefficients"};
constexpr int kMostDegree = 3;

size_t Coefficients(int degree) { return static_cast<size_t>((degree + 1) * (degree + 1)); }

// The number of elements of `array` per Gaussian.
size_t ElementsOf(UsdArray array, const UsdSplat& splat) {
  return array == UsdArray::kColors ? Coefficients(splat.degree) : 1;
}

// From z up to y up: z becomes y, y becomes -z.
Eigen::Matrix4d YUpFromZUp() {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return matrix;
}

}  // namespace

uint16_t FloatToHalf(float value) {
  const auto bits = std::bit_cast<uint32_t>(value);
  const auto sign = static_cast<uint16_t>(bits >> 16 & 0x8000);
  const float size = std::abs(value);
  if (std::isnan(value)) return static_cast<uint16_t>(sign | 0x7e00);
  if (size >= 65520) return static_cast<uint16_t>(sign | 0x7c00);
  // Steps are 2^-24 below the smallest normal half, 2^(exponent - 10) above. nearbyint rounds ties
  // to even, and an overflowing mantissa carries into the exponent.
  const int exponent = std::max(std::ilogb(std::max(size, 1e-30f)), -14);
  const auto steps = static_cast<uint32_t>(std::nearbyint(std::ldexp(size, 10 - exponent)));
  return static_cast<uint16_t>(sign | (steps + (static_cast<uint32_t>(exponent + 14) << 10)));
}

namespace {

// The color space of the attribute, or of the nearest prim with one (UsdColorSpaceAPI).
std::string ColorSpaceOf(const UsdStage& stage, const UsdPrim& prim, const UsdValue* colors) {
  if (colors && !colors->color_space.empty()) return colors->color_space;
  for (const UsdPrim* at = &prim;; at = &stage.prims[static_cast<size_t>(at->parent)]) {
    const auto found = at->attributes.find("colorSpace:name");
    if (found != at->attributes.end() && !found->second.text.empty()) return found->second.text;
    if (at->parent < 0) return {};
  }
}

constexpr size_t kNamedOthers = 4;  // number of prims in a sentence

}  // namespace

void UsdSplats::Fail(const std::string& fault) const { throw InputError(path_, fault); }

UsdSplats::UsdSplats(const UsdStage& stage, const std::filesystem::path& path)
    : stage_(stage), path_(path) {
  for (const UsdPrim& prim : stage.prims) {
    const bool is_splat = prim.type == kUsdSplatType;
    if (is_splat && IsShown(stage, prim)) {
      Add(prim);
      continue;
    }
    if (prim.type.empty() || prim.type == "Xform" || prim.type == "Scope") continue;
    if (is_splat) ++hidden_;
    if (++num_others_ > kNamedOthers) continue;
    others_ += (others_.empty() ? "" : ", ") + Printable(prim.name.substr(0, 80));
  }
  if (!splats_.empty()) return;
  std::string fault = "holds no Gaussians: no prim is a " + std::string(kUsdSplatType);
  if (hidden_ > 0) fault += " that is shown";
  if (stage.refers) fault += ". It refers to other layers: open the one that holds them";
  if (stage.variants) fault += ". Variants are not looked into";
  Fail(fault);
}

void UsdSplats::Add(const UsdPrim& prim) {
  UsdSplat splat;
  splat.prim = &prim;
  for (size_t a = 0; a < kUsdArrays; ++a) {
    for (const char* suffix : {"", "h"}) {  // floats come first if both exist
      const auto found = prim.attributes.find(kArrayNames[a] + std::string(suffix));
      if (found == prim.attributes.end()) continue;
      if (!found->second.has_floats() && found->second.animated) {
        Fail("prim " + Printable(prim.name.substr(0, 80)) + ": its " + found->first +
             " are animated, which is not supported");
      }
      if (!found->second.has_floats() || splat.arrays[a]) continue;
      splat.arrays[a] = &found->second;
      splat.names[a] = found->first;
    }
  }
  const UsdValue* means = splat.arrays[0];
  if (!means) return;  // no particles
  splat.count = means->floats.size() / 3;
  SetDegree(splat);
  for (size_t a = 0; a < kUsdArrays; ++a) {
    const UsdValue* values = splat.arrays[a];
    const size_t expected = splat.count * ElementsOf(static_cast<UsdArray>(a), splat);
    if (values && values->floats.size() / values->components != expected) {
      Fail("prim " + Printable(prim.name.substr(0, 80)) + ": " + splat.names[a] + " has " +
           std::to_string(values->floats.size() / values->components) + " values, not the " +
           std::to_string(expected) + " of " + std::to_string(splat.count) + " Gaussians");
    }
  }
  Eigen::Matrix4d matrix = StageFromPrim(stage_, prim, path_);
  if (stage_.meters_per_unit) {
    matrix.topRows<3>() *= *stage_.meters_per_unit;
  }
  if (stage_.z_up) matrix = YUpFromZUp() * matrix;
  const auto placed = SimilarityOf(matrix);
  if (!placed) {
    Fail("prim " + Printable(prim.name.substr(0, 80)) +
         " is stretched, sheared or mirrored, which is not supported");
  }
  splat.color_space =
      ColorSpaceOf(stage_, prim, splat.arrays[static_cast<size_t>(UsdArray::kColors)]);
  // The identity stays exact.
  splat.frame_from_prim = matrix.isIdentity(0) ? Sim3d{} : *placed;
  splats_.push_back(std::move(splat));
}

void UsdSplats::SetDegree(UsdSplat& splat) const {
  const UsdValue* colors = splat.arrays[static_cast<size_t>(UsdArray::kColors)];
  if (!colors) return;  // gray, of degree 0
  const auto authored = splat.prim->attributes.find("radiance:sphericalHarmonicsDegree");
  const bool has = authored != splat.prim->attributes.end() && authored->second.numbers.size() == 1;
  const double degree = has ? authored->second.numbers[0] : 3;  // the schema's fallback
  if (!(degree >= 0 && degree <= 16) || degree != std::floor(degree)) {
    Fail("prim " + Printable(splat.prim->name.substr(0, 80)) + " has no SH degree from 0 to 16");
  }
  splat.degree = static_cast<int>(degree);
}

GaussianModel UsdSplats::Load(Monitor& monitor) const {
  GaussianModel model;
  size_t total = 0;
  int degree = 0;
  for (const UsdSplat& splat : splats_) {
    total += splat.count;
    degree = std::max(degree, std::min(splat.degree, kMostDegree));
  }
  model.Resize(total, degree);
  size_t first = 0;
  for (const UsdSplat& splat : splats_) {
    LoadPrim(splat, first, model, monitor);
    first += splat.count;
  }
  AddNotes(model);
  return model;
}

void UsdSplats::LoadPrim(const UsdSplat& splat, size_t first, GaussianModel& model,
                         Monitor& monitor) const {
  const Placement placement(splat.frame_from_prim);
  const size_t file_width = 3 * Coefficients(splat.degree);
  const size_t width = 3 * Coefficients(std::min(splat.degree, kMostDegree));
  const auto values = [&](UsdArray array, size_t g, size_t components, float otherwise, float* to) {
    const UsdValue* from = splat.arrays[static_cast<size_t>(array)];
    for (size_t i = 0; i < components; ++i) {
      to[i] = from ? from->floats[g * components + i] : otherwise;
    }
  };
  const auto report = [&](size_t done) {
    monitor.Step("load", static_cast<double>(first + done),
                 static_cast<double>(model.NumGaussians()));
  };
  ForRows(splat.count, report, [&](size_t begin, size_t end) {
    for (size_t g = begin; g < end; ++g) {
      SplatRow row;
      float opacity = 1;
      std::array<float, 3> scale{};
      values(UsdArray::kMeans, g, 3, 0, row.mean.data());
      values(UsdArray::kQuats, g, 4, 0, row.quat_wxyz.data());  // zero means no rotation
      values(UsdArray::kScales, g, 3, 1, scale.data());
      values(UsdArray::kOpacities, g, 1, 1, &opacity);
      if (!(opacity >= 0 && opacity <= 1)) {
        Fail("Gaussian " + std::to_string(first + g) + ": opacity is not from 0 to 1");
      }
      for (size_t i = 0; i < 3; ++i) {
        if (scale[i] < 0) Fail("Gaussian " + std::to_string(first + g) + ": scale is negative");
        row.log_scale[i] = LogScale(scale[i]);
      }
      row.opacity_logit = Logit(opacity);
      if (const UsdValue* colors = splat.arrays[static_cast<size_t>(UsdArray::kColors)]) {
        std::copy_n(&colors->floats[g * file_width], width, row.sh.data());
      }
      placement.Move(row, std::min(splat.degree, kMostDegree));
      SetRow(model, first + g, FlipAxes(row, kRightUpBack));
    }
  });
}

void UsdSplats::AddNotes(GaussianModel& model) const {
  std::vector<std::string>& notes = model.source.notes;
  const auto note_if = [&](bool holds, const std::string& text) {
    if (holds && std::find(notes.begin(), notes.end(), text) == notes.end()) notes.push_back(text);
  };
  std::string others = others_;
  if (num_others_ > kNamedOthers) {
    others += " and " + std::to_string(num_others_ - kNamedOthers) + " more";
  }
  note_if(num_others_ > 0,
          "other prims of the stage are not used, and are lost unless the output has the same "
          "extension and the same Gaussians: " +
              others);
  note_if(stage_.refers, "other layers that the stage refers to are not used");
  note_if(stage_.variants, "variants of the stage are not used");
  note_if(!stage_.meters_per_unit, "the stage has no metersPerUnit: a unit is taken as it is");
  for (const UsdSplat& splat : splats_) {
    const std::optional<ColorSpace> space = ColorSpaceNamed(
        splat.color_space.empty() ? NameOf(ColorSpace::kSrgbDisplay) : splat.color_space);
    if (&splat == &splats_[0]) model.traits.color_space = space.value_or(ColorSpace::kSrgbDisplay);
    note_if(!space, "the colors' space is unknown to Retint: they are used as they are");
    note_if(space && *space != model.traits.color_space,
            "prims have colors in different spaces: all are taken as those of the first one");
    note_if(splat.degree > kMostDegree, "spherical harmonics above degree 3 are not used");
    const auto hint = splat.prim->attributes.find("projectionModeHint");
    note_if(hint != splat.prim->attributes.end() && hint->second.text == "tangential",
            "the stage asks for a tangential projection: Retint's is perspective");
  }
}

std::vector<float> UsdValues(UsdArray array, const SplatRow& row, int degree) {
  switch (array) {
    case UsdArray::kMeans:
      return {row.mean.begin(), row.mean.end()};
    case UsdArray::kQuats: {
      const std::array<double, 4> q = Normalized(row.quat_wxyz);
      return {float(q[0]), float(q[1]), float(q[2]), float(q[3])};
    }
    case UsdArray::kScales: {
      std::vector<float> scales;
      for (const float scale : row.log_scale) scales.push_back(std::exp(std::min(scale, 88.0f)));
      return scales;
    }
    case UsdArray::kOpacities:
      return {static_cast<float>(Sigmoid(row.opacity_logit))};
    default:
      return {row.sh.begin(), row.sh.begin() + static_cast<ptrdiff_t>(3 * Coefficients(degree))};
  }
}

}  // namespace retint
