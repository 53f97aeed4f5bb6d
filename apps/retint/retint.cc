// SPDX-License-Identifier: BSD-3-Clause
// retint: the command line.
#include "retint/command.h"

int main(int argc, char** argv) { return retint::cli::RunCommand(argc, argv); }
