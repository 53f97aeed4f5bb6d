// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/regions_panel.h"

#include <algorithm>
#include <utility>

#include <QGridLayout>
#include <QHeaderView>
#include <QLabel>
#include <QMenu>
#include <QPainter>
#include <QSignalBlocker>
#include <QSlider>
#include <QSpinBox>
#include <QToolButton>
#include <QVBoxLayout>

#include "base/error.h"
#include "recolor/palette.h"
#include "viewer/canvas/canvas.h"
#include "viewer/canvas/contrast.h"
#include "viewer/panels/edit_panel.h"
#include "viewer/panels/guide.h"
#include "viewer/panels/jump_slider.h"
#include "viewer/panels/layer_style.h"
#include "viewer/panels/operation_views.h"
#include "viewer/panels/row_tree.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/widgets/long_text.h"

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

}  // namespace

RegionsPanel::RegionsPanel(SceneController* controller, Canvas* canvas, CurrentRegion* current)
    : controller_(controller), canvas_(canvas), current_(current) {
  setObjectName("regions_panel");
  list_ = new RowTree;
  list_->setObjectName("region_list");
  list_->setAccessibleName(tr("Regions"));
  list_->setColumnCount(kColumns);
  list_->setHeaderLabels({tr("Region"), tr("Solo"), tr("Color"), tr("Opacity")});
  list_->setToolTip(
      tr("The first is applied first; drag to reorder.\nSolo shows one region alone; it is not an "
         "edit.\n"
         "Show or hide: Space · "
         "rename: F2 · duplicate: Ctrl+D · delete: Del · move: Alt+Up, Alt+Down"));
  list_->header()->setStretchLastSection(false);
  list_->header()->setSectionResizeMode(kName, QHeaderView::Stretch);
  for (const int column : {kSolo, kColor, kStrength}) {
    list_->header()->setSectionResizeMode(column, QHeaderView::ResizeToContents);
  }
  empty_ = new QLabel(tr("No region yet. Stop at a good view and press Enter or B to paint one."));
  empty_->setWordWrap(true);
  empty_->setMargin(8);
  empty_->setAlignment(Qt::AlignTop | Qt::AlignLeft);
  BuildButtons();
  BuildEditors();
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 6, 6, 6);
  layout->addWidget(buttons_);
  layout->addWidget(empty_);
  layout->addWidget(list_);
  layout->addWidget(editors_);
  layout->addStretch(1);

  connect(list_, &QTreeWidget::itemChanged, this, &RegionsPanel::OnItemChanged);
  connect(list_, &QTreeWidget::currentItemChanged, this, [this](QTreeWidgetItem* item) {
    if (!filling_) current_->Set(IdOf(item));
  });
  connect(list_, &RowTree::rowMoved, this, [this](int from, int to) {
    controller_->Do(MoveRegion{IdOf(list_->topLevelItem(from)), size_t(to)});
  });
  connect(list_, &RowTree::deletePressed, remove_, &QToolButton::click);
  connect(list_, &RowTree::duplicatePressed, this, [this] {
    if (Current()) controller_->Duplicate(current_->id());
  });
  list_->setContextMenuPolicy(Qt::CustomContextMenu);
  connect(list_, &QWidget::customContextMenuRequested, this, [this](const QPoint& at) {
    QTreeWidgetItem* item = list_->itemAt(at);
    if (!item) return;
    list_->setCurrentItem(item);
    auto* menu = new QMenu(this);
    menu->setAttribute(Qt::WA_DeleteOnClose);
    FillMenu(menu);
    menu->popup(list_->viewport()->mapToGlobal(at));
  });
  connect(list_, &RowTree::stepPressed, this, &RegionsPanel::Step);
  connect(list_, &RowTree::renamePressed, this, &RegionsPanel::Rename);
  connect(controller_, &SceneController::regionsChanged, this, &RegionsPanel::Refresh);
  const auto fresh = [this] {
    colors_.Clear();
    waiting_.reset();
    ahead_.reset();
    Refresh();
  };
  connect(controller_, &SceneController::opened, this, fresh);
  connect(controller_, &SceneController::closed, this, fresh);
  connect(current_, &CurrentRegion::changed, this, &RegionsPanel::Refresh);
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
               [this] { Q_EMIT paintWanted(0); });
  extend_ = add("region_extend", tr("Paint"), tr("Extend or erase this region from this view"),
                [this] { Q_EMIT paintWanted(current_->id()); });
  remove_ = add("region_delete", QStringLiteral("−"), tr("Delete this region (Del in the list)"),
                [this] { controller_->Do(RemoveRegion{current_->id()}); });
  layout->addStretch();
  layout->addWidget(MakeGuideButton("Edit colors"));
}

