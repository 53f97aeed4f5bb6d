// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/scene_source.h"

#include <utility>

#include "base/error.h"

namespace retint {

void LimitRegionCache(const MemoryLimits& given, const LargeScene* large, EditSession& session,
                      RegionId region, RefitOptions* refit) {
  const MemoryLimits limits = given.For(session.scene().backend());
  const bool on_host = limits.CacheSide() == MemorySide::kHost;
  if (!large && on_host && limits.host_bytes == 0) return;
  EditSize size = large ? large->size() : SizeOfWhole(session);
  size.refit = *refit;
  refit->SetRegionCacheBytes(RegionCacheThatFits(limits, session, region, size));
}

std::string WriteEdited(const EditSession& session, const LargeScene* large,
                        const std::filesystem::path& staged, const std::filesystem::path& target,
                        Monitor& monitor) {
  session.WriteSplat(staged, monitor);
  if (!large) return "";
  try {
    if (large->WriteIndexOf(staged, target)) return "";
    return SplatIndex::PathFor(target).string() +
           " is not an index of a splat, and is not written over";
  } catch (const RunError& error) {
    return std::string("the output has no index: ") + error.what();
  } catch (const InputError& error) {
    return std::string("the output has no index: ") + error.what();
  }
}

void SceneInParts::ForPaint(const std::vector<std::string>& pictures, Monitor& monitor) {
  session_ = large_->Show(pictures, std::move(session_), monitor);
  if (opened_) std::exchange(opened_, nullptr)(*session_);
}

void SceneInParts::ForDepth(const SelectionSource& selection, Monitor& monitor) {
  std::vector<PosedCamera> cameras;
  for (const PaintedView& view : selection.painted) cameras.push_back(view.camera);
  session_ = large_->ForDepth(cameras, selection.select, std::move(session_), monitor);
}

void SceneInParts::ForSelections(const std::vector<const SelectionSource*>& selections,
                                 const std::vector<std::string>& pictures, Monitor& monitor) {
  session_ = large_->ForSelections(selections, pictures, std::move(session_), monitor);
}

}  // namespace retint
