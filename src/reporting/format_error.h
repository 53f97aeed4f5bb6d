// SPDX-License-Identifier: BSD-3-Clause
// The errors of renders by the rounding of a splat's format, reported before the file is put in
// place.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "opening/open_scene.h"

namespace retint {

inline constexpr size_t kFormatErrorViews = 6;

struct FormatError {
  std::string format;  // "SPZ"
  int views = 0;
  double mean = 0, percentile_99 = 0;  // DeltaE00 of all pixels
  double worst = 0;                    // the highest mean of a view
  std::string worst_view;
};

// DeltaE00 between the renders of `before` and of `after` in up to 6 of `views`, spread evenly over
// them, at least one. Stage: "color error".
FormatError MeasureFormatError(Renderer& before, const GaussianModel& after,
                               const Reconstruction& model, const std::vector<const View*>& views,
                               Monitor& monitor);

// The same of a scene that was written to `path` with the coefficients `sh`, [N, K, 3]; nullopt
// where the format keeps floats. InputError where the file cannot be read back.
std::optional<FormatError> MeasureWritten(OpenScene& scene, std::span<const float> sh,
                                          const std::filesystem::path& path, Monitor& monitor);

// A JSON object, and the report (reporting/report.h) with that as "format".
std::string ToJson(const FormatError& error);
std::string WithFormatError(const std::string& report, const std::optional<FormatError>& error);

// "DeltaE00 0.31 on average, 1.9 in the worst 1 % of the pixels; over 6 views"
std::string DescribeFormatError(const FormatError& error);

}  // namespace retint
