// SPDX-License-Identifier: BSD-3-Clause
// The editor of one edit: the list of its steps, and the page of the one that is chosen. It
// knows nothing of regions: an edit comes in, and what the user makes of it goes out.
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

  // Shows the edit of `subject` (a region; another one begins in the mode of its last operation).
  // `base` is its color without an edit.
  void Show(uint64_t subject, const ColorEdit& edit, const QColor& base);
  const ColorEdit& edit() const { return edit_; }
  // Where the keyboard goes to choose a color: the square of the page's color, else the steps.
  QWidget* ColorControl() const;
  RowTree& list() { return *list_; }
  // The color of the picture that pickWanted() asked for.
  void TakePicked(const QColor& color);
  void SetCanPick(bool can);  // whether pickWanted() leads anywhere
  void TakePalette(const ColorOperation& palette);
  // [P, 3]: what pixelsWanted() asked for.
  void TakePixels(uint64_t subject, const std::vector<float>& pixels);

 Q_SIGNALS:
  // By the user; it is valid. `dragging`: more is to come.
  void edited(const retint::ColorEdit& edit, bool dragging);
  void pickWanted();
  // The view that shows, or its photo, is to be edited in another program.
  void elsewhereWanted(bool photo);
  // Pixels of the region as it is without its edit are wanted, for TakePixels().
  void pixelsWanted();
  void splitWanted();  // of the Gaussians that take paint
  // The main colors that the steps before `before` leave are wanted, for TakePalette().
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
  // In the list, of a page: the one at hand, else the first. -1: none.
  int IndexOf(ColorOperationKind kind, int mode) const;
  int RowOfPage() const;  // the first operation that the page shows, -1: none
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
  int row_ = -1;  // of the list; -1: none
  int mode_ = 0;
  bool filling_ = false, pick_for_page_ = false;
  std::vector<float> pixels_;              // [P, 3], of pixels_of_
  uint64_t pixels_of_ = 0, asked_of_ = 0;  // subjects
  std::map<int, float> strengths_;         // of operations that are off, by row
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
