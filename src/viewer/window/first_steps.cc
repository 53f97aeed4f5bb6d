// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/first_steps.h"

#include <algorithm>

#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QSettings>
#include <QTimer>
#include <QToolButton>
#include <QVBoxLayout>

namespace retint {
namespace {

constexpr char kSetting[] = "first_steps_done";
constexpr int kMargin = 12, kBelowLabel = 48;  // the canvas names its view in the corner
constexpr int kLookMs = 4000;                  // time to see the last tick

QString TextOf(int step) {
  switch (step) {
    case FirstSteps::kOpen:
      return FirstSteps::tr("Open a scene");
    case FirstSteps::kPaint:
      return FirstSteps::tr("Press B and brush over an object");
    case FirstSteps::kAccept:
      return FirstSteps::tr("Accept with Enter");
    case FirstSteps::kColor:
      return FirstSteps::tr("Choose a color");
    default:
      return FirstSteps::tr("Export the splat, or save");
  }
}

}  // namespace

FirstSteps::FirstSteps(QWidget* parent) : QFrame(parent) {
  setObjectName("first_steps");
  setFrameShape(QFrame::StyledPanel);
  setAutoFillBackground(true);
  setAttribute(Qt::WA_NoMousePropagation);
  setCursor(Qt::ArrowCursor);
  auto* close = new QToolButton;
  close->setObjectName("first_steps_close");
  close->setAutoRaise(true);
  close->setFocusPolicy(Qt::NoFocus);
  close->setText(QStringLiteral("✕"));
  close->setToolTip(tr("Close for good"));
  close->setAccessibleName(close->toolTip());
  auto* head = new QHBoxLayout;
  head->addWidget(new QLabel(tr("<b>A first recolor</b>")), 1);
  head->addWidget(close);
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(12, 8, 8, 12);
  column->setSpacing(4);
  column->addLayout(head);
  for (QLabel*& line : lines_) {
    line = new QLabel;
    column->addWidget(line);
  }
  connect(close, &QToolButton::clicked, this, &FirstSteps::Finish);
  Describe();
  hide();
}

bool FirstSteps::IsWanted() { return !QSettings().value(kSetting).toBool(); }

void FirstSteps::SetDone(Step step) {
  if (done_[step]) return;
  done_[step] = true;
  Describe();
  if (std::ranges::find(done_, false) == done_.end()) {
    QTimer::singleShot(kLookMs, this, &FirstSteps::Finish);
  }
}

void FirstSteps::Finish() {
  QSettings().setValue(kSetting, true);
  deleteLater();
}

// The next step is bold.
void FirstSteps::Describe() {
  const size_t next = size_t(std::ranges::find(done_, false) - done_.begin());
  for (size_t i = 0; i < lines_.size(); ++i) {
    const QString text =
        (done_[i] ? QStringLiteral("✓  ") : QStringLiteral("○  ")) + TextOf(int(i));
    lines_[i]->setText(i == next ? "<b>" + text + "</b>" : text);
    lines_[i]->setEnabled(!done_[i]);
  }
  Place();
}

void FirstSteps::ShowOver(QWidget* area) {
  if (area_ != area) {
    if (area_) area_->removeEventFilter(this);
    if (area) area->installEventFilter(this);
    area_ = area;
  }
  setVisible(area != nullptr);
  Place();
}

void FirstSteps::Place() {
  if (!area_) return;
  adjustSize();
  const QPoint corner = area_->mapTo(parentWidget(), area_->rect().topLeft());
  move(corner + QPoint(kMargin, kBelowLabel));
  raise();
}

bool FirstSteps::eventFilter(QObject* object, QEvent* event) {
  if (event->type() == QEvent::Resize || event->type() == QEvent::Move) Place();
  return QFrame::eventFilter(object, event);
}

}  // namespace retint
