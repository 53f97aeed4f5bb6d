// SPDX-License-Identifier: BSD-3-Clause
// Workspace, View, Camera, Splat and pictures.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "colmap_io/image_io.h"
#include "scene/image_size.h"
#include "splat_io/splat_io.h"
#include "types.h"

namespace retint::python {
namespace {

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

// ---- Camera ----

// [3, 4] or [4, 4]: x_in_cam = R x_in_world + t.
Rigid3d ToPose(const Doubles& matrix) {
  const bool fits =
      matrix.ndim() == 2 && matrix.shape(1) == 4 && (matrix.shape(0) == 3 || matrix.shape(0) == 4);
  CheckOption(fits, "cam_from_world is a matrix [3, 4] or [4, 4]");
  const auto m = matrix.unchecked<2>();
  Eigen::Matrix3d rotation;
  Rigid3d pose;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rotation(i, j) = m(i, j);
    pose.translation(i) = m(i, 3);
  }
  // A rotation up to the rounding of single precision.
  const bool is_rotation =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-4 &&
      rotation.determinant() > 0 && pose.translation.allFinite();
  CheckOption(is_rotation, "cam_from_world is not a rotation and a translation");
  pose.rotation = Eigen::Quaterniond(rotation).normalized();
  return pose;
}

py::array_t<double> FromPose(const Rigid3d& pose) {
  py::array_t<double> matrix({4, 4});
  auto m = matrix.mutable_unchecked<2>();
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      m(i, j) = i == 3 ? double(j == 3) : j == 3 ? pose.translation(i) : rotation(i, j);
    }
  }
  return matrix;
}

py::array_t<double> FromVector(const Eigen::Vector3d& vector) {
  py::array_t<double> array(3);
  std::copy_n(vector.data(), 3, array.mutable_data());
  return array;
}

PosedCamera MakeCamera(int width, int height, double fx, double fy, double cx, double cy,
                       const py::object& cam_from_world) {
  CheckOption(width > 0 && height > 0, "a camera's width and height are positive");
  CheckOption(IsImageSize(static_cast<uint64_t>(width), static_cast<uint64_t>(height)),
              "a camera has at most 2^31 pixels, and 1000000 along a side");
  CheckOption(fx > 0 && fy > 0, "a camera's focal lengths are positive");
  CheckOption(std::isfinite(fx) && std::isfinite(fy) && std::isfinite(cx) && std::isfinite(cy),
              "a camera's focal lengths and principal point are finite");
  PosedCamera camera;
  camera.camera = Camera::Pinhole(1, width, height, fx, fy, cx, cy);
  if (!cam_from_world.is_none()) camera.cam_from_world = ToPose(Doubles(cam_from_world));
  return camera;
}

void BindCamera(py::module_& module) {
  py::class_<PosedCamera>(
      module, "Camera",
      "A pinhole camera and its pose. x points right, y down, z forward; pixel (x, y) covers "
      "[x, x+1) x [y, y+1).")
      .def(py::init(&MakeCamera), py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"),
           py::arg("cx"), py::arg("cy"), py::arg("cam_from_world") = py::none(),
           "`width`, `height`, the focal lengths `fx` and `fy` and the principal point `cx`, `cy` "
           "are in pixels. `cam_from_world` is a matrix [3, 4] or [4, 4], x_in_cam = R x_in_world "
           "+ t; without it the camera stands at the origin. OptionError if a size is not "
           "positive, or the matrix is not a rotation and a translation.")
      .def_property_readonly(
          "width", [](const PosedCamera& c) { return c.camera.width; },
          "Width of the image, in pixels.")
      .def_property_readonly(
          "height", [](const PosedCamera& c) { return c.camera.height; },
          "Height of the image, in pixels.")
      .def_property_readonly(
          "model",
          [](const PosedCamera& c) {
            const CameraModelInfo* info = FindCameraModel(static_cast<int>(c.camera.model));
            return std::string(info ? info->name : "unknown");
          },
          "COLMAP's name of the camera model.")
      .def_property_readonly(
          "params", [](const PosedCamera& c) { return c.camera.params; },
          "COLMAP's parameters in COLMAP's order, in pixels.")
      .def_property_readonly(
          "K",
          [](const PosedCamera& c) {
            if (!c.camera.IsPinhole()) throw InputError("the camera is not a pinhole camera");
            py::array_t<double> matrix({3, 3});
            auto m = matrix.mutable_unchecked<2>();
            const Eigen::Matrix3d k = c.camera.K();
            for (int i = 0; i < 3; ++i) {
              for (int j = 0; j < 3; ++j) m(i, j) = k(i, j);
            }
            return matrix;
          },
          "[3, 3] float64: the calibration matrix, in pixels.")
      .def_property_readonly(
          "cam_from_world", [](const PosedCamera& c) { return FromPose(c.cam_from_world); },
          "[4, 4] float64: from the world to the camera's frame.")
      .def_property_readonly(
          "center", [](const PosedCamera& c) { return FromVector(c.Center()); },
          "[3] float64: the camera's position in the world.")
      .def("__repr__", [](const PosedCamera& c) {
        return "<retint.Camera " + std::to_string(c.camera.width) + "x" +
               std::to_string(c.camera.height) + ">";
      });
}

