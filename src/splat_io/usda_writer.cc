// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/usda_writer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "splat_io/axes.h"
#include "splat_io/usd_splats.h"

namespace retint {
namespace {

constexpr size_t kBlockRows = 4096;

struct ArrayText {
  UsdArray array;
  const char* declaration;
};
constexpr ArrayText kWrittenArrays[] = {
    {UsdArray::kQuats, "quatf[] orientations"},
    {UsdArray::kOpacities, "float[] opacities"},
    {UsdArray::kMeans, "point3f[] positions"},
    {UsdArray::kScales, "float3[] scales"},
    {UsdArray::kColors, "float3[] radiance:sphericalHarmonicsCoefficients"},
};

}  // namespace

void AppendUsdaElement(std::span<const float> numbers, std::string& text) {
  std::array<char, 32> digits;
  if (numbers.size() > 1) text += '(';
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0) text += ", ";
    const auto end = std::to_chars(digits.begin(), digits.end(), numbers[i]).ptr;
    text.append(digits.begin(), end);
  }
  if (numbers.size() > 1) text += ')';
}

std::array<std::array<float, 3>, 2> UsdExtent(const GaussianModel& model) {
  std::array<std::array<float, 3>, 2> corners;
  corners[0].fill(std::numeric_limits<float>::max());
  corners[1].fill(std::numeric_limits<float>::lowest());
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    const auto scales = std::span(model.log_scales).subspan(3 * g, 3);
    const float reach =
        3 * std::exp(std::min(*std::max_element(scales.begin(), scales.end()), 80.0f));
    for (size_t i = 0; i < 3; ++i) {
      const float x = kRightUpBack[i] * model.means[3 * g + i];
      corners[0][i] = std::min(corners[0][i], x - reach);
      corners[1][i] = std::max(corners[1][i], x + reach);
    }
  }
  return corners;
}

void WriteUsda(const GaussianModel& model, Monitor& monitor,
               const std::function<void(std::string_view)>& write) {
  std::string text = "#usda 1.0\n(\n    defaultPrim = \"";
  text.append(kUsdSplatName).append("\"\n    doc = \"Retint\"\n    metersPerUnit = 1\n");
  text.append("    upAxis = \"Y\"\n)\n\ndef ").append(kUsdSplatType).append(" \"");
  text.append(kUsdSplatName).append("\" (\n    prepend apiSchemas = [\"ColorSpaceAPI\"]\n)\n{\n");
  text.append("    uniform token colorSpace:name = \"").append(NameOf(model.traits.color_space));
  text.append("\"\n    float3[] extent = [");
  const auto corners = UsdExtent(model);
  AppendUsdaElement(corners[0], text);
  text += ", ";
  AppendUsdaElement(corners[1], text);
  text += "]\n";
  const size_t count = model.NumGaussians();
  for (size_t a = 0; a < std::size(kWrittenArrays); ++a) {
    text += "    " + std::string(kWrittenArrays[a].declaration) + " = [";
    const size_t width = kWrittenArrays[a].array == UsdArray::kQuats       ? 4
                         : kWrittenArrays[a].array == UsdArray::kOpacities ? 1
                                                                           : 3;
    for (size_t g = 0; g < count; ++g) {
      if (g % kBlockRows == 0) {
        monitor.Step("save", static_cast<double>(a * count + g),
                     static_cast<double>(std::size(kWrittenArrays) * count));
        write(text);
        text.clear();
      }
      const SplatRow row = FlipAxes(GetRow(model, g), kRightUpBack);
      const std::vector<float> values = UsdValues(kWrittenArrays[a].array, row, model.sh_degree);
      for (size_t i = 0; i < values.size(); i += width) {
        if (g + i > 0) text += ", ";
        AppendUsdaElement(std::span(values).subspan(i, width), text);
      }
    }
    text += ']';
    if (kWrittenArrays[a].array == UsdArray::kColors) {
      text += " (\n        elementSize = " + std::to_string(model.NumShCoeffs()) +
              "\n        interpolation = \"vertex\"\n    )";
    }
    text += '\n';
  }
  text += "    uniform int radiance:sphericalHarmonicsDegree = " + std::to_string(model.sh_degree) +
          "\n    uniform token projectionModeHint = \"perspective\"\n"
          "    uniform token sortingModeHint = \"zDepth\"\n}\n";
  write(text);
}

}  // namespace retint
