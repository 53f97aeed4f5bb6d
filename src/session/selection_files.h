// SPDX-License-Identifier: BSD-3-Clause
// A selection on disk, as `retint project` writes it and `retint refit` reads it: a mask of every
// view, and beside them the Gaussians' shares, which paint and cloud determine and which could be
// computed from the masks alone only nearly.
//
//   <folder>/<image name>.png
//   <folder>/shares.bin         8 bytes "RTSHARES", then little-endian: uint64 N, uint64 XXH64 of
//                               the masks, N floats, the share of each Gaussian in [0, 1]
//   <folder>/confidence.bin     the same after "RTCONFID": how sure each share is, in [0, 1]; only
//                               of shares that were completed (selection/completion.h)
//
// The masks' XXH64 is of the following bytes: for each mask in ascending order of the names, the
// image name, a zero byte, and the pixels row by row.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "scene/image.h"

namespace retint {

// <folder>/<image name>.png of each mask; RunError when it cannot be written. Stage: "save".
void WriteMasks(const std::filesystem::path& folder, const std::map<std::string, Mask>& masks,
                Monitor& monitor);

// `masks` by image name; `confidence` may be empty: then there is no file of it. RunError when one
// cannot be written.
void WriteShares(const std::filesystem::path& folder, const std::map<std::string, Mask>& masks,
                 const std::vector<float>& shares, const std::vector<float>& confidence = {});

struct SharesOfMasks {
  std::vector<float> shares;      // [num_gaussians]; empty where there are none that fit
  std::vector<float> confidence;  // the same of theirs
  std::string why_not;            // why a file that is there was left aside, one line
};

// The shares that belong to `masks`. A file whose masks were changed since, or that belongs to
// another splat, is left aside. InputError when it is damaged.
SharesOfMasks ReadShares(const std::filesystem::path& folder,
                         const std::map<std::string, Mask>& masks, size_t num_gaussians);

}  // namespace retint
