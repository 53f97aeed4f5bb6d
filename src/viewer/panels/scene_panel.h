// SPDX-License-Identifier: BSD-3-Clause
// The open scene: files, cameras, points, Gaussians, and probable faults.
#pragma once

#include <string>
#include <vector>

#include <QWidget>

class QLabel;
class QListWidget;
class QTreeWidget;

namespace retint {

class SceneController;

class ScenePanel : public QWidget {
  Q_OBJECT

 public:
  explicit ScenePanel(SceneController* controller);

 private:
  void Show();
  void AddWarnings(const std::vector<std::string>& warnings);

  SceneController* controller_;
  QLabel* none_;
  QTreeWidget* facts_;
  QLabel* warnings_title_;
  QListWidget* warnings_;
};

}  // namespace retint
