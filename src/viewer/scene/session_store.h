// SPDX-License-Identifier: BSD-3-Clause
// Sessions on disk, as the window sees them: opening, saving, and an autosave after every change
// that a crash leaves behind.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <QObject>
#include <QTimer>

#include "saving/autosave.h"
#include "viewer/scene/scene_controller.h"

namespace retint {

class SessionStore : public QObject {
  Q_OBJECT

 public:
  explicit SessionStore(SceneController* controller, QObject* parent = nullptr);
  ~SessionStore() override;

  // The session that was opened or saved last, an absolute path; empty: never saved.
  const std::filesystem::path& folder() const { return folder_; }
  // Asked when something is written: a JSON object of what the window wants to find again.
  void SetViewState(std::function<std::string()> state) { view_state_ = std::move(state); }

  // A session or an autosave of one, which is then not saved yet. restored(), or the controller's
  // openFailed().
  void Open(const std::filesystem::path& folder, const SessionOptions& options);
  // saved(), or the controller's failed() or cancelled(). `then` runs after saved().
  void Save(const std::filesystem::path& folder, std::function<void()> then = {});
  // Regions differ from those of the session on disk in what would be saved.
  bool IsModified() const;
  // Another program has saved the session since it was opened or saved here.
  bool IsSavedElsewhere() const;

  // The work is saved or given up: removes the autosave, and the one that it was recovered from.
  void DropAutosave();
  const Autosave* autosave() const { return autosave_.get(); }  // null: none yet

 Q_SIGNALS:
  void saved(const QString& path);
  void restored(const std::string& view);
  void autosaveFailed(const QString& message);  // once, until one works again

 private:
  void OnRegions();
  void SubmitAutosave();
  void OnAutosave(const std::string& error);
  void RemoveRecovered();
  std::string ViewState() const { return view_state_ ? view_state_() : std::string(); }

  // When a session was written, and how long its manifest is; nothing: there is none.
  using Stamp = std::optional<std::pair<std::filesystem::file_time_type, uintmax_t>>;
  static Stamp StampOf(const std::filesystem::path& folder);

  SceneController* controller_;
  std::filesystem::path folder_;
  Stamp stamp_;                      // of folder_, as it is known here
  std::weak_ptr<RegionSet> saving_;  // lives while a session is being written
  RegionSet saved_, submitted_;
  std::function<std::string()> view_state_;
  std::shared_ptr<SessionWriter> writer_;  // of folder_; used on the worker
  std::unique_ptr<Autosave> autosave_;
  std::filesystem::path recovered_;  // the autosave that was opened; empty: none
  bool autosave_fails_ = false;
  uint64_t autosaves_ = 0;  // made so far; what one that is gone still says does not count
  QTimer timer_;
};

}  // namespace retint
