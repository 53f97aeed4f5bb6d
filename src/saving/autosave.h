// SPDX-License-Identifier: BSD-3-Clause
// Keeps accepted work if the program or the machine crashes. After each change a snapshot of the
// session is written to a folder of its own, beside the session. For a session that was never
// saved, that is in the user's data folder. The lock of a running program ends with its process; an
// autosave without one was left behind.
//
//   DIR/NAME.retint                    the session
//   DIR/NAME.autosave.retint           its autosave, a session like any other
//   DIR/.NAME.autosave.retint.lock     locked while its program lives
#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "saving/session_file.h"

namespace retint {

// $XDG_DATA_HOME/retint/autosave, else ~/.local/share/retint/autosave. May not exist.
std::filesystem::path AutosaveDataFolder();
// Whether a folder has an autosave's name: NAME.autosave.retint, NAME.autosave-2.retint, ...
bool IsAutosave(const std::filesystem::path& folder);

class Autosave {
 public:
  // Called on the writing thread after each write; `error` is empty when it worked.
  using OnWritten = std::function<void(const std::string& error)>;

  // Takes a free name beside `session` (empty: never saved), or in the data folder where that
  // cannot be written. Never the name of an autosave that is still there. RunError when neither can
  // be.
  explicit Autosave(const std::filesystem::path& session, OnWritten on_written = {});
  ~Autosave();  // writes the waiting snapshot; files on disk stay, unless they were discarded
  Autosave(const Autosave&) = delete;
  Autosave& operator=(const Autosave&) = delete;

  // Returns at once; a snapshot that still waits is replaced. Heavy parts that were written before
  // are not written again.
  void Submit(SessionSnapshot snapshot);
  void Flush();  // until all that was submitted is on disk or has failed
  // The work is safe elsewhere, or not wanted: removes the autosave. Later snapshots make it anew.
  void Discard();

  const std::filesystem::path& folder() const { return folder_; }
  std::string error() const;  // of the last write

 private:
  void TakeName(const std::filesystem::path& session);
  void Loop();

  const OnWritten on_written_;
  std::filesystem::path folder_, lock_path_;
  int lock_ = -1;
  std::unique_ptr<SessionWriter> writer_;  // of the thread, or under mutex_ while it is idle
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_.
  std::optional<SessionSnapshot> pending_;
  std::string error_;
  bool busy_ = false, quit_ = false;
  std::thread thread_;  // last: starts when everything above exists
};

// An autosave whose program is gone.
struct Recovery {
  std::filesystem::path folder;   // OpenSession() it
  std::filesystem::path session;  // that it belongs to; empty: never saved
  std::filesystem::file_time_type time;
  SessionInfo info;
};

// Newest first: in the data folder and beside each of `sessions`. Those that are older than their
// session, or damaged, are left out.
std::vector<Recovery> FindRecoverable(const std::vector<std::filesystem::path>& sessions);
// Once it was recovered and saved, or is not wanted.
void RemoveRecovery(const Recovery& recovery);

}  // namespace retint