// ---- Workspace ----

std::vector<PyView> ViewsOf(const PyWorkspace& self) {
  std::vector<PyView> views;
  for (const View* view : self.data->reconstruction.ViewsByName()) {
    views.push_back({self.data, view});
  }
  return views;
}

py::tuple SparsePoints(const PyWorkspace& self) {
  const auto& points = self.data->reconstruction.points;
  const auto count = static_cast<py::ssize_t>(points.size());
  py::array_t<double> xyz({count, py::ssize_t{3}});
  py::array_t<uint8_t> rgb({count, py::ssize_t{3}});
  double* position = xyz.mutable_data();
  uint8_t* color = rgb.mutable_data();
  for (const auto& [id, point] : points) {
    position = std::copy_n(point.xyz.data(), 3, position);
    color = std::copy_n(point.color.data(), 3, color);
  }
  return py::make_tuple(xyz, rgb);
}

void BindWorkspace(py::module_& module) {
  py::class_<PyView>(module, "View", "A posed image of a workspace.")
      .def_property_readonly(
          "name", [](const PyView& v) { return v.view->name; },
          "The photo's name relative to the image folder, with '/' between folders.")
      .def_property_readonly(
          "id", [](const PyView& v) { return v.view->id; }, "COLMAP's image id.")
      .def_property_readonly(
          "camera", [](const PyView& v) { return v.workspace->reconstruction.Posed(*v.view); },
          "The view's Camera.")
      .def_property_readonly(
          "photo_path", [](const PyView& v) { return FromPath(v.workspace->PhotoPath(*v.view)); },
          "Path of the photo. The file may be missing.")
      .def(
          "photo", [](const PyView& v) { return FromPixels(v.workspace->ReadPhoto(*v.view)); },
          "Reads the photo: [H, W, 3] float32, RGB in [0, 1] as stored. InputError if the file "
          "is missing or damaged.")
      .def("__repr__", [](const PyView& v) { return "<retint.View " + v.view->name + ">"; });
  py::class_<PyWorkspace>(module, "Workspace",
                          "A COLMAP workspace: cameras, posed images (views) and sparse points.")
      .def(py::init([](const py::object& path, const py::object& images, const std::string& model) {
             const auto root = ToPath(path), folder = ToPath(images);
             const py::gil_scoped_release unlocked;
             return PyWorkspace{std::make_shared<Workspace>(Workspace::Open(root, folder, model))};
           }),
           py::arg("path"), py::arg("images") = py::none(), py::arg("model") = "",
           "Opens a folder with a model in `sparse/0`, `sparse` or the folder itself, text or "
           "binary. `images`: the folder of the photos, by default PATH/images. `model`: the name "
           "of the sparse model, if there are several. InputError for missing or damaged files.")
      .def_property_readonly(
          "root", [](const PyWorkspace& w) { return FromPath(w.data->root); },
          "The workspace's folder.")
      .def_property_readonly("views", &ViewsOf, "Every View, sorted by name.")
      .def_property_readonly(
          "points", &SparsePoints,
          "The sparse points, sorted by id: positions [P, 3] float64 in the world, and colors "
          "[P, 3] uint8, RGB.")
      .def_property_readonly(
          "warnings", [](const PyWorkspace& w) { return w.data->warnings; },
          "One line for each oddity of the files.")
      .def("__len__", [](const PyWorkspace& w) { return w.data->reconstruction.views.size(); })
      .def(
          "__getitem__",
          [](const PyWorkspace& w, const std::string& name) {
            return PyView{w.data, &w.data->RequireView(name)};
          },
          py::arg("name"), "The view of that name. InputError if there is none.")
      .def(
          "__iter__", [](const PyWorkspace& w) { return py::iter(py::cast(ViewsOf(w))); },
          "Iterates over the views, sorted by name.")
      .def("__repr__", [](const PyWorkspace& w) {
        return "<retint.Workspace " + std::to_string(w.data->reconstruction.views.size()) +
               " views, " + std::to_string(w.data->reconstruction.points.size()) + " points>";
      });
}

