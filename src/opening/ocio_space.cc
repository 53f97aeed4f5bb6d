// SPDX-License-Identifier: BSD-3-Clause
#include "opening/ocio_space.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include <OpenColorIO/OpenColorIO.h>
#include <Eigen/LU>

#include "base/color_difference.h"
#include "base/edit_distance.h"
#include "base/error.h"
#include "base/files.h"
#include "base/option_name.h"
#include "base/printable.h"
#include "kernels/common/color_ops.h"
#include "render/color_encoding.h"

namespace retint {
namespace {

namespace ocio = OCIO_NAMESPACE;

constexpr int kSamples = 4097;         // of the curve
constexpr double kMostDifference = 1;  // CIEDE2000
constexpr size_t kSuggested = 5;

// sRGB by its names in the configs of ACES, the Academy's and others.
constexpr const char* kSrgbNames[] = {
    "sRGB - Texture",           "srgb_texture", "srgb_tx", "sRGB Encoded Rec.709 (sRGB)",
    "Utility - sRGB - Texture", "sRGB"};

std::string ConfigOf(const std::string& given) {
  if (!given.empty()) return given;
  const char* const named = std::getenv("OCIO");
  CheckOption(named && *named != 0, OptionName("space") + " needs " + OptionName("ocio") +
                                        ", or a config in the environment variable OCIO");
  return named;
}

ocio::ConstConfigRcPtr ReadConfig(const std::string& path) {
  if (!path.starts_with("ocio://") && !IsFile(path)) throw InputError(path, "is not a file");
  ocio::SetLoggingLevel(ocio::LOGGING_LEVEL_NONE);
  ocio::ClearAllCaches();  // a file of the same name may have changed
  try {
    return ocio::Config::CreateFromFile(path.c_str());
  } catch (const std::exception& error) {
    throw InputError(path, "is not a config that OpenColorIO " + std::string(ocio::GetVersion()) +
                               " reads: " + OneLine(error.what()));
  }
}

std::vector<std::string> NamesOf(const ocio::Config& config) {
  std::vector<std::string> names;
  const auto of = std::pair(ocio::SEARCH_REFERENCE_SPACE_ALL, ocio::COLORSPACE_ALL);
  for (int i = 0; i < config.getNumColorSpaces(of.first, of.second); ++i) {
    names.emplace_back(config.getColorSpaceNameByIndex(of.first, of.second, i));
  }
  return names;
}

std::string Listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

// A config's conversion between two spaces, as exact as it can be.
class Conversion {
 public:
  Conversion(const ocio::Config& config, const char* from, const char* to)
      : processor_(
            config.getProcessor(from, to)->getOptimizedCPUProcessor(ocio::OPTIMIZATION_LOSSLESS)) {}
  Eigen::Vector3f operator()(Eigen::Vector3f color) const {
    processor_->applyRGB(color.data());
    return color;
  }

