// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/edit_panel.h"

#include <algorithm>
#include <utility>

#include <QActionGroup>
#include <QApplication>
#include <QClipboard>
#include <QHeaderView>
#include <QLabel>
#include <QMenu>
#include <QSignalBlocker>
#include <QStackedLayout>
#include <QToolButton>
#include <QVBoxLayout>

#include "base/error.h"
#include "recolor/edit_text.h"
#include "viewer/panels/color_picker.h"
#include "viewer/panels/edit_pages.h"
#include "viewer/panels/layer_style.h"
#include "viewer/panels/operation_views.h"
#include "viewer/panels/row_tree.h"
#include "viewer/widgets/long_text.h"

namespace retint {
namespace {

using Kind = ColorOperationKind;

enum Column { kName, kStrength, kColumns };
constexpr int kRows = 3;  // visible without scrolling

void ForgetMeasured(ColorEdit& edit, size_t from) {
  for (size_t i = from; i < edit.operations.size(); ++i) ForgetMeasured(edit.operations[i]);
}

// As wide as the widest page, and as high as the current page at its width.
class PageLayout : public QStackedLayout {
 public:
  bool hasHeightForWidth() const override { return true; }
  int heightForWidth(int width) const override {
    const QWidget* page = currentWidget();
    if (!page) return 0;
    return page->hasHeightForWidth() ? page->heightForWidth(width) : page->sizeHint().height();
  }
  QSize sizeHint() const override { return WithHeight(QStackedLayout::sizeHint().width()); }
  QSize minimumSize() const override { return WithHeight(QStackedLayout::minimumSize().width()); }

