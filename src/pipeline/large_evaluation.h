// SPDX-License-Identifier: BSD-3-Clause
// How well a recolored splat shows an edit, of one that is larger than memory: some views after the
// others, each with the Gaussians that it may see. Every figure is, bit for bit, that of the whole.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>

#include "base/monitor.h"
#include "pipeline/large_scene.h"
#include "recolor/color_edit.h"
#include "reporting/report.h"
#include "selecting/selection_files.h"

namespace retint {

// A splat before and after it was recolored, as far as it can be told apart.
struct SplatShape {
  std::filesystem::path path;
  size_t count = 0;  // Gaussians
  int sh_degree = 0;
};
// InputError unless both have as many Gaussians of the same degree.
void CheckSameShape(const SplatShape& before, const SplatShape& after);
// InputError: their means differ.
[[noreturn]] void FailOfOtherMeans(const std::filesystem::path& before,
                                   const std::filesystem::path& after);

struct LargeEvaluation {
  std::filesystem::path after;  // a binary .ply too
  MaskFolder masks;
  std::optional<MaskFolder> true_masks;  // the same edit by these, too
  ColorEdit edit;                        // without pictures
  float strength = 1;
  TargetKind target = TargetKind::kRender;
  // Called with the first part.
  std::function<void(EditSession&)> opened;
};

// Reads both files once, and then the parts of both that the views with a mask see. The report has
// all but options; the refit's solver is "external". InputError as CheckSameShape, and for a file
// that changes meanwhile; OptionError as LargeScene, and for an edit by pictures.
RunReport EvaluateInParts(LargeScene& large, LargeEvaluation evaluation, Monitor& monitor);

}  // namespace retint
