// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/canvas/uncertainty.h"

#include "opening/photo_paint.h"

namespace retint {
namespace {

constexpr int kSuggested = 5;  // number of views that each assume the ones before to be painted

}  // namespace

Uncertainty::Uncertainty(SceneController* controller, CurrentRegion* current, QObject* parent)
    : QObject(parent), controller_(controller), current_(current) {
  connect(current_, &CurrentRegion::changed, this, &Uncertainty::Follow);
  connect(controller_, &SceneController::regionsChanged, this, &Uncertainty::Follow);
  // Selections of two scenes may have the same id.
  for (const auto another : {&SceneController::opened, &SceneController::closed}) {
    connect(controller_, another, this, [this] {
      found_.reset();
      selection_ = asked_ = 0;
      Q_EMIT changed();
    });
  }
  const auto stopped = [this](quint64 task) {
    if (task == task_) asked_ = 0;
  };
  connect(controller_, &SceneController::failed, this,
          [=](const QString&, const QString&, quint64 task) { stopped(task); });
  connect(controller_, &SceneController::cancelled, this,
          [=](const QString&, quint64 task) { stopped(task); });
}

std::shared_ptr<const Uncertainty::Found> Uncertainty::found() const {
  return found_ && found_->selection == selection_ ? found_ : nullptr;
}

void Uncertainty::Follow() {
  const Region* region = current_->region();
  const uint64_t now = region ? region->selection->id : 0;
  if (now == selection_) return;
  selection_ = now;
  asked_ = 0;
  Q_EMIT changed();
}

void Uncertainty::Find() {
  if (found() || (asked_ != 0 && asked_ == selection_)) return;
  const Region* region = current_->region();
  if (!region) return Q_EMIT refused(tr("Choose a region first: what is uncertain is its own"));
  const auto selection = region->selection;
  if (selection->source.painted.empty()) {
    return Q_EMIT refused(tr("The masks of this region were not painted here"));
  }
  if (!selection->source.projector.Completes()) {
    return Q_EMIT refused(
        tr("Nothing is uncertain: only what you painted is selected. Choose \"The whole object\" "
           "and select again to take in sides that you did not see"));
  }
  asked_ = selection->id;
  task_ = controller_->Ask(
      tr("Finding what is uncertain"),
      [=](EditSession& session, Monitor& monitor) {
        const SelectionSource& source = selection->source;
        ProjectedMasks projected = session.selection().Project(source, monitor);
        std::vector<std::string> painted;
        for (const PaintedView& one : source.painted) {
          for (std::string& name : PaintedNames(session.scene().workspace(), one)) {
            painted.push_back(std::move(name));
          }
        }
        Found found;
        found.selection = selection->id;
        found.views = SuggestViews(session.scene().renderer(), session.scene().reconstruction(),
                                   session.scene().pictures().Groups(), painted,
                                   projected.confidence, projected.visible, kSuggested, monitor);
        for (float& one : projected.confidence) one = 1 - one;
        found.undecided =
            std::make_shared<const std::vector<float>>(std::move(projected.confidence));
        return found;
      },
      [this](Found found) {
        if (asked_ == found.selection) asked_ = 0;
        if (found.selection != selection_) return;  // the selection has changed
        found_ = std::make_shared<const Found>(std::move(found));
        Q_EMIT changed();
      });
}

}  // namespace retint
