// SPDX-License-Identifier: BSD-3-Clause
// The quality of an edit: PSNR inside and outside the mask against the edited targets, bleed, worst
// views, SH range.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "recolor/color_edit.h"
#include "recolor/sh_refitter.h"
#include "render/renderer.h"

namespace retint {

struct QualityNumbers {
  int views = 0;
  double psnr_inside_before = 0,
         psnr_inside_after = 0;  // dB over pixels with mask >= 0.5, peak 1, all views pooled
  double psnr_outside = 0;       // dB over pixels with mask 0, result against original target
  double bleed = 0;              // mean |after - before| outside, in [0, 1]
  // Share of the pixels inside whose edited color, before it is brought into the range, no screen
  // shows.
  double out_of_gamut = 0;
};

struct ViewQuality {
  std::string name;
  bool heldout = false;
  double coverage = 0, psnr_inside = 0, psnr_outside = 0;
};

struct ShRange {
  float min = 0, max = 0;
};

struct QualityReport {
  QualityNumbers train, heldout;
  std::vector<ViewQuality> worst;  // up to 5, lowest psnr_inside first
  ShRange sh_before, sh_after;
  int row_step = 1;  // of which rows of pixels were measured, see EvaluateEdit()
  std::vector<ViewQuality>
      views;  // that hold a masked pixel, all of them, lowest psnr_inside first
};

// Sums over the pixels of one view; squared errors, and values of pixels.
struct ErrorSums {
  double inside_before = 0, inside_after = 0, outside = 0, bleed = 0;
  int64_t inside_values = 0, outside_values = 0, out_of_gamut = 0;
  void operator+=(const ErrorSums& other);
};
struct ViewErrors {
  std::string name;
  double coverage = 0;  // of the mask
  ErrorSums sums;
};

// EvaluateEdit() in two steps, for a splat that is opened in parts, in one process. First the
// errors of `targets`, in their order. Then the report on the errors of all views, in the order of
// the views, without the ranges of SH. Stage "evaluate", with the views that `progress` counts.
struct EvaluationProgress {
  size_t done = 0, total = 0;  // views
};
std::vector<ViewErrors> MeasureErrors(Renderer& renderer, std::span<const float> sh_before,
                                      std::span<const float> sh_after,
                                      const std::vector<RefitTarget>& targets,
                                      const ColorEdit& edit, EvaluationProgress* progress,
                                      Monitor& monitor);
QualityReport ReportOn(const std::vector<ViewErrors>& train,
                       const std::vector<ViewErrors>& heldout);

// Renders every target before and after. A perfect match is reported as 99 dB. The renderer is left
// with `sh_before`. `row_step`, 1, 2, 4, 8 or 16: measures every so many rows of pixels only, other
// ones in every view.
QualityReport EvaluateEdit(Renderer& renderer, std::span<const float> sh_before,
                           std::span<const float> sh_after, const std::vector<RefitTarget>& train,
                           const std::vector<RefitTarget>& heldout, const ColorEdit& edit,
                           Monitor& monitor, int row_step = 1);

}  // namespace retint
