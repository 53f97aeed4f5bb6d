// SPDX-License-Identifier: BSD-3-Clause
// Arrays between C++ and numpy. Arrays to Python are views of the C++ memory, which they keep
// alive. Arrays from Python are read in place if they are contiguous and of the right type.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>

#include "scene/image.h"

namespace retint::python {

namespace py = pybind11;

// An array over `data` that keeps `owner` alive.
template <typename T>
py::array ViewOf(const T* data, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
                 const py::object& owner, bool writeable = false) {
  py::array array(py::dtype::of<T>(), std::move(shape), std::move(strides), data, owner);
  if (!writeable) array.attr("flags").attr("writeable") = false;
  return array;
}

// A Python object that keeps what `shared` points to alive.
template <typename T>
py::object Keeper(std::shared_ptr<T> shared) {
  auto held = std::make_unique<std::shared_ptr<T>>(std::move(shared));
  py::capsule capsule(held.get(), [](void* p) { delete static_cast<std::shared_ptr<T>*>(p); });
  held.release();
  return capsule;
}

// The values of a vector as an array of that shape; the array owns them.
template <typename T, typename Allocator>
py::array Owned(std::vector<T, Allocator> values, std::vector<py::ssize_t> shape) {
  auto shared = std::make_shared<std::vector<T, Allocator>>(std::move(values));
  const T* data = shared->data();
  return ViewOf(data, std::move(shape), {}, Keeper(std::move(shared)), /*writeable=*/true);
}

// [H, W, C], or [H, W] where C is 1.
template <typename T, int C>
std::vector<py::ssize_t> ShapeOf(const PixelArray<T, C>& image) {
  std::vector<py::ssize_t> shape = {image.height, image.width};
  if (C > 1) shape.push_back(C);
  return shape;
}

template <typename T, int C>
py::array FromPixels(PixelArray<T, C> image) {
  auto shape = ShapeOf(image);
  return Owned(std::move(image.data), std::move(shape));
}

// A mask that others keep alive, not to be written to.
py::array FromMask(const Mask& mask, const py::object& owner);

bool IsPath(const py::object& object);

// A mask from an array [H, W]: bool, uint8 (0 outside, 255 inside), or floats in [0, 1]; or from
// the path of a picture. OptionError for another shape or type, and for another size than width x
// height where these are not 0.
Mask ToMask(const py::object& mask, int width = 0, int height = 0);

// A dict, or the items of another mapping; OptionError for other objects.
py::dict ToDictOfMasks(const py::object& masks);

// An image from an array [H, W, 3] of floats or of uint8 (divided by 255). OptionError otherwise.
Image ToImage(const py::object& image);

// An array of float32 that lies in one piece; `values` is copied only where it is not one already.
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
// OptionError naming `what` unless the array has the shape.
void RequireShape(const py::array& array, std::initializer_list<py::ssize_t> shape,
                  const std::string& what);
inline std::span<const float> SpanOf(const Floats& array) {
  return {array.data(), static_cast<size_t>(array.size())};
}

// str and os.PathLike. None is the empty path.
std::filesystem::path ToPath(const py::object& path);
py::object FromPath(const std::filesystem::path& path);  // pathlib.Path

}  // namespace retint::python
