// SPDX-License-Identifier: BSD-3-Clause
#include "editing/edit_options.h"

#include "base/error.h"

namespace retint {
namespace {

EditOptions Paper() {
  EditOptions paper;
  SelectOptions& select = paper.select;
  select.depth_method = "stereo-hv";
  select.depth.stereo_hv.both_sides = false;
  select.depth.stereo_hv.aggregate = StereoAggregate::kMin;
  select.depth.stereo_hv.arbitrate = false;
  select.depth.stereo_hv.subpixel = false;
  select.cloud.sample_fraction = 0.7;
  select.cloud.outlier_neighbors = 16;
  select.cloud.outlier_stddev = 0.007;
  select.register_cloud = false;
  paper.projector.kind = ProjectorKind::kQuads;
  RefitOptions& refit = paper.refit.options;
  paper.refit.target = TargetKind::kPhoto;
  refit.solver = Solver::kAdam;
  refit.active_threshold = 0;  // whatever a mask touches
  refit.adam.iterations = 0;   // until stopped
  refit.adam.closed_form_start = false;
  refit.adam.learning_rate = 2.5e-4;
  refit.adam.lambda_dssim = 0.2;
  return paper;
}

}  // namespace

void EditOptions::Describe(OptionList& list) {
  select.Describe(list);
  projector.Describe(list);
  refit.Describe(list);
}

void EditOptions::Check() const {
  select.Check();
  projector.Check();
  refit.Check();
}

void EditOptions::SetSeed(uint64_t seed) {
  select.cloud.seed = seed;
  select.registration.seed = seed;
  refit.options.adam.seed = seed;
}

void EditOptions::EndByThemselves() {
  AdamOptions& adam = refit.options.adam;
  if (adam.iterations == 0) adam.iterations = AdamOptions().iterations;
}

std::vector<std::string> Presets() { return {"retint", "paper"}; }

EditOptions PresetOptions(std::string_view name) {
  if (name == "retint") return {};
  if (name == "paper") return Paper();
  throw OptionError("preset '" + std::string(name) + "' is not retint or paper");
}

}  // namespace retint