 private:
  QSize WithHeight(int width) const { return {width, heightForWidth(width)}; }
};

}  // namespace

EditPanel::EditPanel(QWidget* parent) : QWidget(parent) {
  setObjectName("edit_panel");
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(4);
  BuildList();
  BuildPages();
  picker_ = new ColorPicker;
  picker_->setObjectName("color_picker");
  problem_ = new QLabel;
  problem_->setObjectName("edit_problem");
  problem_->setWordWrap(true);
  problem_->hide();
  mode_name_ = new QLabel;
  mode_name_->setObjectName("mode_name");
  QFont font = mode_name_->font();
  font.setBold(true);
  mode_name_->setFont(font);
  layout->addWidget(list_box_);
  layout->addWidget(mode_name_);
  layout->addWidget(picker_);
  layout->addLayout(pages_);
  layout->addWidget(problem_);
  connect(picker_, &ColorPicker::changed, this,
          [this](const QColor& color, bool dragging) { page()->ChooseColor(color, dragging); });
  connect(picker_, &ColorPicker::pickWanted, this, [this] {
    pick_for_page_ = false;
    Q_EMIT pickWanted();
  });
  ShowAll();
}

void EditPanel::BuildList() {
  list_box_ = new QWidget;
  auto* layout = new QVBoxLayout(list_box_);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(3);
  auto* buttons = new QHBoxLayout;
  buttons->setSpacing(3);
  const auto add = [&](const char* name, const QString& text, const QString& tip) {
    auto* button = new QToolButton;
    button->setObjectName(name);
    button->setText(text);
    button->setToolTip(tip);
    button->setAccessibleName(tip);
    button->setFocusPolicy(Qt::StrongFocus);
    buttons->addWidget(button);
    return button;
  };
  add_ = add("operation_add", QStringLiteral("+"), tr("Add a step at the end of the list"));
  add_->setPopupMode(QToolButton::InstantPopup);
  add_->setMenu(new QMenu(add_));
  remove_ = add("operation_remove", QStringLiteral("−"), tr("Remove this step (Del in the list)"));
  buttons->addStretch();
  copy_ = add("edit_copy", tr("Copy"), tr("Copy all steps, as the text of an edit.json"));
  paste_ = add("edit_paste", tr("Paste"), tr("Replace all steps by those that were copied"));
  layout->addLayout(buttons);
  list_ = new RowTree;
  list_->setObjectName("operation_list");
  list_->setAccessibleName(tr("Steps"));
  list_->setColumnCount(kColumns);
  list_->setHeaderHidden(true);
  list_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  list_->setToolTip(tr(
      "What is done to the colors, the first at first. An eye switches a step off and on; drag to "
      "reorder; double-click the percentage to do less of it.\nOff and on: Space · percentage: "
      "F2 · remove: Del · move: Alt+Up, Alt+Down"));
  list_->header()->setStretchLastSection(false);
  list_->header()->setSectionResizeMode(kName, QHeaderView::Stretch);
  list_->header()->setSectionResizeMode(kStrength, QHeaderView::ResizeToContents);
  layout->addWidget(list_);
  connect(remove_, &QToolButton::clicked, this, [this] { RemoveRow(row_); });
  const auto edit_strength = [this](QTreeWidgetItem* item) {
    if (item) list_->editItem(item, kStrength);
  };
  connect(list_, &QTreeWidget::itemDoubleClicked, this, [=](QTreeWidgetItem* item, int column) {
    if (column == kStrength) edit_strength(item);
  });
  connect(list_, &RowTree::renamePressed, this, [=, this] { edit_strength(list_->currentItem()); });
  connect(copy_, &QToolButton::clicked, this, &EditPanel::Copy);
  connect(paste_, &QToolButton::clicked, this, &EditPanel::Paste);
  connect(list_, &RowTree::deletePressed, remove_, &QToolButton::click);
  connect(list_, &RowTree::stepPressed, this, [this](int by) { MoveRow(row_, row_ + by); });
  connect(list_, &RowTree::rowMoved, this, &EditPanel::MoveRow);
  connect(list_, &QTreeWidget::itemChanged, this, &EditPanel::OnItemChanged);
  connect(list_, &QTreeWidget::currentItemChanged, this, [this](QTreeWidgetItem* item) {
    if (!filling_ && item) SetRow(list_->indexOfTopLevelItem(item));
  });
}

void EditPanel::BuildPages() {
  modes_ = new QActionGroup(this);
  pages_ = new PageLayout;
  AddPage("recolor", tr("Recolor"), tr("Make it this color: shading and highlights stay"),
          new RecolorPage);
  AddPage("adjust", tr("Adjust"), tr("Turn hues, change chroma and lightness, in OKLCh"),
          new AdjustPage);
  AddPage("curves", tr("Curves"), tr("Draw how bright dark, middle and light colors become"),
          new TonePage(Tone::Kind::kCurve));
  AddPage("levels", tr("Levels"), tr("Set black, middle and white"),
          new TonePage(Tone::Kind::kLevels));
  AddPage("grade", tr("Grade"), tr("Exposure, contrast, gamma, white balance, saturation"),
          new GradePage);
  lut_ = new LutPage;
  AddPage("lut", tr("LUT"), tr("Look colors up in a table from a file"), lut_);
  connect(lut_, &LutPage::added, this,
          [this](const ColorOperation& operation) { Insert(operation, false); });
  AddPage("gradient", tr("Gradient"), tr("Replace colors by their lightness"), new GradientPage);
  palette_ = new PalettePage;
  AddPage("palette", tr("Palette"), tr("Give each of the region's main colors another one"),
          palette_);
  connect(palette_, &PalettePage::measureWanted, this, [this](int count) {
    const int row = IndexOf(Kind::kPalette, pages_->indexOf(palette_));
    Q_EMIT paletteWanted(count, row < 0 ? int(edit_.operations.size()) : row);
  });
  auto* picture = new PicturePage;
  AddPage("picture", tr("Picture"), tr("Take over what was painted on a view in another program"),
          picture);
  connect(picture, &PicturePage::elsewhereWanted, this, &EditPanel::elsewhereWanted);
  connect(picture, &PicturePage::splitWanted, this, &EditPanel::splitWanted);
  AddPage("tint", tr("Tint"), tr("Multiply the colors, as the ReCoGS paper does"), new TintPage);
  QMenu* more = add_->menu()->addMenu(tr("More"));
  FillMore(more);
  // For operations from elsewhere: the menu has no entry for it.
  AddPage("matrix", tr("Matrix"), tr("Any affine map of the colors"), new MatrixPage);
  modes_->actions().back()->setVisible(false);
  connect(modes_, &QActionGroup::triggered, this, [this](const QAction* action) {
    SetMode(int(modes_->actions().indexOf(action)));
    asked_of_ = 0;  // the region may be larger than when its pixels were measured
    row_ = RowOfPage();
    ShowAll();
  });
}

void EditPanel::AddPage(const char* name, const QString& text, const QString& tip, EditPage* page) {
  QAction* action = add_->menu()->addAction(text);
  action->setObjectName(QStringLiteral("mode_%1").arg(name));
  action->setToolTip(tip);
  action->setCheckable(true);
  modes_->addAction(action);
  pages_->addWidget(page);
  connect(page, &EditPage::changed, this, &EditPanel::Take);
  connect(page, &EditPage::removed, this, &EditPanel::RemoveFromPage);
  connect(page, &EditPage::colorChanged, this, [this, page] { picker_->SetColor(page->color()); });
  connect(page, &EditPage::pickWanted, this, [this] {
    pick_for_page_ = true;
    Q_EMIT pickWanted();
  });
}

// An entry for each operation, even if the edit already has one of its kind.
void EditPanel::FillMore(QMenu* menu) {
  menu->setObjectName("operation_more");
  for (const ColorOperationType& type : ColorOperationTypes()) {
    if (type.kind == Kind::kPicture) continue;  // does not come from here
    QAction* action =
        menu->addAction(OperationTitle(type.kind), this, [this, kind = type.kind] { Add(kind); });
    action->setObjectName(type.name);
  }
}

QWidget* EditPanel::ColorControl() const {
  return page()->color().isValid() ? static_cast<QWidget*>(&picker_->square()) : list_;
}

// --- Showing -------------------------------------------------------------------------------------

EditPage* EditPanel::page() const { return static_cast<EditPage*>(pages_->currentWidget()); }

int EditPanel::ModeOf(const ColorOperation& operation) const {
  for (int mode = 0; mode < pages_->count(); ++mode) {
    if (static_cast<EditPage*>(pages_->widget(mode))->Shows(operation)) return mode;
  }
  return 0;
}

int EditPanel::IndexOf(Kind kind, int mode) const {
  const auto& operations = edit_.operations;
  const auto* of = static_cast<EditPage*>(pages_->widget(mode));
  const auto is_it = [&](const ColorOperation& one) { return one.kind == kind && of->Shows(one); };
  if (row_ >= 0 && is_it(operations[size_t(row_)])) return row_;
  const auto found = std::ranges::find_if(operations, is_it);
  return found == operations.end() ? -1 : int(found - operations.begin());
}

int EditPanel::RowOfPage() const {
  for (const Kind kind : page()->kinds()) {
    if (const int row = IndexOf(kind, mode_); row >= 0) return row;
  }
  return -1;
}

void EditPanel::Show(uint64_t subject, const ColorEdit& edit, const QColor& base) {
  const bool another = subject != subject_;
  subject_ = subject;
  base_ = base;
  const int old_count = int(edit_.operations.size());
  edit_ = edit;
  const int count = int(edit_.operations.size());
  if (another) {
    strengths_.clear();
    Complain({});
    row_ = count - 1;
    SetMode(count > 0 ? ModeOf(edit_.operations.back()) : 0);
  } else {
    row_ = std::min(row_, count - 1);
    // If a step came back, or from elsewhere, choose the page that shows it.
    if (row_ < 0 && count > old_count) row_ = RowOfPage();
  }
  for (int i = 0; i < pages_->count(); ++i) {
    static_cast<EditPage*>(pages_->widget(i))->SetSubject(subject, base);
  }
  ShowAll();
}

void EditPanel::ShowAll() {
  ShowList();
  ShowPage();
}

void EditPanel::ShowList() {
  filling_ = true;
  const auto& operations = edit_.operations;
  while (list_->topLevelItemCount() > int(operations.size())) {
    delete list_->takeTopLevelItem(list_->topLevelItemCount() - 1);
  }
  while (list_->topLevelItemCount() < int(operations.size())) new QTreeWidgetItem(list_);
  for (size_t i = 0; i < operations.size(); ++i) {
    QTreeWidgetItem* item = list_->topLevelItem(int(i));
    const QString text = OperationSummary(operations[i]);
    item->setText(kName, text);
    item->setToolTip(kName, text);
    item->setCheckState(kName, operations[i].strength > 0 ? Qt::Checked : Qt::Unchecked);
    item->setText(kStrength, tr("%1 %").arg(qRound(operations[i].strength * 100)));
    item->setTextAlignment(kStrength, Qt::AlignRight | Qt::AlignVCenter);
    // Setting even the same flags would reset the text of an open editor.
    const Qt::ItemFlags flags = Qt::ItemIsEnabled | Qt::ItemIsSelectable | Qt::ItemIsEditable |
                                Qt::ItemIsUserCheckable | Qt::ItemNeverHasChildren;
    if (item->flags() != flags) item->setFlags(flags);
  }
  list_->setCurrentItem(row_ >= 0 ? list_->topLevelItem(row_) : nullptr);
  filling_ = false;
  // A constant height, so that nothing below moves.
  const int row = LayerHeight(*list_);
  list_->setFixedHeight(kRows * row + 2 * list_->frameWidth());
  const int count = int(operations.size());
  remove_->setEnabled(row_ >= 0);
  add_->setEnabled(count < kMaxColorOps);
  copy_->setEnabled(count > 0);
}

void EditPanel::ShowPage() {
  modes_->actions().at(mode_)->setChecked(true);
  mode_name_->setText(modes_->actions().at(mode_)->text());
  page()->Show([this](Kind kind) -> const ColorOperation* {
    const int index = IndexOf(kind, mode_);
    return index < 0 ? nullptr : &edit_.operations[size_t(index)];
  });
  const QColor color = page()->color();
  picker_->setVisible(color.isValid());
  if (color.isValid()) picker_->SetColor(color);
  ShowHistogram();
}

// The histogram of the colors after the earlier steps.
void EditPanel::ShowHistogram() {
  auto* tone = qobject_cast<TonePage*>(page());
  if (!tone || subject_ == 0) return;
  if (asked_of_ != subject_) {
    asked_of_ = subject_;
    Q_EMIT pixelsWanted();
  }
  if (pixels_of_ != subject_) return tone->SetHistogram({});
  const int row = IndexOf(Kind::kLut, mode_);
  ColorEdit before = edit_;
  before.strength = 1;
  if (row >= 0) before.operations.resize(size_t(row));
  std::vector<float> pixels = pixels_;
  // The main color of an earlier step comes soon, and shows the histogram again.
  if (!before.NeedsMainColor()) CompiledEdit(before).ApplyToAll(pixels);
  tone->SetHistogram(LumaHistogram(pixels));
}

void EditPanel::TakePixels(uint64_t subject, const std::vector<float>& pixels) {
  constexpr size_t kMost = 20000;
  const size_t step = pixels.size() / 3 / kMost + 1;
  pixels_.clear();
  for (size_t i = 0; i + 2 < pixels.size(); i += 3 * step) {
    pixels_.insert(pixels_.end(), {pixels[i], pixels[i + 1], pixels[i + 2]});
  }
  pixels_of_ = subject;
  ShowHistogram();
}

void EditPanel::SetMode(int mode) {
  mode_ = mode;
  pages_->setCurrentIndex(mode);
  pages_->invalidate();
}

void EditPanel::SetRow(int row) {
  row_ = row;
  SetMode(ModeOf(edit_.operations[size_t(row)]));
  ShowAll();
}

// --- Input ---------------------------------------------------------------------------------------

bool EditPanel::Send(ColorEdit edit, bool dragging) {
  try {
    edit.Check();
  } catch (const OptionError& error) {
    Complain(QString::fromUtf8(error.what()));
    return false;
  }
  Complain({});
  edit_ = std::move(edit);
  row_ = std::min(row_, int(edit_.operations.size()) - 1);
  ShowAll();
  Q_EMIT edited(edit_, dragging);
  return true;
}

void EditPanel::Complain(const QString& problem) {
  problem_->setText(Breakable(problem));
  problem_->setVisible(!problem.isEmpty());
}

void EditPanel::Add(Kind kind) {
  if (kind == Kind::kLut) {  // needs a file first
    SetMode(pages_->indexOf(lut_));
    ShowAll();
    return lut_->Choose(true);
  }
  Insert(NewOperation(kind, picker_->color()), false);
}

void EditPanel::Insert(const ColorOperation& operation, bool dragging) {
  ColorEdit edit = edit_;
  auto at = edit.operations.end();
  // The soft clip of colors stays the last step.
  if (operation.kind != Kind::kSoftClip) {
    while (at != edit.operations.begin() && std::prev(at)->kind == Kind::kSoftClip) --at;
  }
  const int before = std::exchange(row_, int(at - edit.operations.begin()));
  const int mode = mode_;
  edit.operations.insert(at, operation);
  strengths_.clear();
  SetMode(ModeOf(operation));
  if (Send(std::move(edit), dragging)) return;
  row_ = before;
  SetMode(mode);
  ShowAll();
}

// Takes an operation from a page: replaces the shown one, or adds it.
void EditPanel::Take(const ColorOperation& operation, bool dragging) {
  const int index = IndexOf(operation.kind, ModeOf(operation));
  if (index < 0) return Insert(operation, dragging);
  ColorEdit edit = edit_;
  edit.operations[size_t(index)] = operation;
  // During a drag, later steps keep their measured colors, because measuring takes too long.
  if (!dragging) ForgetMeasured(edit, size_t(index) + 1);
  row_ = index;
  Send(std::move(edit), dragging);
}

void EditPanel::RemoveRow(int row) {
  if (row < 0 || row >= int(edit_.operations.size())) return;
  ColorEdit edit = edit_;
  edit.operations.erase(edit.operations.begin() + row);
  ForgetMeasured(edit, size_t(row));
  strengths_.clear();
  Send(std::move(edit), false);
}

// The page stays, and chooses another operation that it shows.
void EditPanel::RemoveFromPage(Kind kind) {
  RemoveRow(IndexOf(kind, mode_));
  row_ = RowOfPage();
  ShowAll();
}

void EditPanel::MoveRow(int from, int to) {
  const int count = int(edit_.operations.size());
  if (from < 0 || to < 0 || from >= count || to >= count || from == to) return;
  ColorEdit edit = edit_;
  const ColorOperation moved = edit.operations[size_t(from)];
  edit.operations.erase(edit.operations.begin() + from);
  edit.operations.insert(edit.operations.begin() + to, moved);
  ForgetMeasured(edit, size_t(std::min(from, to)));
  strengths_.clear();
  row_ = to;
  Send(std::move(edit), false);
}

// Off means a strength of 0. Switched on again, the operation gets its old strength.
void EditPanel::OnItemChanged(QTreeWidgetItem* item, int column) {
  if (filling_) return;
  const int row = list_->indexOfTopLevelItem(item);
  if (column == kStrength) return SetStrength(row, item->text(kStrength));
  const bool on = item->checkState(kName) == Qt::Checked;
  ColorEdit edit = edit_;
  float& strength = edit.operations[size_t(row)].strength;
  if (on == (strength > 0)) return;
  if (on) {
    const auto old = strengths_.find(row);
    strength = old == strengths_.end() ? 1 : old->second;
  } else {
    strengths_[row] = std::exchange(strength, 0.0F);
  }
  ForgetMeasured(edit, size_t(row) + 1);
  Send(std::move(edit), false);
}

// Takes typed text: "40" or "40 %".
void EditPanel::SetStrength(int row, const QString& percent) {
  bool is_number = false;
  const double value = QString(percent).remove('%').trimmed().toDouble(&is_number);
  if (!is_number || value < 0 || value > 100) {
    ShowList();
    return Complain(tr("A step is done by 0 to 100 percent."));
  }
  ColorEdit edit = edit_;
  edit.operations[size_t(row)].strength = float(value / 100);
  ForgetMeasured(edit, size_t(row) + 1);
  Send(std::move(edit), false);
}

void EditPanel::Copy() {
  QApplication::clipboard()->setText(
      QString::fromStdString(EditToJson(edit_, /*with_tables=*/true)));
}

void EditPanel::Paste() {
  const QString text = QApplication::clipboard()->text();
  ColorEdit edit;
  try {
    edit = EditFromJson(text.toStdString(), {});
  } catch (const Error& error) {
    return Complain(tr("What was copied is no edit: %1").arg(QString::fromUtf8(error.what())));
  }
  // Another region has another main color.
  ForgetMeasured(edit, 0);
  strengths_.clear();
  const int last = int(edit.operations.size()) - 1;
  if (Send(std::move(edit), false) && last >= 0) SetRow(last);
}

void EditPanel::SetCanPick(bool can) {
  picker_->SetCanPick(can);
  for (int i = 0; i < pages_->count(); ++i) {
    static_cast<EditPage*>(pages_->widget(i))->SetCanPick(can);
  }
  ShowPage();
}

void EditPanel::TakePalette(const ColorOperation& palette) {
  palette_->TakeMeasured(palette);
  ShowPage();
}

void EditPanel::TakePicked(const QColor& color) {
  if (pick_for_page_) return page()->TakePicked(color);
  picker_->Choose(color);
}

}  // namespace retint
