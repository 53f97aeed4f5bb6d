// SPDX-License-Identifier: BSD-3-Clause
// Asks which pictures of the edited scene, or a region's masks, are to be written, and where.
#pragma once

#include <filesystem>

#include <QDialog>

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QFormLayout;
class QLabel;
class QLineEdit;
class QPushButton;
class QSpinBox;

namespace retint {

class ExportDialog : public QDialog {
  Q_OBJECT

 public:
  enum class Kind { kViews, kTurntable, kMasks };
  // Choices of kViews and of kTurntable.
  enum Views { kAllViews, kShownView };
  enum Path { kOrbit, kThroughViews };

  // `subject`: of kViews the name of the view that shows, empty where the camera is free; of kMasks
  // the region's name. The dialog deletes itself when it closes.
  ExportDialog(Kind kind, const QString& subject, const QString& folder, QWidget* parent);

  int choice() const;  // of kMasks: 0
  // Of kTurntable.
  int frames() const;
  int frames_per_second() const;
  QSize frame_size() const;  // of a frame; empty: as the path has it
  bool video() const;        // also wanted
  std::filesystem::path folder() const;

 private:
  void AddChoice(QFormLayout* form, Kind kind, const QString& view);
  void AddTurntable(QFormLayout* form);
  void AddFolder(QFormLayout* form, const QString& folder);
  void Check();

  QComboBox* choice_ = nullptr;
  QComboBox* size_ = nullptr;
  QDoubleSpinBox* seconds_ = nullptr;
  QSpinBox* rate_ = nullptr;
  QCheckBox* video_ = nullptr;
  QLineEdit* folder_;
  QLabel* problem_;
  QPushButton* write_;
};

}  // namespace retint
