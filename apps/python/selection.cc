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
          "[H, W] float32: z along the viewing axis, in world units; 0 if a pixel has no depth.")
      .def_property_readonly(
          "valid",
          [](const py::object& self) {
            return FromMask(self.cast<const DepthEstimate&>().valid, self);
          },
          "[H, W] uint8: 255 if the method measured the pixel; 0 if the depth is filled in or "
          "unknown.")
      .def_readonly("valid_fraction", &DepthEstimate::valid_fraction,
                    "Fraction of valid pixels, in [0, 1].")
      .def_readonly("method", &DepthEstimate::method, "The method's name, for example 'stereo-hv'.")
      .def_readonly("reason", &DepthEstimate::reason, "How the depth was found, in one line.")
      .def_readonly("warning", &DepthEstimate::warning,
                    "Which of the options could not be met, or ''.")
      .def(
          "write",
          [](const DepthEstimate& self, const py::object& path) {
            WriteDepthMap(ToPath(path), self.depth);
          },
          py::arg("path"),
          "Writes the depth as COLMAP's dense depth map (.bin). RunError if it cannot be written.")
      .def("__repr__", [](const DepthEstimate& self) {
        return fmt::format("<retint.Depth {}x{} by {}, {:.0f} % valid>", self.depth.width,
                           self.depth.height, self.method, 100 * self.valid_fraction);
      });
  py::class_<PaintedView>(module, "Painted", "A view and its painted mask.")
      .def_readonly("view", &PaintedView::name, "The view's name.")
      .def_readonly("camera", &PaintedView::camera, "The view's Camera.")
      .def_property_readonly(
          "mask",
          [](const py::object& self) { return FromMask(self.cast<PaintedView&>().mask, self); },
          "[H, W] uint8: 0 outside, 255 inside.")
      .def_readonly("outlined_by", &PaintedView::outlined_by,
                    "The network that outlined the mask, as its file names it, or ''.")
      .def("__repr__", [](const PaintedView& self) {
        const auto& values = self.mask.data;
        const auto inside =
            std::count_if(values.begin(), values.end(), [](uint8_t v) { return v >= 128; });
        return fmt::format("<retint.Painted {}, {} pixels>", self.name, inside);
      });
}

void BindCloud(py::module_& module) {
  using P = const SelectionPoint&;
  py::class_<PySelection>(
      module, "Selection",
      "A selection in 3D: one point for each painted pixel that was sampled. Arrays share "
      "its memory; you cannot write to them.")
      .def_static(
          "read",
          [](const py::object& path) {
            PySelection selection;
            selection.source.cloud = ReadCloud(ToPath(path));
            return selection;
          },
          py::arg("path"),
          "Reads a point cloud (.ply) that Retint wrote, or another one with x, y and z. "
          "InputError if it is missing or damaged.")
      .def(
          "write",
          [](const PySelection& self, const py::object& path) {
            WriteCloud(ToPath(path), self.source.cloud);
          },
          py::arg("path"), "Writes the points as .ply. RunError if it cannot be written.")
      .def_property_readonly("positions", PointsOf([](P p) { return p.position.data(); }, 3),
                             "[P, 3] float32: positions in the world.")
      .def_property_readonly("normals", PointsOf([](P p) { return p.normal.data(); }, 3),
                             "[P, 3] float32: unit normals in the world, toward the camera.")
      .def_property_readonly("colors", PointsOf([](P p) { return p.color.data(); }, 3),
                             "[P, 3] uint8: RGB of the photo or render.")
      .def_property_readonly("footprints", PointsOf([](P p) { return &p.footprint; }, 0),
                             "[P] float32: size of a pixel at the point, in world units.")
      .def_property_readonly("confidences", PointsOf([](P p) { return &p.confidence; }, 0),
                             "[P] float32: 1 if the depth was measured, 0.5 if it was filled in.")
      .def_property_readonly("coverages", PointsOf([](P p) { return &p.coverage; }, 0),
                             "[P] float32 in (0, 1]: value of the soft painted mask.")
      .def_property_readonly(
          "source", PointsOf([](P p) { return &p.source; }, 0),
          "[P] uint16: index into `sources`, the view that the point comes from.")
      .def_property_readonly(
          "sources", [](const PySelection& self) { return self.source.cloud.sources; },
          "Names of the painted views.")
      .def_property_readonly(
          "painted", [](const PySelection& self) { return self.source.painted; },
          "The painted views.")
      .def_readonly("depths", &PySelection::depths, "The depth of each painted view.")
      .def_property_readonly(
          "reports",
          [](const PySelection& self) {
            py::list list;
            for (const PaintedReport& report : self.source.reports)
              list.append(FromPainted(report));
            return list;
          },
          "One dict for each painted view: its depth, sampled points and registration.")
      .def("__add__", &Joined, py::arg("other"),
           "A selection with the points of both. OptionError if a view is painted in both.")
      .def("__len__", [](const PySelection& self) { return self.source.cloud.points.size(); })
      .def("__repr__", [](const PySelection& self) {
        return "<retint.Selection " + std::to_string(self.source.cloud.points.size()) + " points>";
      });
}

