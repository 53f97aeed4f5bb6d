// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/regions_panel.h"

#include <algorithm>

#include <QApplication>
#include <QGridLayout>
#include <QHeaderView>
#include <QKeyEvent>
#include <QLabel>
#include <QMouseEvent>
#include <QPainter>
#include <QSignalBlocker>
#include <QSlider>
#include <QSpinBox>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/main_window.h"
#include "viewer/panels/color_picker.h"

namespace retint {
namespace {

constexpr int kSwatch = 16;

QIcon Swatch(const QColor& color, const QPalette& palette) {
  QPixmap picture(kSwatch, kSwatch);
  picture.fill(color);
  QPainter painter(&picture);
  painter.setPen(palette.color(QPalette::Text));
  painter.drawRect(0, 0, kSwatch - 1, kSwatch - 1);
  // In a selected row too: the style would blend it with the selection's color.
  QIcon icon(picture);
  icon.addPixmap(picture, QIcon::Selected);
  return icon;
}

bool IsListKey(const QKeyEvent& event) {
  const bool plain = event.modifiers() == Qt::NoModifier;
  switch (event.key()) {
    case Qt::Key_Delete:
    case Qt::Key_F2:
    case Qt::Key_Space:
    case Qt::Key_Up:
    case Qt::Key_Down:
      return plain || event.modifiers() == Qt::AltModifier;
    case Qt::Key_D:
      return event.modifiers() == Qt::ControlModifier;
    default:
      return false;
  }
}

}  // namespace

QColor TintColor(const ColorEdit& edit) {
  // What "make it this color" was told, else what white becomes.
  Eigen::Vector3f shown = CompiledEdit(edit).Apply(Eigen::Vector3f::Ones());
  for (const ColorOperation& op : edit.operations) {
    if (op.kind == ColorOperationKind::kRecolor) {
      shown = Eigen::Map<const Eigen::Vector3f>(op.Get("to").data());
    }
  }
  const auto part = [&](int c) { return std::clamp(shown[c], 0.0F, 1.0F); };
  return QColor::fromRgbF(part(0), part(1), part(2));
}

// --- RegionTree ----------------------------------------------------------------------------------

RegionTree::RegionTree(QWidget* parent) : QTreeWidget(parent) {
  setRootIsDecorated(false);
  setUniformRowHeights(true);
  setAllColumnsShowFocus(true);
  setSelectionMode(SingleSelection);
  setEditTriggers(DoubleClicked);
  setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
}

bool RegionTree::event(QEvent* event) {
  // Keys that mean something else to the window are the list's while it has the focus.
  if (event->type() == QEvent::ShortcutOverride && IsListKey(*static_cast<QKeyEvent*>(event))) {
    event->accept();
    return true;
  }
  return QTreeWidget::event(event);
}

void RegionTree::keyPressEvent(QKeyEvent* event) {
  if (state() == EditingState) return QTreeWidget::keyPressEvent(event);
  const bool alt = event->modifiers() == Qt::AltModifier;
  if (event->key() == Qt::Key_Delete) return Q_EMIT deletePressed();
  if (event->key() == Qt::Key_F2) return Q_EMIT renamePressed();
  if (event->key() == Qt::Key_D && event->modifiers() == Qt::ControlModifier) {
    return Q_EMIT duplicatePressed();
  }
  if (alt && event->key() == Qt::Key_Up) return Q_EMIT stepPressed(-1);
  if (alt && event->key() == Qt::Key_Down) return Q_EMIT stepPressed(1);
  if (event->key() == Qt::Key_Space && currentItem()) {
    QTreeWidgetItem* item = currentItem();
    item->setCheckState(0, item->checkState(0) == Qt::Checked ? Qt::Unchecked : Qt::Checked);
    return;
  }
  QTreeWidget::keyPressEvent(event);
}

void RegionTree::mousePressEvent(QMouseEvent* event) {
  QTreeWidget::mousePressEvent(event);
  QTreeWidgetItem* item = itemAt(event->pos());
  drag_from_ = event->button() == Qt::LeftButton && item ? indexOfTopLevelItem(item) : -1;
  pressed_ = event->pos();
}

void RegionTree::mouseMoveEvent(QMouseEvent* event) {
  if (drag_from_ < 0 || !(event->buttons() & Qt::LeftButton)) return;
  const bool far = (event->pos() - pressed_).manhattanLength() >= QApplication::startDragDistance();
  if (gap_ < 0 && !far) return;
  gap_ = GapAt(event->pos().y());
  setCursor(Qt::ClosedHandCursor);
  viewport()->update();
}

void RegionTree::mouseReleaseEvent(QMouseEvent* event) {
  const int from = drag_from_, gap = gap_;
  drag_from_ = gap_ = -1;
  if (gap < 0) return QTreeWidget::mouseReleaseEvent(event);
  unsetCursor();
  viewport()->update();
  const int to = gap > from ? gap - 1 : gap;
  if (to != from) Q_EMIT rowMoved(from, to);
}

int RegionTree::GapAt(int y) const {
  for (int row = 0; row < topLevelItemCount(); ++row) {
    if (y < visualItemRect(topLevelItem(row)).center().y()) return row;
  }
  return topLevelItemCount();
}

void RegionTree::paintEvent(QPaintEvent* event) {
  QTreeWidget::paintEvent(event);
  if (gap_ < 0 || topLevelItemCount() == 0) return;
  const bool end = gap_ == topLevelItemCount();
  const QRect row = visualItemRect(topLevelItem(end ? gap_ - 1 : gap_));
  const int y = end ? row.bottom() : row.top();
  QPainter painter(viewport());
  painter.setPen(QPen(palette().color(QPalette::Highlight), 3));
  painter.drawLine(0, y, viewport()->width(), y);
}

// --- RegionsPanel --------------------------------------------------------------------------------

RegionsPanel::RegionsPanel(MainWindow* window)
    : window_(window), controller_(&window->controller()) {
  setObjectName("regions_panel");
  list_ = new RegionTree;
  list_->setObjectName("region_list");
  list_->setAccessibleName(tr("Regions"));
  list_->setColumnCount(kColumns);
  list_->setHeaderLabels({tr("Shown, name"), tr("Solo"), tr("Color"), tr("Strength")});
  list_->setToolTip(
      tr("The first is applied first; drag to reorder. Tints multiply where regions overlap, so "
         "their order shows little.\nSolo shows one region alone; it is not an edit.\n"
         "Show or hide: Space · "
         "rename: F2 · duplicate: Ctrl+D · delete: Del · move: Alt+Up, Alt+Down"));
  list_->header()->setStretchLastSection(false);
  list_->header()->setSectionResizeMode(kName, QHeaderView::Stretch);
  for (const int column : {kSolo, kColor, kStrength}) {
    list_->header()->setSectionResizeMode(column, QHeaderView::ResizeToContents);
  }
  list_->setMinimumHeight(4 * (fontMetrics().height() + 8));
  empty_ = new QLabel(tr("No region yet. Stop at a good view and press Enter or B to paint one."));
  empty_->setWordWrap(true);
  empty_->setMargin(8);
  empty_->setAlignment(Qt::AlignTop | Qt::AlignLeft);
  empty_->setMinimumHeight(list_->minimumHeight());
  BuildButtons();
  BuildEditors();
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 6, 6, 6);
  layout->addWidget(buttons_);
  layout->addWidget(empty_, 1);
  layout->addWidget(list_, 1);
  layout->addWidget(editors_);

