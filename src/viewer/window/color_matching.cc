// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/color_matching.h"

#include "reporting/match_report.h"
#include "viewer/canvas/canvas.h"
#include "viewer/window/dialogs.h"

namespace retint {

ColorMatching::ColorMatching(const WindowParts& parts, PhotoLoader* photos, QWidget* window)
    : QObject(window), window_(window), parts_(parts), photos_(photos) {
  connect(parts_.controller, &SceneController::closed, this, [this] {
    delete dialog_;
    comparison_ = 0;
  });
}

void ColorMatching::Start() {
  if (!parts_.controller->IsOpen()) return;
  if (!dialog_) {
    dialog_ = new MatchDialog(parts_.controller->facts(), photos_, window_);
    connect(dialog_, &QDialog::accepted, this, [this] { MatchTo(dialog_->recipe()); });
  }
  const UserPicture* shown = parts_.canvas->picture();
  dialog_->Propose(shown ? shown->name : std::string());
  dialog_->open();
}

void ColorMatching::MatchTo(const MatchRecipe& recipe) {
  const auto compare = [recipe](EditSession& session, Monitor& monitor) {
    session.refits().CollectFits();
    return MatchByRecipe(session, recipe, monitor);
  };
  comparison_ = parts_.controller->Ask(tr("Comparing colors"), compare,
                                       [this](const SceneMatch& match) { Show(match); });
}

void ColorMatching::Show(const SceneMatch& match) {
  QString text;
  for (const std::string& line : LinesOf(match)) text += QString::fromStdString(line) + "\n";
  if (!match.warning.empty()) text += QString::fromStdString(match.warning) + "\n";
  if (match.colors.map == MatchMap::kNone) {
    const QString title = tr("The colors stay as they are");
    auto* box =
        new QMessageBox(QMessageBox::Information, title, title, QMessageBox::Close, window_);
    box->setInformativeText(text);
    return parts_.dialogs->Show(box);
  }
  const auto add = [colors = match.colors](EditSession& session, Monitor& monitor) {
    return ApplyMatch(session, colors, "match", monitor);
  };
  parts_.dialogs->Ask(tr("Match the colors?"), text, tr("&Match"), [this, add] {
    parts_.controller->Ask(tr("Matching colors"), add, [this](RegionId id) { Q_EMIT matched(id); });
  });
}

bool ColorMatching::Explain(quint64 task, const QString& message) {
  if (task == 0 || task != comparison_ || !dialog_) return false;
  dialog_->open();
  parts_.dialogs->SetFront(dialog_);
  parts_.dialogs->ShowError(tr("The colors could not be compared"), MatchDialog::Spelled(message));
  return true;
}

}  // namespace retint
