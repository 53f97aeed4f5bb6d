// SPDX-License-Identifier: BSD-3-Clause
// The .ksplat of GaussianSplats3D (github.com/mkkellogg/GaussianSplats3D, SplatBuffer.js); only
// read.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// A header of 4096 bytes, section headers of 1024 bytes, then the sections: positions in buckets,
// and a record for each Gaussian. Compression level 0 stores floats, level 1 positions in 16 bits
// within the bucket and the rest as binary16, level 2 SH in 8 bits. Colors and opacities are always
// bytes. Sections of a lower SH degree than the largest get zeros. The frame is that of the .ply.
class KsplatCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return ".ksplat"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view) const override { return false; }
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  bool CanWrite() const override { return false; }
};

}  // namespace retint
