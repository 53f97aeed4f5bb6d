// SPDX-License-Identifier: BSD-3-Clause
// The list of keys.
#pragma once

#include <vector>

#include <QDialog>
#include <QString>

namespace retint {

class KeysDialog : public QDialog {
  Q_OBJECT

 public:
  explicit KeysDialog(QWidget* parent = nullptr);
  // For a screen with this much room; the list scrolls.
  static QSize FirstSize(const QSize& room, const QFontMetrics& font);
};

// Rows of the list: commands, mouse, selection mode.
struct KeyRow {
  QString group, what, keys;
};
std::vector<KeyRow> KeyRows();

}  // namespace retint
