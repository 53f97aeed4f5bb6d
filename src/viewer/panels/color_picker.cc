// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/color_picker.h"

#include <algorithm>
#include <cmath>

#include <QGridLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QMouseEvent>
#include <QPainter>
#include <QSignalBlocker>
#include <QSpinBox>

namespace retint {
namespace {

constexpr double kStep = 0.01, kFarStep = 0.1;  // of the keyboard
constexpr double kLastHue = 0.9999;             // 1 would be the first one again

double Clamped(double value) { return std::clamp(value, 0.0, 1.0); }

void PaintFocus(QWidget& widget, QPainter& painter) {
  painter.setRenderHint(QPainter::Antialiasing, false);
  painter.setBrush(Qt::NoBrush);
  const bool focus = widget.hasFocus();
  painter.setPen(
      QPen(widget.palette().color(focus ? QPalette::Highlight : QPalette::Mid), focus ? 2 : 1));
  painter.drawRect(widget.rect().adjusted(0, 0, -1, -1));
}

// Black and white, so that it is seen on any color.
void PaintMark(QPainter& painter, const QWidget& widget, QPointF at, double radius) {
  // Whole at the border too.
  const double margin = radius + 2;
  at.setX(std::clamp(at.x(), margin, std::max(margin, widget.width() - 1 - margin)));
  at.setY(std::clamp(at.y(), margin, std::max(margin, widget.height() - 1 - margin)));
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setBrush(Qt::NoBrush);
  painter.setPen(QPen(Qt::black, 3));
  painter.drawEllipse(at, radius, radius);
  painter.setPen(QPen(Qt::white, 1.5));
  painter.drawEllipse(at, radius, radius);
}

}  // namespace

// --- ColorSquare ---------------------------------------------------------------------------------

ColorSquare::ColorSquare(QWidget* parent) : QWidget(parent) {
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setCursor(Qt::CrossCursor);
  setAccessibleName(tr("Saturation and value"));
  setToolTip(tr("Saturation to the right, value upwards (arrows; Shift: further)"));
}

void ColorSquare::SetHue(double hue) {
  hue_ = std::clamp(hue, 0.0, kLastHue);
  update();
}

void ColorSquare::SetValues(double saturation, double value) {
  saturation_ = Clamped(saturation);
  value_ = Clamped(value);
  update();
}

void ColorSquare::paintEvent(QPaintEvent*) {
  constexpr int kCells = 64;  // enough: the painter interpolates
  if (picture_hue_ != hue_) {
    picture_ = QImage(kCells, kCells, QImage::Format_RGB32);
    for (int y = 0; y < kCells; ++y) {
      for (int x = 0; x < kCells; ++x) {
        const double s = x / (kCells - 1.0), v = 1 - y / (kCells - 1.0);
        picture_.setPixel(x, y, QColor::fromHsvF(float(hue_), float(s), float(v)).rgb());
      }
    }
    picture_hue_ = hue_;
  }
  QPainter painter(this);
  painter.setRenderHint(QPainter::SmoothPixmapTransform);
  painter.drawImage(rect(), picture_);
  PaintFocus(*this, painter);
  PaintMark(painter, *this, {saturation_ * (width() - 1), (1 - value_) * (height() - 1)}, 5);
}

void ColorSquare::TakeMouse(const QPointF& at) {
  SetValues(at.x() / std::max(1, width() - 1), 1 - at.y() / std::max(1, height() - 1));
  Q_EMIT dragged();
}

void ColorSquare::mousePressEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) TakeMouse(event->position());
}

void ColorSquare::mouseMoveEvent(QMouseEvent* event) {
  if (event->buttons() & Qt::LeftButton) TakeMouse(event->position());
}

void ColorSquare::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) Q_EMIT released();
}

void ColorSquare::keyPressEvent(QKeyEvent* event) {
  const double step = event->modifiers() & Qt::ShiftModifier ? kFarStep : kStep;
  double s = saturation_, v = value_;
  switch (event->key()) {
    case Qt::Key_Left:
      s -= step;
      break;
    case Qt::Key_Right:
      s += step;
      break;
    case Qt::Key_Up:
      v += step;
      break;
    case Qt::Key_Down:
      v -= step;
      break;
    default:
      return QWidget::keyPressEvent(event);
  }
  SetValues(s, v);
  Q_EMIT released();
}

// --- HueStrip ------------------------------------------------------------------------------------

HueStrip::HueStrip(QWidget* parent) : QWidget(parent) {
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setAccessibleName(tr("Hue"));
  setToolTip(tr("Hue (left, right; Shift: further)"));
}

void HueStrip::SetHue(double hue) {
  hue_ = std::clamp(hue, 0.0, kLastHue);
  update();
}

void HueStrip::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  QLinearGradient hues(0, 0, width(), 0);
  constexpr int kStops = 12;
  for (int i = 0; i <= kStops; ++i) {
    const double at = double(i) / kStops;
    hues.setColorAt(at, QColor::fromHsvF(float(std::min(at, kLastHue)), 1, 1));
  }
  painter.fillRect(rect(), hues);
  PaintFocus(*this, painter);
  PaintMark(painter, *this, {hue_ * (width() - 1), (height() - 1) / 2.0}, 5);
}

