// SPDX-License-Identifier: BSD-3-Clause
// The modes in which an edit is made: a page each, which shows and changes the operations of its
// kinds and knows nothing of the rest of the list.
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
  // The operation of a kind that the page is about; null: the edit has none.
  using Find = std::function<const ColorOperation*(ColorOperationKind kind)>;

  explicit EditPage(Kinds kinds);
  const Kinds& kinds() const { return kinds_; }
  // Whether the page is about an operation of one of its kinds.
  virtual bool Shows(const ColorOperation& operation) const;
  void Show(const Find& find);
  // Of a mode in which one color is chosen. Invalid: there is none to be chosen.
  virtual QColor color() const { return {}; }
  virtual void ChooseColor(const QColor& /*color*/, bool /*dragging*/) {}
  // A color of the picture that the page itself has asked for.
  virtual void TakePicked(const QColor& /*color*/) {}
  void SetCanPick(bool can) { can_pick_ = can; }
  // Whose edit shows, and the color that it has without one.
  void SetSubject(uint64_t subject, const QColor& base) { subject_ = subject, base_ = base; }

 Q_SIGNALS:
  // By the user. The operation takes the place of the one that was shown, or is added. `dragging`:
  // more is to come.
  void changed(const retint::ColorOperation& operation, bool dragging);
  void removed(retint::ColorOperationKind kind);
  void colorChanged();  // color(), but nothing of the edit
  void pickWanted();    // TakePicked() is to follow

 protected:
  // The page's own parts besides rows and boxes.
  virtual void ShowMore() {}
  // Rows for the parameters of a kind, or a box for one that has none.
  void AddRows(ColorOperationKind kind);
  void AddBox(ColorOperationKind kind, const QString& tip);
  // The button of pickWanted().
  QToolButton* MakePick(const char* name, const QString& text, const QString& tip);
  const ColorOperation* shown(ColorOperationKind kind) const {
    return find_ ? find_(kind) : nullptr;
  }
  // The operation that shows, else a new one.
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
  uint64_t ranged_of_ = 0;  // the subject for which the box was ticked or not
};

class GradePage : public EditPage {
  Q_OBJECT

 public:
  GradePage();
  void TakePicked(const QColor& color) override;  // "this should be gray"

 protected:
  void ShowMore() override;

 private:
  QLabel* note_;  // on the white balance that was found last, while it is that
  GrayBalance balance_;
};

// Curves, or levels.
class TonePage : public EditPage {
  Q_OBJECT

 public:
  explicit TonePage(Tone::Kind kind);
  bool Shows(const ColorOperation& operation) const override;
  // Of what comes into the step, see LumaHistogram().
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
  // Asks which file. `another`: its table is to be added to those that the edit has.
  void Choose(bool another);

 Q_SIGNALS:
  void added(const retint::ColorOperation& operation);

 protected:
  void ShowMore() override;

 private:
  // In the background; changed() or added(), or what is wrong with it.
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
  // What measureWanted() asked for: kPalette of colors that stay.
  void TakeMeasured(const ColorOperation& palette);

 Q_SIGNALS:
  // The main colors of the region are to be measured, which changes nothing of the edit.
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
  std::vector<QToolButton*> buttons_;  // one a pair
  size_t current_ = 0;
  int asked_ = 0;  // main colors; 0: nothing was asked yet
  uint64_t asked_of_ = 0;
  bool waits_ = false;  // for TakeMeasured()
  // As long as the edit has no palette; none: not measured yet.
  std::optional<ColorOperation> measured_;
};

// Paint on views from another program.
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

// Of an operation that no mode is for.
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
