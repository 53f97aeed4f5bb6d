// SPDX-License-Identifier: BSD-3-Clause
// The command line as a function.
#pragma once

namespace retint::cli {

// Parses, runs one verb, prints, and turns its exceptions into one line on stderr. Returns the exit
// code. It takes the handlers of SIGINT, SIGTERM, SIGHUP and SIGXFSZ.
int RunCommand(int argc, char** argv);

}  // namespace retint::cli
