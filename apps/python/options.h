// SPDX-License-Identifier: BSD-3-Clause
// Described options (base/option.h) as keyword arguments. A new option appears here by itself.
#pragma once

#include <string>

#include <pybind11/pybind11.h>

#include "base/option.h"
#include "editing/edit_options.h"

namespace retint::python {

namespace py = pybind11;

// Gives every option that a keyword names its value: iterations=5, for each choice that has it, or
// mm={"iterations": 5}, of one choice alone (with _ for -). OptionError for a keyword that none
// has, and for a value of another type or out of range.
void SetOptions(const OptionList& list, const py::kwargs& keywords);

// The preset's options of an edit, changed by the keywords. "preset" and "colmap_program" are
// keywords too, and "matcher" may be a network (matcher.h). `describe` lists those that the call
// has.
template <typename Describe>
EditOptions Resolve(const py::kwargs& keywords, Describe describe);
EditOptions StartOptions(py::kwargs& keywords);  // takes those out
void FinishOptions(EditOptions& options);        // checks them

// Name, default, range, unit, help and where it applies, of each option: list of dict.
py::list OptionTable(const OptionList& list);
// The same as lines of a docstring.
std::string OptionLines(const OptionList& list);

template <typename Describe>
EditOptions Resolve(const py::kwargs& keywords, Describe describe) {
  py::kwargs left(keywords.attr("copy")());
  EditOptions options = StartOptions(left);
  OptionList list;
  describe(options, list);
  SetOptions(list, left);
  FinishOptions(options);
  return options;
}

}  // namespace retint::python
