// SPDX-License-Identifier: BSD-3-Clause
// The scene's answer to an outline that strokes found in one picture: the Gaussians, which all
// views show, decide the parts that this picture leaves open. The user's outline holds unless
// somebody takes the scene's.
#pragma once

#include <optional>

#include "base/monitor.h"
#include "scene/image.h"
#include "selecting/selection_pipeline.h"

namespace retint {

struct SceneAnswer {
  Mask mask;     // of the picture: the outline, with its open parts as the scene has them
  Mask differs;  // 255 where that is another outline, but for specks and lines as thin as a border
  double changed = 0;  // pixels of `differs`, as a share of the outline's own
  // Whether `mask` is as large as the outline, or nearly (MayStandFor()). Else the scene means
  // something else, and its answer is of no use.
  bool may_stand = false;

  static constexpr double kNoticed = 0.05;  // from which a person sees that the two differ
  bool IsWorthAsking() const { return may_stand && changed >= kNoticed; }
};

// `own` with its `undecided` pixels (255; MaskFromScribbles()) decided by the scene. None if the
// scene has no answer: no decided pixel has depth, or nothing would be selected.
std::optional<SceneAnswer> AskScene(SelectionPipeline& selection, const UserPicture& picture,
                                    const Mask& own, const Mask& undecided, Monitor& monitor);

// Pixels that are inside in one of two masks of a size and outside in the other, as
// SceneAnswer::differs has them.
Mask OutlinesDiffer(const Mask& a, const Mask& b);

}  // namespace retint
