// SPDX-License-Identifier: BSD-3-Clause
// Session: photos of distorted cameras in their own pixels.
#include <map>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "opening/pictures.h"
#include "rendering.h"
#include "types.h"

namespace retint::python {
namespace {

// work(session, pictures of the photos), as PySession::Use.
template <typename Work>
auto WithPhotos(PySession& self, Work&& work) {
  return self.Use([&](EditSession& session) {
    return work(session, Pictures(session.scene().workspace(), Pixels::kPhoto));
  });
}

py::list Photos(PySession& self) {
  const auto all =
      WithPhotos(self, [](EditSession&, const Pictures& pictures) { return pictures.all(); });
  py::list photos;
  for (const UserPicture& picture : all) {
    py::list views;
    for (const View* face : picture.faces) views.append(face->name);
    py::dict photo;
    photo["name"] = picture.name;
    photo["width"] = picture.width;
    photo["height"] = picture.height;
    photo["views"] = std::move(views);
    photo["distorted"] = picture.photo != nullptr;
    photos.append(std::move(photo));
  }
  return photos;
}

UserPicture RequirePhoto(PySession& self, const std::string& name) {
  return WithPhotos(
      self, [&](EditSession&, const Pictures& pictures) { return pictures.RequireOne(name); });
}

std::vector<PaintedView> PaintPhoto(PySession& self, const std::string& name,
                                    const py::object& mask) {
  const UserPicture photo = RequirePhoto(self, name);
  const Mask paint = ToMask(mask, photo.width, photo.height);
  return WithPhotos(self, [&](EditSession&, const Pictures& pictures) {
    return pictures.Brush(photo, paint, name);
  });
}

// Every layer that was rendered of the faces, as the photo has it.
RenderOutput Compose(const Pictures& pictures, const UserPicture& photo,
                     const std::map<const View*, RenderOutput>& faces,
                     const RenderRequest& request) {
  RenderOutput output;
  if (request.rgb) {
    output.rgb = pictures.Compose(photo, [&](const View& face) { return faces.at(&face).rgb; });
  }
  if (request.alpha) {
    output.alpha =
        pictures.ComposeScalar(photo, [&](const View& face) { return faces.at(&face).alpha; });
  }
  const auto depth = [&](DepthMap RenderOutput::*layer) {
    return pictures.ComposeDepth(photo, [&](const View& face) { return faces.at(&face).*layer; });
  };
  if (request.depth_median) output.depth_median = depth(&RenderOutput::depth_median);
  if (request.depth_expected) output.depth_expected = depth(&RenderOutput::depth_expected);
  return output;
}

py::object RenderPhoto(PySession& self, const std::string& name, const py::object& what,
                       const py::object& sh) {
  const RenderRequest request = ToRequest(what);
  const Floats given = ToSh(self, sh);
  const UserPicture photo = RequirePhoto(self, name);
  return Layers(WithPhotos(self,
                           [&](EditSession& session, const Pictures& pictures) {
                             ShowSh(session, given);
                             std::map<const View*, RenderOutput> faces;
                             for (const View* face : photo.faces) {
                               const PosedCamera camera =
                                   session.scene().reconstruction().Posed(*face);
                               faces[face] = session.scene().renderer().Render(camera, request);
                             }
                             return Compose(pictures, photo, faces, request);
                           }),
                what);
}

PyMasks FromPhotos(PySession& self, const py::object& given) {
  std::map<std::string, Mask> masks;
  for (const auto& [name, mask] : ToDictOfMasks(given)) {
    const UserPicture photo = RequirePhoto(self, name.cast<std::string>());
    masks[photo.name] = ToMask(py::reinterpret_borrow<py::object>(mask), photo.width, photo.height);
  }
  return WithPhotos(self, [&](EditSession&, const Pictures& pictures) {
    PyMasks result;
    result.masks = pictures.ToViews(masks);
    return result;
  });
}

py::dict ToPhotos(PySession& self, const PyMasks& given) {
  auto masks = WithPhotos(self, [&](EditSession& session, const Pictures& pictures) {
    for (const auto& [name, mask] : given.masks) {
      const Camera& camera = session.scene()
                                 .reconstruction()
                                 .Posed(session.scene().workspace().RequireView(name))
                                 .camera;
      CheckOption(mask.width == camera.width && mask.height == camera.height,
                  "the mask of " + name + " has not its view's size");
    }
    return pictures.FromViews(given.masks);
  });
  py::dict photos;
  for (auto& [name, mask] : masks) photos[py::str(name)] = FromPixels(std::move(mask));
  return photos;
}

}  // namespace

void BindPhotos(py::class_<PySession>& type) {
  type.def_property_readonly(
          "photos", &Photos,
          "The photos in their own pixels, sorted by name. Each is a dict: 'name', 'width', "
          "'height', 'views' (names of the pinhole views that show it) and 'distorted' (False if "
          "its only view has the photo's own pixels).")
      .def("paint_photo", &PaintPhoto, py::arg("photo"), py::arg("mask"),
           "Pairs the views that show a photo with its mask, given in the photo's own pixels. "
           "Accepts the same masks as paint() and returns a list for select().")
      .def("render_photo", &RenderPhoto, py::arg("photo"), py::arg("what") = "rgb",
           py::arg("sh") = py::none(),
           "render() in the photo's own pixels, 0 if a pixel has no ray. Depth is z of the "
           "photo's camera, or the distance if that camera sees too wide for z.")
      .def("masks_of_photos", &FromPhotos, py::arg("masks"),
           "Makes Masks of the views, for add_region(), from a dict of photos' names to masks in "
           "the photos' own pixels.")
      .def("photo_masks", &ToPhotos, py::arg("masks"),
           "Masks in the photos' own pixels: a dict of photos' names to [H, W] uint8.");
}

}  // namespace retint::python
