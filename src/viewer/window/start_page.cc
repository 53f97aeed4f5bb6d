// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/start_page.h"

#include <algorithm>

#include <QAction>
#include <QGridLayout>
#include <QLocale>
#include <QPainter>
#include <QPainterPath>
#include <QPushButton>
#include <QVBoxLayout>

#include "viewer/window/recent_files.h"

namespace retint {
namespace {

constexpr int kWidest = 960, kGap = 16, kRound = 8;
constexpr QSize kCard(224, 184), kPicture(224, 126);
constexpr qsizetype kMostCards = 8;

// A picture with a name and a date; the tool tip has the paths.
class Card : public QPushButton {
 public:
  explicit Card(const QString& entry)
      : picture_(QPixmap::fromImage(RecentPicture(entry))), time_(RecentTime(entry)) {
    setText(RecentName(entry));
    setToolTip(RecentTitle(entry));
    setFixedSize(kCard);
    setCursor(Qt::PointingHandCursor);
    setAttribute(Qt::WA_Hover);
  }

 protected:
  void paintEvent(QPaintEvent*) override {
    QPainter painter(this);
    painter.setRenderHint(QPainter::Antialiasing);
    painter.setRenderHint(QPainter::SmoothPixmapTransform);
    QPainterPath shape;
    shape.addRoundedRect(QRectF(rect()).adjusted(1, 1, -1, -1), kRound, kRound);
    painter.fillPath(shape, palette().color(QPalette::Base));
    painter.save();
    painter.setClipPath(shape);
    const QRect picture(QPoint(0, 0), kPicture);
    painter.fillRect(picture, palette().color(QPalette::AlternateBase));
    if (!picture_.isNull()) painter.drawPixmap(picture, picture_);
    painter.restore();
    const bool marked = underMouse() || hasFocus();
    painter.setPen(
        QPen(palette().color(marked ? QPalette::Highlight : QPalette::Mid), marked ? 2 : 1));
    painter.drawPath(shape);
    const QRect line(12, kPicture.height() + 8, width() - 24, fontMetrics().height());
    painter.setPen(palette().color(QPalette::Text));
    painter.drawText(line, Qt::AlignLeft | Qt::AlignVCenter,
                     fontMetrics().elidedText(text(), Qt::ElideMiddle, line.width()));
    painter.setPen(palette().color(QPalette::PlaceholderText));
    painter.drawText(line.translated(0, fontMetrics().height() + 2),
                     Qt::AlignLeft | Qt::AlignVCenter,
                     QLocale().toString(time_.date(), QLocale::ShortFormat));
  }

 private:
  const QPixmap picture_;
  const QDateTime time_;
};

// Says where to drop files, and opens the form on a click.
class DropTarget : public QPushButton {
 public:
  DropTarget() {
    setText(tr("Open a scene…"));
    setCursor(Qt::PointingHandCursor);
    setAttribute(Qt::WA_Hover);
    setFixedHeight(96);
  }

