// SPDX-License-Identifier: BSD-3-Clause
// Pictures and depth of a session's scene.
#pragma once

#include <pybind11/pybind11.h>

#include "arrays.h"
#include "types.h"

namespace retint::python {

// The backend of that name. OptionError for one that is not there.
std::shared_ptr<Backend> OpenBackend(const std::string& name);
// Adds render(), depth() and seen_from() to the class.
void BindRendering(py::class_<PySession>& type);
// What `what` asks of a render, and the layers as Python gets them: an array, or a dict of them.
// OptionError for a name that is no layer's.
RenderRequest ToRequest(const py::object& what);
py::object Layers(RenderOutput output, const py::object& what);
// Has the session's renderer show coefficients that were given, or the scene as it is now.
void ShowSh(EditSession& session, const Floats& given);
// Coefficients that were given, checked against the session's; of no dimension for None.
Floats ToSh(PySession& self, const py::object& sh);

}  // namespace retint::python
