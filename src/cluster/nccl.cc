// SPDX-License-Identifier: BSD-3-Clause
#include "cluster/nccl.h"

#include <dlfcn.h>

#include <chrono>
#include <cstdlib>
#include <future>
#include <utility>
#include <vector>

#include "base/error.h"

namespace retint {
namespace {

constexpr const char* kLibrary = "libnccl.so.2";

// The function `name` of `library`; false, and says so, where it has none.
template <typename Function>
bool Resolve(void* library, const char* name, Function*& function, std::string* missing) {
  function = reinterpret_cast<Function*>(dlsym(library, name));
  if (!function && missing->empty()) *missing = name;
  return function != nullptr;
}

std::string LoaderFault() {
  const char* const text = dlerror();
  return text ? text : "unknown error";
}

// Fills `nccl` from the file; else says why not.
bool Load(const std::string& file, Nccl* nccl, std::string* fault) {
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    *fault = LoaderFault();
    return false;
  }
  std::string missing;
  Resolve(library, "ncclGetVersion", nccl->get_version, &missing);
  Resolve(library, "ncclGetUniqueId", nccl->get_unique_id, &missing);
  Resolve(library, "ncclCommInitRank", nccl->comm_init_rank, &missing);
  Resolve(library, "ncclCommDestroy", nccl->comm_destroy, &missing);
  Resolve(library, "ncclCommGetAsyncError", nccl->comm_get_async_error, &missing);
  Resolve(library, "ncclGetErrorString", nccl->get_error_string, &missing);
  Resolve(library, "ncclGetLastError", nccl->get_last_error, &missing);
  Resolve(library, "ncclGroupStart", nccl->group_start, &missing);
  Resolve(library, "ncclGroupEnd", nccl->group_end, &missing);
  Resolve(library, "ncclSend", nccl->send, &missing);
  Resolve(library, "ncclRecv", nccl->receive, &missing);
  std::string optional;
  Resolve(library, "ncclMemAlloc", nccl->mem_alloc, &optional);
  Resolve(library, "ncclMemFree", nccl->mem_free, &optional);
  if (missing.empty()) return true;
  *fault = file + ": no function " + missing + ": no NCCL, or one older than 2.13";
  dlclose(library);
  return false;
}

// A rank's part of a group.
struct Joined {
  Nccl::Comm comm = nullptr;
  void* memory = nullptr;  // of the first transfer, which nobody waits for
};

void SendAndReceive(const Nccl& nccl, Nccl::Comm comm, std::span<const DeviceTransfer> sends,
                    std::span<const DeviceTransfer> receives, Nccl::Stream stream) {
  nccl.Check(nccl.group_start(), "ncclGroupStart");
  for (const DeviceTransfer& one : sends) {
    nccl.Check(nccl.send(one.data, one.bytes, Nccl::kBytes, one.other, comm, stream), "ncclSend");
  }
  for (const DeviceTransfer& one : receives) {
    nccl.Check(nccl.receive(one.data, one.bytes, Nccl::kBytes, one.other, comm, stream),
               "ncclRecv");
  }
  nccl.Check(nccl.group_end(), "ncclGroupEnd");
}

// A few bytes from each rank to each, on CUDA's own stream: NCCL opens a way when it is first gone.
void OpenWays(const Nccl& nccl, int rank, int size, Joined* joined) {
  constexpr size_t kBytes = 16;
  if (!nccl.mem_alloc || !nccl.mem_free) return;
  nccl.Check(nccl.mem_alloc(&joined->memory, 2 * kBytes * size_t(size)), "ncclMemAlloc");
  char* const memory = static_cast<char*>(joined->memory);
  std::vector<DeviceTransfer> sends, receives;
  for (int r = 0; r < size; ++r) {
    if (r == rank) continue;
    sends.push_back({r, memory + 2 * kBytes * size_t(r), kBytes});
    receives.push_back({r, memory + 2 * kBytes * size_t(r) + kBytes, kBytes});
  }
  SendAndReceive(nccl, joined->comm, sends, receives, nullptr);
}

class NcclLink : public DeviceLink {
 public:
  NcclLink(const Nccl& nccl, const NcclId& id, int rank, int size)
      : nccl_(nccl), joining_(std::async(std::launch::async, [&nccl, id, rank, size] {
          Joined joined;
          nccl.Check(nccl.comm_init_rank(&joined.comm, size, id, rank), "ncclCommInitRank");
          OpenWays(nccl, rank, size, &joined);
          return joined;
        })) {}

  ~NcclLink() override {
    try {
      nccl_.comm_destroy(Comm());
      if (joined_.memory) nccl_.mem_free(joined_.memory);
    } catch (const RunError&) {  // a group that was never joined is not left
    }
  }

  bool IsReady() override {
    constexpr std::chrono::seconds kNow{0};
    return !joining_.valid() || joining_.wait_for(kNow) == std::future_status::ready;
  }

  std::string Name() const override { return "NCCL " + nccl_.Version(); }

  void Transfer(std::span<const DeviceTransfer> sends, std::span<const DeviceTransfer> receives,
                void* stream) override {
    const Nccl::Comm comm = Comm();
    // Of earlier transfers, which nobody waited for.
    Nccl::Result earlier = Nccl::kSuccess;
    nccl_.Check(nccl_.comm_get_async_error(comm, &earlier), "ncclCommGetAsyncError");
    if (earlier != Nccl::kInProgress) nccl_.Check(earlier, "an earlier transfer");
    SendAndReceive(nccl_, comm, sends, receives, stream);
  }

 private:
  Nccl::Comm Comm() {
    if (joining_.valid()) joined_ = joining_.get();
    if (!joined_.comm) throw RunError("NCCL: the ranks could not be joined");
    return joined_.comm;
  }

  const Nccl& nccl_;
  std::future<Joined> joining_;
  Joined joined_;
};

}  // namespace

std::string Nccl::Version() const {
  int version = 0;
  if (get_version(&version) != kSuccess) return "?";
  // 2.8 and older counted in hundreds; none of them has all functions.
  return std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
         std::to_string(version % 100);
}

void Nccl::Check(Result result, const char* call) const {
  if (result == kSuccess) return;
  std::string text = std::string("NCCL: ") + call + ": " + get_error_string(result);
  const char* const more = get_last_error(nullptr);
  if (more && *more) text += std::string(" (") + more + ")";
  throw RunError(text + "; RETINT_NCCL=off does without it");
}

const Nccl* FindNccl(std::string* fault) {
  const char* const named = std::getenv("RETINT_NCCL");
  const std::string file = named && *named ? named : kLibrary;
  if (file == "off") {
    *fault = "RETINT_NCCL=off";
    return nullptr;
  }
  Nccl nccl;
  if (!Load(file, &nccl, fault)) return nullptr;
  // Only sends and receives are called: multicast would take memory for nothing.
  setenv("NCCL_NVLS_ENABLE", "0", 0);
  static Nccl found;
  found = nccl;
  return &found;
}

std::unique_ptr<DeviceLink> JoinNccl(const Nccl& nccl, const NcclId& id, int rank, int size) {
  return std::make_unique<NcclLink>(nccl, id, rank, size);
}

}  // namespace retint
