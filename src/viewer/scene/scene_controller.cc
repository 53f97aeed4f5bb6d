// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/scene_controller.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/error.h"
#include "base/memory.h"
#include "base/staged_output.h"
#include "opening/photo_paint.h"
#include "viewer/scene/failure_text.h"
#include "viewer/scene/post.h"
#include "viewer/scene/scene_worker.h"

namespace retint {
namespace {

constexpr int kReleaseMs = 1000;  // after a scene was closed and nobody reads it

QString Text(const std::string& text) { return QString::fromStdString(text); }

// The name of a stage, for the user.
QString StageText(const std::string& stage) {
  static const std::map<std::string, const char*> kTexts = {
      {"align", QT_TRANSLATE_NOOP("retint::SceneController", "aligning with the cameras")},
      {"check", QT_TRANSLATE_NOOP("retint::SceneController", "checking the scene")},
      {"cloud", QT_TRANSLATE_NOOP("retint::SceneController", "building the cloud")},
      {"color error", QT_TRANSLATE_NOOP("retint::SceneController", "comparing colors")},
      {"completion", QT_TRANSLATE_NOOP("retint::SceneController", "deciding what nobody painted")},
      {"compare", QT_TRANSLATE_NOOP("retint::SceneController", "comparing pictures")},
      {"depth", QT_TRANSLATE_NOOP("retint::SceneController", "measuring depth")},
      {"evaluate", QT_TRANSLATE_NOOP("retint::SceneController", "rendering views")},
      {"gaussians", QT_TRANSLATE_NOOP("retint::SceneController", "making Gaussians")},
      {"index", QT_TRANSLATE_NOOP("retint::SceneController", "sorting the Gaussians")},
      {"load", QT_TRANSLATE_NOOP("retint::SceneController", "reading files")},
      {"match", QT_TRANSLATE_NOOP("retint::SceneController", "comparing colors")},
      {"photos", QT_TRANSLATE_NOOP("retint::SceneController", "reading photos")},
      {"pictures", QT_TRANSLATE_NOOP("retint::SceneController", "reading pictures")},
      {"points", QT_TRANSLATE_NOOP("retint::SceneController", "looking up the sparse points")},
      {"projection", QT_TRANSLATE_NOOP("retint::SceneController", "projecting onto every view")},
      {"refine", QT_TRANSLATE_NOOP("retint::SceneController", "splitting Gaussians")},
      {"refit", QT_TRANSLATE_NOOP("retint::SceneController", "fitting colors")},
      {"registration",
       QT_TRANSLATE_NOOP("retint::SceneController", "registering to the sparse points")},
      {"render", QT_TRANSLATE_NOOP("retint::SceneController", "rendering views")},
      {"rounds", QT_TRANSLATE_NOOP("retint::SceneController", "comparing with earlier rounds")},
      {"save", QT_TRANSLATE_NOOP("retint::SceneController", "writing files")},
      {"shares",
       QT_TRANSLATE_NOOP("retint::SceneController", "finding the Gaussians of the masks")},
      {"suggestion", QT_TRANSLATE_NOOP("retint::SceneController", "rating the views")},
      {"views", QT_TRANSLATE_NOOP("retint::SceneController", "placing views")}};
  const auto found = kTexts.find(stage);
  return found == kTexts.end() ? Text(stage) : SceneController::tr(found->second);
}

bool SameFits(const RegionSet& a, const RegionSet& b) {
  return std::equal(
      a.regions.begin(), a.regions.end(), b.regions.begin(), b.regions.end(),
      [](const Region& x, const Region& y) { return x.fit == y.fit && x.paint == y.paint; });
}

}  // namespace

PosedCamera SceneFacts::Shown(const UserPicture& picture) const {
  return PosedPicture(*workspace, picture);
}

std::shared_ptr<const LensPicture> SceneFacts::Lens(const UserPicture& picture, int width,
                                                    int height) const {
  return picture.photo ? lenses->Get(picture.photo->lens, width, height) : nullptr;
}

std::vector<const View*> SceneFacts::Standpoints() const {
  std::vector<const View*> stands;
  for (const UserPicture& picture : pictures->all()) stands.push_back(picture.faces.front());
  return stands;
}

struct SceneController::State {
  RegionSet regions;
  HistoryState history;
  uint64_t edits = 0;
};

struct SceneController::Outcome {
  TaskId task = 0;
  QString label;
  std::shared_ptr<EditSession> session;
  State state;
  std::exception_ptr error;
  std::function<void()> done;
};

SceneController::SceneController(QObject* parent)
    : QObject(parent),
      colors_(std::make_unique<SceneColors>(this)),
      results_(std::make_unique<SceneResults>(this)) {
  worker_ = std::make_unique<SceneWorker>(
      [this](const Progress& step) {
        Post(this, [this, step] { Q_EMIT progress(StageText(step.stage), step.fraction); });
      },
      [this](const QString& label) {
        Post(this, [this, label] {
          task_ = label;
          Q_EMIT taskChanged(label);
        });
      });
}

SceneController::~SceneController() {
  worker_.reset();
  colors_.reset();
}

// ---- Scene

void SceneController::Open(const OpenRequest& request) {
  auto folder = request.place();
  if (folder.filename().empty()) folder = folder.parent_path();
  OpenWith(Text(folder.filename().string()), [request](Monitor& monitor) {
    return EditSession::Open(request.workspace, request.splat, request.options, monitor);
  });
}

void SceneController::Replace(const QString& name, Opener opener, std::function<void()> done,
                              bool same_views) {
  const auto session = std::make_shared<std::shared_ptr<EditSession>>();
  const auto start = std::chrono::steady_clock::now();
  const auto finish = [=, this, done = std::move(done)](std::exception_ptr error) {
    if (!error) {
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
      has_same_views_ = same_views;
      OpenDone(*session, taken.count());
      has_same_views_ = false;
      if (done) done();
      return;
    }
    try {
      std::rethrow_exception(error);
    } catch (const Cancelled&) {
      Q_EMIT openCancelled();
    } catch (const std::exception& failure) {
      Q_EMIT openFailed(FailureText(failure));
    }
  };
  worker_->Post({tr("Opening %1").arg(name),
                 [session, opener = std::move(opener)](Monitor& monitor) {
                   *session = opener(monitor);
                   (*session)->refits().optimizer();  // made here, so that every thread may call it
                 },
                 [this, finish](std::exception_ptr error) {
                   Post(this, [finish, error] { finish(error); });
                 }});
}

void SceneController::SplitGaussians(RegionId id, const RefineOptions& options,
                                     const std::filesystem::path& splat,
                                     std::function<void(const RefineSummary&)> done) {
  colors_->CancelRefit();
  const QString label = tr("Splitting Gaussians");
  const auto finer = std::make_shared<FinerSession>();
  Run(
      label,
      [=](EditSession& session, Monitor& monitor) {
        CheckOutput(splat);
        *finer = MakeFinerSession(session, id, options, splat, monitor);
      },
      [=, this, done = std::move(done)] {
        if (!finer->session) return done(finer->summary);
        if (!finer->session->store().regions().SavesLike(regions_)) {
          Q_EMIT failed(label, tr("The regions were changed meanwhile. Split once more."));
          return;
        }
        Replace(
            Text(splat.filename().string()),
            [finer](Monitor&) { return std::move(finer->session); }, [=] { done(finer->summary); },
            /*same_views=*/true);
      });
}

void SceneController::OpenDone(const std::shared_ptr<EditSession>& session, double seconds) {
  const bool replaces = IsOpen();
  Retire();
  if (replaces) Q_EMIT closed();
  session_ = session;
  auto facts = std::make_shared<SceneFacts>();
  facts->request = {session->scene().workspace().root, session->scene().splat_path(),
                    session->scene().options()};
  // Aliases: the session lives as long as one of these pointers.
  facts->workspace = {session, &session->scene().workspace()};
  facts->original = {session, &session->scene().original()};
  facts->backend = session->scene().renderer().shared_backend();
  facts->views = session->scene().reconstruction().ViewsByName();
  facts->pictures = std::make_shared<const Pictures>(session->scene().pictures());
  facts->train = session->scene().train_views();
  facts->heldout = session->scene().heldout_views();
  facts->warnings = session->warnings();
  facts->load_seconds = seconds;
  facts_ = facts;
  // A restored session already has regions. No task of the worker uses it yet.
  regions_ = session->store().regions();
  colors_->Begin(session);
  Q_EMIT opened();
  Q_EMIT regionsChanged();
  Q_EMIT colors_->shChanged();
  colors_->Refresh();
}

void SceneController::Retire() {
  colors_->End();
  if (session_) {
    // The worker joins the optimizer, which may take long. An earlier task may have started it
    // again.
    worker_->Post({{},
                   [session = session_](Monitor&) {
                     session->refits().optimizer().Cancel();
                     session->refits().optimizer().Wait();
                   },
                   {}});
  }
  session_.reset();
  facts_.reset();
  regions_ = {};
  history_ = {};
  pending_.clear();
  solo_ = 0;
  QTimer::singleShot(kReleaseMs, this, [this] {
    worker_->Post({{}, [](Monitor&) { ReleaseFreedMemory(); }, {}});
  });
}

void SceneController::Close() {
  if (!IsOpen()) return;
  worker_->Cancel();
  Retire();
  Q_EMIT closed();
}

void SceneController::Cancel() { worker_->Cancel(); }

SceneController::TaskId SceneController::Run(const QString& label, Work work,
                                             std::function<void()> done) {
  return Queue(label, std::move(work), std::move(done)) ? tasks_ : 0;
}

std::shared_ptr<Monitor> SceneController::Queue(const QString& label, Work work,
                                                std::function<void()> done) {
  if (!session_) return nullptr;
  const auto outcome = std::make_shared<Outcome>();
  outcome->task = ++tasks_;
  outcome->label = label;
  outcome->session = session_;
  outcome->done = std::move(done);
  const uint64_t edits = edits_;
  return worker_->Post(
      {label,
       [outcome, work = std::move(work)](Monitor& monitor) { work(*outcome->session, monitor); },
       [this, outcome, edits](std::exception_ptr error) {
         EditHistory& history = outcome->session->store().history();
         outcome->error = error;
         outcome->state = {outcome->session->store().regions(),
                           {history.CanUndo(), history.CanRedo(), history.UndoLabel(),
                            history.RedoLabel(), history.Labels(), history.steps_done()},
                           edits};
         Post(this, [this, outcome] { TaskDone(*outcome); });
       }});
}

void SceneController::TaskDone(const Outcome& outcome) {
  if (outcome.session != session_) return;  // closed in the meantime
  Apply(outcome.state);
  if (outcome.error) {
    ReportFailure(outcome);
  } else if (outcome.done) {
    outcome.done();
  }
}

void SceneController::ReportFailure(const Outcome& outcome) {
  try {
    std::rethrow_exception(outcome.error);
  } catch (const Cancelled&) {
    Q_EMIT cancelled(outcome.label, outcome.task);
  } catch (const std::exception& failure) {
    Q_EMIT failed(outcome.label, FailureText(failure), outcome.task);
  }
}

void SceneController::Apply(const State& state) {
  pending_.erase(pending_.begin(), pending_.upper_bound(state.edits));
  RegionSet regions = state.regions;
  for (const auto& [number, edit] : pending_) retint::Apply(edit, &regions);
  const bool fits = !SameFits(regions, regions_);
  regions_ = std::move(regions);
  history_ = state.history;
  if (solo_ != 0 && !regions_.Find(solo_)) solo_ = 0;
  colors_->Refresh();
  if (fits) colors_->Compose();
  Q_EMIT regionsChanged();
}

// ---- Selection and regions

SceneController::TaskId SceneController::SelectRound(Round round,
                                                     std::function<void(RegionId)> done) {
  const auto id = std::make_shared<RegionId>(round.base);
  const SelectOptions select = round.select;
  const ProjectorOptions project = round.project;
  return Run(
      tr("Selecting"),
      [id, round = std::move(round)](EditSession& session, Monitor& monitor) {
        const Region* region = *id ? session.store().regions().Find(*id) : nullptr;
        if (*id && !region) throw InputError("the region is not there any more");
        const auto base = region ? region->selection : nullptr;
        RegionSelection selection = session.selection().SelectRound(
            base.get(), round.paint, round.select, round.project, monitor);
        // Last chance to cancel without a change.
        monitor.ThrowIfCancelled();
        if (*id) {
          session.store().SetSelection(*id, std::move(selection.masks), std::move(selection.shares),
                                       monitor, std::move(selection.source));
        } else {
          *id = session.store().Add(round.name.toStdString(), std::move(selection.masks),
                                    std::move(selection.shares), round.edit, monitor,
                                    std::move(selection.source));
        }
        ReleaseFreedMemory();  // the stages held several times what remains
      },
      [=, this, done = std::move(done)] {
        Q_EMIT selectedWith(*id, select, project);
        Q_EMIT regionAdded(*id);
        if (done) done(*id);
      });
}

void SceneController::SelectAgain(RegionId id, const SelectOptions& select,
                                  const ProjectorOptions& project) {
  if (selecting_again_) selecting_again_->Cancel();
  selecting_again_ = Queue(
      tr("Selecting again"),
      [=](EditSession& session, Monitor& monitor) {
        const Region* region = session.store().regions().Find(id);
        if (!region) throw Cancelled();  // deleted in the meantime
        SelectionSource source = region->selection->source;
        if (source.painted.empty()) {
          throw InputError("the masks of this region were not painted here");
        }
        source.select = select;
        source.projector = project;
        session.selection().Select(source, monitor);
        ProjectedMasks projected = session.selection().Project(source, monitor);
        monitor.ThrowIfCancelled();  // last chance to cancel without a change
        session.store().SetSelection(id, std::move(projected.masks), std::move(projected.shares),
                                     monitor, std::move(source));
      },
      [=, this] {
        Q_EMIT selectedWith(id, select, project);
        Q_EMIT selectedAgain(id);
      });
}

void SceneController::SeeSelection(RegionId id, const PosedCamera& camera,
                                   std::shared_ptr<const LensPicture> lens) {
  Ask(
      tr("Projecting the selection"),
      [=](EditSession& session, Monitor&) {
        const Region* region = session.store().regions().Find(id);
        if (!region) throw Cancelled();  // deleted in the meantime
        return DrawThrough(lens.get(), camera, [&](const PosedCamera& face) {
          return session.selection().SeenFrom(*region->selection, face);
        });
      },
      [=, this](Mask mask) { Q_EMIT selectionSeen(id, std::make_shared<Mask>(std::move(mask))); });
}

void SceneController::Do(const RegionEdit& edit, const std::string& merge_key) {
  if (!session_) return;
  ++edits_;
  retint::Apply(edit, &regions_);
  pending_.emplace(edits_, edit);
  Run({}, [=](EditSession& session, Monitor&) { session.store().Do(edit, merge_key); });
  colors_->Refresh();  // starts now; panels follow while it runs
  Q_EMIT regionsChanged();
}

void SceneController::Duplicate(RegionId id) {
  Ask(
      {}, [=](EditSession& session, Monitor&) { return session.store().Duplicate(id); },
      [this](RegionId copy) { Q_EMIT regionAdded(copy); });
}

void SceneController::Undo() {
  Run({}, [](EditSession& session, Monitor&) { session.store().history().Undo(); });
}

void SceneController::Redo() {
  Run({}, [](EditSession& session, Monitor&) { session.store().history().Redo(); });
}

void SceneController::GoToStep(size_t done) {
  Run({}, [done](EditSession& session, Monitor&) {
    while (session.store().history().steps_done() > done && session.store().history().Undo()) {
    }
    while (session.store().history().steps_done() < done && session.store().history().Redo()) {
    }
  });
}

void SceneController::SetSolo(RegionId id) {
  if (solo_ == id) return;
  solo_ = id;
  Q_EMIT regionsChanged();
  colors_->Refresh();
}

}  // namespace retint
