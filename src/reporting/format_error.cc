// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/format_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "base/color_difference.h"
#include "base/parallel.h"
#include "splat_io/splat_io.h"

namespace retint {
namespace {

constexpr double kBin = 0.01;    // DeltaE00
constexpr size_t kBins = 12001;  // up to 120, more than two colors of a screen differ
using Json = nlohmann::ordered_json;
using Histogram = std::array<int64_t, kBins>;

CieLab LabAt(const Image& image, size_t pixel) {
  std::array<float, 3> rgb;
  for (size_t c = 0; c < 3; ++c) rgb[c] = std::clamp(image.data[3 * pixel + c], 0.0F, 1.0F);
  return CieLabFromSrgb(rgb.data());
}

// Of every pixel.
std::vector<float> Differences(const Image& a, const Image& b) {
  std::vector<float> differences(a.NumPixels());
  ParallelRanges(a.height, 8, [&](int64_t begin, int64_t end) {
    const auto width = static_cast<size_t>(a.width);
    for (auto p = static_cast<size_t>(begin) * width; p < static_cast<size_t>(end) * width; ++p) {
      differences[p] = static_cast<float>(ColorDifference(LabAt(a, p), LabAt(b, p)));
    }
  });
  return differences;
}

double Percentile99(const Histogram& histogram, int64_t count) {
  int64_t above = 0;
  for (size_t bin = kBins; bin-- > 0;) {
    above += histogram[bin];
    if (100 * above > count) return kBin * static_cast<double>(bin);
  }
  return 0;
}

}  // namespace

FormatError MeasureFormatError(Renderer& before, const GaussianModel& after,
                               const Reconstruction& model, const std::vector<const View*>& views,
                               Monitor& monitor) {
  RendererOptions options;
  options.cache_bytes = 0;
  Renderer written(before.shared_backend(), after, options);
  RenderRequest request;
  request.cache = false;
  const size_t count = std::min(views.size(), kFormatErrorViews);
  FormatError error;
  Histogram histogram{};
  int64_t pixels = 0;
  double total = 0;
  for (size_t i = 0; i < count; ++i) {
    monitor.Step("color error", static_cast<double>(i), static_cast<double>(count));
    const View& view = *views[i * views.size() / count];
    const PosedCamera posed = model.Posed(view);
    const std::vector<float> differences =
        Differences(before.Render(posed, request).rgb, written.Render(posed, request).rgb);
    double sum = 0;
    for (const float difference : differences) {
      sum += static_cast<double>(difference);
      ++histogram[std::min(kBins - 1, static_cast<size_t>(static_cast<double>(difference) / kBin))];
    }
    const double mean = sum / static_cast<double>(differences.size());
    if (i == 0 || mean > error.worst) {
      error.worst = mean;
      error.worst_view = view.name;
    }
    total += sum;
    pixels += static_cast<int64_t>(differences.size());
  }
  monitor.Step("color error", 1, 1);
  error.views = static_cast<int>(count);
  error.mean = total / static_cast<double>(std::max<int64_t>(pixels, 1));
  error.percentile_99 = Percentile99(histogram, pixels);
  return error;
}

std::optional<FormatError> MeasureWritten(OpenScene& scene, std::span<const float> sh,
                                          const std::filesystem::path& path, Monitor& monitor) {
  const SplatCodec& codec = CodecForWriting(path);
  if (!codec.Rounds()) return std::nullopt;
  const GaussianModel back = codec.Read(path, monitor);
  scene.renderer().SetSh(sh);
  FormatError error = MeasureFormatError(scene.renderer(), back, scene.reconstruction(),
                                         scene.reconstruction().ViewsByName(), monitor);
  error.format = codec.Name();
  return error;
}

std::string ToJson(const FormatError& error) {
  const Json json = {{"name", error.format},
                     {"views", error.views},
                     {"color_error",
                      {{"views", error.views},
                       {"mean", error.mean},
                       {"percentile_99", error.percentile_99},
                       {"worst", error.worst},
                       {"worst_view", error.worst_view}}}};
  // A view's name may be bytes that are no text.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string WithFormatError(const std::string& report, const std::optional<FormatError>& error) {
  if (!error) return report;
  Json json = Json::parse(report);
  json["format"] = Json::parse(ToJson(*error));
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string DescribeFormatError(const FormatError& error) {
  std::array<char, 160> text;
  std::snprintf(text.data(), text.size(),
                "DeltaE00 %.2f on average, %.2f and more in 1 %% of the pixels, over %d views",
                error.mean, error.percentile_99, error.views);
  return text.data();
}

}  // namespace retint