 protected:
  void paintEvent(QPaintEvent*) override {
    QPainter painter(this);
    painter.setRenderHint(QPainter::Antialiasing);
    const bool marked = underMouse() || hasFocus();
    painter.setPen(
        QPen(palette().color(marked ? QPalette::Highlight : QPalette::Mid), 1.5, Qt::DashLine));
    painter.drawRoundedRect(QRectF(rect()).adjusted(1, 1, -1, -1), kRound, kRound);
    const int line = fontMetrics().height();
    const QRect upper(0, height() / 2 - line - 2, width(), line);
    painter.setPen(palette().color(QPalette::WindowText));
    painter.drawText(upper, Qt::AlignCenter, text());
    painter.setPen(palette().color(QPalette::PlaceholderText));
    painter.drawText(upper.translated(0, line + 4), Qt::AlignCenter,
                     tr("or drop a splat, a COLMAP folder or a session here"));
  }
};

}  // namespace

StartPage::StartPage() {
  setFrameShape(QFrame::NoFrame);
  setWidgetResizable(true);
  title_ = new QLabel;
  title_->setObjectName("welcome_title");
  title_->setWordWrap(true);
  auto* sample = new QPushButton(tr("Try the sample"));
  sample->setObjectName("welcome_sample");
  sample->setProperty("primary", true);
  sample->setCursor(Qt::PointingHandCursor);
  sample->setFixedHeight(40);
  sample->setMinimumWidth(160);
  sample->setToolTip(tr("A small artificial scene to practice on"));
  auto* open = new DropTarget;
  open->setObjectName("welcome_open");
  open->setToolTip(tr("A COLMAP workspace and its splat (Ctrl+O)"));
  choices_ = new QWidget;
  auto* choices = new QVBoxLayout(choices_);
  choices->setContentsMargins(0, 0, 0, 0);
  choices->setSpacing(kGap);
  choices->addWidget(sample, 0, Qt::AlignLeft);
  choices->addWidget(open);
  recent_ = new QWidget;
  recent_->setObjectName("welcome_recent");
  auto* recent = new QVBoxLayout(recent_);
  recent->setContentsMargins(0, kGap, 0, 0);
  auto* heading = new QLabel(tr("<b>Open again</b>"));
  recent->addWidget(heading);
  cards_ = new QGridLayout;
  cards_->setSpacing(kGap);
  recent->addLayout(cards_);
  auto* column = new QWidget;
  column->setMaximumWidth(kWidest);
  auto* lines = new QVBoxLayout(column);
  lines->setContentsMargins(24, 24, 24, 24);
  lines->setSpacing(kGap);
  lines->addStretch(1);
  lines->addWidget(title_);
  lines->addWidget(choices_);
  lines->addWidget(recent_);
  lines->addStretch(2);
  auto* inner = new QWidget;
  auto* middle = new QHBoxLayout(inner);
  middle->setContentsMargins(0, 0, 0, 0);
  middle->addStretch();
  middle->addWidget(column, 100);
  middle->addStretch();
  setWidget(inner);
  connect(sample, &QPushButton::clicked, this, &StartPage::sampleRequested);
  connect(open, &QPushButton::clicked, this, &StartPage::openRequested);
  SetTask({});
}

void StartPage::SetTask(const QString& task) {
  title_->setText(task.isEmpty()
                      ? tr("<h1>Retint</h1>Paint an object on one photo, choose a color, and "
                           "every view of the scene follows.")
                      : "<h1>" + task.toHtmlEscaped() + "…</h1>");
  choices_->setEnabled(task.isEmpty());
  recent_->setEnabled(task.isEmpty());
}

void StartPage::Show(const QStringList& recent) {
  while (QLayoutItem* item = cards_->takeAt(0)) {
    item->widget()->hide();
    item->widget()->deleteLater();  // it may be the pressed one
    delete item;
  }
  for (const QString& entry : recent.mid(0, kMostCards)) {
    auto* card = new Card(entry);
    connect(card, &QPushButton::clicked, this, [this, entry] { Q_EMIT recentRequested(entry); });
    auto* forget = new QAction(tr("Take off this list"), card);
    connect(forget, &QAction::triggered, this, [this, entry] { Q_EMIT forgetRequested(entry); });
    card->addAction(forget);
    card->setContextMenuPolicy(Qt::ActionsContextMenu);
    cards_->addWidget(card, 0, cards_->count());
  }
  recent_->setVisible(!recent.isEmpty());
  Arrange();
}

// As many cards in a row as fit.
void StartPage::Arrange() {
  const int room = std::min(viewport()->width(), kWidest) - 48 + kGap;
  const int columns = std::max(1, room / (kCard.width() + kGap));
  std::vector<QWidget*> cards;
  while (QLayoutItem* item = cards_->takeAt(0)) {
    cards.push_back(item->widget());
    delete item;
  }
  for (size_t i = 0; i < cards.size(); ++i) {
    cards_->addWidget(cards[i], int(i) / columns, int(i) % columns, Qt::AlignLeft | Qt::AlignTop);
  }
  cards_->setColumnStretch(columns, 1);
}

void StartPage::resizeEvent(QResizeEvent* event) {
  QScrollArea::resizeEvent(event);
  Arrange();
}

}  // namespace retint
