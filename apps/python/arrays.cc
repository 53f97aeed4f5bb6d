// SPDX-License-Identifier: BSD-3-Clause
#include "arrays.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "colmap_io/image_io.h"

namespace retint::python {
namespace {

std::string ShapeText(const py::array& array) {
  std::string text = "[";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  }
  return text + "]";
}

bool IsBytes(const py::array& array) {
  return array.dtype().kind() == 'u' && array.itemsize() == 1;
}

std::vector<uint8_t> MaskValues(const py::array& array) {
  std::vector<uint8_t> values(static_cast<size_t>(array.size()));
  if (array.dtype().kind() == 'b') {
    const auto flags = py::array_t<bool, py::array::c_style>::ensure(array);
    std::transform(flags.data(), flags.data() + flags.size(), values.begin(),
                   [](bool inside) { return inside ? 255 : 0; });
    return values;
  }
  if (IsBytes(array)) {
    const auto bytes = py::array_t<uint8_t, py::array::c_style>::ensure(array);
    std::copy_n(bytes.data(), bytes.size(), values.begin());
    return values;
  }
  if (array.dtype().kind() != 'f') {
    throw OptionError("a mask's values are bool, uint8 (0 to 255) or floats in [0, 1]");
  }
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>(array);
  for (size_t i = 0; i < values.size(); ++i) {
    const double value = numbers.data()[i];
    if (!(value >= 0 && value <= 1)) throw OptionError("a mask of floats lies in [0, 1]");
    values[i] = static_cast<uint8_t>(std::lround(255 * value));
  }
  return values;
}

}  // namespace

bool IsPath(const py::object& object) {
  return py::isinstance<py::str>(object) || py::hasattr(object, "__fspath__");
}

py::array FromMask(const Mask& mask, const py::object& owner) {
  return ViewOf(mask.data.data(), ShapeOf(mask), {}, owner);
}

Mask ToMask(const py::object& mask, int width, int height) {
  if (IsPath(mask)) {
    return width > 0 ? ReadBrushMask(ToPath(mask), width, height) : ReadMask(ToPath(mask));
  }
  const auto array = py::array::ensure(mask);
  if (!array) {
    PyErr_Clear();
    throw OptionError("a mask is an array or the path of a picture");
  }
  if (array.ndim() != 2) throw OptionError("a mask is [H, W], not " + ShapeText(array));
  if (width > 0) RequireShape(array, {height, width}, "the mask");
  Mask result;
  result.height = static_cast<int>(array.shape(0));
  result.width = static_cast<int>(array.shape(1));
  result.data = MaskValues(array);
  return result;
}

py::dict ToDictOfMasks(const py::object& masks) {
  const bool is_mapping = PyMapping_Check(masks.ptr()) != 0 && py::hasattr(masks, "keys");
  CheckOption(is_mapping, "masks are Masks or a dict of image names to masks");
  return py::dict(masks);
}

Image ToImage(const py::object& image) {
  const auto array = py::array::ensure(image);
  if (!array || array.ndim() != 3 || array.shape(2) != 3) {
    PyErr_Clear();
    throw OptionError("an image is an array [H, W, 3]");
  }
  if (!IsBytes(array) && array.dtype().kind() != 'f') {  // of what range would they be?
    throw OptionError("an image's values are floats or uint8 (0 to 255)");
  }
  const Floats values(array);
  if (!values) throw py::error_already_set();
  Image result;
  result.height = static_cast<int>(array.shape(0));
  result.width = static_cast<int>(array.shape(1));
  result.data.assign(values.data(), values.data() + values.size());
  if (IsBytes(array)) {
    for (float& value : result.data) value /= 255.0F;
  }
  return result;
}

void RequireShape(const py::array& array, std::initializer_list<py::ssize_t> shape,
                  const std::string& what) {
  if (std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim())) return;
  std::string wanted;
  for (const py::ssize_t size : shape) {
    wanted += (wanted.empty() ? "" : ", ") + std::to_string(size);
  }
  throw OptionError(what + " is " + ShapeText(array) + ", expected [" + wanted + "]");
}

std::filesystem::path ToPath(const py::object& path) {
  if (path.is_none()) return {};
  const auto text = py::reinterpret_steal<py::object>(PyOS_FSPath(path.ptr()));
  if (!text) throw py::error_already_set();
  PyObject* bytes = nullptr;  // names of files are bytes, not all of them UTF-8
  if (PyUnicode_FSConverter(text.ptr(), &bytes) == 0) throw py::error_already_set();
  return std::string(py::reinterpret_steal<py::bytes>(bytes));
}

py::object FromPath(const std::filesystem::path& path) {
  const std::string text = path.string();
  const auto name = py::reinterpret_steal<py::object>(
      PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<py::ssize_t>(text.size())));
  if (!name) throw py::error_already_set();
  return py::module_::import("pathlib").attr("Path")(name);
}

}  // namespace retint::python
