// SPDX-License-Identifier: BSD-3-Clause
// The open scene, its tasks and its regions. With colors() and results(), it is the GUI's only
// access to a session. It lives on the GUI thread. The EditSession lives on a worker thread with a
// queue of tasks, so no call here takes long. All signals are emitted on the GUI thread. Results
// are immutable values.
//
// Value edits (SetEdit, SetVisible, ...) show at once in regions(), before the worker has applied
// them. If the session refuses one, it is undone, and failed() reports it.
#pragma once

#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <QObject>
#include <QString>

#include "editing/edit_session.h"
#include "editing/finer_session.h"
#include "scene/gaussian_model.h"
#include "viewer/scene/lens_picture.h"
#include "viewer/scene/scene_colors.h"
#include "viewer/scene/scene_results.h"

namespace retint {

class SceneWorker;

struct OpenRequest {
  // The path that identifies the scene: the workspace, or a single splat.
  const std::filesystem::path& place() const { return workspace.empty() ? splat : workspace; }

  std::filesystem::path workspace, splat;
  SessionOptions options;
};

// The facts of an open scene that do not change. Every thread may keep and read them, even after
// the scene was closed.
struct SceneFacts {
  OpenRequest request;  // as completed by the session: all files and options
  std::shared_ptr<const Workspace> workspace;
  std::shared_ptr<const GaussianModel> original;
  std::shared_ptr<Backend> backend;
  std::vector<const View*> views;           // by name; `workspace` owns them
  std::vector<const View*> train, heldout;  // the same, split
  // Pictures to show and to paint on: photos in their own pixels, or the views that show them.
  std::shared_ptr<const Pictures> pictures;
  std::vector<std::string> warnings;  // one line each, for the user
  double load_seconds = 0;

  PosedCamera Posed(const View& view) const { return workspace->reconstruction.Posed(view); }
  const UserPicture& PictureOf(const View& view) const { return pictures->Of(view); }
  // By its name, or that of a view of it; null: none.
  const UserPicture* FindPicture(std::string_view name) const { return pictures->Find(name); }
  // The camera of the picture's pixels.
  PosedCamera Shown(const UserPicture& picture) const;
  // The lens for the picture of a distorted photo at a size; null: render it directly.
  std::shared_ptr<const LensPicture> Lens(const UserPicture& picture, int width, int height) const;
  // The places of the pictures in order of their names: one view for each.
  std::vector<const View*> Standpoints() const;

  std::shared_ptr<LensPictures> lenses = std::make_shared<LensPictures>();
};

struct HistoryState {
  bool can_undo = false, can_redo = false;
  std::string undo_label, redo_label;
  std::vector<std::string> labels;  // of all edits in the history, the oldest first
  size_t done = 0;                  // number of them that are not undone
};

class SceneController : public QObject {
  Q_OBJECT

 public:
  explicit SceneController(QObject* parent = nullptr);
  ~SceneController() override;  // cancels the current task and joins all threads

  // ---- Scene

  // Replaces the open scene once the new one is loaded; if that fails or is cancelled, keeps it.
  void Open(const OpenRequest& request);
  // The same for any way to make a session. `done` runs after opened().
  using Opener = std::function<std::unique_ptr<EditSession>(Monitor& monitor)>;
  void OpenWith(const QString& name, Opener opener, std::function<void()> done = {}) {
    Replace(name, std::move(opener), std::move(done), /*same_views=*/false);
  }
  // Writes a splat with smaller Gaussians, and opens it with all regions (editing/finer_session.h).
  // It splits large Gaussians in the region's paint or, without paint, in the region. `done` gets a
  // summary; it runs after opened(), or if there was nothing to split.
  void SplitGaussians(RegionId id, const RefineOptions& options, const std::filesystem::path& splat,
                      std::function<void(const RefineSummary& summary)> done);
  // Valid while closed() and opened() are emitted. True if the new scene is the old one with finer
  // Gaussians, so that views and regions are the same.
  bool has_same_views() const { return has_same_views_; }
  void Close();
  bool IsOpen() const { return facts_ != nullptr; }
  std::shared_ptr<const SceneFacts> facts() const { return facts_; }

  // Stops the current long task and all waiting ones. cancelled() follows for each in its turn.
  void Cancel();
  bool IsBusy() const { return !task_.isEmpty(); }
  QString task() const { return task_; }  // of the worker, for the user; empty: none

