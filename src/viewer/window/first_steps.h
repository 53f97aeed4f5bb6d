// SPDX-License-Identifier: BSD-3-Clause
// A list in a corner of the canvas that guides the user to a first recolor. It ticks its steps,
// then disappears for good.
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

  // Shows it at the upper left corner of `area`, a part of its parent, where no banner covers it;
  // null: hides it.
  void ShowOver(QWidget* area);

  // False after all steps were done or the user closed it, also in an earlier run.
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
