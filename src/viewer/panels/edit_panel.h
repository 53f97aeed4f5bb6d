// SPDX-License-Identifier: BSD-3-Clause
// The editor of one edit: the list of its steps, and the page of the chosen one. It does not know
// regions: it gets an edit, and emits the user's changes.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <QColor>
#include <QWidget>

#include "recolor/color_edit.h"

class QAction;
class QActionGroup;
class QLabel;
class QMenu;
class QStackedLayout;
class QToolButton;
class QTreeWidgetItem;

namespace retint {

class ColorPicker;
class EditPage;
class LutPage;
class PalettePage;
class RowTree;

class EditPanel : public QWidget {
  Q_OBJECT

 public:
  explicit EditPanel(QWidget* parent = nullptr);

  // Shows the edit of `subject`, a region. A new subject starts in the mode of its last operation.
  // `base` is its color without an edit.
  void Show(uint64_t subject, const ColorEdit& edit, const QColor& base);
  const ColorEdit& edit() const { return edit_; }
  // The widget with the keyboard focus to choose a color: the page's color square, else the steps.
  QWidget* ColorControl() const;
  RowTree& list() { return *list_; }
  // The answer to pickWanted(): a color of the picture.
  void TakePicked(const QColor& color);
  void SetCanPick(bool can);  // whether the owner can answer pickWanted()
  void TakePalette(const ColorOperation& palette);
  // [P, 3]: the answer to pixelsWanted().
  void TakePixels(uint64_t subject, const std::vector<float>& pixels);

 Q_SIGNALS:
  // By the user; the edit is valid. `dragging`: more changes will follow.
  void edited(const retint::ColorEdit& edit, bool dragging);
  void pickWanted();
  // The user wants to edit the shown view, or its photo, in another program.
  void elsewhereWanted(bool photo);
  // Asks for pixels of the region without its edit, for TakePixels().
  void pixelsWanted();
  void splitWanted();  // of the Gaussians with paint
  // Asks for the main colors after the steps before `before`, for TakePalette().
  void paletteWanted(int count, int before);

 private:
  void BuildList();
  void BuildPages();
  void AddPage(const char* name, const QString& text, const QString& tip, EditPage* page);
  void FillMore(QMenu* menu);
  void ShowAll();
  void ShowList();
  void ShowPage();
  void SetMode(int mode);
  void SetRow(int row);
  void ShowHistogram();
  int ModeOf(const ColorOperation& operation) const;
  // The operation of a page in the list: the chosen one, else the first. -1: none.
  int IndexOf(ColorOperationKind kind, int mode) const;
  int RowOfPage() const;  // the first operation of the page, -1: none
  EditPage* page() const;
  void Add(ColorOperationKind kind);
  void Insert(const ColorOperation& operation, bool dragging);
  void Take(const ColorOperation& operation, bool dragging);
  void RemoveRow(int row);
  void RemoveFromPage(ColorOperationKind kind);
  void MoveRow(int from, int to);
  void OnItemChanged(QTreeWidgetItem* item, int column);
  void SetStrength(int row, const QString& percent);
  void Copy();
  void Paste();
  bool Send(ColorEdit edit, bool dragging);
  void Complain(const QString& problem);

  uint64_t subject_ = 0;
  QColor base_;
  ColorEdit edit_;
  int row_ = -1;  // in the list; -1: none
  int mode_ = 0;
  bool filling_ = false, pick_for_page_ = false;
  std::vector<float> pixels_;              // [P, 3], of pixels_of_
  uint64_t pixels_of_ = 0, asked_of_ = 0;  // subjects
  std::map<int, float> strengths_;         // of disabled operations, by row
  RowTree* list_;
  QWidget* list_box_;
  QToolButton *add_, *remove_, *copy_, *paste_;
  QActionGroup* modes_;  // one a page
  QLabel* mode_name_;
  ColorPicker* picker_;
  QStackedLayout* pages_;
  LutPage* lut_;
  PalettePage* palette_;
  QLabel* problem_;
};

}  // namespace retint
