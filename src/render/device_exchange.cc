// SPDX-License-Identifier: BSD-3-Clause
#include "render/device_exchange.h"

#include <algorithm>
#include <vector>

namespace retint {
namespace {

void Add(Backend& backend, const float* x, const float* y, float* out, size_t count) {
  // By 1: exact, whether or not the multiplication is fused with the addition.
  backend.solve().LinearCombination(
      {.x = x, .y = y, .a = 1, .b = 1, .out = out, .count = int64_t(count)});
}

// One stretch. terms [size, own]: the other ranks' parts for this one's piece.
void SumStretch(Ranks& ranks, Backend& backend, void* stream, float* values, size_t count,
                float* terms) {
  const size_t size = size_t(ranks.size()), me = size_t(ranks.rank());
  const auto begin = [&](size_t r) { return r * count / size; };
  const auto length = [&](size_t r) { return begin(r + 1) - begin(r); };
  const auto piece = [&](size_t r) {
    return DeviceTransfer{int(r), values + begin(r), length(r) * sizeof(float)};
  };
  const size_t own = length(me);
  float* const sum = values + begin(me);
  std::vector<DeviceTransfer> sends, receives;
  for (size_t r = 0; r < size; ++r) {
    if (r == me) continue;
    if (length(r) > 0) sends.push_back(piece(r));
    if (own > 0) receives.push_back({int(r), terms + r * own, own * sizeof(float)});
  }
  ranks.TransferOnDevices(sends, receives, stream);
  // Up to this rank's own term the sum grows in the first rank's place, from there in its own.
  const auto term = [&](size_t r) { return r == me ? sum : terms + r * own; };
  for (size_t r = 1; r < size; ++r) {
    float* const before = r > me ? sum : term(0);
    Add(backend, before, term(r), r >= me ? sum : term(0), own);
  }
  sends.clear(), receives.clear();
  for (size_t r = 0; r < size; ++r) {
    if (r == me) continue;
    if (own > 0) sends.push_back({int(r), sum, own * sizeof(float)});
    if (length(r) > 0) receives.push_back(piece(r));
  }
  ranks.TransferOnDevices(sends, receives, stream);
}

}  // namespace

void SumOnDevices(Ranks& ranks, Backend& backend, Buffer<float>& values, Buffer<float>& scratch,
                  size_t stretch) {
  if (!ranks.AreMany()) return;
  const size_t size = size_t(ranks.size()), longest = std::min(values.size(), stretch);
  float* const terms = backend.Grow(scratch, (longest / size + 1) * size);
  void* const stream = backend.Stream();
  for (size_t at = 0; at < values.size(); at += stretch) {
    SumStretch(ranks, backend, stream, values.data() + at, std::min(stretch, values.size() - at),
               terms);
  }
}

void BroadcastOnDevices(Ranks& ranks, Backend& backend, Buffer<float>& values, int from) {
  if (values.empty()) return;
  const size_t bytes = values.size() * sizeof(float);
  std::vector<DeviceTransfer> sends, receives;
  if (ranks.rank() != from) receives.push_back({from, values.data(), bytes});
  for (int r = 0; r < ranks.size(); ++r) {
    if (ranks.rank() == from && r != from) sends.push_back({r, values.data(), bytes});
  }
  ranks.TransferOnDevices(sends, receives, backend.Stream());
}

}  // namespace retint
