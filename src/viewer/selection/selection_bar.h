// SPDX-License-Identifier: BSD-3-Clause
// The slim strips of selection mode. Above the view: the tools and the options of the one at hand.
// Below it: operations, the effect of a click or an error, accept and cancel.
#pragma once

#include <utility>
#include <vector>

#include <QFrame>
#include <QString>
#include <QStringList>

class QAction;
class QButtonGroup;
class QComboBox;
class QHBoxLayout;
class QLabel;
class QPushButton;
class QSlider;
class QSpinBox;
class QToolBar;
class QToolButton;

namespace retint {

class ReachChoice;
class SelectionCanvas;

// A number with its label, slider and box; the slider's scale may be logarithmic.
class SliderBox : public QWidget {
  Q_OBJECT

 public:
  SliderBox(const QString& label, int low, int high, const QString& suffix, bool logarithmic,
            const QString& tip, QWidget* parent = nullptr);
  int value() const;
  void SetValue(int value);  // says nothing

 Q_SIGNALS:
  void changed(int value);  // by the user

 private:
  int ToSlider(int value) const;
  int FromSlider(int position) const;

  int low_, high_;
  bool logarithmic_;
  QSlider* slider_;
  QSpinBox* box_;
};

class ToolStrip : public QFrame {
  Q_OBJECT

 public:
  explicit ToolStrip(SelectionCanvas* canvas, QWidget* parent = nullptr);
  ReachChoice& reach() { return *reach_; }
  QSize minimumSizeHint() const override;

 protected:
  void changeEvent(QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  void Show();  // the canvas's options
  // Options for which the row has no room go to the list of the button at its end: the picture
  // stays where it is.
  void Fit();
  bool IsUsed(const QWidget* option) const;  // by the current tool
  void DrawIcons();

  SelectionCanvas* canvas_;
  QHBoxLayout* layout_;
  QWidget* buttons_;
  QToolButton* more_;
  QFrame* list_;
  std::vector<QWidget*> options_;  // in their order
  QButtonGroup* tools_;
  ReachChoice* reach_;
  SliderBox *size_, *hardness_, *tolerance_, *edge_, *normal_, *margin_, *opacity_;
};

class ActionStrip : public QFrame {
  Q_OBJECT

 public:
  explicit ActionStrip(SelectionCanvas* canvas, QWidget* parent = nullptr);

  // An error or the next step; stays until the next edit.
  void ShowMessage(const QString& message, bool warning);
  QString message() const;  // empty: only a hint shows
  // The region of the strokes, "New region" or another, and the picture that one paints on. Another
  // target can be chosen until the first stroke.
  void SetTargets(const QStringList& targets, int current, const QString& place);
  void SetPaintable(bool paintable);

 Q_SIGNALS:
  void accept();
  void cancel();
  void targetChosen(int index);

 protected:
  void changeEvent(QEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  QToolBar* MakeOperations();
  void Connect();
  void Show();
  void FitHint();
  void DrawIcons();

  SelectionCanvas* canvas_;
  std::vector<std::pair<QAction*, const char*>> operations_;  // and their icons
  QComboBox* target_;
  QLabel *place_, *hint_;
  QPushButton *accept_, *cancel_;
  QString message_;
  bool warning_ = false, paintable_ = false;
};

}  // namespace retint
