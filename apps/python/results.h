// SPDX-License-Identifier: BSD-3-Clause
// Results of the library as Python dicts.
#pragma once

#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "reporting/report.h"

namespace retint::python {

namespace py = pybind11;

// "train", "heldout" (figures, or None where there is no such view), "views" (worst first),
// "sh_before", "sh_after".
py::dict FromQuality(const QualityReport& quality);
py::dict FromRefit(const RefitSummary& summary);
py::dict FromPainted(const PaintedReport& report);
py::dict FromJson(const std::string& text);  // of an object

}  // namespace retint::python