  connect(list_, &QTreeWidget::itemChanged, this, &RegionsPanel::OnItemChanged);
  connect(list_, &QTreeWidget::currentItemChanged, this, [this](QTreeWidgetItem* item) {
    if (!filling_) window_->SetCurrentRegion(IdOf(item));
  });
  connect(list_, &RegionTree::rowMoved, this, [this](int from, int to) {
    controller_->Move(IdOf(list_->topLevelItem(from)), size_t(to));
  });
  connect(list_, &RegionTree::deletePressed, remove_, &QToolButton::click);
  connect(list_, &RegionTree::duplicatePressed, duplicate_, &QToolButton::click);
  connect(list_, &RegionTree::stepPressed, this, &RegionsPanel::Step);
  connect(list_, &RegionTree::renamePressed, this, [this] {
    if (list_->currentItem()) list_->editItem(list_->currentItem(), kName);
  });
  connect(controller_, &SceneController::regionsChanged, this, &RegionsPanel::Refresh);
  connect(controller_, &SceneController::opened, this, &RegionsPanel::Refresh);
  connect(controller_, &SceneController::closed, this, &RegionsPanel::Refresh);
  connect(window_, &MainWindow::currentRegionChanged, this, &RegionsPanel::Refresh);
  Refresh();
}

void RegionsPanel::BuildButtons() {
  buttons_ = new QWidget;
  auto* layout = new QHBoxLayout(buttons_);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(3);
  const auto add = [&](const char* name, const QString& text, const QString& tip, auto act) {
    auto* button = new QToolButton;
    button->setObjectName(name);
    button->setText(text);
    button->setToolTip(tip);
    button->setAccessibleName(tip);
    button->setFocusPolicy(Qt::StrongFocus);
    connect(button, &QToolButton::clicked, this, act);
    layout->addWidget(button);
    return button;
  };
  paint_ = add("region_new", tr("New"), tr("Paint a new region on this view (Enter, B)"),
               [this] { window_->EnterSelection(0); });
  extend_ = add("region_extend", tr("Paint"), tr("Extend or erase this region from this view"),
                [this] { window_->EnterSelection(window_->current_region()); });
  duplicate_ = add("region_duplicate", tr("Copy"), tr("Duplicate this region (Ctrl+D in the list)"),
                   [this] { controller_->Duplicate(window_->current_region()); });
  remove_ = add("region_delete", tr("Delete"), tr("Delete this region (Del in the list)"),
                [this] { controller_->Remove(window_->current_region()); });
  layout->addStretch();
  up_ = add("region_up", QStringLiteral("▲"), tr("Apply it earlier (Alt+Up in the list)"),
            [this] { Step(-1); });
  down_ = add("region_down", QStringLiteral("▼"), tr("Apply it later (Alt+Down in the list)"),
              [this] { Step(1); });
}

