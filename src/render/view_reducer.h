// SPDX-License-Identifier: BSD-3-Clause
// The views of a task, shared among the processes of a run (base/ranks.h). Each process works on
// its own views, and a ViewReducer puts together their results: the result is that of one process
// that works on all views in their order. An algorithm asks which views are its own, and never how
// many processes there are. An ordinary start is one process, which owns every view.
//
// Functions marked collective must be called by all processes in the same order, from one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/ranks.h"
#include "kernels/backend.h"

namespace retint {

// One view's part of the sums of the Gaussians that it sees.
struct ViewRows {
  std::vector<int32_t> gaussians;  // distinct
  std::vector<float> values;       // [gaussians, C]
};

class ViewReducer {
 public:
  // Shares `count` views among the processes that the calling thread works with (ShareAmong).
  // `costs` says about how long each view takes, and is called only for several processes; null:
  // all alike.
  ViewReducer(Backend& backend, size_t count,
              const std::function<std::vector<double>()>& costs = nullptr);

  bool IsShared() const { return ranks_.AreMany(); }
  bool Owns(size_t view) const { return owners_[view] == ranks_.rank(); }
  std::span<const size_t> own() const { return own_; }  // ascending
  // True in exactly one process, which counts the things that all of them know.
  bool IsFirst() const { return ranks_.IsRoot(); }

  // Collective. Whether any process says so.
  bool Any(bool own) { return ranks_.Any(own); }
  // Collective. The items of all processes. Those of a process's own views, in their order, become
  // those of all views in their order.
  template <typename T>
  std::vector<T> Gather(std::span<const T> own) {
    return ranks_.Gather<T>(own);
  }
  // Collective. Sets the flags, 0 or 1, that any process has set.
  void Unite(std::vector<uint8_t>* flags);
  // Collective. The data of the owner of `view` replaces that of the others; of the same size in
  // all processes.
  void Broadcast(size_t view, std::span<std::byte> data);
  void Broadcast(size_t view, Buffer<float>& values);
  // Collective. The owner's text, of any size.
  std::string BroadcastText(size_t view, const std::string& text);

  // Whether each view's part of a sum is kept until its turn in the order of all views. This is so
  // on the CPU, where a sum must not depend on the number of processes. On a device each process
  // adds up its own views, and Sum() and SumRows() add the processes' sums in their order.
  bool AddsInOrder() const { return IsShared() && backend_.IsHost(); }
  // Collective, not if AddsInOrder().
  void Sum(Buffer<float>& sums);
  // Collective. Completes sums [N, C], or [N, C + 1] `and_square` as in BlendOps::AddRows. If
  // AddsInOrder(), `own` has the part of each view of this process, and `sums` lacks it; else
  // `sums` has it. T is float or double.
  template <typename T>
  void SumRows(const std::vector<ViewRows>& own, size_t channels, bool and_square,
               std::vector<T>* sums);
  // Collective. Ranks::AddInOrder over the parts of an array of `count` blocks of floats whose
  // begins Parts(count) gives, ending with the array's end.
  std::vector<int32_t> Parts(size_t count) const;
  void AddInOrder(std::span<const std::span<std::byte>> parts,
                  const std::function<void(size_t part)>& add) {
    ranks_.AddInOrder(parts, add);
  }

 private:
  std::span<float> HostScratch(size_t count);

  Ranks& ranks_ = CurrentRanks();
  Backend& backend_;
  std::vector<int> owners_;  // [views]
  std::vector<size_t> own_;
  Buffer<float> device_scratch_;     // of SumOnDevices
  std::vector<float> host_scratch_;  // of arrays on their way
  std::shared_ptr<void> host_lock_;  // of its pages
};

}  // namespace retint
