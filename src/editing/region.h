// SPDX-License-Identifier: BSD-3-Clause
// Regions: selections of the user and their edits, as values. States share their heavy parts
// (masks, shares, fits), which are immutable once published, so that copying a state for the undo
// history costs a few pointers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "recolor/color_edit.h"
#include "recolor/gaussian_paint.h"
#include "recolor/sh_refitter.h"
#include "scene/gaussian_model.h"
#include "selecting/region_selection.h"

namespace retint {

// The coefficients that a refit gave to the active Gaussians of one region.
struct RegionFit {
  std::string key;               // of everything that it was computed from, see FitKey
  std::vector<int32_t> indices;  // active Gaussians, ascending
  FloatArray sh;                 // [indices, K, 3], absolute values
  RefitSummary summary;
  size_t Bytes() const;
  // Overwrites the active Gaussians' blocks of `all`, [N, K, 3].
  void Apply(std::span<float> all, int num_coeffs) const;
};

enum class TargetKind {
  kRender,  // the original scene's render, edited: outside the mask nothing can drift
  kPhoto,   // the photo, edited
};

struct RefitJob {
  RefitOptions options;
  TargetKind target = TargetKind::kRender;
  void Describe(OptionList& list);
  void Check() const { options.Check(); }
};

using RegionId = uint32_t;

struct Region {
  RegionId id = 0;
  std::string name;
  std::shared_ptr<const RegionSelection> selection;
  ColorEdit edit;
  // Of the edit's layers on each Gaussian, found again where the layers are others. Follows from
  // them, so that no session holds it. May be null, or of layers that the edit had before.
  std::shared_ptr<const GaussianPaint> paint;
  float strength = 1;  // 0 nothing, 1 the whole edit
  bool visible = true;
  std::shared_ptr<const RegionFit> fit;  // null, or of another key: out of date

  ColorEdit EffectiveEdit() const { return edit.WithStrength(strength); }
};

// All regions, in the order in which their edits apply: each starts from the colors that the ones
// before it left, the first from the original coefficients.
struct RegionSet {
  std::vector<Region> regions;

  const Region* Find(RegionId id) const;
  Region* Find(RegionId id);
  // Names everything that the fit of regions[index] depends on: its and the earlier visible
  // regions' selection, edit and strength, and the job's options that apply to its solver. Memory
  // is one of them: weights that do not fit into the region cache are not rounded.
  std::string FitKey(size_t index, const RefitJob& job) const;
  // Whether both would be saved alike: all but fits and paint, which are derived.
  bool SavesLike(const RegionSet& other) const;
  // Bytes of selections, fits and paint that `other` does not hold too.
  size_t BytesBeyond(const RegionSet& other) const;
};

}  // namespace retint
