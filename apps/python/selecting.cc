// SPDX-License-Identifier: BSD-3-Clause
// Session: paint, selections in 3D and masks.
#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "colmap_io/image_io.h"
#include "colmap_io/png_text.h"
#include "options.h"
#include "results.h"
#include "selecting/paint_held.h"
#include "selecting/selection_files.h"
#include "types.h"

namespace retint::python {
namespace {

PaintedView Paint(PySession& self, const std::string& view, const py::object& mask) {
  const Camera camera = self.Use([&](EditSession& session) {
    const View& found = session.scene().workspace().RequireView(view);
    return session.scene().reconstruction().Posed(found).camera;
  });
  Mask paint = ToMask(mask, camera.width, camera.height);
  PaintedView painted = self.Use(
      [&](EditSession& session) { return session.selection().Paint(view, std::move(paint)); });
  if (IsPath(mask)) painted.outlined_by = ReadPngText(ToPath(mask), kOutlinedBy);
  return painted;
}

PySelection Select(PySession& self, const py::object& given, py::object progress,
                   const py::kwargs& keywords) {
  const std::vector<PaintedView> painted = ToPainted(given);
  const EditOptions options =
      Resolve(keywords, [](EditOptions& o, OptionList& list) { o.select.Describe(list); });
  for (size_t i = 0; i < painted.size(); ++i) {
    for (size_t k = 0; k < i; ++k) {
      CheckOption(painted[i].name != painted[k].name, painted[i].name + " is painted twice");
    }
  }
  return self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    PySelection selection;
    selection.source.painted = painted;
    selection.source.select = options.select;
    selection.depths = session.selection().Select(selection.source, monitor).depths;
    return selection;
  });
}

PySelection EraseFrom(PySession& self, const PySelection& selection, const std::string& view,
                      const py::object& mask, py::object progress, const py::kwargs& keywords) {
  const EditOptions options =
      Resolve(keywords, [](EditOptions& o, OptionList& list) { o.select.DescribeDepth(list); });
  const PaintedView erased = Paint(self, view, mask);
  return self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    PySelection left = selection;
    const DepthEstimate depth =
        session.selection().EstimateDepth(erased.camera, options.select, monitor);
    Erase(left.source.cloud, erased.camera, erased.mask, depth.depth);
    return left;
  });
}

PyMasks Project(PySession& self, const PySelection& selection, py::object progress,
                const py::kwargs& keywords) {
  const EditOptions options =
      Resolve(keywords, [](EditOptions& o, OptionList& list) { o.projector.Describe(list); });
  return self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    SelectionSource source = selection.source;
    source.projector = options.projector;
    ProjectedMasks masks = session.selection().Project(source, monitor);
    const auto warnings = WarningsOfPaint(session.scene().workspace(), source.painted, masks.masks);
    return PyMasks{std::move(masks.masks),      std::move(masks.shares),
                   std::move(source),           fmt::format("{}", fmt::join(warnings, "\n")),
                   std::move(masks.confidence), std::move(masks.visible)};
  });
}

PyMasks Complete(PySession& self, const PySelection& selection, const std::string& reach,
                 py::object progress, const py::kwargs& keywords) {
  py::kwargs all(keywords.attr("copy")());
  all["completion"] = reach;
  return Project(self, selection, std::move(progress), all);
}

PyMasks ReadMasksFrom(PySession& self, const py::object& folder) {
  const auto path = ToPath(folder);
  return self.Use([&](EditSession& session) {
    PyMasks result;
    for (auto& [id, mask] : ReadMasks(path, session.scene().reconstruction())) {
      result.masks.emplace(session.scene().reconstruction().views.at(id).name, std::move(mask));
    }
    SharesOfMasks shares =
        ReadShares(path, result.masks, session.scene().original().NumGaussians());
    result.shares = std::move(shares.shares);
    result.warning = std::move(shares.why_not);
    return result;
  });
}

}  // namespace

std::vector<PaintedView> ToPainted(const py::object& painted) {
  if (py::isinstance<PaintedView>(painted)) return {painted.cast<PaintedView>()};
  try {
    return painted.cast<std::vector<PaintedView>>();
  } catch (const py::cast_error&) {
    throw OptionError("painted is a Painted, as paint() returns it, or a list of them");
  }
}

void BindSelecting(py::class_<PySession>& type) {
  static const auto lines = [](auto describe) {
    EditOptions options;
    OptionList list;
    describe(options, list);
    return OptionLines(list);
  };
  static const std::string select_doc =
      "Finds the painted surface in 3D: estimates depth, samples points, and registers them "
      "to the sparse points. `painted` is a Painted, or a list of them. OptionError if a "
      "view is painted twice." +
      lines([](EditOptions& o, OptionList& list) { o.select.Describe(list); });
  static const std::string project_doc =
      "Makes a mask of every view from a selection. The option `completion` adds sides that "
      "no painted view shows." +
      lines([](EditOptions& o, OptionList& list) { o.projector.Describe(list); });
  type.def("paint", &Paint, py::arg("view"), py::arg("mask"),
           "Pairs a view with its mask, an array [H, W] of the view's size or the path of a "
           "picture. An array holds bool, uint8 (0 outside, 255 inside) or floats in [0, 1]. "
           "InputError if there is no such view or no pixel is set.")
      .def("select", &Select, py::arg("painted"), py::kw_only(), py::arg("progress") = py::none(),
           select_doc.c_str())
      .def("erase", &EraseFrom, py::arg("selection"), py::arg("view"), py::arg("mask"),
           py::kw_only(), py::arg("progress") = py::none(),
           "The selection without the points that the mask of that view shows. Options: those of "
           "depth().")
      .def("project", &Project, py::arg("selection"), py::kw_only(),
           py::arg("progress") = py::none(), project_doc.c_str())
      .def("complete", &Complete, py::arg("selection"), py::arg("reach") = "near", py::kw_only(),
           py::arg("progress") = py::none(),
           "project() with the option completion=REACH: 'near' adds the object's sides that no "
           "painted view shows, 'all' also other things that look the same, 'off' nothing. "
           "Options: those of project().")
      .def("read_masks", &ReadMasksFrom, py::arg("folder"),
           "Reads `FOLDER/<image name>.png`, and the coverage of Gaussians (shares.bin) if it "
           "belongs to these masks. InputError if a file is missing or damaged.");
}

}  // namespace retint::python
