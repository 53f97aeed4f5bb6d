// SPDX-License-Identifier: BSD-3-Clause
// NVIDIA's NCCL, found when the program runs: arrays on the GPUs of one machine move between them
// directly. No header of NCCL is needed to build: the few functions that are called are declared
// here, as NCCL 2.13 and newer have them (docs.nvidia.com/deeplearning/nccl, "API").
#pragma once

#include <array>
#include <memory>
#include <string>

#include "base/ranks.h"

namespace retint {

// The name of a group of ranks for NCCL: made by one of them, known to all. ncclUniqueId.
struct NcclId {
  std::array<char, 128> bytes{};
};

// The functions of the library, resolved; the library stays loaded.
struct Nccl {
  using Comm = void*;    // ncclComm_t
  using Stream = void*;  // cudaStream_t
  using Result = int;    // ncclResult_t
  static constexpr Result kSuccess = 0, kInProgress = 7;
  static constexpr int kBytes = 1;  // ncclUint8

  Result (*get_version)(int* version) = nullptr;
  Result (*get_unique_id)(NcclId* id) = nullptr;
  Result (*comm_init_rank)(Comm* comm, int ranks, NcclId id, int rank) = nullptr;
  Result (*comm_destroy)(Comm comm) = nullptr;
  Result (*comm_get_async_error)(Comm comm, Result* error) = nullptr;
  const char* (*get_error_string)(Result result) = nullptr;
  const char* (*get_last_error)(Comm comm) = nullptr;
  Result (*group_start)() = nullptr;
  Result (*group_end)() = nullptr;
  Result (*send)(const void* data, size_t count, int type, int to, Comm comm,
                 Stream stream) = nullptr;
  Result (*receive)(void* data, size_t count, int type, int from, Comm comm,
                    Stream stream) = nullptr;
  // Of NCCL 2.19 and newer, else null: memory of the current device.
  Result (*mem_alloc)(void** data, size_t bytes) = nullptr;
  Result (*mem_free)(void* data) = nullptr;

  std::string Version() const;  // "2.28.9"
  // RunError("NCCL: call: why") unless `result` is success.
  void Check(Result result, const char* call) const;
};

// The library that RETINT_NCCL names, a file; without it libnccl.so.2, where the system's loader
// looks. Null, and why in `fault`: RETINT_NCCL=off, no such file, a file that is no NCCL or is too
// old.
const Nccl* FindNccl(std::string* fault);

// Joins the ranks of `id`, each with the first device that CUDA shows it, and builds up the
// connections by trying them. This runs on its own thread, so that the caller can continue. The
// first transfer waits for it, and throws RunError if NCCL refuses.
std::unique_ptr<DeviceLink> JoinNccl(const Nccl& nccl, const NcclId& id, int rank, int size);

}  // namespace retint
