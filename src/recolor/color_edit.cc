// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/color_edit.h"

#include <algorithm>
#include <optional>
#include <string>

#include "base/error.h"
#include "kernels/edit_colors.h"
#include "recolor/edit_text.h"
#include "recolor/operation_table.h"
#include "render/color_encoding.h"

namespace retint {
namespace {

using Kind = ColorOperationKind;

AffineColor WithStrengthOf(const AffineColor& map, float strength) {
  const Eigen::Matrix3f identity = Eigen::Matrix3f::Identity();
  return {identity + strength * (map.gain - identity), strength * map.offset};
}

// At its own strength. One of full strength keeps its bits.
std::optional<AffineColor> AffineOf(const ColorOperation& op) {
  const std::optional<AffineColor> full = FullAffine(op);
  return full && op.strength != 1 ? WithStrengthOf(*full, op.strength) : full;
}

}  // namespace

ColorEdit ColorEdit::Tint(const Eigen::Vector3f& tint) {
  ColorEdit edit;
  edit.operations.push_back(ColorOperation::Make(Kind::kTint, {tint[0], tint[1], tint[2]}));
  return edit;
}

ColorEdit ColorEdit::FromAffine(const AffineColor& map) {
  const auto& g = map.gain;
  const auto& o = map.offset;
  ColorEdit edit;
  edit.operations.push_back(
      ColorOperation::Make(Kind::kMatrix, {g(0, 0), g(0, 1), g(0, 2), o[0], g(1, 0), g(1, 1),
                                           g(1, 2), o[1], g(2, 0), g(2, 1), g(2, 2), o[2]}));
  return edit;
}

ColorEdit ColorEdit::WithStrength(float factor) const {
  ColorEdit edit = *this;
  edit.strength *= factor;
  return edit;
}

bool ColorEdit::BringsIntoRange() const {
  return std::any_of(operations.begin(), operations.end(),
                     [](const auto& op) { return op.kind == Kind::kSoftClip; });
}

ColorEdit ColorEdit::OnColorsOf(const GaussianModel& model) const {
  ColorEdit edit = *this;
  edit.light_map = LightMapOf(model.traits);
  return edit;
}

bool ColorEdit::IsAffine() const {
  const bool maps_encodings = light_map && !operations.empty();
  return !maps_encodings && std::all_of(operations.begin(), operations.end(),
                                        [](const auto& op) { return FullAffine(op).has_value(); });
}

AffineColor ColorEdit::Affine() const {
  AffineColor all;
  for (size_t i = 0; i < operations.size(); ++i) {
    const AffineColor map = AffineOf(operations[i]).value();
    all = i == 0 ? map : AffineColor{map.gain * all.gain, map.gain * all.offset + map.offset};
  }
  return strength == 1 ? all : WithStrengthOf(all, strength);
}

bool ColorEdit::NeedsMainColor() const {
  return std::any_of(operations.begin(), operations.end(),
                     [](const auto& op) { return op.NeedsMeasuring(); });
}

bool ColorEdit::HasPaint() const {
  return std::any_of(operations.begin(), operations.end(),
                     [](const auto& op) { return op.picture && !op.picture->layers.empty(); });
}

void ColorEdit::Check() const {
  CheckOption(operations.size() <= size_t(kMaxColorOps),
              "edit: " + std::to_string(operations.size()) + " operations are more than " +
                  std::to_string(kMaxColorOps));
  CheckOption(strength >= 0 && strength <= 1, "edit: strength must be from 0 to 1");
  for (const ColorOperation& op : operations) op.Check();
  CheckOption(std::count_if(operations.begin(), operations.end(),
                            [](const auto& op) { return op.kind == Kind::kPicture; }) <= 1,
              "edit: pictures belong into one operation");
}

CompiledEdit::CompiledEdit(const ColorEdit& edit, OutOfRange out_of_range)
    : affine_(edit.IsAffine()) {
  edit.Check();
  CheckOption(
      std::none_of(edit.operations.begin(), edit.operations.end(),
                   [](const auto& op) { return op.kind == Kind::kPicture && op.NeedsMeasuring(); }),
      "picture: it was not compared with the scene");
  if (affine_) {
    map_ = edit.Affine();
    return;
  }
  for (const ColorOperation& op : edit.operations) {
    if (op.kind == Kind::kSoftClip && out_of_range == OutOfRange::kLeft) continue;
    program_.ops[program_.count++] = Compile(op, tables_);
  }
  program_.strength = edit.strength;
  if (edit.light_map) {
    const ColorEncoding encoding(*edit.light_map, tables_);
    program_.encodes = true;
    program_.encode = encoding.encode;
    program_.decode = encoding.decode;
  }
  program_.tables = tables_.data();
}

Eigen::Vector3f CompiledEdit::Apply(const Eigen::Vector3f& color) const {
  if (affine_) return map_.gain * color + map_.offset;
  Eigen::Vector3f edited = color;
  ApplyColorMap(Map(), 1.0f, edited.data(), edited.data());
  return edited;
}

Eigen::Vector3f CompiledEdit::Apply(const Eigen::Vector3f& color, float mask) const {
  return color + mask * (Apply(color) - color);
}

void CompiledEdit::ApplyToAll(std::span<float> colors) const {
  EditColors(Map(), nullptr, colors.data(), int64_t(colors.size() / 3), colors.data());
}

ColorMap CompiledEdit::Map() const {
  ColorMap map{};
  if (!affine_) {
    map.program = &program_;
    return map;
  }
  for (int c = 0; c < 3; ++c) {
    for (int d = 0; d < 3; ++d) map.delta[3 * c + d] = map_.gain(c, d) - (c == d ? 1.0f : 0.0f);
    map.offset[c] = map_.offset[c];
  }
  return map;
}

ColorEdit ParseTint(std::string_view text) {
  ColorEdit edit;
  edit.operations.push_back(ParseOperation(TypeOf(Kind::kTint), text));
  return edit;
}

}  // namespace retint
