// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/color_picker.h"

#include <algorithm>
#include <cmath>

#include <QButtonGroup>
#include <QGridLayout>
#include <QKeyEvent>
#include <QLineEdit>
#include <QMouseEvent>
#include <QPainter>
#include <QSettings>
#include <QSignalBlocker>
#include <QSpinBox>
#include <QToolButton>

#include "viewer/panels/swatch_row.h"

namespace retint {
namespace {

constexpr double kStep = 0.01, kFarStep = 0.1;  // of the keyboard
constexpr double kLastHue = 0.9999;             // 1 would equal 0
constexpr int kRestMs = 1500;
constexpr int kColumns = 4;

double Clamped(double value) { return std::clamp(value, 0.0, 1.0); }

void PaintFocus(QWidget& widget, QPainter& painter) {
  painter.setRenderHint(QPainter::Antialiasing, false);
  painter.setBrush(Qt::NoBrush);
  const bool focus = widget.hasFocus();
  painter.setPen(
      QPen(widget.palette().color(focus ? QPalette::Highlight : QPalette::Mid), focus ? 2 : 1));
  painter.drawRect(widget.rect().adjusted(0, 0, -1, -1));
}

// Black and white, so that it is visible on any color.
void PaintMark(QPainter& painter, const QWidget& widget, QPointF at, double radius) {
  // Keeps the whole mark inside, at the border too.
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
  SetModel(ColorModels()[0]);
}

void ColorSquare::SetModel(const ColorModel& model) {
  model_ = &model;
  picture_hue_ = -1;
  setAccessibleName(tr("%1 and %2").arg(tr(model.across), tr(model.up)));
  setToolTip(tr("%1 to the right, %2 upwards (arrows; Shift: further)")
                 .arg(tr(model.across), tr(model.up)));
  update();
}

void ColorSquare::SetPlace(const ColorPlace& place) {
  place_ = {std::clamp(place.hue, 0.0, kLastHue), Clamped(place.across), Clamped(place.up)};
  update();
}

void ColorSquare::Draw() {
  constexpr int kCells = 96;  // a side; the painter interpolates
  constexpr int kHatch = 6;   // cells from line to line
  const QColor none = palette().color(QPalette::Window), line = palette().color(QPalette::Mid);
  picture_ = QImage(kCells, kCells, QImage::Format_RGB32);
  for (int y = 0; y < kCells; ++y) {
    for (int x = 0; x < kCells; ++x) {
      const QColor color = model_->color({place_.hue, x / (kCells - 1.0), 1 - y / (kCells - 1.0)});
      const QColor& shown = color.isValid() ? color : (x + y) % kHatch == 0 ? line : none;
      picture_.setPixel(x, y, shown.rgb());
    }
  }
  picture_hue_ = place_.hue;
}

void ColorSquare::changeEvent(QEvent* event) {
  if (event->type() == QEvent::PaletteChange) picture_hue_ = -1;  // hatching has the theme's colors
  QWidget::changeEvent(event);
}

void ColorSquare::paintEvent(QPaintEvent*) {
  if (picture_hue_ != place_.hue) Draw();
  QPainter painter(this);
  painter.setRenderHint(QPainter::SmoothPixmapTransform);
  painter.drawImage(rect(), picture_);
  PaintFocus(*this, painter);
  PaintMark(painter, *this, {place_.across * (width() - 1), (1 - place_.up) * (height() - 1)}, 5);
}

void ColorSquare::TakeMouse(const QPointF& at) {
  SetPlace({place_.hue, at.x() / std::max(1, width() - 1), 1 - at.y() / std::max(1, height() - 1)});
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
  ColorPlace place = place_;
  switch (event->key()) {
    case Qt::Key_Left:
      place.across -= step;
      break;
    case Qt::Key_Right:
      place.across += step;
      break;
    case Qt::Key_Up:
      place.up += step;
      break;
    case Qt::Key_Down:
      place.up -= step;
      break;
    default:
      return QWidget::keyPressEvent(event);
  }
  SetPlace(place);
  Q_EMIT released();
}

// --- HueStrip ------------------------------------------------------------------------------------

HueStrip::HueStrip(QWidget* parent) : QWidget(parent), model_(&ColorModels()[0]) {
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setAccessibleName(tr("Hue"));
  setToolTip(tr("Hue (left, right; Shift: further)"));
}

void HueStrip::SetModel(const ColorModel& model) {
  model_ = &model;
  update();
}

void HueStrip::SetHue(double hue) {
  hue_ = std::clamp(hue, 0.0, kLastHue);
  update();
}

void HueStrip::paintEvent(QPaintEvent*) {
  constexpr double kUp = 0.75;  // light enough to recognize every hue
  QPainter painter(this);
  QLinearGradient hues(0, 0, width(), 0);
  constexpr int kStops = 24;
  for (int i = 0; i <= kStops; ++i) {
    const double at = double(i) / kStops;
    hues.setColorAt(at, NearestColor(*model_, {at, 1, model_ == &ColorModels()[0] ? 1 : kUp}));
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
  BuildTop(layout);
  layout->addWidget(square_, 1, 0, 1, kColumns);
  layout->addWidget(hues_, 2, 0, 1, kColumns);
  const QString names[3] = {tr("Red"), tr("Green"), tr("Blue")};
  for (int c = 0; c < 3; ++c) {
    channels_[c] = new QSpinBox;
    channels_[c]->setObjectName(QStringLiteral("channel%1").arg(c));
    channels_[c]->setRange(0, 255);
    channels_[c]->setPrefix(names[c].left(1) + " ");
    channels_[c]->setAccessibleName(names[c]);
    channels_[c]->setToolTip(tr("%1, 0 to 255").arg(names[c]));
    channels_[c]->setKeyboardTracking(false);
    layout->addWidget(channels_[c], 3, c);
    connect(channels_[c], &QSpinBox::valueChanged, this, &ColorPicker::FromNumbers);
  }
  text_ = new QLineEdit;
  text_->setObjectName("color_text");
  text_->setAccessibleName(tr("Color as #rrggbb or by name"));
  text_->setToolTip(tr("The color as #rrggbb, or by its name: white, tomato, steelblue"));
  text_->setMinimumWidth(text_->fontMetrics().horizontalAdvance("#dddddd") + 16);
  layout->addWidget(text_, 3, 3);
  recent_ = new SwatchRow(tr("Recent"), "recent_colors", SwatchRow::Form::kRecent, this);
  recent_->setObjectName("recent_colors");
  swatches_ = new SwatchRow(tr("Swatches"), "swatches", SwatchRow::Form::kKept, this);
  swatches_->setObjectName("swatches");
  layout->addWidget(recent_, 4, 0, 1, kColumns);
  layout->addWidget(swatches_, 5, 0, 1, kColumns);
  rest_.setSingleShot(true);
  rest_.setInterval(kRestMs);
  connect(&rest_, &QTimer::timeout, this, [this] { recent_->Add(color_); });
  for (SwatchRow* row : {recent_, swatches_}) {
    connect(row, &SwatchRow::chosen, this, &ColorPicker::Choose);
  }
  connect(swatches_, &SwatchRow::addWanted, this, [this] { swatches_->Add(color_); });
  connect(text_, &QLineEdit::editingFinished, this, &ColorPicker::FromText);
  connect(square_, &ColorSquare::dragged, this, [this] { FromSquare(true); });
  connect(square_, &ColorSquare::released, this, [this] { FromSquare(false); });
  connect(hues_, &HueStrip::dragged, this, [this] { FromSquare(true); });
  connect(hues_, &HueStrip::released, this, [this] { FromSquare(false); });
  SetModel(std::clamp(QSettings().value("color_model").toInt(), 0, int(ColorModels().size()) - 1));
  Place(color_);
  ShowNumbers();
}

// Builds the models and the eyedropper.
void ColorPicker::BuildTop(QGridLayout* layout) {
  auto* row = new QHBoxLayout;
  row->setSpacing(3);
  models_ = new QButtonGroup(this);
  const std::span<const ColorModel> models = ColorModels();
  for (int i = 0; i < int(models.size()); ++i) {
    auto* button = new QToolButton;
    button->setText(models[size_t(i)].name);
    button->setObjectName(QStringLiteral("color_model%1").arg(i));
    button->setCheckable(true);
    button->setFocusPolicy(Qt::StrongFocus);
    button->setToolTip(tr("Choose by hue, %1 and %2")
                           .arg(tr(models[size_t(i)].across).toLower(), tr(models[size_t(i)].up)));
    models_->addButton(button, i);
    row->addWidget(button);
  }
  row->addStretch();
  pipette_ = new QToolButton;
  pipette_->setObjectName("color_pipette");
  pipette_->setText(tr("Pi&ck"));
  pipette_->setFocusPolicy(Qt::StrongFocus);
  pipette_->setToolTip(
      tr("Take a color from the picture, with a click (Alt+C). Hold P there to take it from the "
         "photo"));
  pipette_->setShortcut(QKeySequence(tr("Alt+C")));
  row->addWidget(pipette_);
  layout->addLayout(row, 0, 0, 1, kColumns);
  connect(models_, &QButtonGroup::idClicked, this, [this](int index) {
    SetModel(index);
    QSettings().setValue("color_model", index);
  });
  connect(pipette_, &QToolButton::clicked, this, &ColorPicker::pickWanted);
}

void ColorPicker::SetCanPick(bool can) { pipette_->setEnabled(can); }

void ColorPicker::SetModel(int index) {
  model_ = index;
  const ColorModel& model = ColorModels()[size_t(index)];
  models_->button(index)->setChecked(true);
  square_->SetModel(model);
  hues_->SetModel(model);
  Place(color_);
}

void ColorPicker::Place(const QColor& color) {
  ColorPlace before = square_->place();
  before.hue = hues_->hue();
  const ColorPlace place = ColorModels()[size_t(model_)].place(color, before);
  hues_->SetHue(place.hue);
  square_->SetPlace(place);
}

void ColorPicker::SetColor(const QColor& color) {
  if (dragging_) return;  // the drag has the newest color
  if (color.rgb() != color_.rgb() || !color_.isValid()) {
    color_ = QColor(color.rgb());
    Place(color_);
  }
  ShowNumbers();
}

void ColorPicker::Choose(const QColor& color) {
  SetColor(color);
  Changed(false);
}

void ColorPicker::Changed(bool dragging) {
  if (!dragging) rest_.start();
  Q_EMIT changed(color_, dragging);
}

void ColorPicker::ShowNumbers() {
  const int values[3] = {color_.red(), color_.green(), color_.blue()};
  for (int c = 0; c < 3; ++c) {
    const QSignalBlocker quiet(channels_[c]);
    if (channels_[c]->value() != values[c]) channels_[c]->setValue(values[c]);
  }
  if (!text_->hasFocus() || !text_->isModified()) text_->setText(color_.name());
}

void ColorPicker::FromSquare(bool dragging) {
  dragging_ = dragging;
  ColorPlace place = square_->place();
  place.hue = hues_->hue();
  square_->SetPlace(place);
  color_ = QColor(NearestColor(ColorModels()[size_t(model_)], place).rgb());
  ShowNumbers();
  Changed(dragging);
  // If the place has no color, the mark moves to the color that was taken.
  if (!dragging && !ColorModels()[size_t(model_)].color(place).isValid()) Place(color_);
}

void ColorPicker::FromNumbers() {
  Choose(QColor(channels_[0]->value(), channels_[1]->value(), channels_[2]->value()));
}

void ColorPicker::FromText() {
  if (!text_->isModified()) return;
  text_->setModified(false);
  const QString text = text_->text().remove(' ');
  const QColor named = QColor::fromString(text);
  const QColor color =
      named.isValid() && named.alpha() == 255 ? named : QColor::fromString("#" + text);
  if (!color.isValid() || color.rgb() == color_.rgb()) return ShowNumbers();
  Choose(color);
}

}  // namespace retint
