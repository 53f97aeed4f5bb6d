// SPDX-License-Identifier: BSD-3-Clause
// The regions of a scene and the history of their edits. Every edit is one step of the history, and
// either finishes or leaves the regions as they were. An id that is no region's is an OptionError.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "editing/history.h"
#include "editing/region.h"
#include "editing/region_edit.h"
#include "opening/open_scene.h"
#include "recolor/palette.h"

namespace retint {

class RegionStore {
 public:
  explicit RegionStore(OpenScene& scene) : scene_(scene), history_(scene.options().history_bytes) {}

  // `masks` by image name; `shares` [N] or empty: computed from the masks of the training views.
  // InputError when a name or size fits no view, or no pixel of any mask is set.
  RegionId Add(std::string name, std::map<std::string, Mask> masks, std::vector<float> shares,
               const ColorEdit& edit, Monitor& monitor, SelectionSource source = {});
  // Another selection for a region, from a later round of painting. The same checks.
  void SetSelection(RegionId id, std::map<std::string, Mask> masks, std::vector<float> shares,
                    Monitor& monitor, SelectionSource source = {});
  // A copy of a region above it, "NAME copy"; shares its selection.
  RegionId Duplicate(RegionId id);
  // One step of the history; those of one non-empty `merge_key` are one together. OptionError for
  // an edit or a strength that is none. The measurements of an edit are made here.
  void Do(RegionEdit edit, std::string_view merge_key = "");
  // Starts the history from regions that were saved and the job whose fits they hold. InputError
  // when they do not belong to this scene; then nothing is changed.
  void Restore(RegionSet regions, const RefitJob& job);

  const RegionSet& regions() const { return history_.current(); }
  const Region& Require(RegionId id) const;
  EditHistory& history() { return history_; }
  // The job whose fits the regions hold: a fit of another is out of date.
  const RefitJob& job() const { return job_; }
  void SetJob(const RefitJob& job) { job_ = job; }
  // The coefficients, [N, K, 3], that the first `count` regions of `state` make of the original's:
  // each visible region's fit, or where that is out of date its closed form.
  FloatArray ShAfter(const RegionSet& state, size_t count) const;
  // [N] m_g by the masks of the training views.
  std::vector<float> SharesOf(const std::map<std::string, Mask>& masks, Monitor& monitor);
  // [P, 3]: pixels of a region as it is before its own edit, see PixelsOfSelection.
  std::vector<float> MeasurePixels(RegionId id);
  // `edit` for a region, with the colors that it lacks (WithMainColors). Changes no region.
  ColorEdit MeasureEdit(RegionId id, const ColorEdit& edit);
  // Up to `count` main colors of a region as it is before its own edit, or of a selection in the
  // original scene, most frequent first. OptionError for a count out of range, see FindPalette.
  std::vector<PaletteColor> MeasurePalette(RegionId id, int count);
  std::vector<PaletteColor> MeasurePalette(const RegionSelection& selection, int count);

 private:
  // `edit` for regions[index] of `state`, with the main colors that it asks for.
  ColorEdit Completed(const ColorEdit& edit, const RegionSet& state, size_t index,
                      const RegionSelection& selection);
  // Finds the region's paint where it is not of the edit's layers.
  void FindPaint(Region& region) const;
  std::shared_ptr<RegionSelection> MakeSelection(const std::string& name,
                                                 std::map<std::string, Mask> masks,
                                                 std::vector<float> shares, SelectionSource source,
                                                 Monitor& monitor);
  void CheckMasks(const std::map<std::string, Mask>& masks) const;
  void CheckRegion(const Region& region) const;

  OpenScene& scene_;
  EditHistory history_;
  RefitJob job_;
  RegionId next_region_ = 1;
  uint64_t next_selection_ = 1;
};

// The targets of a refit in those of `views` that have a mask: their renders, edited. The masks
// must outlive the result.
std::vector<RefitTarget> RenderTargets(const Reconstruction& reconstruction,
                                       const std::map<std::string, Mask>& masks,
                                       const std::vector<const View*>& views);

}  // namespace retint
