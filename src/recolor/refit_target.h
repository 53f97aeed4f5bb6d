// SPDX-License-Identifier: BSD-3-Clause
// A target, checked and made ready. Internal to recolor.
#pragma once

#include <memory>
#include <vector>

#include "kernels/common/color_ops.h"
#include "recolor/color_edit.h"
#include "recolor/sh_refitter.h"
#include "render/renderer.h"

namespace retint {

// InputError naming the view when its mask is missing or not of the view's size.
void CheckTarget(const RefitTarget& target);
// A target's photo, and the picture that RefitTarget::edited makes, with the renderer's background
// removed between the Gaussians, because only the Gaussians are fitted and measured. Null or empty
// if the target has none. InputError if one is not of the view's size.
std::shared_ptr<const Image> PhotoOf(const RefitTarget& target, Renderer& renderer);
Image MadeFor(const RefitTarget& target, Renderer& renderer, Mask* leaves = nullptr);

// The area of each mask, and a little for every view.
std::vector<double> AreasOf(const std::vector<RefitTarget>& targets);

// An edit in backend memory, for its kernels.
struct UploadedEdit {
  UploadedEdit(Backend& backend, const CompiledEdit& edit);
  ColorMap map{};  // refers to the rest
  Buffer<float> tables;
  Buffer<ColorProgram> program;
};

}  // namespace retint
