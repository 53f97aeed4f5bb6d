// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/widgets/path_edit.h"

#include <QDropEvent>
#include <QMimeData>
#include <QUrl>

namespace retint {

QStringList LocalPaths(const QMimeData& dragged) {
  QStringList paths;
  for (const QUrl& url : dragged.urls()) {
    if (url.isLocalFile()) paths << url.toLocalFile();
  }
  return paths;
}

void TakeCopy(QDropEvent* event) {
  event->setDropAction(Qt::CopyAction);
  event->setAccepted(event->dropAction() == Qt::CopyAction);
}

void PathEdit::dragEnterEvent(QDragEnterEvent* event) {
  if (LocalPaths(*event->mimeData()).isEmpty()) return QLineEdit::dragEnterEvent(event);
  TakeCopy(event);
}

void PathEdit::dragMoveEvent(QDragMoveEvent* event) {
  if (LocalPaths(*event->mimeData()).isEmpty()) return QLineEdit::dragMoveEvent(event);
  TakeCopy(event);
}

void PathEdit::dropEvent(QDropEvent* event) {
  const QStringList paths = LocalPaths(*event->mimeData());
  if (paths.isEmpty()) return QLineEdit::dropEvent(event);
  TakeCopy(event);
  if (!event->isAccepted()) return;
  selectAll();
  insert(paths.front());  // as if the user had typed it
}

}  // namespace retint
