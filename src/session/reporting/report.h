// SPDX-License-Identifier: BSD-3-Clause
// What a run did, as report.json: stable keys (docs/formats.md lists them), milliseconds, megabytes
// of 2^20 bytes.
#pragma once

#include <chrono>
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
#include "selection/registration.h"
#include "selection/selection_cloud.h"

namespace retint {

// The version of the program, "0.1.0".
std::string_view Version();

// Highest resident set size of this process so far, MiB.
double PeakRssMb();

// Wall-clock time per stage, summed over visits.
class StageClock {
 public:
  using Now = std::chrono::steady_clock::time_point (*)();
  explicit StageClock(Now now = std::chrono::steady_clock::now) : now_(now) {}

  // Runs until destroyed.
  class Lap {
   public:
    Lap(StageClock& clock, std::string stage) : clock_(clock), stage_(std::move(stage)) {}
    ~Lap() { clock_.Add(stage_, clock_.MillisecondsSince(start_)); }
    Lap(const Lap&) = delete;
    Lap& operator=(const Lap&) = delete;

   private:
    StageClock& clock_;
    std::string stage_;
    std::chrono::steady_clock::time_point start_ = clock_.now_();
  };

  void Add(const std::string& stage, double milliseconds) { stages_[stage] += milliseconds; }
  double Get(const std::string& stage) const;                 // 0 when it never ran
  double Total() const { return MillisecondsSince(start_); }  // since the clock was made

 private:
  double MillisecondsSince(std::chrono::steady_clock::time_point start) const;
  Now now_;
  std::map<std::string, double> stages_;
  std::chrono::steady_clock::time_point start_ = now_();
};

// Of one painted view.
struct PaintedReport {
  std::string view;
  std::string depth_method, depth_reason;
  double valid_fraction = 0;
  CloudSummary cloud;
  RegistrationSummary registration;
};

// Of one region of several.
struct RegionReport {
  std::string name;
  ColorEdit edit;  // at the region's strength
  QualityReport quality;
  std::optional<RefineSummary> refine;  // where Gaussians were split
};

// What can be said where the object's true masks are known.
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