// ---- Splat ----

struct SplatArray {
  const char* name;
  FloatArray GaussianModel::*member;
  std::vector<py::ssize_t> (*shape)(const GaussianModel& model);
  const char* doc;
};

py::ssize_t Count(const GaussianModel& model) {
  return static_cast<py::ssize_t>(model.NumGaussians());
}

using Shape = std::vector<py::ssize_t>;
const SplatArray kArrays[] = {
    {"means", &GaussianModel::means,
     [](const GaussianModel& m) {
       return Shape{Count(m), 3};
     },
     "[N, 3] float32: positions in the world."},
    {"quats_wxyz", &GaussianModel::quats_wxyz,
     [](const GaussianModel& m) {
       return Shape{Count(m), 4};
     },
     "[N, 4] float32: rotations as quaternions w, x, y, z, not normalized."},
    {"log_scales", &GaussianModel::log_scales,
     [](const GaussianModel& m) {
       return Shape{Count(m), 3};
     },
     "[N, 3] float32: natural logarithms of the standard deviations along the Gaussian's "
     "own axes, in world units."},
    {"opacity_logits", &GaussianModel::opacity_logits,
     [](const GaussianModel& m) { return Shape{Count(m)}; },
     "[N] float32: opacities before the sigmoid; the opacity is 1 / (1 + exp(-x))."},
    {"sh", &GaussianModel::sh,
     [](const GaussianModel& m) {
       return Shape{Count(m), m.NumShCoeffs(), 3};
     },
     "[N, K, 3] float32: spherical harmonics of the colors, K = (degree + 1)^2."},
};

const SplatArray& FindArray(const std::string& name) {
  for (const SplatArray& array : kArrays) {
    if (name == array.name) return array;
  }
  throw py::key_error(name);
}

py::array ArrayOf(const PySplat& splat, const SplatArray& array) {
  return ViewOf(((*splat.data).*array.member).data(), array.shape(*splat.data), {},
                Keeper(splat.data), splat.writeable);
}

void CheckWriteable(const PySplat& splat) {
  CheckOption(splat.writeable, "this splat is a session's own; copy() can be written to");
}

void SetArray(PySplat& splat, const std::string& name, const Floats& values) {
  const SplatArray& array = FindArray(name);
  CheckWriteable(splat);
  const Shape shape = array.shape(*splat.data);
  const bool fits = values.ndim() == static_cast<py::ssize_t>(shape.size()) &&
                    std::equal(shape.begin(), shape.end(), values.shape());
  CheckOption(fits, name + " has another shape");
  std::copy_n(values.data(), values.size(), ((*splat.data).*array.member).begin());
}

PySplat FromArrays(const Floats& means, const Floats& quats, const Floats& scales,
                   const Floats& opacities, const Floats& sh) {
  CheckOption(sh.ndim() == 3 && means.ndim() == 2, "means is [N, 3] and sh is [N, K, 3]");
  int degree = 0;
  while (degree < 3 && (degree + 1) * (degree + 1) < sh.shape(1)) ++degree;
  const py::ssize_t count = means.shape(0);
  RequireShape(means, {count, 3}, "means");
  RequireShape(quats, {count, 4}, "quats_wxyz");
  RequireShape(scales, {count, 3}, "log_scales");
  RequireShape(opacities, {count}, "opacity_logits");
  RequireShape(sh, {count, (degree + 1) * (degree + 1), 3}, "sh");
  auto model = std::make_shared<GaussianModel>();
  const auto copy = [](const Floats& values) {
    return FloatArray(values.data(), values.data() + values.size());
  };
  model->sh_degree = degree;
  model->means = copy(means);
  model->quats_wxyz = copy(quats);
  model->log_scales = copy(scales);
  model->opacity_logits = copy(opacities);
  model->sh = copy(sh);
  model->Validate();
  return {std::move(model)};
}

PySplat ReadFrom(const py::object& path, py::object progress) {
  const auto file = ToPath(path);
  Call call(std::move(progress));
  return {call.Run(
      [&](Monitor& monitor) { return std::make_shared<GaussianModel>(ReadSplat(file, monitor)); })};
}

void WriteTo(const PySplat& splat, const py::object& path, py::object progress) {
  const auto file = ToPath(path);
  Call call(std::move(progress));
  call.Run([&](Monitor& monitor) { WriteSplat(file, *splat.data, monitor); });
}

