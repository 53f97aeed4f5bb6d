// SPDX-License-Identifier: BSD-3-Clause
// Internal to network: an encoder of pictures and a decoder of prompts, as exports of Segment
// Anything (Kirillov et al. 2023), MobileSAM and SAM 2 have them.
#pragma once

#include <filesystem>
#include <memory>

#include "network/mask_network.h"
#include "network/network_name.h"

namespace retint {

// The encoder takes one picture, [1, 3, H, W] (normalized as for ImageNet, unless values= says
// otherwise) or [H, W, 3] (0 to 255). If it takes any size, the longer side becomes 1024 pixels.
//
// The decoder's inputs are bound by name. Some are outputs of the encoder. The others are:
// - point_coords [1, N, 2], in pixels of the encoder's picture
// - point_labels [1, N]: 1 inside, 0 outside, 2 and 3 for corners of the rectangle, -1 for none
// - mask_input and has_mask_input, both 0; orig_im_size: height and width
// Its output "masks" [1, M, h, w] has log odds; of several masks, the
// one with the best score counts, as SAM's own export chooses it.
//
// The picture keeps its proportions and is padded with 0 on the right and below. SAM 2, whose
// encoder has several outputs, gets it stretched.
std::unique_ptr<MaskNetwork> MakePromptedOutlines(const NetworkName& encoder,
                                                  const std::filesystem::path& decoder);

}  // namespace retint
