// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/splat_row.h"

#include "base/option_name.h"
#include "scene/sh_band4.h"

namespace retint {

SplatRow GetRow(const GaussianModel& model, size_t g) {
  SplatRow row;
  const auto sh_values = static_cast<size_t>(model.NumShCoeffs()) * 3;
  std::copy_n(&model.means[g * 3], 3, row.mean.begin());
  std::copy_n(&model.quats_wxyz[g * 4], 4, row.quat_wxyz.begin());
  std::copy_n(&model.log_scales[g * 3], 3, row.log_scale.begin());
  row.opacity_logit = model.opacity_logits[g];
  std::copy_n(&model.sh[g * sh_values], sh_values, row.sh.begin());
  return row;
}

void SetRow(GaussianModel& model, size_t g, const SplatRow& row) {
  const auto sh_values = static_cast<size_t>(model.NumShCoeffs()) * 3;
  std::copy_n(row.mean.begin(), 3, &model.means[g * 3]);
  std::copy_n(row.quat_wxyz.begin(), 4, &model.quats_wxyz[g * 4]);
  std::copy_n(row.log_scale.begin(), 3, &model.log_scales[g * 3]);
  model.opacity_logits[g] = row.opacity_logit;
  std::copy_n(row.sh.begin(), sh_values, &model.sh[g * sh_values]);
}

const std::array<float, 256>& LogitsOfBytes() {
  static const std::array<float, 256> logits = [] {
    std::array<float, 256> table;
    for (size_t i = 0; i < table.size(); ++i) table[i] = Logit(static_cast<double>(i) / 255.0);
    return table;
  }();
  return logits;
}

float HalfToFloat(uint16_t half) {
  const float sign = half & 0x8000 ? -1.0f : 1.0f;
  const int exponent = (half >> 10) & 0x1f;
  const int mantissa = half & 0x3ff;
  if (exponent == 0x1f) return mantissa ? NAN : sign * INFINITY;
  if (exponent == 0) return sign * std::ldexp(static_cast<float>(mantissa), -24);
  return sign * std::ldexp(static_cast<float>(mantissa + 1024), exponent - 25);
}

std::array<double, 4> Normalized(const std::array<float, 4>& quat_wxyz) {
  double norm = 0;
  for (const float q : quat_wxyz) norm += static_cast<double>(q) * q;
  norm = std::sqrt(norm);
  if (norm == 0) return {1, 0, 0, 0};
  std::array<double, 4> unit;
  for (size_t i = 0; i < 4; ++i) unit[i] = quat_wxyz[i] / norm;
  return unit;
}

SmallestThree PackSmallestThree(const std::array<double, 4>& unit) {
  SmallestThree packed;
  for (int i = 1; i < 4; ++i) {
    if (std::abs(unit[size_t(i)]) > std::abs(unit[size_t(packed.largest)])) packed.largest = i;
  }
  const double sign = unit[static_cast<size_t>(packed.largest)] < 0 ? -1 : 1;
  size_t next = 0;
  for (int i = 0; i < 4; ++i) {
    if (i != packed.largest) packed.rest[next++] = sign * unit[static_cast<size_t>(i)];
  }
  return packed;
}

void ValidateRead(const GaussianModel& model, const std::filesystem::path& path, BadRows bad) {
  if (bad == BadRows::kDrop) return;
  try {
    model.Validate();
  } catch (const InputError& error) {
    throw InputError(path, error.what() + ("; `retint convert` with " + OptionName("drop_bad")) +
                               " writes a file without such rows");
  }
}

void ValidateWrite(const GaussianModel& model, const std::filesystem::path& path) {
  std::string fault;
  if (model.NumGaussians() == 0) fault = "there are no Gaussians";
  if (model.sh_degree < 0 || model.sh_degree > 3) fault = "SH degree is not 0 to 3";
  if (fault.empty()) {
    try {
      model.Validate();
    } catch (const InputError& error) {
      fault = error.what();
    }
  }
  for (const std::string& comment : model.source.comments) {
    if (comment.find_first_of("\r\n") != std::string::npos ||
        !(comment.starts_with("comment") || comment.starts_with("obj_info"))) {
      fault = "a comment is not one line beginning with comment or obj_info";
    }
  }
  if (!fault.empty()) throw RunError(path.string() + ": not written: " + fault);
}

std::vector<std::string> CommonLosses(const GaussianModel& model, int max_sh_degree,
                                      std::string_view format,
                                      std::span<const RenderModel> render_models,
                                      std::span<const ColorSpace> color_spaces) {
  std::vector<std::string> losses;
  if (const int degree = HasShBand4(model) ? 4 : model.sh_degree; degree > max_sh_degree) {
    losses.push_back("spherical harmonics above degree " + std::to_string(max_sh_degree) +
                     " are dropped, where " + std::string(format) + " ends; the scene has degree " +
                     std::to_string(degree));
  }
  std::string columns;
  for (const ExtraColumn& extra : model.source.extras) {
    if (HasShBand4(model) && ShBand4Columns::IsName(extra.name)) continue;
    if (extra.name == "nx" || extra.name == "ny" || extra.name == "nz") continue;  // always zero
    columns += (columns.empty() ? "" : ", ") + extra.name;
  }
  if (!columns.empty()) losses.push_back("columns that only a .ply holds are dropped: " + columns);
  if (!model.source.trailing_header.empty()) {
    losses.emplace_back("elements after the Gaussians, which only a .ply holds, are dropped");
  }
  const RenderModel render_model = model.traits.render_model;
  const ColorSpace space = model.traits.color_space;
  if (render_model != RenderModel::kDefault &&
      std::find(render_models.begin(), render_models.end(), render_model) == render_models.end()) {
    losses.push_back("the render model " + std::string(NameOf(render_model)) + " is lost, which " +
                     std::string(format) + " cannot say: programs render it as default");
  }
  if (model.traits.chosen_space) {
    losses.push_back("the color space " + model.traits.chosen_space->name + " is lost, which " +
                     std::string(format) + " cannot say: tell the program that reads it");
  } else if (space != ColorSpace::kSrgbDisplay &&
             std::find(color_spaces.begin(), color_spaces.end(), space) == color_spaces.end()) {
    losses.push_back("the color space " + std::string(NameOf(space)) + " is lost, which " +
                     std::string(format) + " cannot say: programs show other colors");
  }
  return losses;
}

}  // namespace retint
