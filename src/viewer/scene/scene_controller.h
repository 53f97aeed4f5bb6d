// SPDX-License-Identifier: BSD-3-Clause
// The open scene, its tasks and its regions; with colors() and results() the GUI's only face of a
// session. Lives on the GUI thread; the EditSession lives on a worker thread with a queue of tasks,
// so that no call here takes long. All signals are emitted on the GUI thread, results as values
// that nobody changes any more.
//
// Value edits (SetEdit, SetVisible, ...) show at once in regions(), before the worker has done
// them; what the session refuses is put back and reported by failed().
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
  // What the scene goes by: the workspace or, of a splat alone, the splat.
  const std::filesystem::path& place() const { return workspace.empty() ? splat : workspace; }

  std::filesystem::path workspace, splat;
  SessionOptions options;
};

// What does not change while a scene is open. Safe to keep and read on any thread, also after the
// scene was closed.
struct SceneFacts {
  OpenRequest request;  // as the session says: where the files are, with what options
  std::shared_ptr<const Workspace> workspace;
  std::shared_ptr<const GaussianModel> original;
  std::shared_ptr<Backend> backend;
  std::vector<const View*> views;           // by name; they live in `workspace`
  std::vector<const View*> train, heldout;  // the same, split
  // What is shown and painted on: photos in their own pixels, or the views that show them.
  std::shared_ptr<const Pictures> pictures;
  std::vector<std::string> warnings;  // one line each, for the user
  double load_seconds = 0;

  PosedCamera Posed(const View& view) const { return workspace->reconstruction.Posed(view); }
  const UserPicture& PictureOf(const View& view) const { return pictures->Of(view); }
  // By its name or that of a view that it shows; null for none.
  const UserPicture* FindPicture(std::string_view name) const { return pictures->Find(name); }
  // The camera of the picture's pixels.
  PosedCamera Shown(const UserPicture& picture) const;
  // How that is made at a size, of a distorted photo; null: it is rendered as it is.
  std::shared_ptr<const LensPicture> Lens(const UserPicture& picture, int width, int height) const;
  // Where the pictures were taken, by their names: a view of each.
  std::vector<const View*> Standpoints() const;

  std::shared_ptr<LensPictures> lenses = std::make_shared<LensPictures>();
};

struct HistoryState {
  bool can_undo = false, can_redo = false;
  std::string undo_label, redo_label;
  std::vector<std::string> labels;  // of all edits that are kept, the oldest first
  size_t done = 0;                  // of them; the others were undone
};

class SceneController : public QObject {
  Q_OBJECT

 public:
  explicit SceneController(QObject* parent = nullptr);
  ~SceneController() override;  // cancels what runs and joins every thread

  // ---- Scene

  // Replaces the open scene once the new one has loaded; a failed or cancelled load keeps it.
  void Open(const OpenRequest& request);
  // The same for any way of making a session. `done` runs after opened().
  using Opener = std::function<std::unique_ptr<EditSession>(Monitor& monitor)>;
  void OpenWith(const QString& name, Opener opener, std::function<void()> done = {}) {
    Replace(name, std::move(opener), std::move(done), /*same_views=*/false);
  }
  // Writes a splat whose large Gaussians are split where a region's paint or, without paint, the
  // region lies (editing/finer_session.h), and opens it with all regions. `done`, which gets what
  // was done, runs after opened(), or where nothing was to be split.
  void SplitGaussians(RegionId id, const RefineOptions& options, const std::filesystem::path& splat,
                      std::function<void(const RefineSummary& summary)> done);
  // While closed() and opened() are emitted: whether the new scene is the old one with finer
  // Gaussians, and has its views and regions.
  bool has_same_views() const { return has_same_views_; }
  void Close();
  bool IsOpen() const { return facts_ != nullptr; }
  std::shared_ptr<const SceneFacts> facts() const { return facts_; }

  // Stops the long task that runs, and those that wait: cancelled() follows for each in its turn.
  void Cancel();
  bool IsBusy() const { return !task_.isEmpty(); }
  QString task() const { return task_; }  // what the worker is at, for people; empty: nothing

