// SPDX-License-Identifier: BSD-3-Clause
// Matching by a network that the user brings: a file for ONNX Runtime, or any program.
#pragma once

#include <memory>
#include <string>

#include "depth/stereo_hv.h"
#include "depth/stereo_matcher.h"

namespace retint {

// `name`: "onnx:FILE[,key=value...]" or "exec:COMMAND". Two calls with the same name return the
// same matcher, which loads its network, or starts its program, once and when it first matches.
// OptionError for a bad name. Matching throws InputError for a network of no use,
// RunError for a program that fails.
//
// A network takes two images [1, C, H, W], or one [1, 2C, H, W], or four, of which two have half
// the size. C is 3 (RGB) or 1 (gray), as floats, half floats or bytes. The size is any or fixed. If
// any, the pair is padded to a multiple of 32 by repeating its right and lower border, and the
// result is cropped. If fixed, the pair is scaled. The output has the size of the input; it is the
// one with "disp" in its name, else the last.
// Keys: `values` is the range of the input: 255 (0 to 255), 1 (0 to 1), signed (-1 to 1), half
// (-0.5 to 0.5), or imagenet (normalized as for ImageNet). `scale` is the factor from the output to
// pixels; below 0 it changes the sign. `pad` replaces the 32. "provider=cpu" does not use CUDA.
// Without `values` and `scale`, both are found by matching test pairs: a texture that is shifted by
// 8 pixels, and small squares before a ground.
//
// A program reads a line "LEFT<tab>RIGHT<tab>OUTPUT" on its stdin: two PNG files, and a path
// without an extension. It writes the disparity to OUTPUT.npy, OUTPUT.pfm or OUTPUT.png and answers
// "ok" (network/program.h).
std::shared_ptr<const StereoMatcher> MakeNetworkMatcher(const std::string& name);

// The network of the options, else that of the environment variable RETINT_MATCHER. OptionError if
// there is neither.
std::shared_ptr<const StereoMatcher> NetworkOf(const StereoHvOptions& options);

}  // namespace retint
