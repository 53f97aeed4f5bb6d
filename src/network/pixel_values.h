// SPDX-License-Identifier: BSD-3-Clause
// The ranges of pixels that networks take.
#pragma once

#include <cstddef>
#include <string>

#include "network/network_name.h"

namespace retint {

// 0 to 255; 0 to 1; -1 to 1; -0.5 to 0.5; or normalized as for ImageNet.
enum class PixelValues { k255, k1, kSigned, kHalf, kImageNet };

const char* NameOf(PixelValues values);
// The setting values=NAME of a network; OptionError for another name.
PixelValues ValuesOf(const NetworkName& name, PixelValues otherwise);

// Of `v` in [0, 255], in the channel R, G or B.
float ToNetwork(PixelValues values, float v, size_t channel);

}  // namespace retint
