// SPDX-License-Identifier: BSD-3-Clause
// Uses Highway: compiled for several targets, chosen at run time.
#include "splat_io/row_vectors.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splat_io/row_vectors.cc"
#include <hwy/foreach_target.h>
// These must follow foreach_target.
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace retint {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr size_t kMostLanes = 16;

// ---- Logarithms

using Floats = hn::CappedTag<float, kMostLanes>;

HWY_INLINE void LogVector(float* values) {
  const Floats d;
  const auto least = hn::Set(d, std::numeric_limits<float>::min());
  const auto value = hn::LoadU(d, values);
  const auto scale = hn::IfThenElse(hn::Eq(value, hn::Zero(d)), least, value);
  const auto is_finite = hn::And(hn::Gt(scale, hn::Zero(d)),
                                 hn::Le(scale, hn::Set(d, std::numeric_limits<float>::max())));
  // A square root keeps infinity, and gives NaN for numbers without a logarithm.
  hn::StoreU(hn::IfThenElse(is_finite, hn::Log(d, scale), hn::Sqrt(scale)), d, values);
}

void LogScalesOfTarget(float* scales, size_t count) {
  const size_t lanes = hn::Lanes(Floats());
  const size_t whole = count / lanes * lanes;
  for (size_t i = 0; i < whole; i += lanes) LogVector(scales + i);
  if (whole == count) return;
  float rest[kMostLanes] = {};
  std::copy(scales + whole, scales + count, rest);
  LogVector(rest);
  std::copy_n(rest, count - whole, scales + whole);
}

// ---- Vertices of a compressed .ply

// Interpolates bounds in double precision, as the format's own programs do.
using Doubles = hn::CappedTag<double, 8>;
using Narrow = hn::Rebind<float, Doubles>;
using Words = hn::Rebind<uint32_t, Doubles>;
using Integers = hn::Rebind<int32_t, Doubles>;
constexpr size_t kMostRows = 8;
constexpr size_t kVertexBytes = 16, kOpacityByte = 12;  // little-endian words

// Some bits of each word, from bit kShift on, as a fraction of the largest value kMost.
template <int kShift, uint32_t kMost>
HWY_INLINE hn::Vec<Doubles> Share(hn::Vec<Words> word) {
  const auto bits = hn::And(hn::ShiftRight<kShift>(word), hn::Set(Words(), kMost));
  const auto value = hn::PromoteTo(Doubles(), hn::BitCast(Integers(), bits));
  return hn::Mul(value, hn::Set(Doubles(), 1.0 / kMost));
}

HWY_INLINE hn::Vec<Narrow> Mix(float low, float high, hn::Vec<Doubles> share) {
  const Doubles d;
  const auto rest = hn::Sub(hn::Set(d, 1.0), share);
  const auto mixed = hn::Add(hn::Mul(hn::Set(d, low), rest), hn::Mul(hn::Set(d, high), share));
  return hn::DemoteTo(Narrow(), mixed);
}

// Unpacks three values of 11, 10 and 11 bits between the six bounds.
HWY_INLINE void UnpackThree(hn::Vec<Words> word, const float* bounds, float* to) {
  hn::StoreInterleaved3(Mix(bounds[0], bounds[3], Share<21, 2047>(word)),
                        Mix(bounds[1], bounds[4], Share<11, 1023>(word)),
                        Mix(bounds[2], bounds[5], Share<0, 2047>(word)), Narrow(), to);
}

// UnpackSmallestThree() of three times 10 bits, below the index of the largest component.
HWY_INLINE void UnpackRotations(hn::Vec<Words> word, float* to) {
  const Doubles d;
  const Words words;
  const Narrow narrow;
  const auto component = [&](hn::Vec<Doubles> share) {
    return hn::Mul(hn::Sub(share, hn::Set(d, 0.5)), hn::Set(d, 1.4142135623730951));
  };
  const auto a = component(Share<20, 1023>(word));
  const auto b = component(Share<10, 1023>(word));
  const auto c = component(Share<0, 1023>(word));
  const auto left =
      hn::Sub(hn::Sub(hn::Sub(hn::Set(d, 1.0), hn::Mul(a, a)), hn::Mul(b, b)), hn::Mul(c, c));
  const auto largest = hn::DemoteTo(narrow, hn::Sqrt(hn::Max(left, hn::Zero(d))));
  const auto first = hn::DemoteTo(narrow, a);
  const auto second = hn::DemoteTo(narrow, b);
  const auto third = hn::DemoteTo(narrow, c);
  const auto place = hn::ShiftRight<30>(word);
  const auto is = [&](uint32_t i) {
    return hn::RebindMask(narrow, hn::Eq(place, hn::Set(words, i)));
  };
  const auto is0 = is(0), is1 = is(1), is2 = is(2), is3 = is(3);
  const auto w = hn::IfThenElse(is0, largest, first);
  const auto x = hn::IfThenElse(is0, first, hn::IfThenElse(is1, largest, second));
  const auto y = hn::IfThenElse(is3, third, hn::IfThenElse(is2, largest, second));
  const auto z = hn::IfThenElse(is3, largest, third);
  hn::StoreInterleaved4(w, x, y, z, narrow, to);
}

HWY_INLINE void UnpackColors(hn::Vec<Words> word, const float* bounds, float* to) {
  const Narrow d;
  const auto coefficient = [&](float low, float high, hn::Vec<Doubles> share) {
    const auto color = Mix(low, high, share);
    return hn::Div(hn::Sub(color, hn::Set(d, 0.5f)), hn::Set(d, kShC0));
  };
  hn::StoreInterleaved3(coefficient(bounds[0], bounds[3], Share<24, 255>(word)),
                        coefficient(bounds[1], bounds[4], Share<16, 255>(word)),
                        coefficient(bounds[2], bounds[5], Share<8, 255>(word)), d, to);
}

// Unpacks as many vertices as Doubles has lanes; their colors go to `colors`, [rows, 3].
HWY_NOINLINE void UnpackRows(const char* vertices, const ChunkBounds& bounds, float* means,
                             float* quats_wxyz, float* log_scales, float* opacity_logits,
                             float* colors) {
  const Words d;
  hn::Vec<Words> position, rotation, scale, color;
  hn::LoadInterleaved4(d, reinterpret_cast<const uint32_t*>(vertices), position, rotation, scale,
                       color);
  UnpackThree(position, bounds.data(), means);
  UnpackRotations(rotation, quats_wxyz);
  UnpackThree(scale, bounds.data() + 6, log_scales);
  UnpackColors(color, bounds.data() + 12, colors);
  static const std::array<float, 256>& logits = LogitsOfBytes();
  for (size_t i = 0; i < hn::Lanes(d); ++i) {
    opacity_logits[i] = logits[static_cast<uint8_t>(vertices[kVertexBytes * i + kOpacityByte])];
  }
}

void UnpackVerticesOfTarget(const char* vertices, size_t count, const ChunkBounds& bounds,
                            const RowPlaces& to, size_t sh_values) {
  const size_t lanes = hn::Lanes(Doubles());
  for (size_t g = 0; g < count; g += lanes) {
    const size_t rows = std::min(lanes, count - g);
    const char* const from = vertices + kVertexBytes * g;
    float colors[3 * kMostRows];
    if (rows == lanes) {  // in place: vector loads would wait for a fresh copy
      UnpackRows(from, bounds, to.mean + 3 * g, to.quat_wxyz + 4 * g, to.log_scale + 3 * g,
                 to.opacity_logit + g, colors);
    } else {
      alignas(uint32_t) char last[kVertexBytes * kMostRows] = {};
      std::copy_n(from, kVertexBytes * rows, last);
      float means[3 * kMostRows], quats[4 * kMostRows], scales[3 * kMostRows], logits[kMostRows];
      UnpackRows(last, bounds, means, quats, scales, logits, colors);
      std::copy_n(means, 3 * rows, to.mean + 3 * g);
      std::copy_n(quats, 4 * rows, to.quat_wxyz + 4 * g);
      std::copy_n(scales, 3 * rows, to.log_scale + 3 * g);
      std::copy_n(logits, rows, to.opacity_logit + g);
    }
    for (size_t i = 0; i < rows; ++i) {
      float* const sh = to.sh + sh_values * (g + i);
      for (size_t c = 0; c < 3; ++c) sh[c] = colors[3 * i + c];
    }
  }
}

// ---- Spherical harmonics of a compressed .ply

constexpr size_t kShBytes = 45, kShFloats = 48;

// ((i + 0.5) / 256 - 0.5) * 8, but -4 and 4 at the ends.
HWY_INLINE void ShOfBytes(const uint8_t* bytes, float* sh) {
  const Floats d;
  const hn::Rebind<int32_t, Floats> integers;
  const auto byte = hn::PromoteTo(integers, hn::LoadU(hn::Rebind<uint8_t, Floats>(), bytes));
  const auto value = hn::ConvertTo(d, byte);
  auto mapped = hn::Add(hn::Mul(value, hn::Set(d, 1.0f / 32)), hn::Set(d, 1.0f / 64 - 4));
  mapped = hn::IfThenElse(hn::Eq(value, hn::Zero(d)), hn::Set(d, -4.0f), mapped);
  mapped = hn::IfThenElse(hn::Eq(value, hn::Set(d, 255.0f)), hn::Set(d, 4.0f), mapped);
  hn::StoreU(mapped, d, sh);
}

// From [3, 15] to [15, 3], then 3 unused bytes, then the last 16 bytes again. They come from a
// single store, because a vector can be loaded from one before it reaches the cache. Reads one byte
// beyond the Gaussian's own.
constexpr size_t kLastAt = kShBytes + 3, kInterleaved = kLastAt + 16;
HWY_INLINE void InterleaveSh(const uint8_t* bytes, uint8_t* interleaved) {
#if HWY_TARGET == HWY_SCALAR
  for (size_t i = 0; i < kShBytes; ++i) interleaved[i] = bytes[i % 3 * 15 + i / 3];
  std::copy_n(interleaved + kShBytes - 16, 16, interleaved + kLastAt);
#else
  const hn::FixedTag<uint8_t, 16> d;
  hn::StoreInterleaved3(hn::LoadU(d, bytes), hn::LoadU(d, bytes + 15), hn::LoadU(d, bytes + 30), d,
                        interleaved);
  const auto before = hn::LoadU(d, interleaved + 16), last = hn::LoadU(d, interleaved + 32);
  hn::StoreU(hn::CombineShiftRightBytes<13>(d, last, before), d, interleaved + kLastAt);
#endif
}

HWY_INLINE void UnpackShRow(const uint8_t* bytes, float* sh) {
  uint8_t interleaved[kInterleaved];
  InterleaveSh(bytes, interleaved);
  const size_t lanes = hn::Lanes(Floats());
  for (size_t i = 0; i + lanes <= kShBytes; i += lanes) ShOfBytes(interleaved + i, sh + 3 + i);
  ShOfBytes(interleaved + kInterleaved - lanes, sh + kShFloats - lanes);  // the rest, overlapping
}

void UnpackShOfTarget(const char* bytes, size_t count, float* sh) {
  if (count == 0) return;
  const auto* from = reinterpret_cast<const uint8_t*>(bytes);
  for (size_t g = 0; g + 1 < count; ++g) UnpackShRow(from + kShBytes * g, sh + kShFloats * g);
  uint8_t last[kShFloats] = {};
  std::copy_n(from + kShBytes * (count - 1), kShBytes, last);
  UnpackShRow(last, sh + kShFloats * (count - 1));
}

}  // namespace HWY_NAMESPACE
}  // namespace retint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace retint {

HWY_EXPORT(LogScalesOfTarget);
HWY_EXPORT(UnpackVerticesOfTarget);
HWY_EXPORT(UnpackShOfTarget);

void LogScales(float* scales, size_t count) {
  HWY_DYNAMIC_DISPATCH(LogScalesOfTarget)(scales, count);
}

void UnpackVertices(const char* vertices, size_t count, const ChunkBounds& bounds,
                    const RowPlaces& to, size_t sh_values) {
  HWY_DYNAMIC_DISPATCH(UnpackVerticesOfTarget)(vertices, count, bounds, to, sh_values);
}

void UnpackShOfDegree3(const char* bytes, size_t count, float* sh) {
  HWY_DYNAMIC_DISPATCH(UnpackShOfTarget)(bytes, count, sh);
}

}  // namespace retint
#endif
