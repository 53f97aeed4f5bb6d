// SPDX-License-Identifier: BSD-3-Clause
#include "retint/version.h"

#include "base/run_clock.h"
#include "cluster/mpi_ranks.h"

namespace retint::cli {
namespace {

std::string Described(const Backend& backend) {
  return std::string(backend.Name()) + " (" + backend.Description() + ")";
}

std::string CudaRemark() {
  const std::string fault = CudaFault();
  return fault.empty() ? "" : "; cuda: " + fault;
}

}  // namespace

std::string VersionText() {
  std::string backends;
  for (const std::string& name : AvailableBackends()) {
    backends += (backends.empty() ? "" : "; ") + Described(*CreateBackend(name));
  }
  const std::string mpi = MpiLibrary();
  return "retint " + std::string(Version()) + "\nbackends: " + backends + CudaRemark() +
         "\nprocesses: " + (mpi.empty() ? "one; built without MPI" : mpi) +
         "\nlibraries: " + RETINT_LIBRARIES;
}

std::string BackendText(const Backend& backend, std::string_view asked) {
  return Described(backend) + (asked == "auto" ? CudaRemark() : "");
}

}  // namespace retint::cli
