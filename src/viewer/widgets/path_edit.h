// SPDX-License-Identifier: BSD-3-Clause
// Files and folders from other programs: what a drop holds, and a field that takes a path.
#pragma once

#include <QLineEdit>
#include <QStringList>

class QDropEvent;
class QMimeData;

namespace retint {

// Of the files and folders of this machine that are dragged; empty where there are none.
QStringList LocalPaths(const QMimeData& dragged);
// Takes a drag or drop as a copy, where it may be one: a program that was told of a move might
// delete the files.
void TakeCopy(QDropEvent* event);

// A path that is typed, or dropped: then it replaces the one before.
class PathEdit : public QLineEdit {
 public:
  using QLineEdit::QLineEdit;

 protected:
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dragMoveEvent(QDragMoveEvent* event) override;
  void dropEvent(QDropEvent* event) override;
};

}  // namespace retint
