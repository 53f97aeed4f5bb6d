// SPDX-License-Identifier: BSD-3-Clause
#include "cluster/mpi_ranks.h"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <utility>

// Without the C++ bindings of old.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

#include "base/error.h"
#include "base/parallel.h"
#include "cluster/nccl.h"

namespace retint {
namespace {

constexpr size_t kMostBytes = size_t{1} << 30;  // a message: MPI counts in int
constexpr int kTag = 1;

void Check(int code, const char* call) {
  if (code == MPI_SUCCESS) return;
  char text[MPI_MAX_ERROR_STRING] = "";
  int length = 0;
  MPI_Error_string(code, text, &length);
  throw RunError(std::string("MPI: ") + call + ": " + text);
}

// body(offset, count) for pieces of `bytes` that MPI can count.
template <typename Body>
void ForPieces(size_t bytes, const Body& body) {
  for (size_t at = 0; at < bytes; at += kMostBytes) {
    body(at, int(std::min(kMostBytes, bytes - at)));
  }
}

int CommRank() {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

int CommSize() {
  int size = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return size;
}

// Whether all ranks run on one machine.
bool OnOneMachine() {
  MPI_Comm machine = MPI_COMM_NULL;
  Check(MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine),
        "MPI_Comm_split_type");
  int size = 0;
  MPI_Comm_size(machine, &size);
  MPI_Comm_free(&machine);
  return size == CommSize();
}

// The message of a rank to the others before their devices are linked: lines, and so the same
// everywhere that decides.
struct LinkOffer {
  std::string device, version, fault;

  std::string Text() const { return device + "\n" + version + "\n" + fault; }
  explicit LinkOffer(std::string_view text) {
    const size_t first = text.find('\n'), second = text.find('\n', first + 1);
    device = text.substr(0, first);
    version = text.substr(first + 1, second - first - 1);
    fault = text.substr(second + 1);
  }
  LinkOffer() = default;
};

// Why ranks with these offers are not linked; empty where they can be.
std::string FaultOf(const std::vector<std::string>& offers) {
  std::set<std::string> devices;
  const LinkOffer root(offers.front());
  for (size_t r = 0; r < offers.size(); ++r) {
    const LinkOffer offer(offers[r]);
    const std::string rank = "rank " + std::to_string(r);
    if (!offer.fault.empty()) return offer.fault;
    if (offer.version != root.version) return rank + " has NCCL " + offer.version;
    if (!devices.insert(offer.device).second) return rank + " shares its GPU with another";
  }
  return "";
}

class MpiRanks : public Ranks {
 public:
  MpiRanks() : Ranks(CommRank(), CommSize()) {}
  ~MpiRanks() override {
    Unlink();
    MPI_Finalize();
  }

 private:
  void DoBroadcast(std::span<std::byte> data, int from) override {
    ForPieces(data.size(), [&](size_t at, int count) {
      Check(MPI_Bcast(data.data() + at, count, MPI_BYTE, from, MPI_COMM_WORLD), "MPI_Bcast");
    });
  }

  std::vector<std::string> DoAllGather(std::string_view mine) override {
    const std::vector<uint64_t> sizes = Sizes({mine.size()});
    std::vector<std::string> all(sizes.size());
    for (size_t r = 0; r < all.size(); ++r) {
      all[r].resize(sizes[r]);
      if (int(r) == rank()) all[r] = mine;
      if (sizes[r] > 0) DoBroadcast(std::as_writable_bytes(std::span(all[r])), int(r));
    }
    return all;
  }

  std::vector<std::string> DoExchange(const std::vector<std::string>& outgoing) override {
    std::vector<uint64_t> own;
    for (const std::string& one : outgoing) own.push_back(one.size());
    const std::vector<uint64_t> sizes = Sizes(own);  // [from, to]
    std::vector<std::string> incoming(outgoing.size());
    const size_t ranks = outgoing.size(), me = size_t(rank());
    std::vector<MPI_Request> requests;
    for (size_t r = 0; r < ranks; ++r) {
      incoming[r].resize(sizes[r * ranks + me]);
      if (r == me) {
        incoming[r] = outgoing[r];
        continue;
      }
      Start(MPI_Irecv, incoming[r].data(), incoming[r].size(), int(r), &requests);
    }
    for (size_t r = 0; r < ranks; ++r) {
      if (r == me) continue;
      Start(MPI_Isend, const_cast<char*>(outgoing[r].data()), outgoing[r].size(), int(r),
            &requests);
    }
    Wait(&requests);
    return incoming;
  }