  // Queues work on the session for the worker thread. `done` runs on the GUI thread, unless the
  // work throws (failed() or cancelled() reports that). `label` names it in the status bar ("" for
  // quick work). regions() is up to date afterward. Returns 0 if no scene is open.
  using Work = std::function<void(EditSession& session, Monitor& monitor)>;
  using TaskId = quint64;
  TaskId Run(const QString& label, Work work, std::function<void()> done = {});
  // The same for work with a result, which `done` gets.
  template <typename Find, typename Done>
  TaskId Ask(const QString& label, Find find, Done done) {
    using Found = std::invoke_result_t<Find, EditSession&, Monitor&>;
    const auto found = std::make_shared<std::optional<Found>>();
    return Run(
        label,
        [found, find = std::move(find)](EditSession& session, Monitor& monitor) {
          *found = find(session, monitor);
        },
        [found, done = std::move(done)] { done(std::move(**found)); });
  }

  // ---- Selection and regions

  // One round of painting: depth, cloud, registration and masks. They become a new region (`base`
  // 0), or extend and erase region `base`. regionAdded(), then `done`. A failed or cancelled round
  // changes nothing.
  struct Round {
    PaintRound paint;
    RegionId base = 0;
    QString name;    // for a new region
    ColorEdit edit;  // for a new region
    SelectOptions select;
    ProjectorOptions project;
  };
  TaskId SelectRound(Round round, std::function<void(RegionId id)> done = {});
  // Selects a region again from its paint, with other options: selectedAgain(). Of several
  // requests, only the newest is completed. InputError for a region without paint.
  void SelectAgain(RegionId id, const SelectOptions& select, const ProjectorOptions& project);
  // The selection of a region as a soft mask of any camera: selectionSeen(). `lens` is as in
  // FrameRequest.
  void SeeSelection(RegionId id, const PosedCamera& camera,
                    std::shared_ptr<const LensPicture> lens = nullptr);

  const RegionSet& regions() const { return regions_; }
  const HistoryState& history() const { return history_; }

  // As RegionStore::Do(), but regions() shows it at once.
  void Do(const RegionEdit& edit, const std::string& merge_key = {});
  void Duplicate(RegionId id);
  void Undo();
  void Redo();
  // Undoes or redoes until this many of history().labels are done.
  void GoToStep(size_t done);
  // Shows only one region (0: all visible ones). This is a way of looking, not an edit: the session
  // does not know it, and undo ignores it.
  void SetSolo(RegionId id);
  RegionId solo() const { return solo_; }

  SceneColors& colors() const { return *colors_; }
  SceneResults& results() const { return *results_; }

 Q_SIGNALS:
  void opened();
  void openFailed(const QString& message);
  void openCancelled();
  void closed();                          // also before opened(), for the replaced scene
  void regionsChanged();                  // regions(), history(), solo()
  void regionAdded(retint::RegionId id);  // or its selection was replaced
  void selectedAgain(retint::RegionId id);
  // The options for the two signals above, before them. Not for masks from elsewhere.
  void selectedWith(retint::RegionId id, const retint::SelectOptions& select,
                    const retint::ProjectorOptions& project);
  void selectionSeen(retint::RegionId id, std::shared_ptr<const retint::Mask> mask);
  // A task with this `label` has started; "": it has ended (IsBusy).
  void taskChanged(const QString& label);
  void progress(const QString& stage, double fraction);
  // `task`: from Run(); 0: another task.
  void cancelled(const QString& label, quint64 task = 0);
  void failed(const QString& label, const QString& message, quint64 task = 0);

 private:
  struct State;    // what the worker publishes after a task
  struct Outcome;  // the end of a task, on its way to the GUI thread
  void Replace(const QString& name, Opener opener, std::function<void()> done, bool same_views);
  void OpenDone(const std::shared_ptr<EditSession>& session, double seconds);
  void TaskDone(const Outcome& outcome);
  void Apply(const State& state);
  void ReportFailure(const Outcome& outcome);
  // Run(), with a monitor to cancel only this task; null if no scene is open.
  std::shared_ptr<Monitor> Queue(const QString& label, Work work, std::function<void()> done);
  void Retire();  // for the open session

  std::shared_ptr<const SceneFacts> facts_;
  std::shared_ptr<EditSession> session_;
  RegionSet regions_;
  HistoryState history_;
  // Local edits that the worker has not applied yet, by number.
  std::map<uint64_t, RegionEdit> pending_;
  uint64_t edits_ = 0;
  TaskId tasks_ = 0;                          // number of tasks queued so far
  std::shared_ptr<Monitor> selecting_again_;  // of the newest SelectAgain(); null before the first
  RegionId solo_ = 0;
  bool has_same_views_ = false;
  QString task_;
  std::unique_ptr<SceneColors> colors_;
  std::unique_ptr<SceneResults> results_;
  std::unique_ptr<SceneWorker> worker_;  // last: its tasks call into the other members
};

}  // namespace retint
