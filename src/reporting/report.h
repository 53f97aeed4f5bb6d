// SPDX-License-Identifier: BSD-3-Clause
// The figures of a run, as report.json: stable keys (docs/formats.md lists them), milliseconds,
// megabytes of 2^20 bytes.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/option.h"
#include "recolor/finer_gaussians.h"
#include "recolor/quality_report.h"
#include "recolor/sh_refitter.h"
#include "selecting/region_selection.h"

namespace retint {

// Of one region of several.
struct RegionReport {
  std::string name;
  ColorEdit edit;  // at the region's strength
  QualityReport quality;
  std::optional<RefineSummary> refine;  // where Gaussians were split
};

// The figures for an object whose true masks are known.
struct TrueMaskReport {
  double mask_iou = 0;    // of the edit's masks with them, mean over the views that either shows in
  QualityReport quality;  // inside, outside and the targets by them
};

// Of a splat that was opened in parts.
struct OutOfCoreReport {
  int64_t gaussians = 0;                            // in memory at a time, at most
  int64_t blocks = 0, all_blocks = 0;               // of the index: of that part, and in all
  int views = 0;                                    // that take part in the edit
  double memory_limit_mb = 0, device_limit_mb = 0;  // 0: none
  double index_ms = 0;                              // to build the index; 0: it was there
};

struct RunReport {
  std::string backend;
  int ranks = 1;         // processes among which the views were shared
  double sent_mb = 0;    // by this one to the others
  std::string exchange;  // "mpi" or "nccl", see Ranks::exchange; empty: one process
  int64_t gaussians = 0;
  int views = 0;
  std::map<std::string, double> stages_ms;
  double peak_rss_mb = 0, peak_device_mb = 0;
  std::vector<OptionSetting> options;  // of the run, those that applied
  std::vector<PaintedReport> painted;
  int mask_views = 0;  // that hold a masked pixel
  double mean_coverage = 0;
  std::optional<ColorEdit> edit;        // of the only region, at its strength
  std::optional<RefineSummary> refine;  // where Gaussians were split
  RefitSummary refit;
  QualityReport quality;
  std::optional<TrueMaskReport> true_masks;
  std::vector<RegionReport> regions;  // of a session's report
  std::optional<OutOfCoreReport> out_of_core;
};

// The report's text. Figures that do not exist (no held-out views, a stage that did not run) are
// null. Several painted views: counts are sums, fractions and corrections means, residuals pooled
// by their counts, and "painted" lists each view's own.
std::string ToJson(const RunReport& report);
// One registration alone, for registration.json.
std::string RegistrationsToJson(const std::vector<PaintedReport>& painted);

}  // namespace retint
