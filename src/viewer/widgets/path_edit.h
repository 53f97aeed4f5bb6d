// SPDX-License-Identifier: BSD-3-Clause
// Files and folders dragged from other programs, and a field for a path.
#pragma once

#include <QLineEdit>
#include <QStringList>

class QDropEvent;
class QMimeData;

namespace retint {

// The dragged files and folders of this machine; empty if there are none.
QStringList LocalPaths(const QMimeData& dragged);
// Accepts a drag or drop as a copy, if it allows one. After a move, the other program might delete
// the files.
void TakeCopy(QDropEvent* event);

// A path to type or to drop. A drop replaces the path before.
class PathEdit : public QLineEdit {
 public:
  using QLineEdit::QLineEdit;

 protected:
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dragMoveEvent(QDragMoveEvent* event) override;
  void dropEvent(QDropEvent* event) override;
};

}  // namespace retint
