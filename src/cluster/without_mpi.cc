// SPDX-License-Identifier: BSD-3-Clause
// For a program that was built without MPI.
#include <cstdlib>

#include "base/error.h"
#include "cluster/mpi_ranks.h"

namespace retint {

std::string MpiLibrary() { return ""; }

std::unique_ptr<Ranks> JoinMpi() {
  throw OptionError(
      "this retint was built without MPI: it cannot share its work with other processes");
}

void AbortMpi(int) { std::abort(); }

}  // namespace retint
