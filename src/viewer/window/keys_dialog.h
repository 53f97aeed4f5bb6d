// SPDX-License-Identifier: BSD-3-Clause
// The list of keys, with a choice of profiles and their conflicts.
#pragma once

#include <QDialog>

#include "viewer/window/key_map.h"

class QComboBox;
class QLabel;
class QTableWidget;

namespace retint {

class KeysDialog : public QDialog {
  Q_OBJECT

 public:
  // `profiles`: the names to choose from.
  KeysDialog(const KeyMap& keys, const QStringList& profiles, QWidget* parent = nullptr);
  // On a screen with this much room; the list scrolls.
  static QSize FirstSize(const QSize& room, const QFontMetrics& font);
  // After the profile was changed.
  void Show(const KeyMap& keys);

 Q_SIGNALS:
  void profileChosen(const QString& name);
  void fileChosen(const QString& path);

 private:
  QComboBox* profile_;
  QLabel* conflicts_;
  QTableWidget* table_;
};

// Rows of (group, what, keys) of everything: commands, mouse, selection mode.
struct KeyRow {
  QString group, what, keys;
};
std::vector<KeyRow> KeyRows(const KeyMap& keys);

}  // namespace retint
