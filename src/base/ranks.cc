// SPDX-License-Identifier: BSD-3-Clause
#include "base/ranks.h"

#include <algorithm>
#include <cstring>

namespace retint {
namespace {

class OneRank : public Ranks {
 public:
  OneRank() : Ranks(0, 1) {}

 private:
  void DoBroadcast(std::span<std::byte>, int) override {}
  std::vector<std::string> DoAllGather(std::string_view mine) override {
    return {std::string(mine)};
  }
  std::vector<std::string> DoExchange(const std::vector<std::string>& outgoing) override {
    return outgoing;
  }
  void Receive(std::span<std::byte>, int) override {}
  void Send(std::span<const std::byte>, int) override {}
  void FinishSends() override {}
};

Ranks& Alone() {
  static OneRank one;
  return one;
}

thread_local Ranks* g_current = nullptr;

}  // namespace

Ranks& CurrentRanks() { return g_current ? *g_current : Alone(); }

ShareAmong::ShareAmong(Ranks& ranks) : before_(g_current) { g_current = &ranks; }
ShareAmong::ShareAmong() : before_(g_current) { g_current = nullptr; }
ShareAmong::~ShareAmong() { g_current = before_; }

void Ranks::Broadcast(std::span<std::byte> data, int from) {
  if (!AreMany() || data.empty()) return;
  if (rank_ == from) bytes_sent_ += data.size();
  DoBroadcast(data, from);
}

std::vector<std::string> Ranks::AllGather(std::string_view mine) {
  if (AreMany()) bytes_sent_ += mine.size();
  return DoAllGather(mine);
}

std::vector<std::string> Ranks::Exchange(const std::vector<std::string>& outgoing) {
  for (size_t r = 0; r < outgoing.size(); ++r) {
    if (int(r) != rank_) bytes_sent_ += outgoing[r].size();
  }
  return DoExchange(outgoing);
}

bool Ranks::Any(bool mine) {
  const char flag = mine ? 1 : 0;
  for (const std::string& one : AllGather({&flag, 1})) {
    if (one.front() != 0) return true;
  }
  return false;
}

void Ranks::AddInOrder(std::span<const std::span<std::byte>> parts,
                       const std::function<void(size_t part)>& add) {
  const int last = size_ - 1;
  for (size_t p = 0; p < parts.size(); ++p) {
    if (rank_ > 0) Receive(parts[p], rank_ - 1);
    add(p);
    if (rank_ == last) continue;
    bytes_sent_ += parts[p].size();
    Send(parts[p], rank_ + 1);
  }
  FinishSends();
  for (const auto& part : parts) Broadcast(part, last);
}

void Ranks::SumByRank(std::span<float> values) {
  if (!AreMany() || values.empty()) return;
  bytes_sent_ += 2 * values.size_bytes() * size_t(size_ - 1) / size_t(size_);
  DoSumByRank(values);
}

// Every rank adds up one piece of the array.
void Ranks::DoSumByRank(std::span<float> values) {
  const size_t ranks = size_t(size_), count = values.size();
  const auto begin = [&](size_t r) { return r * count / ranks; };
  std::vector<std::string> outgoing(ranks);
  for (size_t r = 0; r < ranks; ++r) {
    outgoing[r] = TextOf<float>(values.subspan(begin(r), begin(r + 1) - begin(r)));
  }
  const std::vector<std::string> pieces = DoExchange(outgoing);
  const size_t first = begin(size_t(rank_)), own = begin(size_t(rank_) + 1) - first;
  std::vector<float> sum(own), piece(own);
  for (size_t r = 0; r < ranks; ++r) {
    std::memcpy(piece.data(), pieces[r].data(), own * sizeof(float));
    for (size_t i = 0; i < own; ++i) sum[i] = r == 0 ? piece[i] : sum[i] + piece[i];
  }
  const std::vector<std::string> sums = DoAllGather(TextOf<float>(sum));
  for (size_t r = 0; r < ranks; ++r) {
    sums[r].copy(reinterpret_cast<char*>(values.data() + begin(r)), sums[r].size());
  }
}

void Ranks::LinkDevices(const std::string& device) {
  if (!AreMany()) return;
  link_.reset();
  link_is_ready_ = false;
  link_ = DoLinkDevices(device, &link_text_);
  exchange_ = link_ ? "nccl" : "mpi";
  if (link_) link_text_ = link_->Name();
}

std::unique_ptr<DeviceLink> Ranks::DoLinkDevices(const std::string&, std::string* fault) {
  *fault = "there is no link between devices";
  return nullptr;
}

bool Ranks::UsesLink(size_t bytes) {
  // By MPI the ten sweeps of a fit would take as long with it as a link to come up, a second.
  constexpr size_t kWorthWaiting = size_t{64} << 20;
  if (!link_) return false;
  if (!link_is_ready_ && bytes < kWorthWaiting) link_is_ready_ = !Any(!link_->IsReady());
  return link_is_ready_ || bytes >= kWorthWaiting;
}

void Ranks::TransferOnDevices(std::span<const DeviceTransfer> sends,
                              std::span<const DeviceTransfer> receives, void* stream) {
  for (const DeviceTransfer& one : sends) bytes_sent_ += one.bytes;
  link_->Transfer(sends, receives, stream);
}

std::vector<int> ShareOut(std::span<const double> costs, const Ranks& ranks) {
  double total = 0;
  for (const double cost : costs) total += cost;
  std::vector<int> owners(costs.size());
  double before = 0;
  for (size_t i = 0; i < costs.size(); ++i) {
    // The rank in whose share the middle of the item lies.
    const double middle = total > 0 ? (before + costs[i] / 2) / total : 0;
    owners[i] = std::min(int(middle * ranks.size()), ranks.size() - 1);
    before += costs[i];
  }
  return owners;
}

std::vector<int> ShareOut(size_t count, const Ranks& ranks) {
  return ShareOut(std::vector<double>(count, 1.0), ranks);
}

}  // namespace retint
