// SPDX-License-Identifier: BSD-3-Clause
// Sessions on disk, for the window: opening, saving, and autosaves after each change, which survive
// a crash.
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

  // The absolute path of the session that was last opened or saved; empty: never saved.
  const std::filesystem::path& folder() const { return folder_; }
  // `state` is called for each write. It returns a JSON object with the window's own state.
  void SetViewState(std::function<std::string()> state) { view_state_ = std::move(state); }

  // Opens a session, or an autosave of one, which counts as unsaved. restored(), or the
  // controller's openFailed().
  void Open(const std::filesystem::path& folder, const SessionOptions& options);
  // saved(), or the controller's failed() or cancelled(). `then` runs after saved().
  void Save(const std::filesystem::path& folder, std::function<void()> then = {});
  // Whether regions differ from the session on disk in a way that saving would store.
  bool IsModified() const;
  // Whether another program has saved the session since it was opened or saved here.
  bool IsSavedElsewhere() const;

  // After saving or discarding work: removes the autosave, and the one that it was recovered from.
  void DropAutosave();
  const Autosave* autosave() const { return autosave_.get(); }  // null: none yet

 Q_SIGNALS:
  void saved(const QString& path);
  void restored(const std::string& view);
  void autosaveFailed(const QString& message);  // once, until an autosave works again

 private:
  void OnRegions();
  void SubmitAutosave();
  void OnAutosave(const std::string& error);
  void RemoveRecovered();
  std::string ViewState() const { return view_state_ ? view_state_() : std::string(); }

  // The time when a session was written, and the length of its manifest; nullopt: there is none.
  using Stamp = std::optional<std::pair<std::filesystem::file_time_type, uintmax_t>>;
  static Stamp StampOf(const std::filesystem::path& folder);

  SceneController* controller_;
  std::filesystem::path folder_;
  Stamp stamp_;                      // of folder_, at the last visit
  std::weak_ptr<RegionSet> saving_;  // lives while a session is written
  RegionSet saved_, submitted_;
  std::function<std::string()> view_state_;
  std::shared_ptr<SessionWriter> writer_;  // of folder_; used on the worker
  std::unique_ptr<Autosave> autosave_;
  std::filesystem::path recovered_;  // the opened autosave; empty: none
  bool autosave_fails_ = false;
  uint64_t autosaves_ = 0;  // number of autosaves made; late results of earlier ones are ignored
  QTimer timer_;
};

}  // namespace retint
