// SPDX-License-Identifier: BSD-3-Clause
// The modes of editing, each with a page. A page shows and changes the operations of its kinds, and
// does not know the rest of the list.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <QColor>
#include <QThreadPool>
#include <QWidget>

#include "recolor/color_operation.h"
#include "recolor/tone.h"
#include "recolor/white_balance.h"
#include "viewer/panels/operation_views.h"

class QCheckBox;
class QDoubleSpinBox;
class QLabel;
class QPushButton;
class QSpinBox;
class QToolButton;
class QVBoxLayout;

namespace retint {

class GradientBar;
class ParameterRow;
class ToneGraph;

class EditPage : public QWidget {
  Q_OBJECT

 public:
  using Kinds = std::vector<ColorOperationKind>;
  // The operation of a kind for the page to show; null: the edit has none.
  using Find = std::function<const ColorOperation*(ColorOperationKind kind)>;

  explicit EditPage(Kinds kinds);
  const Kinds& kinds() const { return kinds_; }
  // Whether the page shows this operation of one of its kinds.
  virtual bool Shows(const ColorOperation& operation) const;
  void Show(const Find& find);
  // For pages that choose one color. Invalid: there is no color to choose.
  virtual QColor color() const { return {}; }
  virtual void ChooseColor(const QColor& /*color*/, bool /*dragging*/) {}
  // A color of the picture that the page has asked for.
  virtual void TakePicked(const QColor& /*color*/) {}
  void SetCanPick(bool can) { can_pick_ = can; }
  // The owner of the edit, and its color without an edit.
  void SetSubject(uint64_t subject, const QColor& base) { subject_ = subject, base_ = base; }

 Q_SIGNALS:
  // By the user. The operation replaces the shown one, or is added. `dragging`: more changes will
  // follow.
  void changed(const retint::ColorOperation& operation, bool dragging);
  void removed(retint::ColorOperationKind kind);
  void colorChanged();  // color() has changed, but not the edit
  void pickWanted();    // TakePicked() should follow

 protected:
  // Shows the page's own parts, besides rows and boxes.
  virtual void ShowMore() {}
  // Adds rows for the parameters of a kind; AddBox() adds a box for a kind without parameters.
  void AddRows(ColorOperationKind kind);
  void AddBox(ColorOperationKind kind);
  // Makes the button that emits pickWanted().
  QToolButton* MakePick(const char* name, const QString& text, const QString& tip);
  const ColorOperation* shown(ColorOperationKind kind) const {
    return find_ ? find_(kind) : nullptr;
  }
  // The shown operation, otherwise a new one.
  virtual ColorOperation Operation(ColorOperationKind kind) const;
  QVBoxLayout* rows() const { return layout_; }

  struct Row {
    const ParameterView* view;
    ParameterRow* row;
  };
  std::vector<Row> parameters_;
  uint64_t subject_ = 0;
  QColor base_ = Qt::gray;
  QToolButton* pick_ = nullptr;

 private:
  bool can_pick_ = true;
  Kinds kinds_;
  Find find_;
  QVBoxLayout* layout_;
  std::vector<std::pair<ColorOperationKind, QCheckBox*>> boxes_;
};

// "Make it this color."
class RecolorPage : public EditPage {
  Q_OBJECT

 public:
  RecolorPage();
  QColor color() const override;
  void ChooseColor(const QColor& color, bool dragging) override;
  void TakePicked(const QColor& color) override;

 protected:
  void ShowMore() override;

 private:
  QLabel* from_;
  QToolButton* measure_;
};

class TintPage : public EditPage {
  Q_OBJECT

 public:
  TintPage();
  QColor color() const override;
  void ChooseColor(const QColor& color, bool dragging) override;
};

class AdjustPage : public EditPage {
  Q_OBJECT

 public:
  AdjustPage();
  void TakePicked(const QColor& color) override;

 protected:
  void ShowMore() override;

 private:
  void ShowRange();
  QCheckBox* ranged_;
  uint64_t ranged_of_ = 0;  // the subject for which the box was set by hand
};

class GradePage : public EditPage {
  Q_OBJECT

 public:
  GradePage();
  void TakePicked(const QColor& color) override;  // "this should be gray"

 protected:
  void ShowMore() override;

 private:
  QLabel* note_;  // about the last white balance found, while it is the current one
  GrayBalance balance_;
};

// Curves, or levels.
class TonePage : public EditPage {
  Q_OBJECT

 public:
  explicit TonePage(Tone::Kind kind);
  bool Shows(const ColorOperation& operation) const override;
  // Of the colors before this step, see LumaHistogram().
  void SetHistogram(const std::vector<float>& bins);

 protected:
  void ShowMore() override;

 private:
  void AddButtons();
  void AddLevels();
  void Send(const Tone& tone, bool dragging);
  struct Level {
    ParameterRow* row;
    std::function<double(const Tone& tone)> get;
  };
  const Tone::Kind kind_;
  ToneGraph* graph_;
  QToolButton* remove_ = nullptr;
  std::vector<Level> levels_;
};

// Tables from files.
class LutPage : public EditPage {
  Q_OBJECT

 public:
  LutPage();
  ~LutPage() override;
  bool Shows(const ColorOperation& operation) const override;
  // Asks for a file. `another`: adds its table to those of the edit.
  void Choose(bool another);

 Q_SIGNALS:
  void added(const retint::ColorOperation& operation);

 protected:
  void ShowMore() override;

 private:
  // Reads in the background; then changed() or added(), or shows the problem.
  void Read(const QString& path, bool another);
  QLabel *name_, *problem_;
  QPushButton* open_;
  QThreadPool pool_;
};

class GradientPage : public EditPage {
  Q_OBJECT

 public:
  GradientPage();
  QColor color() const override;
  void ChooseColor(const QColor& color, bool dragging) override;

 protected:
  void ShowMore() override;

 private:
  void Send(bool dragging);
  GradientBar* bar_;
  QToolButton *add_, *remove_, *reverse_;
};

// The region's main colors, each with its new color.
class PalettePage : public EditPage {
  Q_OBJECT

 public:
  PalettePage();
  QColor color() const override;
  void ChooseColor(const QColor& color, bool dragging) override;
  // The answer to measureWanted(): a kPalette of unchanged colors.
  void TakeMeasured(const ColorOperation& palette);

 Q_SIGNALS:
  // Asks to measure the region's main colors, which does not change the edit.
  void measureWanted(int count);

 protected:
  void ShowMore() override;

 private:
  void SetCurrent(size_t pair);
  void Ask(int count);
  ColorOperation Drawn() const;
  bool IsMeasured() const;
  QSpinBox* count_;
  QToolButton *stay_, *measure_;
  QWidget* pairs_;
  QLabel* note_;
  std::vector<QToolButton*> buttons_;  // one for each pair
  size_t current_ = 0;
  int asked_ = 0;  // number of main colors; 0: not asked yet
  uint64_t asked_of_ = 0;
  bool waits_ = false;  // for TakeMeasured()
  // While the edit has no palette; none: not measured yet.
  std::optional<ColorOperation> measured_;
};

// Views that another program painted.
class PicturePage : public EditPage {
  Q_OBJECT

 public:
  PicturePage();

 Q_SIGNALS:
  void elsewhereWanted(bool photo);
  void splitWanted();

 protected:
  void ShowMore() override;

 private:
  QLabel* found_;
  QPushButton* split_;
};

// For an operation without a mode.
class MatrixPage : public EditPage {
  Q_OBJECT

 public:
  MatrixPage();

 protected:
  void ShowMore() override;

 private:
  std::vector<QDoubleSpinBox*> cells_;
};

}  // namespace retint
