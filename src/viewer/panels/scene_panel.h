// SPDX-License-Identifier: BSD-3-Clause
// What is open: files, cameras, points, Gaussians, and what seems wrong with them.
#pragma once

#include <string>
#include <vector>

#include <QWidget>

class QLabel;
class QListWidget;
class QTreeWidget;

namespace retint {

class MainWindow;

class ScenePanel : public QWidget {
  Q_OBJECT

 public:
  explicit ScenePanel(MainWindow* window);

 private:
  void Show();
  void AddWarnings(const std::vector<std::string>& warnings);

  MainWindow* window_;
  QLabel* none_;
  QTreeWidget* facts_;
  QLabel* warnings_title_;
  QListWidget* warnings_;
};

}  // namespace retint