void SetRenderModel(PySplat& splat, const std::string& name) {
  CheckWriteable(splat);
  const auto model = RenderModelNamed(name);
  CheckOption(model.has_value(), "render_model is 'default', 'mip', '2dgs' or '3dgut'");
  splat.data->traits.render_model = *model;
  splat.data->traits.render_model_reason = "chosen";
}

void SetColorSpace(PySplat& splat, const std::string& name) {
  CheckWriteable(splat);
  const auto space = ColorSpaceNamed(name);
  CheckOption(space.has_value(), "'" + name + "' is not a color space of splats");
  splat.data->traits.color_space = *space;
}

// ---- Splat, pickled ----

// Of a file the texts and data are bytes.
py::list FromTexts(const std::vector<std::string>& texts) {
  py::list list;
  for (const std::string& text : texts) list.append(py::bytes(text));
  return list;
}

template <typename Bytes>
py::bytes FromBytes(const Bytes& bytes) {
  return {bytes.data(), bytes.size()};
}

template <typename Bytes>
Bytes ToBytes(const py::handle& object) {
  const auto text = object.cast<std::string>();
  return Bytes(text.begin(), text.end());
}

// The arrays, and the rest of the file.
py::tuple StateOf(const PySplat& splat) {
  py::list arrays, extras;
  for (const SplatArray& array : kArrays) arrays.append(ArrayOf(splat, array));
  const SourceLayout& source = splat.data->source;
  for (const ExtraColumn& extra : source.extras) {
    extras.append(
        py::make_tuple(extra.name, extra.type, extra.bytes_per_value, FromBytes(extra.bytes)));
  }
  return py::make_tuple(arrays, FromTexts(source.comments), FromTexts(source.property_order),
                        extras, FromTexts(source.trailing_header), FromBytes(source.trailing_bytes),
                        py::bytes(source.packed_format), FromBytes(source.packed),
                        FromTexts(source.notes), NameOf(splat.data->traits.render_model),
                        splat.data->traits.render_model_reason,
                        NameOf(splat.data->traits.color_space));
}

PySplat FromState(const py::tuple& state) {
  using Texts = std::vector<std::string>;
  CheckOption(state.size() == 12, "this is not the state of a Splat");
  const auto arrays = state[0].cast<std::vector<Floats>>();
  CheckOption(arrays.size() == std::size(kArrays), "this is not the state of a Splat");
  PySplat splat = FromArrays(arrays[0], arrays[1], arrays[2], arrays[3], arrays[4]);
  SourceLayout& source = splat.data->source;
  source.comments = state[1].cast<Texts>();
  source.property_order = state[2].cast<Texts>();
  for (const py::handle& extra : state[3]) {
    const auto [name, type, size, bytes] =
        extra.cast<std::tuple<std::string, std::string, int, py::bytes>>();
    source.extras.push_back({name, type, size, ToBytes<std::vector<char>>(bytes)});
    CheckOption(size > 0 && source.extras.back().bytes.size() ==
                                splat.data->NumGaussians() * static_cast<size_t>(size),
                "the column " + name + " has another length");
  }
  source.trailing_header = state[4].cast<Texts>();
  source.trailing_bytes = ToBytes<std::vector<char>>(state[5]);
  source.packed_format = state[6].cast<std::string>();
  source.packed = ToBytes<UnsetVector<char>>(state[7]);
  source.notes = state[8].cast<Texts>();
  SetRenderModel(splat, state[9].cast<std::string>());
  splat.data->traits.render_model_reason = state[10].cast<std::string>();
  SetColorSpace(splat, state[11].cast<std::string>());
  return splat;
}

