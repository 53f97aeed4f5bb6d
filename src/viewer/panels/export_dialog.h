// SPDX-License-Identifier: BSD-3-Clause
// Asks which pictures of the edited scene are to be written, and where.
#pragma once

#include <filesystem>

#include <QDialog>

class QComboBox;
class QLabel;
class QLineEdit;
class QPushButton;
class QSpinBox;

namespace retint {

class ExportDialog : public QDialog {
  Q_OBJECT

 public:
  enum class Kind { kViews, kTurntable };
  // Choices of kViews and of kTurntable.
  enum Views { kAllViews, kShownView };
  enum Path { kOrbit, kThroughViews };

  // `view` is the name of the view that shows; empty: the camera is free.
  ExportDialog(Kind kind, const QString& view, const QString& folder, QWidget* parent);

  int choice() const;
  int frames() const;
  std::filesystem::path folder() const;

 private:
  void Check();

  QComboBox* choice_;
  QSpinBox* frames_ = nullptr;
  QLineEdit* folder_;
  QLabel* problem_;
  QPushButton* write_;
};

}  // namespace retint
