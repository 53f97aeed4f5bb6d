// SPDX-License-Identifier: BSD-3-Clause
// How Python calls into the library: long work runs without the interpreter's lock, reports to a
// Python callable, and stops when that raises or when Ctrl-C was pressed.
#pragma once

#include <optional>
#include <type_traits>
#include <utility>

#include <pybind11/pybind11.h>

#include "base/error.h"
#include "base/monitor.h"

namespace retint::python {

namespace py = pybind11;

// One long call. Made and destroyed with the lock held.
class Call {
 public:
  // `progress` is called with the stage and its fraction in [0, 1]; None: nothing is.
  explicit Call(py::object progress)
      : progress_(std::move(progress)), monitor_([this](const Progress& p) { Report(p); }) {}
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  // work(monitor) without the lock. An exception of the callable is raised here; the work was then
  // cancelled.
  template <typename Work>
  std::invoke_result_t<Work, Monitor&> Run(Work&& work) {
    try {
      const py::gil_scoped_release unlocked;
      return work(monitor_);
    } catch (const Cancelled&) {
      if (!raised_) throw;
    }
    throw py::error_already_set(std::move(*raised_));
  }

 private:
  // May be called from any thread; the monitor calls it one at a time. Ctrl-C is seen on Python's
  // main thread.
  void Report(const Progress& progress) {
    const py::gil_scoped_acquire locked;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!progress_.is_none()) progress_(progress.stage, progress.fraction);
    } catch (py::error_already_set& error) {
      raised_.emplace(std::move(error));
      monitor_.Cancel();
    }
    if (raised_) throw Cancelled();
  }

  py::object progress_;
  std::optional<py::error_already_set> raised_;
  Monitor monitor_;
};

}  // namespace retint::python