  // Every rank adds up one piece of the array.
  void DoSumByRank(std::span<float> values) override {
    constexpr int64_t kGrain = 1 << 16;
    const size_t ranks = size_t(size()), me = size_t(rank());
    const auto begin = [&](size_t r) { return r * values.size() / ranks; };
    const auto piece = [&](size_t r) { return values.subspan(begin(r), begin(r + 1) - begin(r)); };
    const std::span<float> own = piece(me);
    pieces_.resize(own.size() * ranks);
    std::vector<MPI_Request> requests;
    for (size_t r = 0; r < ranks; ++r) {
      if (r == me) continue;
      Start(MPI_Irecv, pieces_.data() + r * own.size(), own.size_bytes(), int(r), &requests);
    }
    for (size_t r = 0; r < ranks; ++r) {
      if (r == me) continue;
      Start(MPI_Isend, piece(r).data(), piece(r).size_bytes(), int(r), &requests);
    }
    Wait(&requests);
    ParallelRanges(int64_t(own.size()), kGrain, [&](int64_t first, int64_t last) {
      for (size_t i = size_t(first); i < size_t(last); ++i) {
        float sum = 0;
        for (size_t r = 0; r < ranks; ++r) {
          const float term = r == me ? own[i] : pieces_[r * own.size() + i];
          sum = r == 0 ? term : sum + term;
        }
        own[i] = sum;
      }
    });
    for (size_t r = 0; r < ranks; ++r) {
      if (r == me) continue;
      Start(MPI_Irecv, piece(r).data(), piece(r).size_bytes(), int(r), &requests);
      Start(MPI_Isend, own.data(), own.size_bytes(), int(r), &requests);
    }
    Wait(&requests);
  }

  void Receive(std::span<std::byte> data, int from) override {
    ForPieces(data.size(), [&](size_t at, int count) {
      Check(MPI_Recv(data.data() + at, count, MPI_BYTE, from, kTag, MPI_COMM_WORLD,
                     MPI_STATUS_IGNORE),
            "MPI_Recv");
    });
  }

  void Send(std::span<const std::byte> data, int to) override {
    Start(MPI_Isend, const_cast<std::byte*>(data.data()), data.size(), to, &sends_);
  }

  void FinishSends() override { Wait(&sends_); }

  std::unique_ptr<DeviceLink> DoLinkDevices(const std::string& device,
                                            std::string* fault) override {
    LinkOffer offer;
    offer.device = device;
    const Nccl* nccl = nullptr;
    const bool on_one_machine = OnOneMachine();
    if (device.empty()) {
      offer.fault = "the backend is the processor";
    } else if (!on_one_machine) {
      offer.fault = "the ranks run on several machines";
    } else {
      nccl = FindNccl(&offer.fault);
    }
    if (nccl) offer.version = nccl->Version();
    *fault = FaultOf(AllGather(offer.Text()));
    if (!fault->empty()) return nullptr;
    NcclId id;
    if (IsRoot()) nccl->Check(nccl->get_unique_id(&id), "ncclGetUniqueId");
    Broadcast(std::as_writable_bytes(std::span(id.bytes)), 0);
    return JoinNccl(*nccl, id, rank(), size());
  }

  // Of every rank the same number of sizes, by rank.
  std::vector<uint64_t> Sizes(const std::vector<uint64_t>& own) {
    std::vector<uint64_t> all(own.size() * size_t(size()));
    Check(MPI_Allgather(own.data(), int(own.size()), MPI_UINT64_T, all.data(), int(own.size()),
                        MPI_UINT64_T, MPI_COMM_WORLD),
          "MPI_Allgather");
    return all;
  }

  // MPI_Irecv or MPI_Isend of any number of bytes.
  template <typename Call>
  static void Start(const Call& call, void* data, size_t bytes, int other,
                    std::vector<MPI_Request>* requests) {
    ForPieces(bytes, [&](size_t at, int count) {
      Check(call(static_cast<char*>(data) + at, count, MPI_BYTE, other, kTag, MPI_COMM_WORLD,
                 &requests->emplace_back()),
            "MPI_Irecv or MPI_Isend");
    });
  }

  static void Wait(std::vector<MPI_Request>* requests) {
    const int count = int(requests->size());
    Check(MPI_Waitall(count, requests->data(), MPI_STATUSES_IGNORE), "MPI_Waitall");
    requests->clear();
  }

  std::vector<MPI_Request> sends_;
  std::vector<float> pieces_;  // of the other ranks, kept between sums
};

}  // namespace

std::string MpiLibrary() {
  char text[MPI_MAX_LIBRARY_VERSION_STRING] = "";
  int length = 0;
  MPI_Get_library_version(text, &length);
  const std::string version(text, size_t(std::max(length, 0)));
  return version.substr(0, version.find_first_of(",\n"));
}

std::unique_ptr<Ranks> JoinMpi() {
  int started = 0;
  Check(MPI_Initialized(&started), "MPI_Initialized");
  if (started) {
    throw RunError(
        "this process has started MPI already: run retint as a program of its own, or "
        "set RETINT_MPI=off, with which it works alone");
  }
  int provided = MPI_THREAD_SINGLE;
  // One thread calls it, others compute.
  const int code = MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  if (code != MPI_SUCCESS || provided < MPI_THREAD_FUNNELED) {
    throw RunError("MPI cannot be started beside threads");
  }
  Check(MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
  return std::make_unique<MpiRanks>();
}

void AbortMpi(int code) {
  MPI_Abort(MPI_COMM_WORLD, code);
  std::abort();  // it does not come back
}

}  // namespace retint
