// SPDX-License-Identifier: BSD-3-Clause
// Hashes, random numbers and smooth noise for the synthetic scenes: pure functions of their
// arguments, so that results depend neither on threads nor on the standard library.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace retint::synthetic {

inline uint64_t Mix(uint64_t x) {  // the finaliser of SplitMix64 (Steele et al. 2014)
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

inline uint64_t HashOf(uint64_t a, uint64_t b, uint64_t c = 0, uint64_t d = 0) {
  return Mix(Mix(Mix(Mix(a) ^ b) ^ c) ^ d);
}

inline double Unit(uint64_t hash) { return double(hash >> 11) * 0x1p-53; }  // [0, 1)

class Random {
 public:
  explicit Random(uint64_t seed) : state_(Mix(seed)) {}
  uint64_t Bits() { return Mix(state_++); }
  double Uniform() { return Unit(Bits()); }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  double Gaussian() {  // Box-Muller
    const double u = 1 - Uniform(), v = Uniform();
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
  }

 private:
  uint64_t state_;
};

inline double Smooth(double edge0, double edge1, double x) {
  const double t = std::fmin(std::fmax((x - edge0) / (edge1 - edge0), 0.0), 1.0);
  return t * t * (3 - 2 * t);
}

// Value noise in [0, 1], unit lattice.
inline double Noise(double x, double y, uint64_t seed) {
  const double fx = std::floor(x), fy = std::floor(y);
  const uint64_t base = uint64_t(int64_t(fx)) * 0xd1b54a32d192ed03ull +
                        uint64_t(int64_t(fy)) * 0xabc98388fb8fac03ull + seed;
  const auto corner = [base](uint64_t i, uint64_t j) {
    return Unit(Mix(base + i * 0xd1b54a32d192ed03ull + j * 0xabc98388fb8fac03ull));
  };
  const double u = Smooth(0, 1, x - fx), v = Smooth(0, 1, y - fy);
  const double top = corner(0, 0) + u * (corner(1, 0) - corner(0, 0));
  const double bottom = corner(0, 1) + u * (corner(1, 1) - corner(0, 1));
  return top + v * (bottom - top);
}

// Sum of `octaves` of noise, each twice as fine and half as strong; in [0, 1], mean 0.5.
inline double Fbm(double x, double y, int octaves, uint64_t seed) {
  double sum = 0, weight = 0, amplitude = 1;
  for (int i = 0; i < octaves; ++i) {
    sum += amplitude * Noise(x, y, seed + uint64_t(i));
    weight += amplitude;
    amplitude *= 0.5;
    x = 2 * x + 17.3;
    y = 2 * y - 9.1;
  }
  return sum / weight;
}

}  // namespace retint::synthetic
