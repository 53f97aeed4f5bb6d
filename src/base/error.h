// SPDX-License-Identifier: BSD-3-Clause
// The exceptions of Retint. A library never aborts and never prints; the CLI turns each of these
// into one line on stderr and an exit code, the viewer into a dialog.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace retint {

// Base of all. `what()` is one line, complete on its own: file, line where known, and fault.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A bad option or argument; exit code 2. Thrown by every Options::Check().
class OptionError : public Error {
 public:
  using Error::Error;
};

// A file or a scene that cannot be used; exit code 3. "path:line: fault" or "path: fault".
class InputError : public Error {
 public:
  explicit InputError(const std::string& fault) : Error(fault) {}
  InputError(const std::filesystem::path& path, std::string_view fault);
  InputError(const std::filesystem::path& path, int64_t line, std::string_view fault);
};

// A depth is needed, but no painted pixel has one.
class NoDepthError : public InputError {
 public:
  using InputError::InputError;
};

// Failure while running: disk full, unwritable folder, device error; exit code 4.
class RunError : public Error {
 public:
  using Error::Error;
};

// The user stopped the work (Monitor::Cancel, Ctrl-C); exit code 130. Nothing partial is left
// behind.
class Cancelled : public Error {
 public:
  Cancelled() : Error("cancelled") {}
};

// Throws OptionError(message) unless `ok`; the message says which option and why.
inline void CheckOption(bool ok, const std::string& message) {
  if (!ok) throw OptionError(message);
}

}  // namespace retint
