// SPDX-License-Identifier: BSD-3-Clause
#include "rendering.h"

#include <pybind11/stl.h>

#include "kernels/backend.h"
#include "options.h"
#include "recolor/finer_gaussians.h"
#include "reporting/export.h"

namespace retint::python {
namespace {

// The layers of a render, and their places.
struct Layer {
  const char* name;
  bool RenderRequest::*wanted;
  py::array (*take)(RenderOutput& output);
};
const Layer kLayers[] = {
    {"rgb", &RenderRequest::rgb, [](RenderOutput& o) { return FromPixels(std::move(o.rgb)); }},
    {"depth", &RenderRequest::depth_median,
     [](RenderOutput& o) { return FromPixels(std::move(o.depth_median)); }},
    {"depth_expected", &RenderRequest::depth_expected,
     [](RenderOutput& o) { return FromPixels(std::move(o.depth_expected)); }},
    {"alpha", &RenderRequest::alpha,
     [](RenderOutput& o) { return FromPixels(std::move(o.alpha)); }},
};
constexpr const char* kWhat =
    " `what` is one of these, or a list of them, which returns a dict: 'rgb' ([H, W, 3] "
    "float32, RGB as stored, not clamped above), 'alpha' ([H, W] float32 in [0, 1]), "
    "'depth' or 'depth_expected' ([H, W] float32, z in world units, 0 if there is none).";

const Layer& FindLayer(const std::string& name) {
  for (const Layer& layer : kLayers) {
    if (name == layer.name) return layer;
  }
  throw OptionError("what: '" + name + "' is not rgb, depth, depth_expected or alpha");
}

std::vector<std::string> Names(const py::object& what) {
  if (py::isinstance<py::str>(what)) return {what.cast<std::string>()};
  return what.cast<std::vector<std::string>>();
}

py::object RenderSession(PySession& self, const py::object& view, const py::object& what,
                         const py::object& sh) {
  const RenderRequest request = ToRequest(what);
  const Floats given = ToSh(self, sh);
  const auto workspace =
      self.Use([&](EditSession& session) { return self.Share(session.scene().workspace()); });
  const PosedCamera camera = ToViewpoint(view, workspace.get()).camera;
  RenderOutput output = self.Use([&](EditSession& session) {
    ShowSh(session, given);
    return session.scene().renderer().Render(camera, request);
  });
  return Layers(std::move(output), what);
}

DepthEstimate SessionDepth(PySession& self, const py::object& view, py::object progress,
                           const py::kwargs& keywords) {
  const EditOptions options =
      Resolve(keywords, [](EditOptions& o, OptionList& list) { o.select.DescribeDepth(list); });
  const auto workspace =
      self.Use([&](EditSession& session) { return self.Share(session.scene().workspace()); });
  const PosedCamera camera = ToViewpoint(view, workspace.get()).camera;
  return self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    return session.selection().EstimateDepth(camera, options.select, monitor);
  });
}

py::array SeenFrom(PySession& self, const py::object& region, const py::object& view) {
  const auto workspace =
      self.Use([&](EditSession& session) { return self.Share(session.scene().workspace()); });
  const Viewpoint at = ToViewpoint(view, workspace.get());
  const auto selection = SelectionOf(self, region);
  // A view has a mask, with the paint in it.
  if (at.view) {
    const auto mask = selection->masks.find(at.view->name);
    if (mask != selection->masks.end()) return FromPixels(Mask(mask->second));
  }
  return FromPixels(self.Use(
      [&](EditSession& session) { return session.selection().SeenFrom(*selection, at.camera); }));
}

// Without a session: a renderer for this call.
std::unique_ptr<Renderer> MakeRenderer(const GaussianModel& model, const std::string& backend,
                                       const std::array<float, 3>& background) {
  model.Validate();
  RendererOptions options;
  options.background = background;
  return std::make_unique<Renderer>(OpenBackend(backend), model, options);
}

py::object Render(const PySplat& splat, const py::object& view, const py::object& what,
                  const std::string& backend, const std::array<float, 3>& background) {
  RenderRequest request = ToRequest(what);
  request.cache = false;
  const PosedCamera camera = ToViewpoint(view, nullptr).camera;
  const auto work = [&] {
    const py::gil_scoped_release unlocked;
    return MakeRenderer(*splat.data, backend, background)->Render(camera, request);
  };
  return Layers(work(), what);
}

DepthEstimate DepthOf(const PySplat& splat, const py::object& view, const std::string& backend,
                      py::object progress, const py::kwargs& keywords) {
  const EditOptions options =
      Resolve(keywords, [](EditOptions& o, OptionList& list) { o.select.DescribeDepth(list); });
  const PosedCamera camera = ToViewpoint(view, nullptr).camera;
  const std::shared_ptr<const Workspace> workspace =
      py::isinstance<PyView>(view) ? view.cast<const PyView&>().workspace : nullptr;
  Call call(std::move(progress));
  return call.Run([&](Monitor& monitor) {
    const auto renderer = MakeRenderer(*splat.data, backend, {0, 0, 0});
    return MakeDepthEstimator(options.select.depth_method, *renderer, workspace.get(),
                              options.select.depth)
        ->Estimate(camera, monitor);
  });
}

