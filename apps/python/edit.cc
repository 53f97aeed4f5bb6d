// SPDX-License-Identifier: BSD-3-Clause
// Edit: a list of operations on colors. Its keywords come from the table of operations.
#include <algorithm>
#include <string>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "base/error.h"
#include "recolor/edit_text.h"
#include "results.h"
#include "types.h"

namespace retint::python {
namespace {

// The option "white-balance" of the command line is the keyword white_balance.
std::string Keyword(const ColorOperationType& type) {
  std::string name = type.option;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// The text of the command line: 0.5 is "0.5", (1, 0, 0) is "1.0,0.0,0.0", True is nothing.
std::string ValueText(const std::string& name, const py::handle& value) {
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (value.is(py::bool_(true))) return "";
  const auto number = [&](const py::handle& one) {
    const double d = PyFloat_AsDouble(one.ptr());
    if (d == -1 && PyErr_Occurred()) {
      PyErr_Clear();
      throw OptionError(name + ": a value is a number, a list of numbers, a text or a dict");
    }
    return py::repr(py::float_(d)).cast<std::string>();
  };
  if (!py::isinstance<py::sequence>(value) && !py::isinstance<py::array>(value)) {
    return number(value);
  }
  std::string text;
  for (const py::handle& one : value) text += (text.empty() ? "" : ",") + number(one);
  return text;
}

ColorOperation ToOperation(const std::string& name, const py::handle& value) {
  const auto types = ColorOperationTypes();
  const auto type = std::find_if(types.begin(), types.end(), [&](const ColorOperationType& one) {
    return name == Keyword(one) || name == one.name;
  });
  if (type == types.end()) {
    std::string all;
    for (const ColorOperationType& one : types) all += (all.empty() ? "" : ", ") + Keyword(one);
    throw OptionError("there is no operation '" + name + "'; there are " + all);
  }
  if (!py::isinstance<py::dict>(value)) return ParseOperation(*type, ValueText(name, value));
  py::dict one;
  one["op"] = type->name;
  for (const auto& [key, inner] : value.cast<py::dict>()) one[key] = inner;
  py::dict all;
  all["operations"] = py::make_tuple(one);
  const auto json = py::module_::import("json").attr("dumps")(all).cast<std::string>();
  return EditFromJson(json, ".").operations.front();
}

ColorEdit MakeEdit(const py::kwargs& operations) {
  ColorEdit edit;
  for (const auto& [name, value] : operations) {
    if (value.is(py::bool_(false)) || value.is_none()) continue;
    edit.operations.push_back(ToOperation(name.cast<std::string>(), value));
  }
  edit.Check();
  return edit;
}

ColorEdit Joined(const ColorEdit& first, const ColorEdit& second) {
  CheckOption(first.strength == 1 && second.strength == 1,
              "an edit with a strength of its own cannot be joined to another");
  ColorEdit edit = first;
  edit.operations.insert(edit.operations.end(), second.operations.begin(), second.operations.end());
  edit.Check();
  return edit;
}

// [..., 3] through the edit.
py::array Apply(const ColorEdit& edit, const Floats& colors) {
  CheckOption(colors.ndim() >= 1 && colors.shape(colors.ndim() - 1) == 3, "colors are [..., 3]");
  std::vector<float> values(colors.data(), colors.data() + colors.size());
  const CompiledEdit compiled(edit);
  for (size_t i = 0; i < values.size(); i += 3) {
    Eigen::Map<Eigen::Vector3f> color(values.data() + i);
    color = compiled.Apply(Eigen::Vector3f(color));
  }
  return Owned(std::move(values), {colors.shape(), colors.shape() + colors.ndim()});
}

std::string Documentation() {
  std::string text =
      "A list of operations on colors, in order. Each keyword is an operation. Its value is "
      "the text that the command line accepts, a number, or a sequence of numbers. It may "
      "also be a dict of parameters, or True for an operation without parameters:\n"
      "  Edit(tint='#3060ff', exposure=0.5), Edit(to={'color': [0.2, 0.4, 1]}), "
      "Edit(invert=True)\n"
      "To use an operation twice, join two edits with +. docs/edits.md explains every "
      "operation.\n"
      "\n"
      "Operations:\n";
  for (const ColorOperationType& type : ColorOperationTypes()) {
    text += "  " + Keyword(type) + (*type.syntax != 0 ? std::string("=") + type.syntax : "=True") +
            "  " + type.help + "\n";
  }
  return text;
}

}  // namespace

void BindEdit(py::module_& module) {
  static const std::string documentation = Documentation();
  py::class_<ColorEdit>(module, "Edit", documentation.c_str())
      .def(py::init(&MakeEdit),
           "Makes an edit from operations, as above, in the order of the keywords. False and None "
           "leave an operation out. OptionError for an unknown name or a bad value.")
      .def_static(
          "from_json", [](const std::string& text) { return EditFromJson(text, "."); },
          py::arg("text"),
          "Makes an edit from the JSON of an edit file (docs/files-report.md). OptionError names "
          "the operation at fault.")
      .def_static(
          "read", [](const py::object& path) { return ReadEdit(ToPath(path)); }, py::arg("path"),
          "Reads an edit file, or the edit of a report (.json). InputError if it is missing or "
          "wrong.")
      .def(
          "to_json", [](const ColorEdit& edit) { return EditToJson(edit, /*with_tables=*/true); },
          "The edit as JSON on one line, with the values of lookup tables.")
      .def("apply", &Apply, py::arg("colors"),
           "Applies the edit to colors [..., 3], RGB in [0, 1] as stored. Returns float32 of the "
           "same shape, not clamped. OptionError if an operation needs a region's main color, for "
           "example `to`.")
      .def_property_readonly(
          "operations",
          // The type is declared: deduced, it is an accessor that outlives the object that it
          // points into.
          [](const ColorEdit& edit) -> py::list {
            return FromJson(EditToJson(edit, /*with_tables=*/false))["operations"];
          },
          "The operations as dicts, as an edit file has them.")
      .def_readonly("strength", &ColorEdit::strength, "From 0, no change, to 1, the whole edit.")
      .def("__add__", &Joined, py::arg("other"),
           "An edit with the operations of both, in order. OptionError if one has a strength "
           "below 1.")
      .def("__eq__", [](const ColorEdit& a, const ColorEdit& b) { return a == b; })
      .def("__repr__", [](const ColorEdit& edit) {
        return "<retint.Edit " + EditToJson(edit, /*with_tables=*/false) + ">";
      });
}

}  // namespace retint::python
