// SPDX-License-Identifier: BSD-3-Clause
// Depth, Painted, Selection, Masks and Region: what the stages hand to each other.
#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "base/staged_output.h"
#include "colmap_io/depth_map_io.h"
#include "results.h"
#include "selecting/selection_files.h"
#include "types.h"

namespace retint::python {
namespace {

// A member of every point of a cloud as an array over the cloud's memory.
template <typename T>
py::array PointsView(const py::object& self, const T* first, py::ssize_t columns) {
  const auto& cloud = self.cast<const PySelection&>().source.cloud;
  const auto count = static_cast<py::ssize_t>(cloud.points.size());
  std::vector<py::ssize_t> shape = {count}, strides = {sizeof(SelectionPoint)};
  if (columns > 0) {
    shape.push_back(columns);
    strides.push_back(sizeof(T));
  }
  return ViewOf(first, std::move(shape), std::move(strides), self);
}

// `member` points into a point; columns 0: one value a point.
template <typename Member>
auto PointsOf(Member member, py::ssize_t columns) {
  return [member, columns](const py::object& self) {
    static const SelectionPoint none{};
    const auto& points = self.cast<const PySelection&>().source.cloud.points;
    return PointsView(self, member(points.empty() ? none : points.front()), columns);
  };
}

// The masks of any of these as a dict of arrays that keep `owner` alive.
py::dict MaskDict(const std::map<std::string, Mask>& masks, const py::object& owner) {
  py::dict dict;
  for (const auto& [name, mask] : masks) dict[py::str(name)] = FromMask(mask, owner);
  return dict;
}

py::array SharesView(const std::vector<float>& shares, const py::object& owner) {
  return ViewOf(shares.data(), {static_cast<py::ssize_t>(shares.size())}, {}, owner);
}

PyMasks MasksFromDict(const py::object& masks, const py::object& shares) {
  PyMasks result;
  for (const auto& [name, mask] : ToDictOfMasks(masks)) {
    result.masks.emplace(name.cast<std::string>(),
                         ToMask(py::reinterpret_borrow<py::object>(mask)));
  }
  if (shares.is_none()) return result;
  const Floats values(shares);
  CheckOption(values.ndim() == 1, "shares is [N]");
  result.shares.assign(values.data(), values.data() + values.size());
  return result;
}

void WriteMasksTo(const PyMasks& self, const py::object& folder, py::object progress) {
  const auto path = ToPath(folder);
  Call call(std::move(progress));
  call.Run([&](Monitor& monitor) {
    StagedOutput staged;
    staged.AddFolder(path, [&](const std::filesystem::path& to) {
      WriteMasks(to, self.masks, monitor);
      if (!self.shares.empty()) WriteShares(to, self.masks, self.shares, self.confidence);
    });
    staged.Commit();
  });
}

PySelection Joined(const PySelection& first, const PySelection& second) {
  std::set<std::string> names;
  for (const PaintedView& view : first.source.painted) names.insert(view.name);
  for (const PaintedView& view : second.source.painted) {
    CheckOption(!names.contains(view.name), view.name + " is painted in both selections");
  }
  PySelection both = first;
  Append(both.source.cloud, second.source.cloud);
  const auto add = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  add(both.source.painted, second.source.painted);
  add(both.source.reports, second.source.reports);
  add(both.depths, second.depths);
  return both;
}

void BindDepth(py::module_& module) {
  py::class_<DepthEstimate>(module, "Depth", "The depth of one view.")
      .def_property_readonly(
          "depth",
          [](const py::object& self) {
            const auto& depth = self.cast<const DepthEstimate&>().depth;
            return ViewOf(depth.data.data(), ShapeOf(depth), {}, self);
          },
          "[H, W] float32: z along the viewing axis, world units; 0 where there is none.")
      .def_property_readonly(
          "valid",
          [](const py::object& self) {
            return FromMask(self.cast<const DepthEstimate&>().valid, self);
          },
          "[H, W] uint8: 255 measured by the method itself, 0 filled in or unknown.")
      .def_readonly("valid_fraction", &DepthEstimate::valid_fraction,
                    "In [0, 1]: how much of the view is valid.")
      .def_readonly("method", &DepthEstimate::method, "The method's name: 'stereo-hv' and others.")
      .def_readonly("reason", &DepthEstimate::reason, "What was done, in a line.")
      .def_readonly("warning", &DepthEstimate::warning, "What was asked for and not done, or ''.")
      .def(
          "write",
          [](const DepthEstimate& self, const py::object& path) {
            WriteDepthMap(ToPath(path), self.depth);
          },
          py::arg("path"), "Writes COLMAP's dense depth map (.bin).")
      .def("__repr__", [](const DepthEstimate& self) {
        return fmt::format("<retint.Depth {}x{} by {}, {:.0f} % valid>", self.depth.width,
                           self.depth.height, self.method, 100 * self.valid_fraction);
      });
  py::class_<PaintedView>(module, "Painted", "A view and the mask that was painted on it.")
      .def_readonly("view", &PaintedView::name, "The view's name.")
      .def_readonly("camera", &PaintedView::camera, "The view's Camera.")
      .def_property_readonly(
          "mask",
          [](const py::object& self) { return FromMask(self.cast<PaintedView&>().mask, self); },
          "[H, W] uint8: 0 outside, 255 inside.")
      .def("__repr__", [](const PaintedView& self) {
        const auto& values = self.mask.data;
        const auto inside =
            std::count_if(values.begin(), values.end(), [](uint8_t v) { return v >= 128; });
        return fmt::format("<retint.Painted {}, {} pixels>", self.name, inside);
      });
}

void BindCloud(py::module_& module) {
  using P = const SelectionPoint&;
  py::class_<PySelection>(module, "Selection",
                          "A selection in 3D: a point for each painted pixel that was sampled. "
                          "Arrays show its memory and cannot be written to.")
      .def_static(
          "read",
          [](const py::object& path) {
            PySelection selection;
            selection.source.cloud = ReadCloud(ToPath(path));
            return selection;
          },
          py::arg("path"), "Reads a point cloud (.ply) of Retint's or any with x y z.")
      .def(
          "write",
          [](const PySelection& self, const py::object& path) {
            WriteCloud(ToPath(path), self.source.cloud);
          },
          py::arg("path"), "Writes the points (.ply).")
      .def_property_readonly("positions", PointsOf([](P p) { return p.position.data(); }, 3),
                             "[P, 3] float32, world.")
      .def_property_readonly("normals", PointsOf([](P p) { return p.normal.data(); }, 3),
                             "[P, 3] float32, world, unit, towards the camera.")
      .def_property_readonly("colors", PointsOf([](P p) { return p.color.data(); }, 3),
                             "[P, 3] uint8, RGB.")
      .def_property_readonly("footprints", PointsOf([](P p) { return &p.footprint; }, 0),
                             "[P] float32: world size of a pixel there.")
      .def_property_readonly("confidences", PointsOf([](P p) { return &p.confidence; }, 0),
                             "[P] float32: 1 depth measured, 0.5 filled in.")
      .def_property_readonly("coverages", PointsOf([](P p) { return &p.coverage; }, 0),
                             "[P] float32 in (0, 1]: the soft mask's value.")
      .def_property_readonly("source", PointsOf([](P p) { return &p.source; }, 0),
                             "[P] uint16: index into `sources`.")
      .def_property_readonly(
          "sources", [](const PySelection& self) { return self.source.cloud.sources; },
          "list of str: names of the painted views.")
      .def_property_readonly(
          "painted", [](const PySelection& self) { return self.source.painted; }, "list of Painted")
      .def_readonly("depths", &PySelection::depths, "list of Depth, one a painted view")
      .def_property_readonly(
          "reports",
          [](const PySelection& self) {
            py::list list;
            for (const PaintedReport& report : self.source.reports)
              list.append(FromPainted(report));
            return list;
          },
          "list of dict: what became of each painted view.")
      .def("__add__", &Joined, py::arg("other"), "A selection with the points of both.")
      .def("__len__", [](const PySelection& self) { return self.source.cloud.points.size(); })
      .def("__repr__", [](const PySelection& self) {
        return "<retint.Selection " + std::to_string(self.source.cloud.points.size()) + " points>";
      });
}

void BindMasks(py::module_& module) {
  py::class_<PyMasks>(
      module, "Masks",
      "Soft masks by image name and, where they come from a projection, the share of "
      "each Gaussian. Arrays cannot be written to.")
      .def(py::init(&MasksFromDict), py::arg("masks"), py::arg("shares") = py::none(),
           "From a dict of image names to masks ([H, W] arrays or paths) and shares [N] in [0, 1]; "
           "without shares they are computed from the masks when a region is made.")
      .def("write", &WriteMasksTo, py::arg("folder"), py::arg("progress") = py::none(),
           "Writes FOLDER/<image name>.png and, where they are known, shares.bin and "
           "confidence.bin.")
      .def_property_readonly(
          "shares",
          [](const py::object& self) {
            return SharesView(self.cast<const PyMasks&>().shares, self);
          },
          "[N] float32 in [0, 1]; [0] where unknown.")
      .def_property_readonly(
          "confidence",
          [](const py::object& self) {
            return SharesView(self.cast<const PyMasks&>().confidence, self);
          },
          "[N] float32 in [0, 1]: how sure each share is, 1 where paint shows it; [0] without a "
          "completion.")
      .def_readonly("warning", &PyMasks::warning,
                    "Why shares beside the masks were left aside, which painted views' masks hold "
                    "less than half of the paint, or ''.")
      .def(
          "keys",
          [](const py::object& self) {
            return MaskDict(self.cast<const PyMasks&>().masks, self).attr("keys")();
          },
          "The image names.")
      .def(
          "items",
          [](const py::object& self) {
            return MaskDict(self.cast<const PyMasks&>().masks, self).attr("items")();
          },
          "Pairs of an image name and its mask.")
      .def("__iter__",
           [](const py::object& self) {
             return py::iter(MaskDict(self.cast<const PyMasks&>().masks, self));
           })
      .def("__contains__",
           [](const PyMasks& self, const std::string& name) { return self.masks.contains(name); })
      .def("__len__", [](const PyMasks& self) { return self.masks.size(); })
      .def(
          "__getitem__",
          [](const py::object& self, const std::string& name) {
            const auto& masks = self.cast<const PyMasks&>().masks;
            const auto found = masks.find(name);
            if (found == masks.end()) throw py::key_error(name);
            return FromMask(found->second, self);
          },
          py::arg("name"), "[H, W] uint8: 0 outside, 255 inside; 128 and above is inside.")
      .def("__repr__", [](const PyMasks& self) {
        return "<retint.Masks of " + std::to_string(self.masks.size()) + " views>";
      });
}

void BindRegion(py::module_& module) {
  py::class_<PyRegion>(module, "Region", "A region as it was when it was asked for.")
      .def_property_readonly(
          "id", [](const PyRegion& r) { return r.data.id; }, "The number that add_region() gave.")
      .def_property_readonly(
          "name", [](const PyRegion& r) { return r.data.name; }, "As people see it.")
      .def_property_readonly(
          "edit", [](const PyRegion& r) { return r.data.edit; }, "The region's Edit.")
      .def_property_readonly(
          "strength", [](const PyRegion& r) { return r.data.strength; },
          "From 0, no change, to 1, the whole edit.")
      .def_property_readonly(
          "visible", [](const PyRegion& r) { return r.data.visible; },
          "False: the region is left out of renders, fits and files.")
      .def_property_readonly(
          "masks",
          [](const PyRegion& r) {
            return MaskDict(r.data.selection->masks, Keeper(r.data.selection));
          },
          "dict of image names to [H, W] uint8.")
      .def_property_readonly(
          "shares",
          [](const PyRegion& r) {
            return SharesView(r.data.selection->shares, Keeper(r.data.selection));
          },
          "[N] float32 in [0, 1]: how much of each Gaussian is in the region.")
      .def_property_readonly(
          "refit",
          [](const PyRegion& r) -> py::object {
            if (!r.data.fit) return py::none();
            return FromRefit(r.data.fit->summary);
          },
          "dict of the last refit's figures, or None.")
      .def("__repr__", [](const PyRegion& r) {
        return "<retint.Region " + std::to_string(r.data.id) + " " + r.data.name + ">";
      });
}

}  // namespace

void BindSelection(py::module_& module) {
  BindDepth(module);
  BindCloud(module);
  BindMasks(module);
  BindRegion(module);
}

}  // namespace retint::python
