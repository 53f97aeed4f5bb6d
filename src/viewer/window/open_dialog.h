// SPDX-License-Identifier: BSD-3-Clause
// Asks for a scene to open: workspace, splat, photos, backend. On another thread, it renders a few
// views of them: does the splat lie where the photos show it? If it does not, Align finds the pose
// of the splat.
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
  // Shows why the request could not be opened, until the form changes.
  void ShowFailure(const QString& message);

 private:
  void Browse(QLineEdit* edit, bool folder, const QString& title);
  void FollowWorkspace();
  std::optional<Sim3d> Frame() const;  // nullopt: the text is not a similarity
  QString Splat() const;               // as typed; empty field: the one that was found
  void ListSpaces();                   // of the OpenColorIO config
  void Check();
  void UpdateButtons();
  QWidget* MakeFitLine();
  // Checks how well renders and photos agree, a moment after the last change of the form.
  void AskFit();
  void ShowFit(const SceneCheck& check);
  void StartOrStopAlign();
  void EndAlign(const QString& text);
  void Take(const AlignResult& result);

  QLineEdit *workspace_, *splat_, *photos_, *frame_, *config_;
  OpenRequest start_;  // fields that the form does not have keep their values
  QString splat_of_;   // workspace for which the splat was chosen; empty: none
  QComboBox *render_model_, *space_, *backend_;
  QSpinBox* holdout_;
  QLabel *problem_, *fit_;
  QPushButton* align_;
  QProgressBar* progress_;
  QDialogButtonBox* buttons_;
  bool valid_ = false, aligning_ = false;
  QTimer ask_;
  FrameFinder finder_;
};

// The folder of the session that `path` names: the folder itself, or the folder of its
// session.json; empty if it names none.
QString SessionOf(const QString& path);
// The meaning of dropped or given paths. A folder with a model is a workspace. A folder NAME.retint
// or with a session.json is a session, and so are files in it. Any other file is a splat.
// `problem`: why they cannot be opened; empty: they can.
struct DroppedPaths {
  QString workspace, splat, session, problem;
};
DroppedPaths SortPaths(const QStringList& paths);
// FindSplat(); empty if there is none.
QString GuessSplat(const QString& workspace);
// The filter for a file dialog, "Gaussian splats (*.ply ...)", of all readable formats or only of
// the writable ones.
QString SplatFilter(bool writable = false);

}  // namespace retint