void RegionsPanel::Rename() {
  if (list_->currentItem()) list_->editItem(list_->currentItem(), kName);
}

// Of the region without its edit; the steps before the palette are applied to the colors found.
void RegionsPanel::MeasurePalette(int count, int before) {
  const RegionId id = current_->id();
  controller_->Ask(
      tr("Measuring the main colors"),
      [=](EditSession& session, Monitor&) { return session.store().MeasurePalette(id, count); },
      [=, this](const std::vector<PaletteColor>& found) {
        const Region* region = Current();
        if (!region || region->id != id || found.empty()) return;
        ColorEdit steps = region->edit;
        steps.operations.resize(std::min(size_t(before), steps.operations.size()));
        const CompiledEdit compiled(steps.NeedsMainColor() ? ColorEdit() : steps);
        ColorOperation palette = ColorOperation::Palette(int(found.size()));
        for (size_t i = 0; i < found.size(); ++i) {
          const Eigen::Vector3f color =
              compiled.Apply(Eigen::Vector3f(found[i].rgb.data())).cwiseMax(0).cwiseMin(1);
          std::ranges::copy(color, palette.values.begin() + std::ptrdiff_t(i * kPairValues));
        }
        edit_->TakePalette(palette);
      });
}

void RegionsPanel::MeasureAhead() {
  const Region* of = Current();
  if (!of || !of->edit.operations.empty()) return;
  using Found = std::optional<ColorOperation>;
  controller_->Ask(
      {},
      [id = of->id](EditSession& session, Monitor&) -> Found {
        const ColorOperation recolor = NewOperation(ColorOperationKind::kRecolor, Qt::gray);
        try {
          return session.store().MeasureEdit(id, {{recolor}, 1}).operations.front();
        } catch (const Error&) {
          return std::nullopt;  // the first color says what is wrong
        }
      },
      [this, id = of->id](const Found& found) {
        const Region* region = Current();
        const bool fits = region && region->id == id && region->edit.operations.empty();
        if (found && fits) ahead_ = Ahead{id, *found};
      });
}

void RegionsPanel::FillMenu(QMenu* menu) {
  menu->setObjectName("region_menu");
  const auto add = [&](const char* name, const QString& text, auto act) {
    menu->addAction(text, this, act)->setObjectName(name);
  };
  add("menu_paint", tr("Paint…"), [this] { extend_->click(); });
  menu->addSeparator();
  add("menu_rename", tr("Rename\tF2"), [this] { Rename(); });
  add("menu_duplicate", tr("Duplicate\tCtrl+D"), [this] { Q_EMIT list_->duplicatePressed(); });
  menu->addSeparator();
  add("menu_split", tr("Split Gaussians…"), [this] { Q_EMIT splitWanted(); });
  add("menu_masks", tr("Save masks…"), [this] { Q_EMIT masksWanted(); });
  menu->addSeparator();
  add("menu_delete", tr("Delete\tDel"), [this] { remove_->click(); });
}

