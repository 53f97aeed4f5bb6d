// SPDX-License-Identifier: BSD-3-Clause
#include "render/view_reducer.h"

#include <algorithm>
#include <type_traits>

#include "base/parallel.h"
#include "render/device_exchange.h"

namespace retint {
namespace {

constexpr int64_t kGrain = 1 << 14;  // Gaussians of a task

// As BlendOps::AddRows().
template <typename T>
void AddRows(const ViewRows& rows, size_t channels, bool and_square, std::vector<T>* sums) {
  const size_t width = channels + (and_square ? 1 : 0);
  ParallelRanges(int64_t(rows.gaussians.size()), kGrain, [&](int64_t first, int64_t last) {
    for (auto r = size_t(first); r < size_t(last); ++r) {
      T* const sum = sums->data() + width * size_t(rows.gaussians[r]);
      const float* const row = rows.values.data() + channels * r;
      for (size_t c = 0; c < channels; ++c) sum[c] += T(row[c]);
      if (and_square) sum[channels] += T(row[channels - 1] * row[channels - 1]);
    }
  });
}

}  // namespace

ViewReducer::ViewReducer(Backend& backend, size_t count,
                         const std::function<std::vector<double>()>& costs)
    : backend_(backend) {
  owners_ = IsShared() && costs ? ShareOut(costs(), ranks_) : ShareOut(count, ranks_);
  for (size_t view = 0; view < count; ++view) {
    if (Owns(view)) own_.push_back(view);
  }
}

// A bit a flag.
void ViewReducer::Unite(std::vector<uint8_t>* flags) {
  if (!IsShared()) return;
  constexpr int64_t kBits = 8, kFlags = 1 << 16;  // a task
  const int64_t count = int64_t(flags->size());
  std::string bits(size_t((count + kBits - 1) / kBits), '\0');
  ParallelRanges(int64_t(bits.size()), kFlags, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin * kBits; i < std::min(end * kBits, count); ++i) {
      char& byte = bits[size_t(i / kBits)];
      if ((*flags)[size_t(i)]) byte = char(byte | 1 << i % kBits);
    }
  });
  for (const std::string& one : ranks_.AllGather(bits)) {
    ParallelRanges(count, kFlags, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        (*flags)[size_t(i)] |= uint8_t(one[size_t(i / kBits)] >> i % kBits & 1);
      }
    });
  }
}

void ViewReducer::Broadcast(size_t view, std::span<std::byte> data) {
  ranks_.Broadcast(data, owners_[view]);
}

void ViewReducer::Broadcast(size_t view, Buffer<float>& values) {
  if (!IsShared()) return;
  if (!backend_.IsHost() && ranks_.UsesLink(values.size() * sizeof(float))) {
    return BroadcastOnDevices(ranks_, backend_, values, owners_[view]);
  }
  const std::span<float> host = HostScratch(values.size());
  if (Owns(view)) backend_.CopyToHost(host.data(), values.data(), host.size_bytes());
  ranks_.Broadcast(BytesOf(host), owners_[view]);
  backend_.CopyToDevice(values.data(), host.data(), host.size_bytes());
}

std::string ViewReducer::BroadcastText(size_t view, const std::string& text) {
  if (!IsShared()) return text;
  const bool owns = Owns(view);
  return ranks_.AllGather(owns ? std::string_view(text)
                               : std::string_view())[size_t(owners_[view])];
}

void ViewReducer::Sum(Buffer<float>& sums) {
  if (!IsShared() || sums.empty()) return;
  if (ranks_.UsesLink(sums.size() * sizeof(float))) {
    return SumOnDevices(ranks_, backend_, sums, device_scratch_);
  }
  const std::span<float> host = HostScratch(sums.size());
  backend_.CopyToHost(host.data(), sums.data(), host.size_bytes());
  ranks_.SumByRank(host);
  backend_.CopyToDevice(sums.data(), host.data(), host.size_bytes());
}

template <typename T>
void ViewReducer::SumRows(const std::vector<ViewRows>& own, size_t channels, bool and_square,
                          std::vector<T>* sums) {
  if (!IsShared()) return;
  const std::span<std::byte> bytes = BytesOf(std::span(*sums));
  if (AddsInOrder()) {
    ranks_.AddInOrder({&bytes, 1}, [&](size_t) {
      for (const ViewRows& rows : own) AddRows(rows, channels, and_square, sums);
    });
  } else if constexpr (std::is_same_v<T, float>) {
    ranks_.SumByRank(*sums);
  } else {
    const std::vector<T> mine = *sums;
    ranks_.AddInOrder({&bytes, 1}, [&](size_t) {
      for (size_t i = 0; !IsFirst() && i < mine.size(); ++i) (*sums)[i] += mine[i];
    });
  }
}
template void ViewReducer::SumRows(const std::vector<ViewRows>&, size_t, bool, std::vector<float>*);
template void ViewReducer::SumRows(const std::vector<ViewRows>&, size_t, bool,
                                   std::vector<double>*);

// Several parts a process, so that few wait for their turn; none too small.
std::vector<int32_t> ViewReducer::Parts(size_t count) const {
  constexpr size_t kPartsOfProcess = 4, kLeastBlocks = 256;
  const size_t parts =
      std::clamp<size_t>(count / kLeastBlocks, 1, kPartsOfProcess * size_t(ranks_.size()));
  std::vector<int32_t> begins;
  for (size_t p = 0; p <= parts; ++p) begins.push_back(int32_t(p * count / parts));
  return begins;
}

// A device reaches it quickly.
std::span<float> ViewReducer::HostScratch(size_t count) {
  if (host_scratch_.size() < count) {
    host_lock_.reset();
    host_scratch_.assign(count, 0.0f);
    host_lock_ = backend_.LockPages(host_scratch_.data(), count * sizeof(float));
  }
  return std::span(host_scratch_).first(count);
}

}  // namespace retint