void RegionsPanel::BuildEditors() {
  editors_ = new QWidget;
  auto* layout = new QGridLayout(editors_);
  layout->setContentsMargins(0, 4, 0, 0);
  title_ = new QLabel;
  title_->setTextFormat(Qt::PlainText);
  title_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  layout->addWidget(title_, 0, 0, 1, 3);
  picker_ = new ColorPicker;
  picker_->setObjectName("color_picker");
  layout->addWidget(picker_, 1, 0, 1, 3);
  auto* label = new QLabel(tr("S&trength"));
  strength_ = new QSlider(Qt::Horizontal);
  strength_->setObjectName("strength");
  strength_->setRange(0, 100);
  strength_->setAccessibleName(tr("Strength"));
  strength_->setToolTip(tr("How much of the edit is done, in percent (Alt+T, arrows)"));
  percent_ = new QSpinBox;
  percent_->setRange(0, 100);
  percent_->setSuffix(tr(" %"));
  percent_->setAccessibleName(tr("Strength in percent"));
  label->setBuddy(strength_);
  layout->addWidget(label, 2, 0);
  layout->addWidget(strength_, 2, 1);
  layout->addWidget(percent_, 2, 2);
  connect(picker_, &ColorPicker::changed, this, &RegionsPanel::OnColor);
  connect(strength_, &QSlider::sliderPressed, this, [this] { ++drags_; });
  connect(strength_, &QSlider::valueChanged, this, &RegionsPanel::OnStrength);
  connect(percent_, &QSpinBox::valueChanged, this, &RegionsPanel::OnStrength);
}

RegionId RegionsPanel::IdOf(const QTreeWidgetItem* item) const {
  return item ? item->data(kName, Qt::UserRole).toUInt() : 0;
}

const Region* RegionsPanel::Current() const {
  return controller_->regions().Find(window_->current_region());
}

void RegionsPanel::FillRow(QTreeWidgetItem* item, const Region& region, bool solo) {
  const QString name = QString::fromStdString(region.name);
  const QColor color = TintColor(region.edit);
  item->setData(kName, Qt::UserRole, region.id);
  item->setText(kName, name);
  item->setToolTip(kName, name);
  item->setCheckState(kName, region.visible ? Qt::Checked : Qt::Unchecked);
  item->setCheckState(kSolo, solo ? Qt::Checked : Qt::Unchecked);
  const QString text = ChangesNothing(region.edit) ? tr("none yet") : color.name();
  if (item->text(kColor) != text) {
    item->setIcon(kColor, ChangesNothing(region.edit) ? QIcon() : Swatch(color, palette()));
  }
  item->setText(kColor, text);
  item->setText(kStrength, tr("%1 %").arg(qRound(region.strength * 100)));
  item->setTextAlignment(kStrength, Qt::AlignRight | Qt::AlignVCenter);
  // Set anew, even the same flags would reset the text of an editor that is open.
  const Qt::ItemFlags flags = Qt::ItemIsEnabled | Qt::ItemIsSelectable | Qt::ItemIsUserCheckable |
                              Qt::ItemIsEditable | Qt::ItemNeverHasChildren;
  if (item->flags() != flags) item->setFlags(flags);
}

