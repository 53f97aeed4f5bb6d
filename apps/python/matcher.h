// SPDX-License-Identifier: BSD-3-Clause
// Networks as keyword arguments: their names, and functions in Python.
#pragma once

#include <memory>

#include <pybind11/pybind11.h>

#include "depth/stereo_hv.h"
#include "network/mask_network.h"

namespace retint::python {

namespace py = pybind11;

// Takes "matcher" out of `keywords` if it is a network ("onnx:FILE", "exec:COMMAND") or a function
// of two images [H, W, 3] uint8 that returns their disparity [H, W], and puts "network" in its
// place. Takes out "onnx_runtime" too, a path.
void TakeMatcher(py::kwargs& keywords, StereoHvOptions& options);

// A network's name (network/mask_network.h), or a function of an image [H, W, 3] uint8 that returns
// its mask [H, W], uint8 or in [0, 1]. Null for None.
std::shared_ptr<const MaskNetwork> ToMaskNetwork(const py::object& network);

}  // namespace retint::python