void HueStrip::TakeMouse(const QPointF& at) {
  SetHue(at.x() / std::max(1, width() - 1));
  Q_EMIT dragged();
}

void HueStrip::mousePressEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) TakeMouse(event->position());
}

void HueStrip::mouseMoveEvent(QMouseEvent* event) {
  if (event->buttons() & Qt::LeftButton) TakeMouse(event->position());
}

void HueStrip::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) Q_EMIT released();
}

void HueStrip::keyPressEvent(QKeyEvent* event) {
  const double step = event->modifiers() & Qt::ShiftModifier ? kFarStep : kStep;
  if (event->key() != Qt::Key_Left && event->key() != Qt::Key_Right) {
    return QWidget::keyPressEvent(event);
  }
  SetHue(hue_ + (event->key() == Qt::Key_Left ? -step : step));
  Q_EMIT released();
}

// --- ColorPicker ---------------------------------------------------------------------------------

ColorPicker::ColorPicker(QWidget* parent) : QWidget(parent), color_(Qt::white) {
  square_ = new ColorSquare;
  square_->setObjectName("color_square");
  hues_ = new HueStrip;
  hues_->setObjectName("hue_strip");
  auto* layout = new QGridLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(square_, 0, 0, 1, 4);
  layout->addWidget(hues_, 1, 0, 1, 4);
  const QString names[3] = {tr("Red"), tr("Green"), tr("Blue")};
  for (int c = 0; c < 3; ++c) {
    channels_[c] = new QSpinBox;
    channels_[c]->setObjectName(QStringLiteral("channel%1").arg(c));
    channels_[c]->setRange(0, 255);
    channels_[c]->setPrefix(names[c].left(1) + " ");
    channels_[c]->setAccessibleName(names[c]);
    channels_[c]->setToolTip(tr("%1, 0 to 255").arg(names[c]));
    channels_[c]->setKeyboardTracking(false);
    layout->addWidget(channels_[c], 2, c);
    connect(channels_[c], &QSpinBox::valueChanged, this, &ColorPicker::FromNumbers);
  }
  text_ = new QLineEdit;
  text_->setObjectName("color_text");
  text_->setAccessibleName(tr("Color as #rrggbb or by name"));
  text_->setToolTip(tr("The color as #rrggbb, or by its name: white, tomato, steelblue"));
  text_->setMinimumWidth(text_->fontMetrics().horizontalAdvance("#dddddd") + 16);
  layout->addWidget(text_, 2, 3);
  connect(text_, &QLineEdit::editingFinished, this, &ColorPicker::FromText);
  connect(square_, &ColorSquare::dragged, this, [this] { FromSquare(true); });
  connect(square_, &ColorSquare::released, this, [this] { FromSquare(false); });
  connect(hues_, &HueStrip::dragged, this, [this] { FromSquare(true); });
  connect(hues_, &HueStrip::released, this, [this] { FromSquare(false); });
  SetColor(color_);
}

void ColorPicker::SetColor(const QColor& color) {
  if (dragging_) return;  // the mouse knows better
  if (color.rgb() != color_.rgb() || !color_.isValid()) {
    color_ = QColor(color.rgb());
    const double hue = color.hsvHueF();
    if (hue >= 0) hues_->SetHue(hue);
    square_->SetHue(hues_->hue());
    const double saturation = color.value() == 0 ? square_->saturation() : color.hsvSaturationF();
    square_->SetValues(saturation, color.valueF());
  }
  ShowNumbers();
}

void ColorPicker::ShowNumbers() {
  const int values[3] = {color_.red(), color_.green(), color_.blue()};
  for (int c = 0; c < 3; ++c) {
    const QSignalBlocker quiet(channels_[c]);
    channels_[c]->setValue(values[c]);
  }
  if (!text_->hasFocus() || !text_->isModified()) text_->setText(color_.name());
}

void ColorPicker::FromSquare(bool dragging) {
  dragging_ = dragging;
  square_->SetHue(hues_->hue());
  color_ =
      QColor::fromHsvF(float(hues_->hue()), float(square_->saturation()), float(square_->value()))
          .toRgb();
  ShowNumbers();
  Q_EMIT changed(color_, dragging);
}

void ColorPicker::FromNumbers() {
  SetColor(QColor(channels_[0]->value(), channels_[1]->value(), channels_[2]->value()));
  Q_EMIT changed(color_, false);
}

void ColorPicker::FromText() {
  if (!text_->isModified()) return;
  text_->setModified(false);
  const QString text = text_->text().remove(' ');
  const QColor named = QColor::fromString(text);
  const QColor color =
      named.isValid() && named.alpha() == 255 ? named : QColor::fromString("#" + text);
  if (!color.isValid() || color.rgb() == color_.rgb()) return ShowNumbers();
  SetColor(color);
  Q_EMIT changed(color_, false);
}

}  // namespace retint
