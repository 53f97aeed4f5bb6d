// SPDX-License-Identifier: BSD-3-Clause
// The fault of a command line, as one line that names the option and the remedy.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace retint::cli {

std::string UsageFault(const CLI::App& app, const CLI::ParseError& error);
std::string UnknownVerb(const CLI::App& app, const std::string& word);

}  // namespace retint::cli
