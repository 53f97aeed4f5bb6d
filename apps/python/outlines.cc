// SPDX-License-Identifier: BSD-3-Clause
// Session: the mask of a view by the tools that find an outline, and the main colors of a
// selection.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "matcher.h"
#include "recolor/palette.h"
#include "selecting/view_mask.h"
#include "selection/mask_tools/scribbles.h"
#include "types.h"

namespace retint::python {
namespace {

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

// `least` to `most` finite numbers; OptionError naming them otherwise.
std::vector<double> Numbers(const py::object& values, size_t least, size_t most,
                            const std::string& what) {
  std::vector<double> numbers;
  try {
    numbers = values.cast<std::vector<double>>();
  } catch (const py::cast_error&) {
    throw OptionError(what + " is a sequence of numbers");
  }
  const bool finite = std::all_of(numbers.begin(), numbers.end(),
                                  [](double v) { return std::isfinite(v) && std::abs(v) < 1e9; });
  CheckOption(finite && numbers.size() >= least && numbers.size() <= most,
              what + fmt::format(" has {} to {} finite numbers", least, most));
  return numbers;
}

// [n, 2].
std::vector<Eigen::Vector2d> Points(const py::handle& points, const std::string& what) {
  const auto array = Doubles::ensure(points);
  if (!array) {
    PyErr_Clear();
    throw OptionError(what + " is an array [n, 2]");
  }
  CheckOption(array.ndim() == 2 && array.shape(1) == 2 && array.shape(0) > 0,
              what + " is an array [n, 2]");
  std::vector<Eigen::Vector2d> result;
  for (py::ssize_t i = 0; i < array.shape(0); ++i) {
    result.emplace_back(array.at(i, 0), array.at(i, 1));
    CheckOption(result.back().allFinite() && result.back().cwiseAbs().maxCoeff() < 1e6,
                what + " holds pixels of the view");
  }
  return result;
}

// A mask, a picture's path, or a list of polylines [n, 2].
Mask Strokes(PySession& self, const py::object& strokes, double brush, const UserPicture& view,
             bool inside) {
  if (strokes.is_none()) return {};
  const std::string what = inside ? "a stroke of `inside`" : "a stroke of `outside`";
  if (IsPath(strokes)) {
    const std::filesystem::path path = ToPath(strokes);
    return self.Use([&](EditSession& session) {
      return session.scene().pictures().ReadStrokesOf(view, path, inside);
    });
  }
  if (!py::isinstance<py::list>(strokes) && !py::isinstance<py::tuple>(strokes)) {
    return ToMask(strokes, view.width, view.height);
  }
  CheckOption(std::isfinite(brush) && brush > 0 && brush <= 10000,
              "brush is a width in pixels, above 0");
  Mask mask(view.width, view.height);
  for (const py::handle& stroke : strokes) DrawStroke(Points(stroke, what), brush, &mask);
  return mask;
}

Mask MakeMask(PySession& self, const std::string& view, const py::object& inside,
              const py::object& outside, double brush, const py::object& mask,
              const py::object& wand, const py::object& scissors, const py::object& sphere,
              const py::object& box, const py::object& like, int snap_edge, bool this_view_alone,
              const std::string& image, const std::string& pixels, const py::object& network,
              const py::object& points, const py::object& points_outside,
              const py::object& rectangle, py::object progress) {
  CheckOption(image == "render" || image == "photo", "image is 'render' or 'photo'");
  CheckOption(pixels == "pinhole" || pixels == "photo", "pixels is 'pinhole' or 'photo'");
  CheckOption(snap_edge >= 0 && snap_edge <= 200, "snap_edge is 0 to 200 pixels");
  const UserPicture picture = self.Use([&](EditSession& session) {
    const Pixels own = pixels == "photo" ? Pixels::kPhoto : Pixels::kPinhole;
    return Pictures(session.scene().workspace(), own).RequireOne(view);
  });
  ViewMaskRequest request;
  request.photo = image == "photo";
  request.snap_edge = snap_edge;
  request.this_view_alone = this_view_alone;
  if (!mask.is_none()) request.mask = ToMask(mask, picture.width, picture.height);
  request.network = ToMaskNetwork(network);
  if (!points.is_none()) request.prompt.inside = Points(points, "points");
  if (!points_outside.is_none()) {
    request.prompt.outside = Points(points_outside, "points_outside");
  }
  if (!rectangle.is_none()) {
    const auto at = Numbers(rectangle, 4, 4, "rectangle");
    const Eigen::Vector2d a(at[0], at[1]), b(at[2], at[3]);
    request.prompt.rectangle = {a.cwiseMin(b), a.cwiseMax(b)};
  }
  request.inside = Strokes(self, inside, brush, picture, true);
  request.outside = Strokes(self, outside, brush, picture, false);
  if (!wand.is_none()) {
    const auto at = Numbers(wand, 2, 5, "wand");
    WandOptions& options = request.wand.emplace();
    options.x = static_cast<int>(std::floor(at[0]));
    options.y = static_cast<int>(std::floor(at[1]));
    if (at.size() > 2) options.color = at[2];
    if (at.size() > 3) options.depth = at[3];
    if (at.size() > 4) options.normal = at[4];
  }
  if (!scissors.is_none()) {
    for (const Eigen::Vector2d& point : Points(scissors, "scissors")) {
      request.scissors.emplace_back(point.array().floor().cast<int>());
    }
  }
  if (!sphere.is_none()) {
    const auto at = Numbers(sphere, 4, 4, "sphere");
    request.sphere = {{at[0], at[1], at[2]}, at[3]};
  }
  if (!box.is_none()) {
    const auto at = Numbers(box, 6, 6, "box");
    request.box = {{at[0], at[1], at[2]}, {at[3], at[4], at[5]}};
  }
  if (!like.is_none()) {
    const auto at = Numbers(like, 2, 3, "like");
    auto& options = request.like.emplace();
    options.x = static_cast<int>(std::floor(at[0]));
    options.y = static_cast<int>(std::floor(at[1]));
    if (at.size() > 2) options.tolerance = at[2];
  }
  return self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    return MakeViewMask(session.selection(), picture, request, monitor);
  });
}