void RegionsPanel::BuildEditors() {
  editors_ = new QWidget;
  editors_->setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Minimum);
  auto* layout = new QGridLayout(editors_);
  layout->setContentsMargins(0, 4, 0, 0);
  title_ = new ElidedLabel;
  layout->addWidget(title_, 0, 0, 1, 3);
  edit_ = new EditPanel;
  layout->addWidget(edit_, 1, 0, 1, 3);
  auto* label = new QLabel(tr("Opaci&ty"));
  strength_ = new JumpSlider(Qt::Horizontal);
  strength_->setObjectName("strength");
  strength_->setRange(0, 100);
  strength_->setAccessibleName(tr("Opacity"));
  strength_->setToolTip(tr("How much of all steps is done, in percent (Alt+T, arrows)"));
  percent_ = new QSpinBox;
  percent_->setObjectName("strength_percent");
  percent_->setRange(0, 100);
  percent_->setSuffix(tr(" %"));
  percent_->setKeyboardTracking(false);
  percent_->setAccessibleName(tr("Opacity in percent"));
  label->setBuddy(strength_);
  layout->addWidget(label, 2, 0);
  layout->addWidget(strength_, 2, 1);
  layout->addWidget(percent_, 2, 2);
  connect(edit_, &EditPanel::edited, this, &RegionsPanel::OnEdit);
  connect(edit_, &EditPanel::pickWanted, canvas_, [this] { canvas_->SetPicking(true); });
  connect(edit_, &EditPanel::elsewhereWanted, this, &RegionsPanel::elsewhereWanted);
  connect(edit_, &EditPanel::splitWanted, this, &RegionsPanel::splitWanted);
  connect(edit_, &EditPanel::paletteWanted, this, &RegionsPanel::MeasurePalette);
  connect(edit_, &EditPanel::pixelsWanted, this, [this] {
    const RegionId id = current_->id();
    controller_->Ask(
        {},
        [id](EditSession& session, Monitor&) {
          const bool exists = session.store().regions().Find(id) != nullptr;  // not deleted since
          return exists ? session.store().MeasurePixels(id) : std::vector<float>();
        },
        [this, id](const std::vector<float>& pixels) { edit_->TakePixels(id, pixels); });
  });
  connect(canvas_, &Canvas::picked, edit_, &EditPanel::TakePicked);
  connect(strength_, &QSlider::sliderPressed, this, [this] { ++drags_; });
  connect(strength_, &QSlider::valueChanged, this, &RegionsPanel::OnStrength);
  connect(percent_, &QSpinBox::valueChanged, this, &RegionsPanel::OnStrength);
}

RegionId RegionsPanel::IdOf(const QTreeWidgetItem* item) const {
  return item ? item->data(kName, Qt::UserRole).toUInt() : 0;
}

const Region* RegionsPanel::Current() const { return controller_->regions().Find(current_->id()); }

void RegionsPanel::FillRow(QTreeWidgetItem* item, const Region& region, bool solo) {
  const QString name = QString::fromStdString(region.name);
  item->setData(kName, Qt::UserRole, region.id);
  item->setText(kName, name);
  item->setToolTip(kName, name);
  item->setCheckState(kName, region.visible ? Qt::Checked : Qt::Unchecked);
  item->setCheckState(kSolo, solo ? Qt::Checked : Qt::Unchecked);
  const bool untouched = ChangesNothing(region.edit);
  const QColor named = NamedColor(region.edit);
  const QColor color = untouched         ? QColor()
                       : named.isValid() ? named
                                         : Edited(region.edit, BaseOf(region));
  const auto& operations = region.edit.operations;
  const QString text = untouched                ? tr("none yet")
                       : named.isValid()        ? named.name()
                       : operations.size() == 1 ? OperationTitle(operations.front())
                                                : tr("%1 steps").arg(operations.size());
  if (item->data(kColor, Qt::UserRole).value<QColor>() != color) {
    item->setData(kColor, Qt::UserRole, color);
    item->setIcon(kColor, color.isValid() ? Swatch(color, palette()) : QIcon());
  }
  item->setText(kColor, text);
  item->setText(kStrength, tr("%1 %").arg(qRound(region.strength * 100)));
  item->setTextAlignment(kStrength, Qt::AlignRight | Qt::AlignVCenter);
  // Set anew, even the same flags would reset the text of an editor that is open.
  const Qt::ItemFlags flags = Qt::ItemIsEnabled | Qt::ItemIsSelectable | Qt::ItemIsUserCheckable |
                              Qt::ItemIsEditable | Qt::ItemNeverHasChildren;
  if (item->flags() != flags) item->setFlags(flags);
}

// The color that a first recolor replaces was measured in the views, or named.
QColor RegionsPanel::BaseOf(const Region& region) {
  const auto& operations = region.edit.operations;
  if (!operations.empty() && operations.front().kind == ColorOperationKind::kRecolor &&
      operations.front().IsSet("from")) {
    return ToColor(operations.front().Get("from"));
  }
  const auto facts = controller_->facts();
  const QColor color = facts ? colors_.Before(region, *facts->original) : QColor();
  return color.isValid() ? color : QColor(Qt::gray);
}

void RegionsPanel::Refresh() {
  const Region* of = Current();
  if (ahead_ && (!of || of->id != ahead_->region || !of->edit.operations.empty())) ahead_.reset();
  SendWaiting();
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
    if (regions[i].id == current_->id()) current = item;
  }
  list_->setCurrentItem(current);
  filling_ = false;
  FitList();
  setFocusProxy(regions.empty() ? static_cast<QWidget*>(paint_) : list_);
  empty_->setVisible(regions.empty());
  list_->setVisible(!regions.empty());
  ShowCurrent();
}

