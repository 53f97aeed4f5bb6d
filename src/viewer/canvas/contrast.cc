// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/canvas/contrast.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "recolor/color_edit.h"
#include "recolor/main_color.h"
#include "render/color_encoding.h"
#include "viewer/canvas/overlay_color.h"

namespace retint {
namespace {

// In the order of kOverlayNames.
const QColor kOverlays[] = {{255, 140, 0}, {0, 150, 255}, {255, 0, 200}, {60, 220, 0}};
// Distance in red, green and blue, at most 441. At 150, azure stands out from sky blue, and orange
// from a fox.
constexpr double kStandsOut = 150;
constexpr double kMostSamples = 2e5;
constexpr double kCovers = 0.25;  // of the most that a Gaussian of the region covers
constexpr size_t kMostGaussians = 40000;

double Distance(const QColor& a, const QColor& b) {
  return std::hypot(a.red() - b.red(), a.green() - b.green(), a.blue() - b.blue());
}

QColor ToQColor(const Eigen::Vector3f& color) {
  const auto part = [&](int c) { return std::clamp(color[c], 0.0F, 1.0F); };
  return QColor::fromRgbF(part(0), part(1), part(2));
}

QColor preferred;  // for the whole program, like the theme

}  // namespace

void PreferOverlayColor(const QString& name) {
  const auto found = std::find_if(std::begin(kOverlayNames), std::end(kOverlayNames),
                                  [&](const char* one) { return name == one; });
  const auto at = size_t(found - std::begin(kOverlayNames));
  preferred = at < std::size(kOverlays) ? kOverlays[at] : QColor();
}

QColor ContrastingColor(const QColor& under, const QColor& current) {
  if (preferred.isValid()) return preferred;
  const QColor first = current.isValid() ? current : kOverlays[0];
  if (!under.isValid() || Distance(first, under) >= kStandsOut) return first;
  return *std::max_element(
      std::begin(kOverlays), std::end(kOverlays),
      [&](const QColor& a, const QColor& b) { return Distance(a, under) < Distance(b, under); });
}

QColor MeanColor(const QImage& picture, const std::function<bool(int, int)>& inside) {
  double sum[3] = {}, count = 0;
  const double pixels = double(picture.width()) * picture.height();
  const int step = std::max(1, int(std::sqrt(pixels / kMostSamples)));
  for (int y = 0; y < picture.height(); y += step) {
    for (int x = 0; x < picture.width(); x += step) {
      if (!inside(x, y)) continue;
      const QRgb pixel = picture.pixel(x, y);
      sum[0] += qRed(pixel), sum[1] += qGreen(pixel), sum[2] += qBlue(pixel);
      ++count;
    }
  }
  if (count == 0) return {};
  return QColor(int(sum[0] / count), int(sum[1] / count), int(sum[2] / count));
}

std::optional<Eigen::Vector3f> RegionColors::Of(const RegionSelection& selection,
                                                const GaussianModel& original) {
  const auto [found, fresh] = colors_.try_emplace(selection.id);
  if (!fresh) return found->second;
  const std::vector<float>& shares = selection.shares;
  const auto block = size_t(original.NumShCoeffs()) * 3;
  std::vector<std::pair<double, size_t>> weights;  // with the index of the Gaussian
  double most = 0;
  for (size_t g = 0; g < shares.size() && (g + 1) * block <= original.sh.size(); ++g) {
    if (shares[g] <= 0) continue;
    const double opacity = 1 / (1 + std::exp(-double(original.opacity_logits[g])));
    weights.emplace_back(opacity * double(shares[g]), g);
    most = std::max(most, weights.back().first);
  }
  // A Gaussian that covers almost nothing says little about the region's color.
  std::erase_if(weights, [&](const auto& one) { return one.first < kCovers * most; });
  const size_t step = weights.size() / kMostGaussians + 1;
  const BaseColors base(original);
  std::vector<float> colors;
  for (size_t i = 0; i < weights.size(); i += step) {
    const Eigen::Vector3f color = base.Of(weights[i].second);
    colors.insert(colors.end(), color.data(), color.data() + 3);
  }
  if (const auto main = FindMainColor(colors)) {
    found->second = Eigen::Vector3f(main->rgb.data());
  }
  return found->second;
}

QColor RegionColors::Before(const Region& region, const GaussianModel& original) {
  const auto color = Of(*region.selection, original);
  return color ? ToQColor(*color) : QColor();
}

QColor RegionColors::After(const Region& region, const GaussianModel& original) {
  const ColorEdit edit = region.EffectiveEdit();
  const auto color = Of(*region.selection, original);
  // An edit without a measured main color shows the original.
  if (!color || edit.NeedsMainColor()) return Before(region, original);
  return ToQColor(CompiledEdit(edit).Apply(*color));
}

}  // namespace retint
