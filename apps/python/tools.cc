// SPDX-License-Identifier: BSD-3-Clause
// Functions beside a session: align, score.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "colmap_io/nerfstudio.h"
#include "opening/align.h"
#include "rendering.h"
#include "reporting/score.h"
#include "results.h"
#include "splat_io/splat_io.h"
#include "types.h"

namespace retint::python {
namespace {

py::dict AlignSplat(const PyWorkspace& workspace, const PySplat& splat, const std::string& backend,
                    int views, py::object progress) {
  CheckOption(views >= 1, "views is at least 1");
  AlignOptions options;
  options.views = views;
  Call call(std::move(progress));
  const AlignResult result = call.Run([&](Monitor& monitor) {
    Workspace own = *workspace.data;
    own.UndistortViews();
    return Align(OpenBackend(backend), own, *splat.data,
                 FindTransformFiles(own.root, own.root / "splat"), options, monitor);
  });
  py::dict dict = FromJson(WorldFromSplatToJson(result.world_from_splat));
  dict["source"] = result.source;
  dict["psnr_before"] = result.psnr_before;
  dict["psnr_after"] = result.psnr_after;
  return dict;
}

py::object ScoreMasks(const py::object& truth, const py::object& masks,
                      const std::vector<std::string>& painted, const py::object& workspace,
                      py::object progress) {
  ScoreRequest request;
  request.truth = ToPath(truth);
  request.masks = ToPath(masks);
  request.painted = painted;
  if (!workspace.is_none()) {
    request.model = &workspace.cast<const PyWorkspace&>().data->reconstruction;
  }
  Call call(std::move(progress));
  return FromJson(call.Run([&](Monitor& monitor) { return ToJson(Score(request, monitor)); }));
}

}  // namespace

void BindTools(py::module_& module) {
  module.def("align", &AlignSplat, py::arg("workspace"), py::arg("splat"), py::kw_only(),
             py::arg("backend") = "auto", py::arg("views") = 8, py::arg("progress") = py::none(),
             "Finds how a Splat from another frame lies in a Workspace. Returns a dict: "
             "'world_from_splat' (4x4, for Session), 'source' (the start of the search), "
             "'psnr_before' and 'psnr_after' (dB against the photos; NaN without photos). `views`: "
             "how many photos it compares.");
  module.def(
      "score", &ScoreMasks, py::arg("truth"), py::arg("masks"),
      py::arg("painted") = std::vector<std::string>(), py::arg("workspace") = py::none(),
      py::kw_only(), py::arg("progress") = py::none(),
      "Compares a folder of masks with true masks, both `<image name>.png`. Returns a dict "
      "with the keys of the report of `retint score`. `painted`: names of views that no mean "
      "includes. `workspace`: adds means of the views near the painted ones.");
}

}  // namespace retint::python
