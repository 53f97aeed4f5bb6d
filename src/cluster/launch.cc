// SPDX-License-Identifier: BSD-3-Clause
// The launcher's variables in the environment, and their consequences for cores and GPUs.
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "base/files.h"
#include "cluster/mpi_ranks.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// The first of `names` that is set to a number; else `otherwise`.
int Variable(std::initializer_list<const char*> names, int otherwise) {
  for (const char* name : names) {
    const char* const text = std::getenv(name);
    int value = 0;
    if (!text) continue;
    const std::string number = text;
    const char* const end = number.data() + number.size();
    // Slurm's counts of a job on several machines look like "4(x2)".
    if (std::from_chars(number.data(), end, value).ec == std::errc()) return value;
  }
  return otherwise;
}

// /dev/nvidia0 and so on.
int CountDevices() {
  int count = 0;
  for (const fs::path& path : ListFolder("/dev")) {
    const std::string name = path.filename().string();
    const size_t digits = std::string("nvidia").size();
    count += name.starts_with("nvidia") && name.size() > digits &&
             std::all_of(name.begin() + std::ptrdiff_t(digits), name.end(),
                         [](unsigned char c) { return std::isdigit(c) != 0; });
  }
  return count;
}

std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> parts;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

}  // namespace

Launch ReadLaunch() {
  Launch launch;
  const char* const wanted = std::getenv("RETINT_MPI");
  if (wanted && std::string(wanted) == "off") return launch;
  // Open MPI's mpirun; PMIx and PMI by srun. Slurm's own variables are set for programs that it
  // started without MPI, too, and only complete these.
  launch.rank = Variable({"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"}, -1);
  launch.by_mpi = launch.rank >= 0;
  if (!launch.by_mpi) return Launch();
  launch.size = std::max(
      1, Variable({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS", "SLURM_NTASKS"}, 1));
  launch.local_rank = std::max(
      0, Variable({"OMPI_COMM_WORLD_LOCAL_RANK", "MPI_LOCALRANKID", "SLURM_LOCALID"}, launch.rank));
  launch.local_size = std::clamp(Variable({"OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS",
                                           "SLURM_STEP_TASKS_PER_NODE", "SLURM_TASKS_PER_NODE"},
                                          launch.size),
                                 1, launch.size);
  return launch;
}

void ChooseDevice(const Launch& launch) {
  if (!launch.by_mpi) return;
  std::vector<std::string> devices;
  if (const char* const set = std::getenv("CUDA_VISIBLE_DEVICES")) {
    devices = SplitAtCommas(set);
  } else {
    for (int d = 0; d < CountDevices(); ++d) devices.push_back(std::to_string(d));
  }
  if (devices.empty()) return;
  const std::string& device = devices[size_t(launch.local_rank) % devices.size()];
  setenv("CUDA_VISIBLE_DEVICES", device.c_str(), 1);
}

int ThreadsOfRank(const Launch& launch) {
  const int cores = int(std::max(1L, sysconf(_SC_NPROCESSORS_ONLN)));
  int bound = cores;
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) == 0) bound = std::max(1, CPU_COUNT(&set));
  return std::clamp(cores / launch.local_size, 1, bound);
}

}  // namespace retint
