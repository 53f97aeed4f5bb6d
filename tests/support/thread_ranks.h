// SPDX-License-Identifier: BSD-3-Clause
// Ranks that are threads of the test, to share data as processes do.
#pragma once

#include <algorithm>
#include <barrier>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/ranks.h"

namespace retint {

// Their shared state.
struct ThreadWorld {
  explicit ThreadWorld(int size)
      : meeting(size), texts(size_t(size)), lists(size_t(size)), mail(size_t(size)) {}
  std::barrier<> meeting;
  std::vector<std::string> texts;               // [rank]
  std::vector<std::vector<std::string>> lists;  // [rank][to]
  std::mutex mutex;
  std::condition_variable arrived;
  std::vector<std::deque<std::pair<int, std::string>>> mail;  // [to]: from, text
};

class ThreadRank : public Ranks {
 public:
  ThreadRank(ThreadWorld& world, int rank, int size) : Ranks(rank, size), world_(world) {}
  bool link_is_up = true;

 private:
  void DoBroadcast(std::span<std::byte> data, int from) override {
    const std::string text = DoAllGather(rank() == from ? TextOf(std::span<const std::byte>(data))
                                                        : std::string_view())[size_t(from)];
    text.copy(reinterpret_cast<char*>(data.data()), data.size());
  }
  std::vector<std::string> DoAllGather(std::string_view mine) override {
    world_.texts[size_t(rank())] = mine;
    world_.meeting.arrive_and_wait();
    std::vector<std::string> all = world_.texts;
    world_.meeting.arrive_and_wait();
    return all;
  }
  std::vector<std::string> DoExchange(const std::vector<std::string>& outgoing) override {
    world_.lists[size_t(rank())] = outgoing;
    world_.meeting.arrive_and_wait();
    std::vector<std::string> incoming;
    for (const auto& list : world_.lists) incoming.push_back(list[size_t(rank())]);
    world_.meeting.arrive_and_wait();
    return incoming;
  }
  void Receive(std::span<std::byte> data, int from) override {
    std::unique_lock lock(world_.mutex);
    auto& box = world_.mail[size_t(rank())];
    auto found = box.end();
    world_.arrived.wait(lock, [&] {
      found = std::find_if(box.begin(), box.end(), [&](auto& one) { return one.first == from; });
      return found != box.end();
    });
    found->second.copy(reinterpret_cast<char*>(data.data()), data.size());
    box.erase(found);
  }
  void Send(std::span<const std::byte> data, int to) override {
    const std::lock_guard lock(world_.mutex);
    world_.mail[size_t(to)].emplace_back(rank(), TextOf(data));
    world_.arrived.notify_all();
  }
  void FinishSends() override {}

  // The "devices" are the host: data goes through the mail.
  class Link : public DeviceLink {
   public:
    explicit Link(ThreadRank& rank) : rank_(rank) {}
    std::string Name() const override { return "threads"; }
    bool IsReady() override { return rank_.link_is_up; }
    void Transfer(std::span<const DeviceTransfer> sends, std::span<const DeviceTransfer> receives,
                  void*) override {
      for (const DeviceTransfer& one : sends) rank_.Send(Bytes(one), one.other);
      for (const DeviceTransfer& one : receives) rank_.Receive(Bytes(one), one.other);
    }

   private:
    static std::span<std::byte> Bytes(const DeviceTransfer& one) {
      return {static_cast<std::byte*>(one.data), one.bytes};
    }
    ThreadRank& rank_;
  };
  // A device that is called "unlinked" is.
  std::unique_ptr<DeviceLink> DoLinkDevices(const std::string& device,
                                            std::string* fault) override {
    if (device == "unlinked") return Ranks::DoLinkDevices(device, fault);
    return std::make_unique<Link>(*this);
  }

  ThreadWorld& world_;
};

// body() on `count` threads, a rank each. None may throw.
inline void RunAsRanks(int count, const std::function<void()>& body) {
  ThreadWorld world(count);
  std::vector<std::thread> threads;
  for (int rank = 0; rank < count; ++rank) {
    threads.emplace_back([&, rank] {
      ThreadRank one(world, rank, count);
      const ShareAmong share(one);
      body();
    });
  }
  for (std::thread& thread : threads) thread.join();
}

// The results of `make` on all ranks, by rank.
template <typename T>
std::vector<T> MakeOnRanks(int count, const std::function<T()>& make) {
  std::vector<T> made(static_cast<size_t>(count));
  RunAsRanks(count, [&] {
    T one = make();
    made[static_cast<size_t>(CurrentRanks().rank())] = std::move(one);
  });
  return made;
}

}  // namespace retint
