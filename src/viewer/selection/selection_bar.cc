// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/selection_bar.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <QAction>
#include <QButtonGroup>
#include <QComboBox>
#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QSlider>
#include <QSpinBox>
#include <QStyle>
#include <QToolBar>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/selection/reach_choice.h"
#include "viewer/selection/selection_canvas.h"
#include "viewer/widgets/icon.h"
#include "viewer/widgets/long_text.h"

namespace retint {
namespace {

constexpr int kSteps = 200;  // of a slider
constexpr int kIcon = 20;
constexpr int kPlaceWidth = 90;  // pixels

const QString kBetweenHints = QStringLiteral("  ·  ");

QSize IconSizeOf(const QWidget& widget) {
  const int side = std::max(kIcon, widget.fontMetrics().height());
  return {side, side};
}

QToolButton* MakeButton(const QString& name, const QString& tip) {
  auto* button = new QToolButton;
  button->setAccessibleName(name);
  button->setToolTip(tip);
  button->setAutoRaise(true);
  button->setIconSize(IconSizeOf(*button));
  button->setFocusPolicy(Qt::TabFocus);
  return button;
}

QFrame* MakeLine() {
  auto* line = new QFrame;
  line->setFrameShape(QFrame::VLine);
  line->setFrameShadow(QFrame::Sunken);
  return line;
}

}  // namespace

// --- SliderBox ---------------------------------------------------------------------------------

SliderBox::SliderBox(const QString& label, int low, int high, const QString& suffix,
                     bool logarithmic, const QString& tip, QWidget* parent)
    : QWidget(parent), low_(low), high_(high), logarithmic_(logarithmic) {
  slider_ = new QSlider(Qt::Horizontal);
  slider_->setRange(0, kSteps);
  slider_->setFixedWidth(76);
  slider_->setAccessibleName(label);
  slider_->setFocusPolicy(Qt::TabFocus);
  box_ = new QSpinBox;
  box_->setRange(low, high);
  box_->setSuffix(suffix);
  box_->setButtonSymbols(QAbstractSpinBox::NoButtons);
  box_->setAlignment(Qt::AlignRight);
  box_->setAccessibleName(label);
  box_->setKeyboardTracking(false);
  auto* text = new QLabel(label);
  text->setBuddy(box_);
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(5);
  layout->addWidget(text);
  layout->addWidget(slider_);
  layout->addWidget(box_);
  setToolTip(tip);
  setSizePolicy(QSizePolicy::Fixed, QSizePolicy::Fixed);
  SetValue(low);
  connect(slider_, &QSlider::valueChanged, this, [this](int position) {
    SetValue(FromSlider(position));
    Q_EMIT changed(value());
  });
  connect(box_, &QSpinBox::valueChanged, this, [this](int value) {
    SetValue(value);
    Q_EMIT changed(value);
  });
}

int SliderBox::value() const { return box_->value(); }

void SliderBox::SetValue(int value) {
  const QSignalBlocker quiet_slider(slider_), quiet_box(box_);
  box_->setValue(value);
  if (FromSlider(slider_->value()) != box_->value()) slider_->setValue(ToSlider(box_->value()));
}

int SliderBox::ToSlider(int value) const {
  const double share = logarithmic_
                           ? std::log(double(value) / low_) / std::log(double(high_) / low_)
                           : double(value - low_) / (high_ - low_);
  return static_cast<int>(std::lround(share * kSteps));
}

int SliderBox::FromSlider(int position) const {
  const double share = double(position) / kSteps;
  return static_cast<int>(std::lround(logarithmic_ ? low_ * std::pow(double(high_) / low_, share)
                                                   : low_ + share * (high_ - low_)));
}

// --- ToolStrip ---------------------------------------------------------------------------------

ToolStrip::ToolStrip(SelectionCanvas* canvas, QWidget* parent) : QFrame(parent), canvas_(canvas) {
  layout_ = new QHBoxLayout(this);
  layout_->setContentsMargins(4, 4, 4, 4);
  layout_->setSpacing(8);
  buttons_ = new QWidget;
  auto* buttons = new QHBoxLayout(buttons_);
  buttons->setContentsMargins(0, 0, 0, 0);
  buttons->setSpacing(2);
  layout_->addWidget(buttons_);
  tools_ = new QButtonGroup(this);
  for (const SelectionTool& tool : SelectionTools()) {
    const QString key = QKeySequence(tool.key).toString();
    QToolButton* button =
        MakeButton(tr(tool.name), tr("%1 (%2): %3").arg(tr(tool.title), key, tr(tool.tip)));
    button->setObjectName(QString("tool") + tool.name);
    button->setCheckable(true);
    tools_->addButton(button, static_cast<int>(tools_->buttons().size()));
    buttons->addWidget(button);
  }
  connect(tools_, &QButtonGroup::idClicked, this, [this](int id) {
    canvas_->SetTool(SelectionTools()[size_t(id)]);
    canvas_->setFocus();
  });
  buttons->addWidget(MakeLine());
  reach_ = new ReachChoice;
  layout_->addWidget(reach_);
  size_ = new SliderBox(tr("Size"), 1, 1000, tr(" px"), true,
                        tr("Diameter of the brush in pixels of the view ([ and ], Alt+wheel)"));
  hardness_ = new SliderBox(tr("Hardness"), 0, 100, tr(" %"), false,
                            tr("100 %: a crisp edge; less: the edge fades out"));
  tolerance_ = new SliderBox(
      tr("Color"), 0, 500, tr(" ‰"), false,
      tr("How far a color may be from the one clicked, in OKLab: black and white are 1000 ‰ apart "
         "(drag right or left while clicking)"));
  edge_ = new SliderBox(tr("Depth step"), 0, 100, tr(" ‰"), false,
                        tr("A step in depth larger than this share of it ends the surface"));
  normal_ = new SliderBox(tr("Turn"), 0, 180, tr("°"), false,
                          tr("How far the surface may turn away from where it was clicked"));
  margin_ = new SliderBox(tr("Margin"), 0, 100, tr(" %"), false,
                          tr("How much larger than what was dragged over the box is, a side"));
  opacity_ = new SliderBox(tr("Overlay"), 0, 100, tr(" %"), false,
                           tr("Opacity of the overlay (, and .); hold \\ to hide it"));
  options_ = {reach_, size_, hardness_, tolerance_, edge_, normal_, margin_, opacity_};
  for (size_t i = 1; i < options_.size(); ++i) layout_->addWidget(options_[i]);
  list_ = new QFrame(this, Qt::Popup);
  list_->setObjectName("toolOptionsList");
  list_->setFrameShape(QFrame::StyledPanel);
  new QVBoxLayout(list_);
  more_ = MakeButton(tr("Options"), tr("More options of this tool"));
  more_->setObjectName("toolOptions");
  more_->setText(QStringLiteral("…"));
  layout_->addWidget(more_);
  layout_->addStretch(1);
  connect(more_, &QToolButton::clicked, this, [this] {
    list_->adjustSize();
    const QPoint below(more_->width() - list_->width(), more_->height());
    list_->move(more_->mapToGlobal(below));
    list_->show();
  });
  connect(size_, &SliderBox::changed, this, [this](int value) {
    canvas_->SetBrush({value / 2.0, canvas_->brush().hardness});
  });
  connect(hardness_, &SliderBox::changed, this, [this](int value) {
    canvas_->SetBrush({canvas_->brush().radius, value / 100.0});
  });
  const auto set_outline = [this](SliderBox* box, auto set) {
    connect(box, &SliderBox::changed, this, [this, set](int value) {
      OutlineOptions outline = canvas_->outline();
      set(outline, value);
      canvas_->SetOutline(outline);
    });
  };
  set_outline(tolerance_, [this](OutlineOptions& outline, int value) {
    canvas_->tool().acts.tolerance(outline) = value / 1000.0;
  });
  set_outline(edge_,
              [](OutlineOptions& outline, int value) { outline.wand.depth = value / 1000.0; });
  set_outline(normal_, [](OutlineOptions& outline, int value) { outline.wand.normal = value; });
  set_outline(margin_,
              [](OutlineOptions& outline, int value) { outline.box_margin = value / 100.0; });
  connect(opacity_, &SliderBox::changed, this,
          [this](int value) { canvas_->SetOverlayOpacity(value / 100.0); });
  connect(canvas_, &SelectionCanvas::optionsChanged, this, &ToolStrip::Show);
  DrawIcons();
  Show();
}

void ToolStrip::Show() {
  const SelectionTool& tool = canvas_->tool();
  tools_->button(static_cast<int>(&tool - SelectionTools().data()))->setChecked(true);
  for (QWidget* option : options_) {
    if (!IsUsed(option)) option->hide();
  }
  OutlineOptions outline = canvas_->outline();
  const auto per_mille = [](double value) { return static_cast<int>(std::lround(1000 * value)); };
  size_->SetValue(static_cast<int>(std::lround(2 * canvas_->brush().radius)));
  hardness_->SetValue(static_cast<int>(std::lround(100 * canvas_->brush().hardness)));
  if (tool.acts.tolerance) tolerance_->SetValue(per_mille(tool.acts.tolerance(outline)));
  edge_->SetValue(per_mille(outline.wand.depth));
  normal_->SetValue(static_cast<int>(std::lround(outline.wand.normal)));
  margin_->SetValue(static_cast<int>(std::lround(100 * outline.box_margin)));
  opacity_->SetValue(static_cast<int>(std::lround(100 * canvas_->overlay_opacity())));
  Fit();
}

bool ToolStrip::IsUsed(const QWidget* option) const {
  const std::pair<const QWidget*, unsigned> sliders[] = {
      {size_, kSizeSlider},  {hardness_, kHardnessSlider}, {tolerance_, kToleranceSlider},
      {edge_, kDepthSlider}, {normal_, kTurnSlider},       {margin_, kMarginSlider}};
  for (const auto& [slider, flag] : sliders) {
    if (option == slider) return (canvas_->tool().acts.sliders & flag) != 0;
  }
  return true;
}

void ToolStrip::Fit() {
  const int gap = layout_->spacing();
  const QMargins margins = layout_->contentsMargins();
  int room = width() - margins.left() - margins.right() - buttons_->sizeHint().width();
  int needed = 0;
  for (const QWidget* option : options_) {
    if (IsUsed(option)) needed += gap + option->sizeHint().width();
  }
  const bool all = needed <= room;
  if (!all) room -= gap + more_->sizeHint().width();
  int in_row = 1;  // of the layout, after the buttons
  for (QWidget* option : options_) {
    if (!IsUsed(option)) {  // in the row or in the list, it is hidden
      in_row += option->parentWidget() == this;
      continue;
    }
    const int taken = gap + option->sizeHint().width();
    const bool fits = taken <= room;
    if (fits) room -= taken;
    if (fits && option->parentWidget() != this) layout_->insertWidget(in_row, option);
    if (!fits && option->parentWidget() == this) list_->layout()->addWidget(option);
    option->show();
    in_row += fits;
  }
  more_->setVisible(!all);
  if (list_->isVisible()) list_->adjustSize();
}

QSize ToolStrip::minimumSizeHint() const {
  const QMargins margins = layout_->contentsMargins();
  int height = 0;
  for (const QWidget* part : options_) height = std::max(height, part->sizeHint().height());
  height = std::max({height, buttons_->sizeHint().height(), more_->sizeHint().height()});
  return {margins.left() + margins.right() + buttons_->sizeHint().width() + layout_->spacing() +
              more_->sizeHint().width(),
          margins.top() + margins.bottom() + height};
}

void ToolStrip::resizeEvent(QResizeEvent* event) {
  QFrame::resizeEvent(event);
  Fit();
}

void ToolStrip::DrawIcons() {
  for (QAbstractButton* button : tools_->buttons()) {
    const SelectionTool& tool = SelectionTools()[size_t(tools_->id(button))];
    button->setIcon(MakeIcon(tool.id, palette()));
  }
}

void ToolStrip::changeEvent(QEvent* event) {
  if (event->type() == QEvent::PaletteChange) DrawIcons();
  QFrame::changeEvent(event);
}

// --- ActionStrip -------------------------------------------------------------------------------

ActionStrip::ActionStrip(SelectionCanvas* canvas, QWidget* parent)
    : QFrame(parent), canvas_(canvas) {
  auto* rows = new QHBoxLayout(this);
  rows->setContentsMargins(4, 4, 4, 4);
  rows->setSpacing(6);
  rows->addWidget(MakeOperations());
  const auto part = [&] {
    auto* widget = new QWidget;
    widget->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
    auto* made = new QHBoxLayout(widget);
    made->setContentsMargins(0, 0, 0, 0);
    made->setSpacing(3);
    rows->addWidget(widget, 1);
    return made;
  };
  QHBoxLayout* layout = part();
  target_ = new QComboBox;
  target_->setObjectName("selectionTarget");
  target_->setAccessibleName(tr("Target of the strokes"));
  target_->setToolTip(tr("What the strokes go to; can be changed until the first stroke"));
  target_->setFocusPolicy(Qt::TabFocus);
  target_->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  target_->setMinimumContentsLength(10);
  target_->setSizePolicy(QSizePolicy::Maximum, QSizePolicy::Fixed);
  layout->addWidget(target_);
  layout->addSpacing(4);
  place_ = new ElidedLabel;
  layout->addWidget(place_, 1);
  layout = part();
  hint_ = new QLabel;
  hint_->setObjectName("selectionHint");
  hint_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  hint_->installEventFilter(this);
  layout->addWidget(hint_, 1);
  layout->addSpacing(10);
  cancel_ = new QPushButton(tr("Cancel"));
  cancel_->setObjectName("selectionCancel");
  cancel_->setToolTip(tr("Leave without a change (Esc); strokes are kept for the next visit"));
  accept_ = new QPushButton(tr("Accept"));
  accept_->setObjectName("selectionAccept");
  accept_->setToolTip(tr("Find the selection in every view (Enter)"));
  for (QPushButton* button : {cancel_, accept_}) {
    button->setFocusPolicy(Qt::TabFocus);
    layout->addWidget(button);
  }
  Connect();
  DrawIcons();
  Show();
}

// Those for which the row has no room go to the menu of the button at the bar's end.
QToolBar* ActionStrip::MakeOperations() {
  auto* bar = new QToolBar;
  bar->setIconSize(IconSizeOf(*bar));
  bar->layout()->setContentsMargins(0, 0, 0, 0);
  const auto add = [&](const char* icon, const char* name, const QString& tip, auto act) {
    QAction* action = bar->addAction(tr(name), this, [this, act] {
      act(*canvas_);
      canvas_->setFocus();
    });
    action->setToolTip(tip);
    QWidget* button = bar->widgetForAction(action);
    button->setObjectName(QString("action") + QString(name).remove(' '));
    button->setAccessibleName(tr(name));
    button->setFocusPolicy(Qt::TabFocus);
    operations_.emplace_back(action, icon);
  };
  add("undo", "Undo", tr("Undo the last stroke (Ctrl+Z)"), [](auto& c) { c.Undo(); });
  add("redo", "Redo", tr("Redo (Ctrl+Shift+Z or Ctrl+Y)"), [](auto& c) { c.Redo(); });
  bar->addSeparator();
  add("grow", "Grow", tr("Grow by a pixel (G)"), [](auto& c) { c.GrowBy(1); });
  add("shrink", "Shrink", tr("Shrink by a pixel (Shift+G)"), [](auto& c) { c.GrowBy(-1); });
  add("invert", "Invert", tr("Invert (Ctrl+I)"), [](auto& c) { c.Invert(); });
  add("all", "Select all", tr("Select all (Ctrl+A)"), [](auto& c) { c.SelectAll(); });
  add("none", "Select none", tr("Select nothing (Ctrl+Shift+A)"), [](auto& c) { c.SelectNone(); });
  bar->addSeparator();
  return bar;
}

void ActionStrip::Connect() {
  connect(target_, &QComboBox::activated, this, &ActionStrip::targetChosen);
  connect(cancel_, &QPushButton::clicked, this, &ActionStrip::cancel);
  connect(accept_, &QPushButton::clicked, this, &ActionStrip::accept);
  connect(canvas_, &SelectionCanvas::optionsChanged, this, &ActionStrip::Show);
  connect(canvas_, &SelectionCanvas::hintChanged, this, &ActionStrip::Show);
  connect(canvas_, &SelectionCanvas::notFound, this,
          [this](const QString& why) { ShowMessage(why, true); });
  connect(canvas_, &SelectionCanvas::edited, this, [this] {
    message_.clear();
    Show();
  });
}

void ActionStrip::ShowMessage(const QString& message, bool warning) {
  message_ = message;
  warning_ = warning;
  Show();
}

QString ActionStrip::message() const { return message_; }

void ActionStrip::SetTargets(const QStringList& targets, int current, const QString& place) {
  target_->clear();
  target_->addItems(targets);
  target_->setCurrentIndex(current);
  place_->setText(place);
  place_->setToolTip(place);
  // No wider than its text: the rest of the row is the hint's.
  place_->setMaximumWidth(std::max(kPlaceWidth, place_->sizeHint().width()));
  QWidget* part = target_->parentWidget();
  part->setMaximumWidth(part->layout()->maximumSize().width());
}

void ActionStrip::SetPaintable(bool paintable) {
  paintable_ = paintable;
  Show();
}

void ActionStrip::Show() {
  QFont font = this->font();
  font.setBold(!message_.isEmpty());
  hint_->setFont(font);
  FitHint();
  const bool undo = canvas_->CanUndo(), redo = canvas_->CanRedo();
  for (const auto& [action, icon] : operations_) {
    const std::string_view name = icon;
    const bool useful = name == "undo" ? undo : name == "redo" ? redo : true;
    action->setEnabled(paintable_ && useful);
  }
  accept_->setEnabled(paintable_);
  target_->setEnabled(paintable_ && !undo && !redo);
}

// As much of the hint as there is room for, whole parts where it can be.
void ActionStrip::FitHint() {
  const QString whole = message_.isEmpty() ? canvas_->Hint()
                        : warning_         ? QString::fromUtf8("⚠ ") + message_
                                           : message_;
  hint_->setToolTip(whole);
  const QFontMetrics metrics(hint_->font());
  QStringList parts = whole.split(kBetweenHints);
  while (parts.size() > 1 &&
         metrics.horizontalAdvance(parts.join(kBetweenHints)) > hint_->width()) {
    parts.removeLast();
  }
  hint_->setText(
      metrics.elidedText(parts.join(kBetweenHints), Qt::ElideRight, std::max(hint_->width(), 1)));
}

bool ActionStrip::eventFilter(QObject* object, QEvent* event) {
  if (object == hint_ && event->type() == QEvent::Resize) FitHint();
  return QFrame::eventFilter(object, event);
}

void ActionStrip::DrawIcons() {
  for (auto& [action, icon] : operations_) action->setIcon(MakeIcon(icon, palette()));
}

void ActionStrip::changeEvent(QEvent* event) {
  if (event->type() == QEvent::PaletteChange) DrawIcons();
  QFrame::changeEvent(event);
}

}  // namespace retint
