// SPDX-License-Identifier: BSD-3-Clause
// What an edit did: PSNR inside and outside the mask against the edited targets, bleed, worst
// views, SH range.
#pragma once

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
  // Share of the pixels inside whose edited color, before soft clipping, no screen shows.
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
  std::vector<ViewQuality>
      views;  // that hold a masked pixel, all of them, lowest psnr_inside first
};

// Renders every target before and after. A perfect match is reported as 99 dB. The renderer is left
// with `sh_before`.
QualityReport EvaluateEdit(Renderer& renderer, std::span<const float> sh_before,
                           std::span<const float> sh_after, const std::vector<RefitTarget>& train,
                           const std::vector<RefitTarget>& heldout, const ColorEdit& edit,
                           Monitor& monitor);

}  // namespace retint
