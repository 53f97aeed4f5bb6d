// SPDX-License-Identifier: BSD-3-Clause
#include "network/pixel_values.h"

#include <algorithm>
#include <array>
#include <iterator>

namespace retint {
namespace {

constexpr std::array<const char*, 5> kNames = {"255", "1", "signed", "half", "imagenet"};

}  // namespace

const char* NameOf(PixelValues values) { return kNames[size_t(values)]; }

PixelValues ValuesOf(const NetworkName& name, PixelValues otherwise) {
  const std::string found = name.OneOf("values", NameOf(otherwise),
                                       {kNames[0], kNames[1], kNames[2], kNames[3], kNames[4]});
  return PixelValues(std::ranges::find(kNames, found) - kNames.begin());
}

float ToNetwork(PixelValues values, float v, size_t channel) {
  constexpr std::array<float, 3> kMean = {0.485f, 0.456f, 0.406f};
  constexpr std::array<float, 3> kDeviation = {0.229f, 0.224f, 0.225f};
  switch (values) {
    case PixelValues::k255:
      return v;
    case PixelValues::k1:
      return v / 255;
    case PixelValues::kSigned:
      return v / 127.5f - 1;
    case PixelValues::kHalf:
      return (v - 128) / 256;
    case PixelValues::kImageNet:
      return (v / 255 - kMean[channel]) / kDeviation[channel];
  }
  return v;
}

}  // namespace retint
