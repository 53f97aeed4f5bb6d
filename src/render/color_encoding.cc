// SPDX-License-Identifier: BSD-3-Clause
#include "render/color_encoding.h"

#include <algorithm>

#include "kernels/common/sh.h"

namespace retint {

ColorEncoding::ColorEncoding(const LightMap& map, std::vector<float>& tables) {
  encode.code = ColorOpCode::kEncode;
  decode.code = ColorOpCode::kDecode;
  std::copy(map.to_light.begin(), map.to_light.end(), encode.values);
  std::copy(map.from_light.begin(), map.from_light.end(), decode.values);
  for (ColorOp* op : {&encode, &decode}) {
    op->strength = 1;
    op->table = int32_t(tables.size());
    op->size = int32_t(map.curve.size());
  }
  tables.insert(tables.end(), map.curve.begin(), map.curve.end());
}

SingleColors::SingleColors(const std::shared_ptr<const LightMap>& map) : maps_(map != nullptr) {
  if (map) encoding_ = ColorEncoding(*map, tables_);
}

void SingleColors::ToSrgb(float* rgb) const {
  if (maps_) ApplyColorOp(encoding_.encode, tables_.data(), rgb);
}

void SingleColors::FromSrgb(float* rgb) const {
  if (maps_) ApplyColorOp(encoding_.decode, tables_.data(), rgb);
}

Eigen::Vector3f BaseColors::Of(size_t gaussian) const {
  const float* const sh = &model_.sh[gaussian * size_t(model_.NumShCoeffs()) * 3];
  Eigen::Vector3f color = (kShC0 * Eigen::Vector3f(sh)).array() + 0.5F;
  if (colors_.maps()) {
    color = color.cwiseMax(0.0F);
    colors_.ToSrgb(color.data());
  }
  return color.cwiseMax(0.0F).cwiseMin(1.0F);
}

}  // namespace retint
