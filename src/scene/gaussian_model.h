// SPDX-License-Identifier: BSD-3-Clause
// A 3D Gaussian Splatting scene as the 3DGS training code stores it: structure of arrays, raw (not
// activated) values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/memory.h"
#include "scene/splat_traits.h"

namespace retint {

// A column of the source file that Retint does not interpret, carried through as bytes.
struct ExtraColumn {
  std::string name;
  std::string type;  // "float", "uchar", ... as the file spells it
  int bytes_per_value = 0;
  std::vector<char> bytes;  // [N * bytes_per_value]
};

// How the file that the scene came from was laid out, so that saving changes only edited values.
struct SourceLayout {
  std::vector<std::string> comments;        // PLY "comment" and "obj_info" lines, whole
  std::vector<std::string> property_order;  // all columns of the vertex element, in file order
  std::vector<ExtraColumn> extras;
  std::vector<std::string> trailing_header;  // header lines of PLY elements after the Gaussians
  std::vector<char> trailing_bytes;          // and their data, uninterpreted
  std::string packed_format;       // of a format that stores rounded values: the codec's own mark
  UnsetVector<char> packed;        // and the file's data; unedited values keep their bytes in it
  std::vector<std::string> notes;  // sentences on parts of the file that the model cannot hold
};

// resize(n) leaves new values unset; resize(n, 0) does not.
using FloatArray = UnsetVector<float>;

struct GaussianModel {
  int sh_degree = 0;          // 0-3
  FloatArray means;           // [N, 3] world
  FloatArray quats_wxyz;      // [N, 4] not normalized
  FloatArray log_scales;      // [N, 3] scale = exp(.)
  FloatArray opacity_logits;  // [N] opacity = sigmoid(.)
  FloatArray sh;  // [N, K, 3], K = (sh_degree + 1)^2; color = max(0, 0.5 + sum_k Y_k sh_k)
  SplatTraits traits;
  SourceLayout source;

  size_t NumGaussians() const { return opacity_logits.size(); }
  int NumShCoeffs() const { return (sh_degree + 1) * (sh_degree + 1); }
  void Resize(size_t count, int degree);  // values that are new are 0
  // The same, but values that are new are not set: for a reader that sets every one of them.
  void ResizeUnset(size_t count, int degree);
  // Throws InputError naming the Gaussian and field when a value is NaN or infinite or the arrays
  // disagree in length.
  void Validate() const;
};

}  // namespace retint
