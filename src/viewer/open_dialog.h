// SPDX-License-Identifier: BSD-3-Clause
// What to open: workspace, splat, photos, backend. Nothing is read here but folder listings.
#pragma once

#include <optional>

#include <QDialog>
#include <QString>
#include <QStringList>

#include "viewer/scene_controller.h"

class QComboBox;
class QDialogButtonBox;
class QLabel;
class QLineEdit;
class QSpinBox;

namespace retint {

class OpenDialog : public QDialog {
  Q_OBJECT

 public:
  explicit OpenDialog(const OpenRequest& start, QWidget* parent = nullptr);
  OpenRequest request() const;
  // Why what the form says could not be opened; stays until the form is changed.
  void ShowFailure(const QString& message);

 private:
  void Browse(QLineEdit* edit, bool folder, const QString& title);
  void FollowWorkspace();
  std::optional<Sim3d> Frame() const;  // nullopt where the text is no similarity
  QString Splat() const;               // as given; an empty field: the one that is found
  void Check();

  QLineEdit *workspace_, *splat_, *photos_, *frame_;
  OpenRequest start_;  // of which stays what the form does not show
  QString splat_of_;   // the workspace that the splat was chosen for; empty: none yet
  QComboBox* backend_;
  QSpinBox* holdout_;
  QLabel* problem_;
  QDialogButtonBox* buttons_;
};

// What dropped or given paths mean together: a folder with a model is a workspace, NAME.retint a
// session, any other file a splat. `problem`: why they cannot be opened, empty when they can.
struct DroppedPaths {
  QString workspace, splat, session, problem;
};
DroppedPaths SortPaths(const QStringList& paths);
// FindSplat(); empty where there is none.
QString GuessSplat(const QString& workspace);
// A file dialog's filter, "Gaussian splats (*.ply ...)": of the formats that can be read, or only
// of those that can be written.
QString SplatFilter(bool writable = false);
// `path`, if its extension is that of a format that can be written; else with such an extension.
QString WithSplatExtension(const QString& path);

}  // namespace retint
