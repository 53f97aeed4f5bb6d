// SPDX-License-Identifier: BSD-3-Clause
// The scene to open: workspace, splat, photos, backend. Beside the form, a thread of its own
// renders a few views of what it names: does the splat lie where the photos show it? If not, Align
// finds how it lies.
#pragma once

#include <optional>

#include <QDialog>
#include <QString>
#include <QStringList>
#include <QTimer>

#include "viewer/scene/scene_controller.h"
#include "viewer/window/frame_finder.h"

class QComboBox;
class QDialogButtonBox;
class QLabel;
class QLineEdit;
class QProgressBar;
class QPushButton;
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
  void UpdateButtons();
  QWidget* MakeFitLine();
  // How renders and photos agree: asked a moment after the last change of the form.
  void AskFit();
  void ShowFit(const SceneCheck& check);
  void StartOrStopAlign();
  void EndAlign(const QString& text);
  void Take(const AlignResult& result);

  QLineEdit *workspace_, *splat_, *photos_, *frame_;
  OpenRequest start_;  // the fields that the form does not show stay
  QString splat_of_;   // the workspace that the splat was chosen for; empty: none yet
  QComboBox *render_model_, *backend_;
  QSpinBox* holdout_;
  QLabel *problem_, *fit_;
  QPushButton* align_;
  QProgressBar* progress_;
  QDialogButtonBox* buttons_;
  bool valid_ = false, aligning_ = false;
  QTimer ask_;
  FrameFinder finder_;
};

// The folder of the session that a path means: the folder itself, or the one whose session.json it
// is; empty where it means none.
QString SessionOf(const QString& path);
// What dropped or given paths mean together: a folder with a model is a workspace, a folder
// NAME.retint or with a session.json, or what is in it, a session, any other file a splat.
// `problem`: why they cannot be opened, empty when they can.
struct DroppedPaths {
  QString workspace, splat, session, problem;
};
DroppedPaths SortPaths(const QStringList& paths);
// FindSplat(); empty where there is none.
QString GuessSplat(const QString& workspace);
// A file dialog's filter, "Gaussian splats (*.ply ...)": of the formats that can be read, or only
// of those that can be written.
QString SplatFilter(bool writable = false);

}  // namespace retint