// As high whatever it holds, so that nothing below it moves.
void RegionsPanel::FitList() {
  constexpr int kRows = 3;
  const int row = LayerHeight(*list_);
  const int height = list_->header()->sizeHint().height() + 2 * list_->frameWidth() + kRows * row;
  list_->setFixedHeight(height);
  empty_->setFixedHeight(height);
}

void RegionsPanel::ShowCurrent() {
  const Region* region = Current();
  const bool open = controller_->IsOpen();
  paint_->setEnabled(open && !selecting_);
  for (QWidget* widget : std::initializer_list<QWidget*>{remove_, editors_}) {
    widget->setEnabled(region != nullptr);
  }
  extend_->setEnabled(region && !selecting_);
  const bool untouched = region && ChangesNothing(region->edit);
  const QString name = region ? QString::fromStdString(region->name) : QString();
  title_->setText(!region     ? tr("Edit: choose a region")
                  : untouched ? tr("Now choose a color for %1").arg(name)
                              : tr("Edit of %1").arg(name));
  QFont font = this->font();
  font.setBold(untouched);
  title_->setFont(font);
  if (!region) return edit_->Show(0, {}, Qt::gray);
  const bool waits = waiting_ && waiting_->region == region->id;
  edit_->Show(region->id, waits ? waiting_->edit : region->edit, BaseOf(*region));
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
  if (visible != region->visible) controller_->Do(SetVisible{id, visible});
  if (name.isEmpty()) return Refresh();
  if (name.toStdString() != region->name) controller_->Do(RenameRegion{id, name.toStdString()});
}

void RegionsPanel::OnEdit(const ColorEdit& chosen, bool dragging) {
  const Region* region = Current();
  if (!region) return;
  ColorEdit edit = chosen;
  if (ahead_ && !edit.operations.empty()) TakeMeasured(edit.operations.front(), ahead_->recolor);
  const std::string key = "edit " + std::to_string(region->id) + " " + std::to_string(drags_);
  if (!dragging) ++drags_;
  canvas_->SetCloudShown(false);  // it would hide the color that is chosen
  if (region->edit.NeedsMainColor()) {
    waiting_ = Waiting{region->id, edit, key};
  } else if (edit != region->edit) {
    controller_->Do(SetEdit{region->id, edit, region->strength}, key);
  }
}

// A color may be dragged faster than the main color that it replaces is measured.
void RegionsPanel::SendWaiting() {
  if (!waiting_) return;
  const Region* region = controller_->regions().Find(waiting_->region);
  if (region && region->edit.NeedsMainColor()) return;
  Waiting next = *std::exchange(waiting_, std::nullopt);
  if (!region) return;  // deleted meanwhile
  const auto& measured = region->edit.operations;
  auto& operations = next.edit.operations;
  bool any = !next.edit.NeedsMainColor();
  for (size_t i = 0; i < std::min(measured.size(), operations.size()); ++i) {
    any |= TakeMeasured(operations[i], measured[i]);
  }
  // Without any it could not be measured, which has been said.
  if (any && next.edit != region->edit) {
    controller_->Do(SetEdit{next.region, next.edit, region->strength}, next.key);
  }
}

void RegionsPanel::SetSelecting(bool selecting) {
  selecting_ = selecting;
  edit_->SetCanPick(!selecting);
  ShowCurrent();
}

void RegionsPanel::OnStrength(int percent) {
  const Region* region = Current();
  if (!region || qRound(region->strength * 100) == percent) return;
  std::string key;  // of a drag, which is one step
  if (strength_->isSliderDown()) {
    key = "strength " + std::to_string(region->id) + " " + std::to_string(drags_);
  }
  controller_->Do(SetEdit{region->id, region->edit, float(percent) / 100.0F}, key);
}

void RegionsPanel::Step(int by) {
  const int row = list_->currentItem() ? list_->indexOfTopLevelItem(list_->currentItem()) : -1;
  const int to = row + by;
  if (row < 0 || to < 0 || to >= list_->topLevelItemCount()) return;
  controller_->Do(MoveRegion{current_->id(), size_t(to)});
}

}  // namespace retint