void RegionsPanel::Refresh() {
  filling_ = true;
  const auto& regions = controller_->regions().regions;
  while (list_->topLevelItemCount() > int(regions.size())) {
    delete list_->takeTopLevelItem(list_->topLevelItemCount() - 1);
  }
  while (list_->topLevelItemCount() < int(regions.size())) new QTreeWidgetItem(list_);
  QTreeWidgetItem* current = nullptr;
  for (size_t i = 0; i < regions.size(); ++i) {
    QTreeWidgetItem* item = list_->topLevelItem(int(i));
    FillRow(item, regions[i], controller_->solo() == regions[i].id);
    if (regions[i].id == window_->current_region()) current = item;
  }
  list_->setCurrentItem(current);
  filling_ = false;
  setFocusProxy(regions.empty() ? static_cast<QWidget*>(paint_) : list_);
  empty_->setVisible(regions.empty());
  list_->setVisible(!regions.empty());
  ShowCurrent();
}

void RegionsPanel::ShowCurrent() {
  const Region* region = Current();
  const bool open = controller_->IsOpen();
  paint_->setEnabled(open);
  for (QWidget* widget : std::initializer_list<QWidget*>{extend_, duplicate_, remove_, editors_}) {
    widget->setEnabled(region != nullptr);
  }
  const int row = list_->currentItem() ? list_->indexOfTopLevelItem(list_->currentItem()) : -1;
  up_->setEnabled(region && row > 0);
  down_->setEnabled(region && row >= 0 && row + 1 < list_->topLevelItemCount());
  const bool untouched = region && ChangesNothing(region->edit);
  const QString name = region ? QString::fromStdString(region->name) : QString();
  title_->setText(!region     ? tr("Tint: choose a region")
                  : untouched ? tr("Now choose a color for %1").arg(name)
                              : tr("Tint of %1").arg(name));
  QFont font = this->font();
  font.setBold(untouched);
  title_->setFont(font);
  if (!region) return;
  picker_->SetColor(TintColor(region->edit));
  const QSignalBlocker quiet(strength_), quiet_too(percent_);
  if (!strength_->isSliderDown()) strength_->setValue(qRound(region->strength * 100));
  percent_->setValue(qRound(region->strength * 100));
}

void RegionsPanel::OnItemChanged(QTreeWidgetItem* item, int column) {
  if (filling_) return;
  const RegionId id = IdOf(item);
  const Region* region = controller_->regions().Find(id);
  if (!region) return;
  if (column == kSolo) {
    return controller_->SetSolo(item->checkState(kSolo) == Qt::Checked ? id : 0);
  }
  if (column != kName) return Refresh();  // not for editing
  const bool visible = item->checkState(kName) == Qt::Checked;
  const QString name = item->text(kName).trimmed();
  if (visible != region->visible) controller_->SetVisible(id, visible);
  if (name.isEmpty()) return Refresh();
  if (name.toStdString() != region->name) controller_->Rename(id, name);
}

void RegionsPanel::OnColor(const QColor& color, bool dragging) {
  const Region* region = Current();
  if (!region) return;
  const auto edit = ColorEdit::Tint({color.redF(), color.greenF(), color.blueF()});
  window_->canvas().SetCloudShown(false);  // it would hide the color that is chosen
  if (edit != region->edit) {
    controller_->SetEdit(region->id, edit, region->strength,
                         "tint " + std::to_string(region->id) + " " + std::to_string(drags_));
  }
  if (!dragging) ++drags_;
}

void RegionsPanel::OnStrength(int percent) {
  const Region* region = Current();
  if (!region || qRound(region->strength * 100) == percent) return;
  controller_->SetEdit(region->id, region->edit, float(percent) / 100.0F,
                       "strength " + std::to_string(region->id) + " " + std::to_string(drags_));
}

void RegionsPanel::Step(int by) {
  const int row = list_->currentItem() ? list_->indexOfTopLevelItem(list_->currentItem()) : -1;
  const int to = row + by;
  if (row < 0 || to < 0 || to >= list_->topLevelItemCount()) return;
  controller_->Move(window_->current_region(), size_t(to));
}

}  // namespace retint
