// SPDX-License-Identifier: BSD-3-Clause
// How different two colors look: CIEDE2000.
#pragma once

namespace retint {

struct CieLab {
  double lightness = 0, a = 0, b = 0;  // white: 100, 0, 0
};

// Of a display-encoded sRGB color (red, green, blue in [0, 1]; not clamped), white point D65.
CieLab CieLabFromSrgb(const float* rgb);

// CIEDE2000 with unit weights (Sharma, Wu & Dalal 2005); about 1 is just noticeable.
double ColorDifference(const CieLab& x, const CieLab& y);

}  // namespace retint
