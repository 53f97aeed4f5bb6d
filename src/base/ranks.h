// SPDX-License-Identifier: BSD-3-Clause
// The processes that share one run's views: each, a rank, owns some of them. Sums over all views
// are added in the order of the views, so that they do not depend on the number of ranks. All ranks
// run the same program on the same files and take the same decisions.
//
// Every function that is marked collective must be called by all ranks in the same order, from one
// thread. An ordinary start is a single rank, for which they do nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace retint {

// Bytes of a device's memory that go to, or come from, another rank.
struct DeviceTransfer {
  int other = 0;
  void* data = nullptr;
  size_t bytes = 0;
};

// A way between the memories of the ranks' devices that does not lead through the hosts'.
class DeviceLink {
 public:
  virtual ~DeviceLink() = default;
  virtual std::string Name() const = 0;  // "NCCL 2.28.9"
  // Whether a transfer would start at once; else it first waits for the links that are still being
  // set up.
  virtual bool IsReady() = 0;
  // Collective. Starts all transfers at once, in the order of the work queued on `stream` (null: in
  // place). The arrays of a rank arrive at another in the order of the lists.
  virtual void Transfer(std::span<const DeviceTransfer> sends,
                        std::span<const DeviceTransfer> receives, void* stream) = 0;
};

class Ranks {
 public:
  virtual ~Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }
  bool IsRoot() const { return rank_ == 0; }
  bool AreMany() const { return size_ > 1; }
  uint64_t bytes_sent() const { return bytes_sent_; }  // by this rank, to all others

  // Collective. `data` of the rank `from` replaces that of the others; of the same size everywhere.
  void Broadcast(std::span<std::byte> data, int from);
  // Collective. The data of every rank, by rank; of any sizes.
  std::vector<std::string> AllGather(std::string_view mine);
  // Collective. `outgoing[r]` goes to rank r; returns the data from each, by rank.
  std::vector<std::string> Exchange(const std::vector<std::string>& outgoing);
  // Collective. True where any rank says so.
  bool Any(bool mine);
  // Collective. The items of all ranks in their order, those of rank 0 first.
  template <typename T>
  std::vector<T> Gather(std::span<const T> mine);

  // Collective. Sums that do not depend on the number of ranks. For each part of an array in turn,
  // `add(part)` adds this rank's values to the part as the previous rank left it (rank 0: as rank 0
  // holds it). In the end all ranks have the last one's sums. While a rank adds to one part, the
  // next rank adds to the part before.
  void AddInOrder(std::span<const std::span<std::byte>> parts,
                  const std::function<void(size_t part)>& add);
  // Collective. values[i] = the sum of all ranks' values[i], in the order of the ranks: of fewer
  // bytes than AddInOrder, but rounded differently for another number of ranks.
  void SumByRank(std::span<float> values);

  // Collective. Looks for a link between the ranks' devices. `device` names this rank's, alike for
  // all its users, or is empty if it has none. RunError if there is a link that fails.
  void LinkDevices(const std::string& device);
  bool DevicesAreLinked() const { return link_ != nullptr; }
  // Collective, with the same number everywhere. Whether an array of so many bytes goes by the
  // link. One that is not ready yet is waited for only where that takes less time than the other
  // way would.
  bool UsesLink(size_t bytes);
  // How large arrays of devices come to other ranks: "mpi" or "nccl"; empty where LinkDevices was
  // not called, or there is one rank.
  const std::string& exchange() const { return exchange_; }
  // The link's name, or why there is none.
  const std::string& link_text() const { return link_text_; }
  // Collective, see DeviceLink; only where DevicesAreLinked().
  void TransferOnDevices(std::span<const DeviceTransfer> sends,
                         std::span<const DeviceTransfer> receives, void* stream);

 protected:
  Ranks(int rank, int size) : rank_(rank), size_(size) {}
  virtual void DoBroadcast(std::span<std::byte> data, int from) = 0;
  virtual std::vector<std::string> DoAllGather(std::string_view mine) = 0;
  virtual std::vector<std::string> DoExchange(const std::vector<std::string>& outgoing) = 0;
  virtual void DoSumByRank(std::span<float> values);
  virtual void Receive(std::span<std::byte> data, int from) = 0;
  // May return before `data` is read, which stays as it is until FinishSends().
  virtual void Send(std::span<const std::byte> data, int to) = 0;
  virtual void FinishSends() = 0;
  // Null if there is no link, with the reason in `fault`; the same on all ranks.
  virtual std::unique_ptr<DeviceLink> DoLinkDevices(const std::string& device, std::string* fault);
  // Ends the work that a link started, which needs the other ranks.
  void Unlink() { link_.reset(); }

 private:
  int rank_ = 0, size_ = 1;
  uint64_t bytes_sent_ = 0;
  std::unique_ptr<DeviceLink> link_;
  bool link_is_ready_ = false;  // on all ranks
  std::string exchange_, link_text_;
};

// Those among which the calling thread shares its work: itself alone, unless a ShareAmong lives.
// Threads that it starts work alone.
Ranks& CurrentRanks();

// While it lives, the calling thread's work is shared among `ranks`, or, without, is its own.
class ShareAmong {
 public:
  explicit ShareAmong(Ranks& ranks);
  ShareAmong();  // this rank alone
  ~ShareAmong();
  ShareAmong(const ShareAmong&) = delete;
  ShareAmong& operator=(const ShareAmong&) = delete;

 private:
  Ranks* before_;
};

// The owner of each item, which takes about costs[i]: ascending, and each rank's costs about equal.
std::vector<int> ShareOut(std::span<const double> costs, const Ranks& ranks);
std::vector<int> ShareOut(size_t count, const Ranks& ranks);  // of equal costs

template <typename T>
std::span<std::byte> BytesOf(std::span<T> values) {
  return std::as_writable_bytes(values);
}
template <typename T>
std::string_view TextOf(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

template <typename T>
std::vector<T> Ranks::Gather(std::span<const T> mine) {
  std::vector<T> all;
  for (const std::string& part : AllGather(TextOf(mine))) {
    const size_t count = part.size() / sizeof(T), first = all.size();
    all.resize(first + count);
    part.copy(reinterpret_cast<char*>(all.data() + first), count * sizeof(T));
  }
  return all;
}

}  // namespace retint
