// SPDX-License-Identifier: BSD-3-Clause
// The Python module retint._retint; apps/python/retint/ has the package around it.
#include <csignal>
#include <iterator>
#include <new>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "base/error.h"
#include "base/run_clock.h"
#include "kernels/backend.h"
#include "retint/command.h"
#include "types.h"

namespace retint::python {
namespace {

// Exceptions live as long as the interpreter.
PyObject* g_error = nullptr;
PyObject* g_option_error = nullptr;
PyObject* g_input_error = nullptr;
PyObject* g_run_error = nullptr;

PyObject* MakeException(py::module_& module, const char* name, const char* doc,
                        const py::object& bases) {
  const std::string full = std::string("retint.") + name;
  PyObject* type = PyErr_NewExceptionWithDoc(full.c_str(), doc, bases.ptr(), nullptr);
  if (!type) throw py::error_already_set();
  module.add_object(name, py::reinterpret_borrow<py::object>(type));
  return type;
}

// Puts back the state that the command line changes.
class SignalHandlers {
 public:
  SignalHandlers() {
    for (size_t i = 0; i < std::size(kSignals); ++i) sigaction(kSignals[i], nullptr, &old_[i]);
  }
  ~SignalHandlers() {
    for (size_t i = 0; i < std::size(kSignals); ++i) sigaction(kSignals[i], &old_[i], nullptr);
  }

 private:
  static constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP, SIGXFSZ};
  struct sigaction old_[std::size(kSignals)]{};
};

// The command line in this process. Its signal handlers are put back afterwards.
int RunMain(const std::vector<std::string>& arguments) {
  std::vector<std::string> texts = {"retint"};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& text : texts) argv.push_back(text.data());
  argv.push_back(nullptr);
  const SignalHandlers handlers;
  const py::gil_scoped_release unlocked;
  return cli::RunCommand(static_cast<int>(texts.size()), argv.data());
}

}  // namespace

void BindErrors(py::module_& module) {
  const py::handle value_error(PyExc_ValueError), run_time(PyExc_RuntimeError);
  g_error = MakeException(
      module, "Error",
      "Base of all errors of Retint. The message is one line, complete without context.",
      py::reinterpret_borrow<py::object>(PyExc_Exception));
  const py::handle error(g_error);
  g_option_error = MakeException(module, "OptionError", "A bad option or argument.",
                                 py::make_tuple(error, value_error));
  g_input_error = MakeException(module, "InputError", "A file or a scene that Retint cannot use.",
                                py::make_tuple(error, value_error));
  g_run_error = MakeException(
      module, "RunError",
      "A failure while running: a full disk, a folder without write access, a GPU error.",
      py::make_tuple(error, run_time));
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const OptionError& caught) {
      PyErr_SetString(g_option_error, caught.what());
    } catch (const InputError& caught) {
      PyErr_SetString(g_input_error, caught.what());
    } catch (const Error& caught) {
      PyErr_SetString(g_run_error, caught.what());
    } catch (const py::cast_error&) {
      PyErr_SetString(g_option_error,
                      "an argument is of a type that the call does not take; help() of it says "
                      "which it takes");
    } catch (const std::invalid_argument& caught) {  // of the kernels
      PyErr_SetString(g_option_error, caught.what());
    }
  });
}

PYBIND11_MODULE(_retint, module) {
  module.doc() = "Retint: recolors regions of 3D Gaussian Splatting scenes.";
  module.attr("__version__") = std::string(Version());
  BindErrors(module);
  BindScene(module);
  BindEdit(module);
  BindSelection(module);
  BindSession(module);
  BindRender(module);
  BindJobs(module);
  BindTools(module);
  module.def("backends", &AvailableBackends,
             "Names of the backends that work here: 'cpu', and 'cuda' if it was built in and there "
             "is a GPU.");
  module.def(
      "run_command", &RunMain, py::arg("arguments"),
      "Runs the command line `retint ARGUMENTS` in this process. It prints as the command "
      "does and returns its exit code: 0 done, 2 usage, 3 input, 4 run time, 130 interrupted.");
}

}  // namespace retint::python