py::list FindColors(PySession& self, const py::object& of, int colors) {
  RegionSelection selection;
  if (py::isinstance<PyMasks>(of)) {
    selection.masks = of.cast<const PyMasks&>().masks;
  } else {
    selection.source.painted = ToPainted(of);
    CheckOption(!selection.source.painted.empty(), "there is nothing painted");
  }
  const auto palette = self.Use(
      [&](EditSession& session) { return session.store().MeasurePalette(selection, colors); });
  if (palette.empty()) throw InputError("no pixel is selected");
  py::list list;
  for (const PaletteColor& color : palette) {
    const auto byte = [&](size_t c) { return std::lround(color.rgb[c] * 255); };
    py::dict dict;
    dict["hex"] = fmt::format("#{:02x}{:02x}{:02x}", byte(0), byte(1), byte(2));
    dict["color"] = py::make_tuple(color.rgb[0], color.rgb[1], color.rgb[2]);
    dict["share"] = color.share;
    list.append(dict);
  }
  return list;
}

}  // namespace

void BindOutlines(py::class_<PySession>& type) {
  const py::none none;
  type.def(
          "mask",
          [](PySession& self, const std::string& view, const py::object& inside,
             const py::object& outside, double brush, const py::object& mask,
             const py::object& wand, const py::object& scissors, const py::object& sphere,
             const py::object& box, const py::object& like, int snap_edge, bool this_view_alone,
             const std::string& image, const std::string& pixels, const py::object& network,
             const py::object& points, const py::object& points_outside,
             const py::object& rectangle, py::object progress) {
            return FromPixels(MakeMask(self, view, inside, outside, brush, mask, wand, scissors,
                                       sphere, box, like, snap_edge, this_view_alone, image, pixels,
                                       network, points, points_outside, rectangle,
                                       std::move(progress)));
          },
          py::arg("view"), py::kw_only(), py::arg("inside") = none, py::arg("outside") = none,
          py::arg("brush") = 6.0, py::arg("mask") = none, py::arg("wand") = none,
          py::arg("scissors") = none, py::arg("sphere") = none, py::arg("box") = none,
          py::arg("like") = none, py::arg("snap_edge") = 0, py::arg("this_view_alone") = false,
          py::arg("image") = "render", py::arg("pixels") = "pinhole", py::arg("network") = none,
          py::arg("points") = none, py::arg("points_outside") = none, py::arg("rectangle") = none,
          py::arg("progress") = none,
          "Selects an object in one view, as `retint mask` does. Returns a soft mask, [H, W] "
          "uint8.\n"
          "\n"
          "One of these selects:\n"
          "- `inside`, `outside`: strokes on and beside the object, each a mask or a list of "
          "lines [n, 2] in pixels that are `brush` pixels wide\n"
          "- `network`: your own network's outline, which strokes correct: 'onnx:FILE', "
          "'onnx:ENCODER.onnx,DECODER.onnx', 'exec:COMMAND', or a function of the image [H, W, 3] "
          "that returns its mask [H, W]. `points` and `points_outside` [n, 2] and `rectangle` (x, "
          "y, x, y), in pixels, say which object\n"
          "- `mask`: an array or a path\n"
          "- `wand`: (x, y[, color[, depth[, normal]]]), a pixel and tolerances\n"
          "- `scissors`: anchors [n, 2] along the outline, in pixels\n"
          "\n"
          "These limit the result:\n"
          "- `sphere`: (x, y, z, radius) in the world\n"
          "- `box`: two corners (x, y, z, x, y, z) in the world\n"
          "- `like`: (x, y[, tolerance]), a pixel of the color to keep\n"
          "\n"
          "These change how it is found:\n"
          "- `snap_edge`: moves the border to edges at most so many pixels away, 0 to 200\n"
          "- `this_view_alone`: completes strokes from this view only, not from other views\n"
          "- `image`: 'render' or 'photo', the picture whose edges and colors count\n"
          "- `pixels`: 'pinhole' for a view, or 'photo' for the photo of that name in its own "
          "pixels")
      .def("palette", &FindColors, py::arg("of"), py::arg("colors") = 5,
           "Finds the main colors inside Masks, a Painted or a list of them, as `retint palette` "
           "does. Returns dicts of 'hex', 'color' (RGB in [0, 1]) and 'share' (in [0, 1]), most "
           "frequent first. InputError if no pixel is selected.");
}

}  // namespace retint::python