void BindSplat(py::module_& module) {
  py::class_<PySplat> type(
      module, "Splat",
      "A 3D Gaussian Splatting scene with the raw values of the training code. Its arrays "
      "share the splat's memory: if you write to an array, you change the splat, and an "
      "array keeps its splat alive. You cannot write to the arrays of a session's own splat.");
  type.def(py::init(&FromArrays), py::arg("means"), py::arg("quats_wxyz"), py::arg("log_scales"),
           py::arg("opacity_logits"), py::arg("sh"),
           "Copies the arrays, which the attributes below describe. OptionError if their shapes "
           "do not fit together.")
      .def_static(
          "read", &ReadFrom, py::arg("path"), py::arg("progress") = py::none(),
          "Reads a file of any supported format. InputError if it is missing, damaged or of no "
          "known format.")
      .def("write", &WriteTo, py::arg("path"), py::arg("progress") = py::none(),
           "Writes the format of the file's extension, whole or not at all. Values that did not "
           "change keep the bytes of the file that you read. OptionError for an unknown "
           "extension, RunError if the file cannot be written.")
      .def(
          "copy",
          [](const PySplat& s) { return PySplat{std::make_shared<GaussianModel>(*s.data)}; },
          "A copy that you can write to.")
      .def_property_readonly(
          "sh_degree", [](const PySplat& s) { return s.data->sh_degree; },
          "Degree of the spherical harmonics, 0 to 3.")
      .def_property_readonly(
          "comments", [](const PySplat& s) { return s.data->source.comments; },
          "The comments of the file that you read.")
      .def_property(
          "render_model",
          [](const PySplat& s) { return std::string(NameOf(s.data->traits.render_model)); },
          &SetRenderModel,
          "How the splat was trained: 'default', 'mip' (with an antialiasing filter), '2dgs' or "
          "'3dgut'. Retint renders the last two as default.")
      .def_property(
          "color_space",
          [](const PySplat& s) { return std::string(NameOf(s.data->traits.color_space)); },
          &SetColorSpace,
          "The space of the blended colors: 'srgb_rec709_display', 'lin_rec709_display', "
          "'srgb_rec709_scene' or 'lin_rec709_scene'. Setting it converts nothing.")
      .def("__len__", [](const PySplat& s) { return s.data->NumGaussians(); })
      .def(
          "__getitem__",
          [](const PySplat& s, const std::string& name) { return ArrayOf(s, FindArray(name)); },
          py::arg("name"),
          "The array of that name, for example `splat['means']`. KeyError if there is none.")
      .def("__setitem__", &SetArray, py::arg("name"), py::arg("values"),
           "Copies values of the same shape into the array of that name. OptionError for another "
           "shape, or if you cannot write to the splat.")
      .def(
          "keys",
          [](const PySplat&) {
            std::vector<std::string> names;
            for (const SplatArray& array : kArrays) names.emplace_back(array.name);
            return names;
          },
          "The names of the arrays.")
      .def(py::pickle(&StateOf, &FromState))
      .def("__repr__", [](const PySplat& s) {
        return "<retint.Splat " + std::to_string(s.data->NumGaussians()) +
               " Gaussians, SH degree " + std::to_string(s.data->sh_degree) + ">";
      });
  for (const SplatArray& array : kArrays) {
    type.def_property(
        array.name, [&array](const PySplat& s) { return ArrayOf(s, array); },
        [&array](PySplat& s, const Floats& values) { SetArray(s, array.name, values); }, array.doc);
  }
}

void BindPictures(py::module_& module) {
  module.def(
      "read_image", [](const py::object& path) { return FromPixels(ReadImage(ToPath(path))); },
      py::arg("path"),
      "Reads a picture: [H, W, 3] float32, RGB in [0, 1] as stored. InputError if it is "
      "missing or damaged.");
  module.def(
      "read_mask", [](const py::object& path) { return FromPixels(ReadMask(ToPath(path))); },
      py::arg("path"),
      "Reads a mask from a picture: [H, W] uint8, 0 outside and 255 inside. If the picture "
      "has transparent pixels, its alpha is the mask; otherwise the largest color channel "
      "is. InputError if it is missing or damaged.");
  module.def(
      "write_png",
      [](const py::object& path, const py::object& pixels) {
        const auto array = py::array::ensure(pixels);
        CheckOption(bool(array), "the pixels are an array [H, W, 3] or [H, W]");
        if (array.ndim() == 2) {
          WritePng(ToPath(path), ToMask(array));
        } else {
          WritePng(ToPath(path), ToImage(array));
        }
      },
      py::arg("path"), py::arg("pixels"),
      "Writes an image [H, W, 3] or a mask [H, W] as an 8-bit PNG. Floats of an image are "
      "clamped to [0, 1]. RunError if the file cannot be written.");
}

}  // namespace

Viewpoint ToViewpoint(const py::object& view, const Workspace* workspace) {
  if (py::isinstance<PosedCamera>(view)) return {view.cast<PosedCamera>()};
  if (py::isinstance<PyView>(view)) {
    const auto& one = view.cast<const PyView&>();
    return {one.workspace->reconstruction.Posed(*one.view), one.view};
  }
  if (workspace && py::isinstance<py::str>(view)) {
    const View& one = workspace->RequireView(view.cast<std::string>());
    return {workspace->reconstruction.Posed(one), &one};
  }
  throw OptionError(workspace ? "a view is a View, a Camera or the name of a view"
                              : "a view is a View or a Camera");
}

void BindScene(py::module_& module) {
  BindCamera(module);
  BindWorkspace(module);
  BindSplat(module);
  BindPictures(module);
}

}  // namespace retint::python
