// SPDX-License-Identifier: BSD-3-Clause
// An unpacked .spz (spz_codec.h), and the conversion of its Gaussians.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "scene/gaussian_model.h"
#include "scene/sh_band4.h"
#include "splat_io/axes.h"
#include "splat_io/splat_row.h"

namespace retint {

inline constexpr size_t kSpzHeaderBytes = 16;
inline constexpr double kSpzFixedMost = (1 << 23) - 1;  // largest value of a position's 24 bits

#pragma pack(push, 1)
struct SpzHeader {
  char magic[4] = {'N', 'G', 'S', 'P'};
  uint32_t version = 3;
  uint32_t count = 0;
  uint8_t sh_degree = 0;
  uint8_t fractional_bits = 12;
  uint8_t flags = 0;
  uint8_t streams = 0;  // version 4
};
#pragma pack(pop)
static_assert(sizeof(SpzHeader) == kSpzHeaderBytes);

// The unpacked file: header, sections in order, extensions.
struct SpzData {
  enum Section { kPositions, kOpacities, kColors, kScales, kRotations, kSh, kSections };

  SpzHeader header;
  UnsetVector<char> bytes;
  AxisSigns axes = kRightUpBack;
  // If so, y is depth and z is height before `axes` apply: (x, y, z) stands for (x, z, -y).
  bool turned = false;

  // Bytes per Gaussian in each section.
  std::array<size_t, kSections> Widths() const;
  size_t SectionAt(size_t section) const;
  size_t Size() const { return SectionAt(kSections); }  // without extensions
  const char* At(size_t section, size_t g) const {
    return bytes.data() + SectionAt(section) + g * Widths()[section];
  }
  char* At(size_t section, size_t g) {
    return const_cast<char*>(std::as_const(*this).At(section, g));
  }
};

// In the model's axes, as everything below.
SplatRow DecodeSpzRow(const SpzData& data, size_t g);
// Decodes Gaussians [begin, end) of a section into the model, with SH up to degree 3.
void DecodeSpzSection(const SpzData& data, SpzData::Section section, size_t begin, size_t end,
                      GaussianModel& model);
// Packs the values that differ from `was`; nullptr: all values. False if the position does not
// fit.
bool EncodeSpzRow(SpzData& data, size_t g, const SplatRow& row, const SplatRow* was);

// The same for degree 4.
ShBand4 DecodeSpzBand4(const SpzData& data, size_t g);
void EncodeSpzBand4(SpzData& data, size_t g, const ShBand4& values, const ShBand4* was);

}  // namespace retint
