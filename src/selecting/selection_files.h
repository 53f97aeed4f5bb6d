// SPDX-License-Identifier: BSD-3-Clause
// A selection on disk, as `retint project` writes it and `retint refit` reads it. It is a mask of
// every view and the Gaussians' shares. The shares are computed from painted masks and cloud; from
// the masks only, they would be less exact.
//
//   <folder>/<image name>.png    or another name of colmap_io/mask_names.h
//   <folder>/shares.bin         8 bytes "RTSHARES", then little-endian: uint64 N, uint64 XXH64 of
//                               the masks, N floats, the share of each Gaussian in [0, 1]
//   <folder>/confidence.bin     the same after "RTCONFID": how sure each share is, in [0, 1]; only
//                               of shares that were completed (selection/completion.h)
//
// The masks' XXH64 is of the following bytes: for each mask in ascending order of the names, the
// image name, a zero byte, and the pixels row by row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "colmap_io/mask_names.h"
#include "opening/open_scene.h"
#include "scene/image.h"

namespace retint {

// Each mask in `folder`, by image name; RunError when it cannot be written, OptionError when two
// would have one name. Stage: "save".
void WriteMasks(const std::filesystem::path& folder, const std::map<std::string, Mask>& masks,
                Monitor& monitor, MaskNames names = MaskNames::kColmap);

// The masks of a folder, as far as they take memory.
struct MaskFolder {
  Pictures::MasksByName masks;     // of the pictures whose masks have a selected pixel
  std::vector<std::string> empty;  // the other pictures that have one, by name
  uint64_t checksum = 0;           // of all of them, as above

  // Of these views, those whose pictures have one; moves masks if it can.
  std::map<std::string, Mask> OfViews(const Pictures& pictures,
                                      const std::vector<const View*>& views) &&;
};
// InputError as Pictures::ReadMasks().
MaskFolder ReadMaskFolder(const std::filesystem::path& folder, bool invert,
                          const Pictures& pictures);

// `masks` by image name; `confidence` may be empty and then gets no file. Values of a `part` of a
// splat are extended to the whole: Gaussians that no view of the part shows have share 0, with full
// confidence. RunError if a file cannot be written.
void WriteShares(const std::filesystem::path& folder, const std::map<std::string, Mask>& masks,
                 const std::vector<float>& shares, const std::vector<float>& confidence = {},
                 const ScenePart* part = nullptr);

struct SharesOfMasks {
  std::vector<float> shares;      // [num_gaussians]; empty if there are none that fit
  std::vector<float> confidence;  // the same of theirs
  std::string why_not;            // why a file that is there was left aside, one line
};

// The shares that belong to `masks`, or to those of a checksum. A file whose masks were changed
// since, or that belongs to another splat, is left aside. InputError when it is damaged.
SharesOfMasks ReadShares(const std::filesystem::path& folder,
                         const std::map<std::string, Mask>& masks, size_t num_gaussians);
SharesOfMasks ReadShares(const std::filesystem::path& folder, uint64_t checksum,
                         size_t num_gaussians);

// The same of a splat larger than memory: the shares that are not 0.
struct SparseShares {
  bool known = false;               // whether there are any that fit
  std::vector<uint32_t> gaussians;  // ascending
  std::vector<float> shares;        // [gaussians]
  std::string why_not;              // as SharesOfMasks has it

  std::vector<float> Of(std::span<const uint32_t> records) const;  // of these, ascending
  std::vector<uint32_t> Above(double threshold) const;             // Gaussians, ascending
};
SparseShares ReadSparseShares(const std::filesystem::path& folder, uint64_t checksum,
                              size_t num_gaussians);

}  // namespace retint
