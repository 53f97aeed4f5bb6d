// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/paint_verdict.h"

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

#include <QDialog>
#include <QDialogButtonBox>
#include <QLabel>
#include <QPixmap>
#include <QScrollArea>
#include <QVBoxLayout>

#include "selecting/paint_held.h"
#include "selecting/paint_picture.h"
#include "viewer/canvas/render_thread.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/widgets/banner.h"

namespace retint {
namespace {

constexpr int kLeastSide = 480, kMostSide = 900;  // pixels of an enlarged picture

QString Sentence(const std::string& words) {
  QString text = QString::fromStdString(words);
  if (!text.isEmpty()) text[0] = text[0].toUpper();
  return text + ".";
}

}  // namespace

struct PaintVerdict::Pictures {
  std::vector<PaintedPicture> views;
};

PaintVerdict::PaintVerdict(SceneController* controller, Banner* banner, QWidget* window)
    : QObject(window), controller_(controller), banner_(banner), window_(window) {
  connect(controller_, &SceneController::regionsChanged, this, &PaintVerdict::Look);
  connect(controller_, &SceneController::closed, this, [this] { region_ = 0; });
}

void PaintVerdict::Show(RegionId id) {
  const Region* region = controller_->regions().Find(id);
  if (!region || !region->selection || region->selection->source.painted.empty()) return;
  if (banner_->Asks()) return;  // a line that needs an answer stays
  const RegionSelection& selection = *region->selection;
  const Workspace& workspace = *controller_->facts()->workspace;
  const auto warnings = WarningsOfPaint(workspace, selection.source.painted, selection.masks);
  warns_ = !warnings.empty();
  text_ = Sentence(warns_ ? warnings.back()
                          : VerdictOfPaint(workspace, selection.source.painted, selection.masks));
  region_ = id;
  selection_ = region->selection;
  was_plain_ = ChangesNothing(region->edit);
  Say(nullptr);
  const auto pictures = std::make_shared<Pictures>();
  controller_->Run(
      {},
      [of = selection_, pictures](EditSession& session, Monitor&) {
        try {
          pictures->views = PicturesOfPaint(session.scene(), of->source.painted, of->masks);
        } catch (const std::exception&) {
          // The line of text is shown without pictures.
        }
      },
      [this, of = selection_, pictures] {
        const bool still = region_ != 0 && selection_ == of && banner_->text() == text_;
        if (still && !pictures->views.empty()) Say(pictures);
      });
}

void PaintVerdict::Say(const std::shared_ptr<const Pictures>& pictures) {
  Banner::Message message;
  message.text = text_;
  if (warns_) {
    message.answers = {{tr("Paint more"), tr("Paint on the view that shows, as another round"),
                        [this, id = region_] { Q_EMIT paintWanted(id); }},
                       {tr("Keep it")}};
  }
  if (pictures) {
    message.picture = ToQImage(pictures->views.back().picture);
    message.open = [this, pictures] { Open(*pictures); };
  }
  banner_->Show(std::move(message));
}

void PaintVerdict::Open(const Pictures& pictures) {
  auto* dialog = new QDialog(window_);
  dialog->setObjectName("paint_pictures");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowTitle(tr("Your paint and what is selected"));
  auto* inner = new QWidget;
  auto* rows = new QVBoxLayout(inner);
  for (const PaintedPicture& view : pictures.views) {
    QPixmap pixmap = QPixmap::fromImage(ToQImage(view.picture));
    const int side = std::clamp(std::max(pixmap.width(), pixmap.height()), kLeastSide, kMostSide);
    pixmap = pixmap.scaled(side, side, Qt::KeepAspectRatio, Qt::SmoothTransformation);
    auto* picture = new QLabel;
    picture->setPixmap(pixmap);
    rows->addWidget(picture);
    rows->addWidget(new QLabel(QString::fromStdString(view.view) + ": " +
                               QString::fromStdString(view.counts.Words())));
  }
  rows->addStretch();
  auto* area = new QScrollArea;
  area->setWidget(inner);
  auto* legend =
      new QLabel(tr("Green: your paint that is selected. Yellow: selected beside it. "
                    "Red: your paint that is left out."));
  legend->setWordWrap(true);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close);
  connect(buttons, &QDialogButtonBox::rejected, dialog, &QDialog::reject);
  auto* layout = new QVBoxLayout(dialog);
  layout->addWidget(legend);
  layout->addWidget(area, 1);
  layout->addWidget(buttons);
  const QSize around(60, 140);  // margins, scroll bars, the rows above and below
  dialog->resize((inner->sizeHint() + around).boundedTo(window_->size()));
  dialog->show();
}

void PaintVerdict::Look() {
  if (region_ == 0) return;
  const Region* region = controller_->regions().Find(region_);
  const bool same =
      region && region->selection == selection_ && (!was_plain_ || ChangesNothing(region->edit));
  if (same) return;
  region_ = 0;
  if (banner_->text() == text_) banner_->Close();
}

}  // namespace retint
