// SPDX-License-Identifier: BSD-3-Clause
// The strip at a side of a window to which its panels fold: a click folds and unfolds them. Folded,
// it shows their names.
#pragma once

#include <QAbstractButton>
#include <QStringList>

namespace retint {

class SideStrip : public QAbstractButton {
  Q_OBJECT

 public:
  explicit SideStrip(Qt::Edge side, QWidget* parent = nullptr);
  void SetFolded(bool folded, const QStringList& panels);
  bool folded() const { return folded_; }
  QSize sizeHint() const override;
  QSize minimumSizeHint() const override { return {sizeHint().width(), 40}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  const Qt::Edge side_;
  bool folded_ = false;
  QStringList panels_;
};

}  // namespace retint
