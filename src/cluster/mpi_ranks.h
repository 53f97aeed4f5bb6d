// SPDX-License-Identifier: BSD-3-Clause
// The processes of one mpirun or srun as ranks. No type of MPI shows here.
#pragma once

#include <memory>
#include <string>

#include "base/ranks.h"

namespace retint {

// The launcher's description of this process; asks nothing of MPI. With RETINT_MPI=off in the
// environment every process is alone.
struct Launch {
  int rank = 0, size = 1;              // of all processes
  int local_rank = 0, local_size = 1;  // of those on this machine
  bool by_mpi = false;                 // started by mpirun, or by srun with PMI or PMIx
};
Launch ReadLaunch();

// The MPI library that the program was built with, "Open MPI 4.1.4"; empty: none.
std::string MpiLibrary();

// Joins the other processes; only where ReadLaunch().by_mpi. Its destructor waits for them and
// leaves. RunError where MPI cannot be started, or was before, by a program that Retint is a module
// of; OptionError where the program was built without MPI.
std::unique_ptr<Ranks> JoinMpi();

// Ends all processes of the run with this exit code, at once. Only between JoinMpi() and the end of
// the object that it returned.
[[noreturn]] void AbortMpi(int code);

// Gives the rank a GPU of its own, by its place on the machine, before CUDA is first used. It sets
// CUDA_VISIBLE_DEVICES; if that is set already, it chooses one of the devices listed there. If
// there are fewer GPUs than ranks, they are shared in turn.
void ChooseDevice(const Launch& launch);

// The cores that a rank's threads get: its share of the machine's, within those it is bound to.
int ThreadsOfRank(const Launch& launch);

}  // namespace retint
