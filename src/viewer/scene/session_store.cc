// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/session_store.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "viewer/scene/post.h"

namespace retint {
namespace {

constexpr int kAutosaveMs = 1500;  // after a change; changes within this time share one autosave
constexpr int kRetryMs = 10000;    // after a failed one

// Absolute, so that it does not depend on the working folder.
std::filesystem::path Whole(const std::filesystem::path& folder) {
  const auto path = std::filesystem::absolute(folder).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

}  // namespace

SessionStore::SessionStore(SceneController* controller, QObject* parent)
    : QObject(parent), controller_(controller) {
  timer_.setSingleShot(true);
  connect(&timer_, &QTimer::timeout, this, &SessionStore::SubmitAutosave);
  const auto forget = [this] {
    // From the scene before: its user has agreed to lose unsaved work.
    DropAutosave();
    autosave_.reset();
    autosave_fails_ = false;
    writer_.reset();
    folder_.clear();
    saved_ = submitted_ = {};
  };
  connect(controller_, &SceneController::opened, this, forget);
  connect(controller_, &SceneController::closed, this, forget);
  connect(controller_, &SceneController::regionsChanged, this, &SessionStore::OnRegions);
  // An accepted selection is minutes of work, so save it now.
  connect(controller_, &SceneController::regionAdded, this, &SessionStore::SubmitAutosave);
}

SessionStore::~SessionStore() = default;

bool SessionStore::IsModified() const {
  return controller_->IsOpen() && !saved_.SavesLike(controller_->regions());
}

SessionStore::Stamp SessionStore::StampOf(const std::filesystem::path& folder) {
  const auto manifest = folder / "session.json";
  std::error_code code;
  const auto time = std::filesystem::last_write_time(manifest, code);
  if (code) return {};
  const auto size = std::filesystem::file_size(manifest, code);
  return code ? Stamp() : Stamp({time, size});
}

bool SessionStore::IsSavedElsewhere() const {
  if (folder_.empty() || !saving_.expired()) return false;
  const Stamp now = StampOf(folder_);
  return now && now != stamp_;
}

void SessionStore::Open(const std::filesystem::path& path, const SessionOptions& options) {
  const auto folder = Whole(path);
  const auto opened = std::make_shared<OpenedSession>();
  const auto stamp = std::make_shared<Stamp>();
  controller_->OpenWith(
      QString::fromStdString(folder.filename().string()),
      [=](Monitor& monitor) {
        *stamp = StampOf(folder);
        *opened = retint::OpenSession(folder, options, monitor);
        return std::move(opened->session);
      },
      [=, this] {
        if (IsAutosave(folder)) {
          folder_ = opened->saved;
          stamp_ = StampOf(folder_);
          recovered_ = folder;
        } else {
          folder_ = folder;
          stamp_ = *stamp;
          saved_ = controller_->regions();
        }
        submitted_ = controller_->regions();
        timer_.stop();  // the open state is on disk already
        Q_EMIT restored(opened->view);
      });
}

void SessionStore::Save(const std::filesystem::path& path, std::function<void()> then) {
  const auto folder = Whole(path);
  if (!writer_ || writer_->folder() != folder) writer_ = std::make_shared<SessionWriter>(folder);
  const auto written = std::make_shared<RegionSet>();
  const auto stamp = std::make_shared<Stamp>();
  saving_ = written;
  controller_->Run(
      tr("Saving the session"),
      [written, stamp, writer = writer_, view = ViewState()](EditSession& session,
                                                             Monitor& monitor) {
        session.refits().CollectFits();
        SessionSnapshot snapshot = TakeSnapshot(session);
        snapshot.view = view;
        writer->Write(snapshot, monitor);
        *stamp = StampOf(writer->folder());
        *written = snapshot.regions;
      },
      [=, this] {
        DropAutosave();
        if (folder_ != folder) autosave_.reset();  // the next one goes beside the new session
        autosave_fails_ = false;
        folder_ = folder;
        stamp_ = *stamp;
        saved_ = submitted_ = *written;
        Q_EMIT saved(QString::fromStdString(folder.string()));
        if (then) then();
      });
}

void SessionStore::OnRegions() {
  if (!submitted_.SavesLike(controller_->regions())) timer_.start(kAutosaveMs);
}

void SessionStore::SubmitAutosave() {
  timer_.stop();
  if (!controller_->IsOpen()) return;
  if (!IsModified()) {
    if (autosave_) autosave_->Discard();  // all changes were undone
    return;
  }
  if (!autosave_) {
    try {
      const auto on_written = [this, of = ++autosaves_](const std::string& error) {
        Post(this, [this, of, error] {
          if (autosave_ && of == autosaves_) OnAutosave(error);
        });
      };
      autosave_ = std::make_unique<Autosave>(folder_, on_written);
    } catch (const Error& error) {
      return OnAutosave(error.what());
    }
  }
  const auto snapshot = std::make_shared<SessionSnapshot>();
  const auto error = std::make_shared<std::string>();
  controller_->Run(
      {},
      [snapshot, error](EditSession& session, Monitor&) {
        try {
          *snapshot = TakeSnapshot(session);
        } catch (const std::exception& failure) {
          *error = failure.what();  // tried again later, like a failed write
        }
      },
      [=, this] {
        if (!error->empty()) return OnAutosave(*error);
        if (!autosave_) return;
        submitted_ = snapshot->regions;
        // Fetching the regions may have announced them as a change.
        if (submitted_.SavesLike(controller_->regions())) timer_.stop();
        snapshot->view = ViewState();
        snapshot->saved = folder_;
        autosave_->Submit(std::move(*snapshot));
      });
}

// Tries a failed autosave again until there is room for it.
void SessionStore::OnAutosave(const std::string& error) {
  const bool failed = !error.empty();
  if (failed) timer_.start(kRetryMs);
  if (!failed) RemoveRecovered();  // the new autosave holds its work too
  if (failed == std::exchange(autosave_fails_, failed) || !failed) return;
  Q_EMIT autosaveFailed(QString::fromStdString(error));
}

void SessionStore::DropAutosave() {
  timer_.stop();
  if (autosave_) autosave_->Discard();
  RemoveRecovered();
}

void SessionStore::RemoveRecovered() {
  if (recovered_.empty()) return;
  Recovery recovery;
  recovery.folder = std::exchange(recovered_, {});
  RemoveRecovery(recovery);
}

}  // namespace retint
