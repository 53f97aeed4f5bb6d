// SPDX-License-Identifier: BSD-3-Clause
// Internal to network: pictures and masks as networks take and give them.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "network/onnx_model.h"
#include "network/pixel_values.h"
#include "scene/image.h"

namespace retint {

inline constexpr int kUsualSide = 1024;  // of a network for any size: ISNet's, BiRefNet's and SAM's

// Without a copy: it is only read.
cv::Mat MatOf(const Image8& image);

// `rgb` at the left and top of an image of `size`, which is 0 elsewhere; [1, 3, H, W], or [H, W, 3]
// if `channels_last`.
Tensor PictureTensor(const cv::Mat& rgb, cv::Size size, PixelValues values, bool channels_last);

// Whether a side of an input can be a picture's; below 0 is any.
bool IsSide(int64_t side);

// Log odds become probabilities; values in [0, 1] stay.
void MakeSure(cv::Mat* mask);

}  // namespace retint
