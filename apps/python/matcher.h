// SPDX-License-Identifier: BSD-3-Clause
// Networks as keyword arguments: their names, and functions in Python.
#pragma once

#include <pybind11/pybind11.h>

#include "depth/stereo_hv.h"

namespace retint::python {

namespace py = pybind11;

// Takes "matcher" out of `keywords` if it is a network ("onnx:FILE", "exec:COMMAND") or a function
// of two images [H, W, 3] uint8 that returns their disparity [H, W], and puts "network" in its
// place. Takes out "onnx_runtime" too, a path.
void TakeMatcher(py::kwargs& keywords, StereoHvOptions& options);

}  // namespace retint::python