void BindMasks(py::module_& module) {
  py::class_<PyMasks>(
      module, "Masks",
      "Soft masks by image name. Masks of a projection also know the coverage of each "
      "Gaussian (`shares`). You cannot write to the arrays.")
      .def(py::init(&MasksFromDict), py::arg("masks"), py::arg("shares") = py::none(),
           "`masks`: a dict of image names to masks, arrays [H, W] or paths. `shares`: the "
           "coverage of each Gaussian, [N] in [0, 1]; without it, add_region() computes it from "
           "the masks.")
      .def("write", &WriteMasksTo, py::arg("folder"), py::arg("progress") = py::none(),
           "Writes `FOLDER/<image name>.png` and, if known, shares.bin and confidence.bin.")
      .def_property_readonly(
          "shares",
          [](const py::object& self) {
            return SharesView(self.cast<const PyMasks&>().shares, self);
          },
          "[N] float32 in [0, 1]: how much of each Gaussian is inside; [0] if unknown.")
      .def_property_readonly(
          "confidence",
          [](const py::object& self) {
            return SharesView(self.cast<const PyMasks&>().confidence, self);
          },
          "[N] float32 in [0, 1]: how sure each value of `shares` is, 1 if a painted view shows "
          "it; [0] without completion.")
      .def_readonly(
          "warning", &PyMasks::warning,
          "Why `shares` of a folder were ignored, or which painted views kept less than half of "
          "their mask; otherwise ''.")
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
          "Pairs of image name and mask.")
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
          py::arg("name"),
          "The mask of that image, [H, W] uint8: 0 outside, 255 inside; 128 and above counts as "
          "inside. KeyError if there is none.")
      .def("__repr__", [](const PyMasks& self) {
        return "<retint.Masks of " + std::to_string(self.masks.size()) + " views>";
      });
}

void BindRegion(py::module_& module) {
  py::class_<PyRegion>(module, "Region",
                       "A region, in the state in which region() or `regions` returned it.")
      .def_property_readonly(
          "id", [](const PyRegion& r) { return r.data.id; },
          "The number that add_region() returned.")
      .def_property_readonly(
          "name", [](const PyRegion& r) { return r.data.name; }, "The region's name.")
      .def_property_readonly(
          "edit", [](const PyRegion& r) { return r.data.edit; }, "The region's Edit.")
      .def_property_readonly(
          "strength", [](const PyRegion& r) { return r.data.strength; },
          "From 0, no change, to 1, the whole edit.")
      .def_property_readonly(
          "visible", [](const PyRegion& r) { return r.data.visible; },
          "If False, renders, fits and files leave the region out.")
      .def_property_readonly(
          "masks",
          [](const PyRegion& r) {
            return MaskDict(r.data.selection->masks, Keeper(r.data.selection));
          },
          "A dict of image names to masks, [H, W] uint8.")
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
          "A dict with the figures of the last refit(), or None.")
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