 private:
  ocio::ConstCPUProcessorRcPtr processor_;
};

Eigen::Vector3d LightOf(const Eigen::Vector3f& srgb) {
  return srgb.unaryExpr([](float v) { return LinearFromSrgb(v); }).cast<double>();
}

// `to_srgb` as a curve, seen in grays, and a matrix, seen in one channel's change at a time.
LightMap CurveAndMatrix(const Conversion& to_srgb) {
  LightMap map;
  float most = -HUGE_VALF;
  for (int i = 0; i < kSamples; ++i) {
    const float x = kCurveEnd * float(i) / (kSamples - 1);
    most = std::max(most, float(LightOf(to_srgb(Eigen::Vector3f::Constant(x))).mean()));
    map.curve.push_back(most);
  }
  // Both, and what the matrix makes of them, are colors that every sRGB space has.
  float ends[3] = {0.3F, 0.4F, 0};
  InverseCurveColor(map.curve.data(), kSamples, ends);
  const Eigen::Vector3f gray = Eigen::Vector3f::Constant(ends[0]);
  Eigen::Matrix3d to_light;
  for (int c = 0; c < 3; ++c) {
    Eigen::Vector3f color = gray;
    color[c] = ends[1];
    to_light.col(c) = (LightOf(to_srgb(color)) - LightOf(to_srgb(gray))) / 0.1;
  }
  using RowMajor = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
  Eigen::Map<RowMajor>(map.to_light.data()) = to_light.cast<float>();
  Eigen::Map<RowMajor>(map.from_light.data()) = to_light.inverse().cast<float>();
  return map;
}

double Difference(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  const auto shown = [](const Eigen::Vector3f& color) {
    return CieLabFromSrgb(color.cwiseMax(0.0F).cwiseMin(1.0F).eval().data());
  };
  return ColorDifference(shown(a), shown(b));
}

// The largest error of the map in either direction, over the colors of a screen. NaN: no such map.
double WorstDifference(const std::shared_ptr<const LightMap>& map, const Conversion& to_srgb,
                       const Conversion& from_srgb) {
  constexpr int kSide = 9;
  const SingleColors colors(map);
  double worst = 0;
  for (int i = 0; i < kSide * kSide * kSide; ++i) {
    const Eigen::Vector3f shown =
        Eigen::Vector3f(float(i % kSide), float(i / kSide % kSide), float(i / kSide / kSide)) /
        (kSide - 1);
    // A splat's blended colors are not below 0: ACEScc has no black for it.
    const Eigen::Vector3f there = from_srgb(shown).cwiseMax(0.0F);
    Eigen::Vector3f encoded = there, decoded = shown;
    colors.ToSrgb(encoded.data());
    colors.FromSrgb(decoded.data());
    const Eigen::Vector3f expected = to_srgb(there);
    for (const double one :
         {Difference(encoded, expected), Difference(to_srgb(decoded), expected)}) {
      if (!(one <= worst)) worst = one;
    }
    if (std::isnan(worst)) break;
  }
  return worst;
}

}  // namespace

std::shared_ptr<const LightMap> ReadOcioSpace(const OcioSpace& space) {
  const std::string path = ConfigOf(space.config);
  const ocio::ConstConfigRcPtr config = ReadConfig(path);
  const ocio::ConstColorSpaceRcPtr own = config->getColorSpace(space.name.c_str());
  if (!own) {
    const std::vector<std::string> names = NamesOf(*config);
    throw InputError(path, "has no color space '" + space.name + "'. Nearest of its " +
                               std::to_string(names.size()) + ": " +
                               Listed(NearestNames(space.name, names, kSuggested)));
  }
  const auto* const srgb =
      std::find_if(std::begin(kSrgbNames), std::end(kSrgbNames),
                   [&](const char* name) { return config->getColorSpace(name) != nullptr; });
  if (srgb == std::end(kSrgbNames)) {
    throw InputError(path, "has no sRGB space. Give it the alias sRGB; its color spaces: " +
                               Listed(NearestNames("sRGB", NamesOf(*config), kSuggested)));
  }
  double worst = 0;
  std::shared_ptr<LightMap> map;
  try {
    const Conversion to_srgb(*config, own->getName(), *srgb);
    map = std::make_shared<LightMap>(CurveAndMatrix(to_srgb));
    map->name = own->getName();
    worst = WorstDifference(map, to_srgb, Conversion(*config, *srgb, own->getName()));
  } catch (const ocio::Exception& error) {
    throw InputError(path, "does not convert between '" + space.name + "' and '" + *srgb +
                               "': " + OneLine(error.what()));
  }
  if (!(worst <= kMostDifference)) {
    throw InputError(path, "'" + space.name +
                               "' differs from sRGB by more than a curve and a matrix. Name a "
                               "logarithmic, linear or gamma space");
  }
  return map;
}

std::vector<std::string> OcioSpaceNames(const std::string& config) {
  return NamesOf(*ReadConfig(ConfigOf(config)));
}

void ChooseSpace(const OcioSpace& space, GaussianModel& model) {
  CheckOption(!space.name.empty() || space.config.empty(),
              OptionName("ocio") + " needs " + OptionName("space"));
  if (!space.name.empty()) model.traits.chosen_space = ReadOcioSpace(space);
}

}  // namespace retint
