// SPDX-License-Identifier: BSD-3-Clause
// Pictures and depth of a session's scene.
#pragma once

#include <pybind11/pybind11.h>

#include "arrays.h"
#include "types.h"

namespace retint::python {

// The backend of that name. OptionError for one that is not there.
std::shared_ptr<Backend> OpenBackend(const std::string& name);
// Adds render(), depth() and mask_seen_from() to the class.
void BindRendering(py::class_<PySession>& type);
// Coefficients that were given, checked against the session's; of no dimension for None.
Floats ToSh(PySession& self, const py::object& sh);

}  // namespace retint::python
