// SPDX-License-Identifier: BSD-3-Clause
// An editing session on disk: everything that it takes to go on editing, in one folder NAME.retint
// (docs/formats.md). The splat and the photos stay where they are and are referred to.
//
// The folder's parts never change once written; session.json, written last and renamed into place,
// says which of them belong to the session, and their sizes and checksums. So a reader sees the old
// session or the new one, never half of either, and saving again writes only new parts.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "base/monitor.h"
#include "editing/edit_session.h"
#include "scene/splat_traits.h"

namespace retint {

inline constexpr int kSessionVersion = 2;

// A session at one moment, as a value: cheap to take and to copy, its heavy parts are shared and
// immutable. So another thread can write it.
struct SessionSnapshot {
  std::filesystem::path workspace, image_folder, splat;  // absolute
  std::shared_ptr<const Reconstruction> views;           // of a splat without a workspace
  std::string model;                                     // see SessionOptions
  Sim3d world_from_splat;
  std::optional<RenderModel> render_model;
  OcioSpace space;
  std::shared_future<FileChecksum> checksum;  // of the splat
  size_t gaussians = 0;
  int sh_degree = 0;
  int holdout = 0;
  std::array<float, 3> background = {0, 0, 0};
  RegionSet regions;
  RefitJob job;
  std::shared_ptr<const SelectionSource> draft;  // painted, but not a region yet; may be null
  std::string view;             // a JSON object of the viewer's own (camera, panels); may be empty
  std::filesystem::path saved;  // the session that this is an autosave of; empty: never saved
};

// InputError for a session without files (made from memory).
SessionSnapshot TakeSnapshot(const EditSession& session);

// Writes one folder, again and again. One thread at a time.
class SessionWriter {
 public:
  explicit SessionWriter(std::filesystem::path folder);
  ~SessionWriter();
  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;

  // RunError when the folder holds something else than a session.
  void CheckFolder() const;
  // The whole session or, on any failure, the one before. RunError when it cannot be written, or
  // when the folder holds something else than a session; OptionError when `view` is not a JSON
  // object. Parts that this writer has written before are not written again; parts that the session
  // no longer needs are removed after the new session is in place. Stage: "save".
  void Write(const SessionSnapshot& snapshot, Monitor& monitor);

  const std::filesystem::path& folder() const { return folder_; }
  int parts_written() const { return parts_written_; }  // by the last Write()

 private:
  struct Impl;
  std::filesystem::path folder_;
  int parts_written_ = 0;
  std::unique_ptr<Impl> impl_;
};

// The head of a session, without its heavy parts.
struct SessionInfo {
  // Their places now. Of a splat without a workspace, `workspace` is empty and `view_folder` a part
  // of the session.
  std::filesystem::path workspace, image_folder, splat, view_folder;
  std::string model;
  Sim3d world_from_splat;
  std::optional<RenderModel> render_model;
  OcioSpace space;
  FileChecksum checksum;
  int holdout = 0;
  std::array<float, 3> background = {0, 0, 0};
  size_t regions = 0;
  std::string written_by;       // version of the program
  std::filesystem::path saved;  // see SessionSnapshot
};

// InputError, as OpenSession().
SessionInfo ReadSessionInfo(const std::filesystem::path& folder);

struct OpenedSession {
  std::unique_ptr<EditSession> session;
  std::shared_ptr<const SelectionSource> draft;  // null: none
  std::string view;                              // JSON object or empty
  std::filesystem::path saved;
};

// Opens the workspace and the splat that a session refers to and restores it: CurrentSh() has the
// bits that it had. Of `options` the backend and the budgets count; the rest comes from the file.
// InputError naming file and fault for whatever is missing, damaged, of a newer version, or of
// another scene; so too when the splat is not the one that was edited. Parts that follow from
// others are no inputs: fits, and of a selection that was painted its masks, shares and points.
// If one cannot be read, the session's warnings() name it; a fit is then missing, the rest is made
// again.
OpenedSession OpenSession(const std::filesystem::path& folder, const SessionOptions& options,
                          Monitor& monitor);

}  // namespace retint
