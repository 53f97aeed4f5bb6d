// SPDX-License-Identifier: BSD-3-Clause
// The source of the scene for the steps of an edit: all of it at once, or one part after the other
// of a splat that is larger than memory.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "editing/edit_session.h"
#include "pipeline/edit_memory.h"
#include "pipeline/large_scene.h"
#include "reporting/report.h"

namespace retint {

// Limits the memory that `refit` uses for a region, so that it fits beside `large` or, if that is
// null, the whole scene. A whole scene has a limit on the CPU only if one was given. OptionError as
// RegionCacheThatFits().
void LimitRegionCache(const MemoryLimits& limits, const LargeScene* large, EditSession& session,
                      RegionId region, RefitOptions* refit);

// Writes `session`'s splat to `staged`, which becomes `target`. For a splat in parts it also writes
// the index of the copy; if it cannot, the returned sentence says why.
std::string WriteEdited(const EditSession& session, const LargeScene* large,
                        const std::filesystem::path& staged, const std::filesystem::path& target,
                        Monitor& monitor);

class SceneSource {
 public:
  virtual ~SceneSource() = default;

  virtual const Workspace& workspace() const = 0;
  virtual Pictures pictures() const = 0;
  // Null if the scene is whole.
  virtual const LargeScene* large() const { return nullptr; }
  bool IsWhole() const { return !large(); }
  // The session of the last step. In parts there is none before ForPaint().
  EditSession& session() const { return *session_; }
  // The same scene with finer Gaussians takes the session's place. Only of a whole one.
  void Replace(std::unique_ptr<EditSession> finer) { session_ = std::move(finer); }

  // Each before its step, in this order for one region; ForSelections() once for all of them.
  // OptionError if a part does not fit into the limits.
  virtual void ForPaint(const std::vector<std::string>& /*pictures*/, Monitor& /*monitor*/) {}
  virtual void ForDepth(const SelectionSource& /*selection*/, Monitor& /*monitor*/) {}
  virtual void ForSelections(const std::vector<const SelectionSource*>& /*selections*/,
                             const std::vector<std::string>& /*pictures*/, Monitor& /*monitor*/) {}
  // LimitRegionCache() of this scene.
  void LimitRefit(RegionId region, RefitOptions* refit) {
    LimitRegionCache(limits_, large(), *session_, region, refit);
  }

 protected:
  explicit SceneSource(const MemoryLimits& limits) : limits_(limits) {}
  std::unique_ptr<EditSession> session_;

 private:
  MemoryLimits limits_;
};

class WholeScene : public SceneSource {
 public:
  explicit WholeScene(std::unique_ptr<EditSession> session, const MemoryLimits& limits = {})
      : SceneSource(limits) {
    session_ = std::move(session);
  }
  const Workspace& workspace() const override { return session_->scene().workspace(); }
  Pictures pictures() const override { return session_->scene().pictures(); }
};

class SceneInParts : public SceneSource {
 public:
  // `opened` is called with the first part.
  SceneInParts(std::unique_ptr<LargeScene> large, const MemoryLimits& limits,
               std::function<void(EditSession&)> opened)
      : SceneSource(limits), large_(std::move(large)), opened_(std::move(opened)) {}
  const Workspace& workspace() const override { return large_->workspace(); }
  Pictures pictures() const override { return large_->pictures(); }
  const LargeScene* large() const override { return large_.get(); }
  void ForPaint(const std::vector<std::string>& pictures, Monitor& monitor) override;
  void ForDepth(const SelectionSource& selection, Monitor& monitor) override;
  void ForSelections(const std::vector<const SelectionSource*>& selections,
                     const std::vector<std::string>& pictures, Monitor& monitor) override;

 private:
  std::unique_ptr<LargeScene> large_;
  std::function<void(EditSession&)> opened_;
};

}  // namespace retint