Eigen::Vector3d ToVector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

py::list TableOf(const std::string& call, const std::string& preset) {
  EditOptions options = PresetOptions(preset);
  RefineOptions refine;
  OptionList list;
  if (call == "select") {
    options.select.Describe(list);
  } else if (call == "depth" || call == "erase") {
    options.select.DescribeDepth(list);
  } else if (call == "project" || call == "complete") {
    options.projector.Describe(list);
  } else if (call == "refit") {
    options.refit.Describe(list);
  } else if (call == "refine_gaussians") {
    refine.Describe(list);
  } else {
    throw OptionError(
        "options are of select, depth, erase, project, complete, refine_gaussians or refit");
  }
  return OptionTable(list);
}

}  // namespace

RenderRequest ToRequest(const py::object& what) {
  RenderRequest request;
  request.rgb = false;
  for (const std::string& name : Names(what)) request.*(FindLayer(name).wanted) = true;
  return request;
}

py::object Layers(RenderOutput output, const py::object& what) {
  if (py::isinstance<py::str>(what)) return FindLayer(what.cast<std::string>()).take(output);
  py::dict layers;
  for (const std::string& name : Names(what)) {
    if (!layers.contains(name)) layers[py::str(name)] = FindLayer(name).take(output);
  }
  return layers;
}

void ShowSh(EditSession& session, const Floats& given) {
  if (given.ndim() > 0) {
    session.scene().renderer().SetSh(SpanOf(given));
  } else {
    session.scene().renderer().SetSh(session.refits().CurrentSh());
  }
}

std::shared_ptr<Backend> OpenBackend(const std::string& name) {
  try {
    return CreateBackend(name);
  } catch (const std::invalid_argument& error) {
    throw OptionError(std::string("backend: ") + error.what());
  }
}

void BindRendering(py::class_<PySession>& type) {
  static const std::string render_doc =
      std::string(
          "Renders the scene with all edits, or with the coefficients `sh` [N, K, 3], from a "
          "view: its name, a View or a Camera.") +
      kWhat;
  static const std::string depth_doc = [] {
    EditOptions options;
    OptionList list;
    options.select.DescribeDepth(list);
    return "Estimates the depth of a view: its name, a View or a Camera." + OptionLines(list);
  }();
  type.def("render", &RenderSession, py::arg("view"), py::arg("what") = "rgb",
           py::arg("sh") = py::none(), render_doc.c_str())
      .def("depth", &SessionDepth, py::arg("view"), py::kw_only(), py::arg("progress") = py::none(),
           depth_doc.c_str())
      .def("seen_from", &SeenFrom, py::arg("region"), py::arg("view"),
           "A region as a soft mask of any view: [H, W] uint8. Pass a Region for its state when "
           "you got it, or an id for its state now.");
}

void BindRender(py::module_& module) {
  static const std::string render_doc =
      std::string("Renders a Splat from a Camera or a View.") + kWhat;
  const std::array<float, 3> black = {0, 0, 0};
  module.def("render", &Render, py::arg("splat"), py::arg("view"), py::arg("what") = "rgb",
             py::kw_only(), py::arg("backend") = "auto", py::arg("background") = black,
             render_doc.c_str());
  module.def(
      "depth", &DepthOf, py::arg("splat"), py::arg("view"), py::kw_only(),
      py::arg("backend") = "auto", py::arg("progress") = py::none(),
      "Estimates the depth of a Splat from a Camera or a View. COLMAP's methods need a View. "
      "Options: those of Session.depth().");
  module.def(
      "orbit",
      [](const PosedCamera& start, const std::array<double, 3>& focus,
         const std::array<double, 3>& up,
         int frames) { return OrbitPath(start, ToVector(focus), ToVector(up), frames); },
      py::arg("start"), py::arg("focus"), py::arg("up"), py::arg("frames"),
      "Cameras of one turn about the axis `up` through the point `focus`, both [3] in the "
      "world. The first of the `frames` is `start`.");
  module.def("options", &TableOf, py::arg("call"), py::arg("preset") = "retint",
             "The options of a call: 'select', 'depth', 'erase', 'project', 'complete', 'refit' or "
             "'refine_gaussians'. Returns dicts of 'name', 'applies' (the value of another option "
             "that makes this one matter, or ''), 'default', 'range', 'unit' and 'help'. `preset`: "
             "'retint' or 'paper'.");
}

}  // namespace retint::python
