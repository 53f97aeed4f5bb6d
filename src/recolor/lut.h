// SPDX-License-Identifier: BSD-3-Clause
// Lookup tables for colors, read by OpenColorIO and evaluated to one form.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "recolor/tone.h"

namespace retint {

inline constexpr int kMaxColorTableSize = 129;  // a side

// Colors at the nodes of a regular grid over the cube [0, 1]^3.
struct ColorTable {
  int size = 0;               // nodes a side, 2 to kMaxColorTableSize
  std::vector<float> values;  // [size, size, size, 3]: blue, green, red (fastest), RGB; finite
  std::string name;           // of the file that it came from; empty: of none
  std::filesystem::path file = {};  // where that is, absolute; empty: not known
  std::optional<Tone> tone = {};    // whose table it is; none: of another

  // OptionError for a size out of range, a wrong number of values or one that is not finite.
  void Check() const;
  bool operator==(const ColorTable& other) const;  // wherever the files are
};

// .cube (1D and 3D), .3dl, .clf, and the CDL files .cdl, .cc and .ccc (of several corrections the
// first). A file whose only operation is a 3D table keeps its nodes exactly; everything else is
// sampled at 65 nodes a side. InputError for a file that is missing, of another kind, cut off, of
// absurd size, or that holds a value that is not finite.
std::shared_ptr<const ColorTable> ReadLut(const std::filesystem::path& path);

}  // namespace retint