  // Any work on the session, on the worker thread; `done` then runs on the GUI thread unless it
  // threw (failed() or cancelled() reports that). `label` names it in the status bar ("" for what
  // takes no time); afterwards regions() is refreshed. 0 when no scene is open.
  using Work = std::function<void(EditSession& session, Monitor& monitor)>;
  using TaskId = quint64;
  TaskId Run(const QString& label, Work work, std::function<void()> done = {});
  // The same for work that finds something, which `done` gets.
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

  // One round of painting: depth, cloud, registration and masks, which then are a new region's
  // (`base` 0), or those of the region that the round extends and erases. regionAdded(), then
  // `done`. A round that fails or is cancelled changes nothing.
  struct Round {
    PaintRound paint;
    RegionId base = 0;
    QString name;    // of a new region
    ColorEdit edit;  // of a new region
    SelectOptions select;
    ProjectorOptions project;
  };
  TaskId SelectRound(Round round, std::function<void(RegionId id)> done = {});
  // The selection of a region anew from its paint, with other options: selectedAgain(). Of several
  // requests only the newest is finished. InputError for a region that was not painted.
  void SelectAgain(RegionId id, const SelectOptions& select, const ProjectorOptions& project);
  // The selection of a region as a soft mask of any camera: selectionSeen(). `lens` as for a
  // FrameRequest.
  void SeeSelection(RegionId id, const PosedCamera& camera,
                    std::shared_ptr<const LensPicture> lens = nullptr);

  const RegionSet& regions() const { return regions_; }
  const HistoryState& history() const { return history_; }

  // As RegionStore::Do(); regions() shows it at once.
  void Do(const RegionEdit& edit, const std::string& merge_key = {});
  void Duplicate(RegionId id);
  void Undo();
  void Redo();
  // Undoes or redoes until so many of history().labels are done.
  void GoToStep(size_t done);
  // Shows one region alone (0: all visible ones again). A way of looking, not an edit: the session
  // does not know of it, and undo does not take it back.
  void SetSolo(RegionId id);
  RegionId solo() const { return solo_; }

  SceneColors& colors() const { return *colors_; }
  SceneResults& results() const { return *results_; }

 Q_SIGNALS:
  void opened();
  void openFailed(const QString& message);
  void openCancelled();
  void closed();                          // also before opened(), of the scene that is replaced
  void regionsChanged();                  // regions(), history(), solo()
  void regionAdded(retint::RegionId id);  // or its selection replaced
  void selectedAgain(retint::RegionId id);
  // With which options, before the two above; not of masks from elsewhere.
  void selectedWith(retint::RegionId id, const retint::SelectOptions& select,
                    const retint::ProjectorOptions& project);
  void selectionSeen(retint::RegionId id, std::shared_ptr<const retint::Mask> mask);
  // `label` began (IsBusy), or ended when empty.
  void taskChanged(const QString& label);
  void progress(const QString& stage, double fraction);
  // `task`: as Run() returned it; 0: no task of Run().
  void cancelled(const QString& label, quint64 task = 0);
  void failed(const QString& label, const QString& message, quint64 task = 0);

 private:
  struct State;    // what the worker publishes after a task
  struct Outcome;  // a task's end, on its way to the GUI thread
  void Replace(const QString& name, Opener opener, std::function<void()> done, bool same_views);
  void OpenDone(const std::shared_ptr<EditSession>& session, double seconds);
  void TaskDone(const Outcome& outcome);
  void Apply(const State& state);
  void ReportFailure(const Outcome& outcome);
  // Run(), with the monitor by which this task alone is cancelled; null when no scene is open.
  std::shared_ptr<Monitor> Queue(const QString& label, Work work, std::function<void()> done);
  void Retire();  // the open session

  std::shared_ptr<const SceneFacts> facts_;
  std::shared_ptr<EditSession> session_;
  RegionSet regions_;
  HistoryState history_;
  // Local edits that the worker has not done yet, by number.
  std::map<uint64_t, RegionEdit> pending_;
  uint64_t edits_ = 0;
  TaskId tasks_ = 0;                          // that were queued so far
  std::shared_ptr<Monitor> selecting_again_;  // of the newest SelectAgain(); null before the first
  RegionId solo_ = 0;
  bool has_same_views_ = false;
  QString task_;
  std::unique_ptr<SceneColors> colors_;
  std::unique_ptr<SceneResults> results_;
  std::unique_ptr<SceneWorker> worker_;  // last: its tasks call into the rest
};

}  // namespace retint
