// SPDX-License-Identifier: BSD-3-Clause
// A list in a corner of the canvas that leads through a first recolor. It ticks itself and then
// goes away for good.
#pragma once

#include <array>

#include <QFrame>
#include <QPointer>

class QLabel;

namespace retint {

class FirstSteps : public QFrame {
  Q_OBJECT

 public:
  enum Step { kOpen, kPaint, kAccept, kColor, kExport };

  explicit FirstSteps(QWidget* parent);

  // It lies at the lower left corner of `area`, which is inside its parent; null: it is hidden.
  void ShowOver(QWidget* area);

  // False once all steps were done, or it was closed, also in another run of the program.
  static bool IsWanted();
  void SetDone(Step step);
  bool IsDone(Step step) const { return done_[step]; }

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void Finish();
  void Place();
  void Describe();

  QPointer<QWidget> area_;
  std::array<QLabel*, kExport + 1> lines_{};
  std::array<bool, kExport + 1> done_{};
};

}  // namespace retint
