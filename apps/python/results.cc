// SPDX-License-Identifier: BSD-3-Clause
#include "results.h"

#include <pybind11/stl.h>

namespace retint::python {
namespace {

py::object FromNumbers(const QualityNumbers& numbers) {
  if (numbers.views == 0) return py::none();
  py::dict dict;
  dict["views"] = numbers.views;
  dict["psnr_inside_before"] = numbers.psnr_inside_before;
  dict["psnr_inside_after"] = numbers.psnr_inside_after;
  dict["psnr_outside"] = numbers.psnr_outside;
  dict["bleed"] = numbers.bleed;
  dict["out_of_gamut"] = numbers.out_of_gamut;
  return dict;
}

}  // namespace

py::dict FromQuality(const QualityReport& quality) {
  py::list views;
  for (const ViewQuality& view : quality.views) {
    py::dict one;
    one["view"] = view.name;
    one["heldout"] = view.heldout;
    one["coverage"] = view.coverage;
    one["psnr_inside"] = view.psnr_inside;
    one["psnr_outside"] = view.psnr_outside;
    views.append(one);
  }
  py::dict dict;
  dict["train"] = FromNumbers(quality.train);
  dict["heldout"] = FromNumbers(quality.heldout);
  dict["views"] = views;
  dict["sh_before"] = py::make_tuple(quality.sh_before.min, quality.sh_before.max);
  dict["sh_after"] = py::make_tuple(quality.sh_after.min, quality.sh_after.max);
  return dict;
}

py::dict FromRefit(const RefitSummary& summary) {
  py::dict dict;
  dict["solver"] = summary.solver;
  dict["iterations"] = summary.iterations;
  dict["active_gaussians"] = summary.active_gaussians;
  dict["changed_gaussians"] = summary.changed_gaussians;
  dict["converged"] = summary.converged;
  dict["losses"] = summary.losses;
  dict["reason"] = summary.reason;
  return dict;
}

py::dict FromPainted(const PaintedReport& report) {
  const RegistrationSummary& moved = report.registration;
  py::dict registration;
  registration["accepted"] = moved.accepted;
  registration["reason"] = moved.reason;
  registration["points_used"] = moved.points_used;
  registration["rms_before"] = moved.rms_before;
  registration["rms_after"] = moved.rms_after;
  registration["heldout_before"] = moved.heldout_before;
  registration["heldout_after"] = moved.heldout_after;
  py::dict dict;
  dict["view"] = report.view;
  dict["depth_method"] = report.depth_method;
  dict["depth_reason"] = report.depth_reason;
  dict["valid_fraction"] = report.valid_fraction;
  dict["mask_pixels"] = report.cloud.mask_pixels;
  dict["sampled"] = report.cloud.sampled;
  dict["kept"] = report.cloud.kept;
  dict["registration"] = registration;
  return dict;
}

py::dict FromJson(const std::string& text) {
  return py::module_::import("json").attr("loads")(text);
}

}  // namespace retint::python
