// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/swatch_row.h"

#include <algorithm>

#include <QKeyEvent>
#include <QLabel>
#include <QMouseEvent>
#include <QPainter>
#include <QSettings>
#include <QToolButton>

#include "viewer/window/wrap_layout.h"

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
}

void SwatchRow::Build() {
  for (QWidget* cell : cells_) {
    cell->hide();
    cell->deleteLater();
  }
  cells_.clear();
  const auto add = [&](const QString& name, const QString& tip) {
    auto* button = new QToolButton;
    button->setAutoRaise(true);
    button->setIconSize({kSide, kSide});
    button->setFocusPolicy(Qt::StrongFocus);
    button->setAccessibleName(name);
    button->setToolTip(tip);
    layout()->addWidget(button);
    cells_.push_back(button);
    return button;
  };
  for (const QColor& color : colors_) {
    const bool kept = form_ == Form::kKept;
    QToolButton* button =
        add(color.name(),
            kept ? tr("%1 (Del or a right click takes it away)").arg(color.name()) : color.name());
    button->setIcon(Filled(color, palette()));
    connect(button, &QToolButton::clicked, this, [this, color] { Q_EMIT chosen(color); });
    if (kept) button->installEventFilter(this);
  }
  if (form_ == Form::kKept) {
    QToolButton* plus = add(tr("Keep this color"), tr("Keep the color that is chosen"));
    plus->setObjectName("swatch_add");
    plus->setText(QStringLiteral("+"));
    plus->setEnabled(colors_.size() < kMostKept);
    connect(plus, &QToolButton::clicked, this, &SwatchRow::addWanted);
  }
  setVisible(!cells_.empty());
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
  Build();
}

void SwatchRow::Remove(size_t index) {
  colors_.erase(colors_.begin() + std::ptrdiff_t(index));
  Save();
  Build();
}

void SwatchRow::Save() const {
  QStringList names;
  for (const QColor& color : colors_) names << color.name();
  QSettings().setValue(key_, names);
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
