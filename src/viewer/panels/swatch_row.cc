// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/swatch_row.h"

#include <algorithm>

#include <QKeyEvent>
#include <QLabel>
#include <QMouseEvent>
#include <QPainter>
#include <QSettings>
#include <QToolButton>

#include "viewer/widgets/wrap_layout.h"

namespace retint {
namespace {

constexpr int kSide = 16;  // of a color, pixels

QIcon Filled(const QColor& color, const QPalette& palette) {
  QPixmap picture(kSide, kSide);
  picture.fill(color);
  QPainter painter(&picture);
  painter.setPen(palette.color(QPalette::Text));
  painter.drawRect(0, 0, kSide - 1, kSide - 1);
  return QIcon(picture);
}

}  // namespace

SwatchRow::SwatchRow(const QString& title, const QString& key, Form form, QWidget* parent)
    : QWidget(parent), key_(key), form_(form) {
  auto* layout = new WrapLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(1);
  title_ = new QLabel(title + " ");
  layout->addWidget(title_);
  QSizePolicy policy(QSizePolicy::Preferred, QSizePolicy::Minimum);
  policy.setHeightForWidth(true);
  setSizePolicy(policy);
  for (const QString& name : QSettings().value(key_).toStringList()) {
    const QColor color = QColor::fromString(name);
    if (color.isValid()) colors_.push_back(color);
  }
  Build();
  // One line high even if it is empty, so that nothing below moves.
  setMinimumHeight(cells_.front()->sizeHint().height());
  Show();
}

QToolButton* SwatchRow::AddButton() {
  auto* button = new QToolButton;
  button->setAutoRaise(true);
  button->setIconSize({kSide, kSide});
  button->setFocusPolicy(Qt::StrongFocus);
  layout()->addWidget(button);
  return button;
}

// Makes all buttons at once. A later button would be the last in the Tab order, and a removed one
// would take the focus along.
void SwatchRow::Build() {
  const bool kept = form_ == Form::kKept;
  const size_t most = kept ? kMostKept : kMostRecent;
  for (size_t i = 0; i < most; ++i) {
    QToolButton* button = AddButton();
    button->setAccessibleName(title_->text().trimmed());
    connect(button, &QToolButton::clicked, this, [this, i] { Q_EMIT chosen(QColor(colors_[i])); });
    if (kept) button->installEventFilter(this);
    cells_.push_back(button);
  }
  if (!kept) return;
  plus_ = AddButton();
  plus_->setAccessibleName(tr("Keep this color"));
  plus_->setToolTip(tr("Keep the color that is chosen"));
  plus_->setObjectName("swatch_add");
  plus_->setText(QStringLiteral("+"));
  connect(plus_, &QToolButton::clicked, this, &SwatchRow::addWanted);
}

void SwatchRow::Show() {
  const bool kept = form_ == Form::kKept;
  for (size_t i = 0; i < cells_.size(); ++i) {
    cells_[i]->setVisible(i < colors_.size());
    if (i >= colors_.size()) continue;
    const QString name = colors_[i].name();
    cells_[i]->setIcon(Filled(colors_[i], palette()));
    cells_[i]->setAccessibleName(name);
    cells_[i]->setToolTip(kept ? tr("%1 (Del or a right click takes it away)").arg(name) : name);
  }
  if (plus_) plus_->setEnabled(colors_.size() < kMostKept);
  updateGeometry();
}

void SwatchRow::Add(const QColor& color) {
  std::erase(colors_, color);
  if (form_ == Form::kRecent) {
    colors_.insert(colors_.begin(), color);
    if (colors_.size() > kMostRecent) colors_.resize(kMostRecent);
  } else if (colors_.size() < kMostKept) {
    colors_.push_back(color);
  }
  Save();
  Show();
}

void SwatchRow::Remove(size_t index) {
  colors_.erase(colors_.begin() + std::ptrdiff_t(index));
  Save();
  Show();
}

void SwatchRow::Save() const {
  QStringList names;
  for (const QColor& color : colors_) names << color.name();
  QSettings().setValue(key_, names);
}

void SwatchRow::changeEvent(QEvent* event) {
  if (event->type() == QEvent::PaletteChange) Show();  // the frame has the theme's colors
  QWidget::changeEvent(event);
}

bool SwatchRow::eventFilter(QObject* object, QEvent* event) {
  const auto cell = std::find(cells_.begin(), cells_.end(), object);
  const auto index = size_t(cell - cells_.begin());
  if (index >= colors_.size()) return false;
  const bool deleted =
      event->type() == QEvent::KeyPress && static_cast<QKeyEvent*>(event)->key() == Qt::Key_Delete;
  const bool clicked = event->type() == QEvent::MouseButtonPress &&
                       static_cast<QMouseEvent*>(event)->button() == Qt::RightButton;
  if (!deleted && !clicked) return false;
  Remove(index);
  return true;
}

}  // namespace retint
