// SPDX-License-Identifier: BSD-3-Clause
#include "options.h"

#include <algorithm>
#include <set>

#include <pybind11/stl.h>

#include "base/error.h"
#include "matcher.h"

namespace retint::python {
namespace {

std::string Underscored(std::string text) {
  std::replace(text.begin(), text.end(), '-', '_');
  return text;
}

OptionValue ToValue(const std::string& name, const py::handle& value) {
  if (PyBool_Check(value.ptr()) ||
      py::str(py::type::of(value).attr("__name__")).cast<std::string>() == "bool_") {
    return static_cast<bool>(PyObject_IsTrue(value.ptr()));
  }
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (PyIndex_Check(value.ptr()) != 0) {
    const auto whole = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
    if (!whole) throw py::error_already_set();
    const long long number = PyLong_AsLongLong(whole.ptr());
    if (number != -1 || !PyErr_Occurred()) return int64_t{number};
    PyErr_Clear();
    const unsigned long long large = PyLong_AsUnsignedLongLong(whole.ptr());
    if (!PyErr_Occurred()) return uint64_t{large};
    PyErr_Clear();
    throw OptionError(name + ": the number is too large");
  }
  const double number = PyFloat_AsDouble(value.ptr());
  if (number == -1 && PyErr_Occurred()) {
    PyErr_Clear();
    throw OptionError(name + " is a number, a text or True or False");
  }
  return number;
}

[[noreturn]] void FailUnknown(const OptionList& list, const std::string& name) {
  std::set<std::string> names = {"preset"};
  for (const Option& option : list) names.insert(option.name);
  std::string all;
  for (const std::string& one : names) all += (all.empty() ? "" : ", ") + one;
  throw OptionError("there is no option '" + name + "'; there are " + all);
}

void SetNamed(const OptionList& list, const std::string& name, const py::handle& value,
              const std::string& group) {
  bool any = false;
  for (const Option& option : list) {
    if (option.name != name || (!group.empty() && Underscored(option.applies) != group)) continue;
    option.Set(ToValue(name, value));
    any = true;
  }
  if (!any) FailUnknown(list, group.empty() ? name : group + "." + name);
}

py::object FromValue(const OptionValue& value) {
  return std::visit([](const auto& held) -> py::object { return py::cast(held); }, value);
}

py::object DefaultOf(const Option& option) { return FromValue(option.Get()); }

}  // namespace

void SetOptions(const OptionList& list, const py::kwargs& keywords) {
  for (const auto& [key, value] : keywords) {
    const auto name = key.cast<std::string>();
    if (!py::isinstance<py::dict>(value)) {
      SetNamed(list, name, value, "");
      continue;
    }
    for (const auto& [inner, inner_value] : value.cast<py::dict>()) {
      SetNamed(list, py::str(inner).cast<std::string>(), inner_value, name);
    }
  }
}

EditOptions StartOptions(py::kwargs& keywords) {
  const auto take = [&](const char* name, const std::string& otherwise) {
    if (!keywords.contains(name)) return otherwise;
    const py::object value = keywords.attr("pop")(name);
    if (!py::isinstance<py::str>(value)) throw OptionError(std::string(name) + " is a text");
    return value.cast<std::string>();
  };
  EditOptions options = PresetOptions(take("preset", "retint"));
  std::string& program = options.select.depth.colmap_mvs.program;
  program = take("colmap_program", program);
  TakeMatcher(keywords, options.select.depth.stereo_hv);
  return options;
}

void FinishOptions(EditOptions& options) {
  options.EndByThemselves();
  options.Check();
}

py::list OptionTable(const OptionList& list) {
  py::list table;
  for (const Option& option : list) {
    py::dict row;
    row["name"] = option.name;
    row["applies"] = option.applies;
    row["default"] = DefaultOf(option);
    if (const auto* choice = std::get_if<OptionChoice>(&option.member)) {
      row["range"] = py::cast(choice->names);
    } else {
      row["range"] = std::holds_alternative<bool*>(option.member) ? "" : option.range.Text();
    }
    row["unit"] = option.unit;
    row["help"] = option.help;
    table.append(row);
  }
  return table;
}

std::string OptionLines(const OptionList& list) {
  std::string lines = "\n\nOptions (keyword arguments, with their defaults):\n";
  for (const Option& option : list) {
    lines += "  " + option.name + "=" + py::repr(DefaultOf(option)).cast<std::string>() + "  " +
             (option.applies.empty() ? "" : option.applies + ": ") + option.help +
             (option.unit.empty() ? "" : ", " + option.unit) + "\n";
  }
  return lines + "  preset='retint'  options to start from: 'retint' or 'paper'\n";
}

}  // namespace retint::python
