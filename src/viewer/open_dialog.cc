// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/open_dialog.h"

#include <algorithm>

#include <QComboBox>
#include <QDialogButtonBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSpinBox>
#include <QVBoxLayout>

#include "splat_io/splat_io.h"

namespace retint {
namespace {

bool HoldsModel(const QString& folder) { return FindModel(folder.toStdString()).has_value(); }

QStringList SplatExtensions(bool writable) {
  QStringList extensions;
  for (const SplatFormat& format : SplatFormats()) {
    if (writable && !format.writable) continue;
    for (const std::string_view extension : format.extensions) {
      extensions << QString::fromUtf8(extension.data(), qsizetype(extension.size()));
    }
  }
  return extensions;
}

QString PathText(const std::filesystem::path& path) {
  return QString::fromStdString(path.string());
}

}  // namespace

QString GuessSplat(const QString& workspace) {
  const auto splat = FindSplat(workspace.toStdString());
  return splat ? PathText(*splat) : QString();
}

QString SplatFilter(bool writable) {
  QStringList patterns;
  for (const QString& extension : SplatExtensions(writable)) patterns << "*" + extension;
  return QObject::tr("Gaussian splats (%1)").arg(patterns.join(' '));
}

QString WithSplatExtension(const QString& path) {
  const QStringList extensions = SplatExtensions(/*writable=*/true);
  const bool has_one = std::any_of(
      extensions.begin(), extensions.end(),
      [&](const QString& extension) { return path.endsWith(extension, Qt::CaseInsensitive); });
  return has_one ? path : path + extensions.value(0);
}

DroppedPaths SortPaths(const QStringList& paths) {
  DroppedPaths sorted;
  const auto take = [&](QString& place, const QString& path) {
    if (!place.isEmpty()) sorted.problem = QObject::tr("%1 and %2: one is enough").arg(place, path);
    place = path;
  };
  for (const QString& path : paths) {
    const QFileInfo info(path);
    if (!info.exists()) {
      sorted.problem = QObject::tr("%1 does not exist").arg(path);
    } else if (path.endsWith(".retint") || path.endsWith(".retint/")) {
      take(sorted.session, path);
    } else if (info.isDir()) {
      if (!HoldsModel(path)) {
        sorted.problem =
            QObject::tr("%1 holds no COLMAP model (cameras, images, points3D)").arg(path);
      }
      take(sorted.workspace, path);
    } else {
      take(sorted.splat, path);
    }
  }
  if (!sorted.session.isEmpty() && paths.size() > 1 && sorted.problem.isEmpty()) {
    sorted.problem =
        QObject::tr("%1: a session names its workspace and splat itself").arg(sorted.session);
  }
  return sorted;
}

OpenDialog::OpenDialog(const OpenRequest& start, QWidget* parent) : QDialog(parent) {
  setWindowTitle(tr("Open a scene"));
  auto* form = new QFormLayout;
  const auto row = [&](const QString& title, const std::filesystem::path& path, const QString& hint,
                       bool folder) {
    auto* edit = new QLineEdit(PathText(path));
    edit->setPlaceholderText(hint);
    edit->setMinimumWidth(420);
    auto* browse = new QPushButton(tr("Browse…"));
    browse->setAutoDefault(false);
    auto* line = new QHBoxLayout;
    line->addWidget(edit);
    line->addWidget(browse);
    auto* label = new QLabel(title);
    label->setBuddy(edit);
    form->addRow(label, line);
    connect(browse, &QPushButton::clicked, this,
            [this, edit, folder, title] { Browse(edit, folder, title); });
    connect(edit, &QLineEdit::textChanged, this, [this, edit] {
      if (edit == workspace_) FollowWorkspace();
      Check();
    });
    return edit;
  };
  workspace_ = row(tr("&Workspace"), start.workspace, tr("folder of a COLMAP model"), true);
  splat_ = row(tr("&Splat"), start.splat, tr("file of this scene's Gaussians"), false);
  photos_ = row(tr("&Photos"), start.options.image_folder, tr("found in the workspace"), true);
  workspace_->setObjectName("workspace");
  splat_->setObjectName("splat");
  splat_of_ = workspace_->text().trimmed();
  connect(splat_, &QLineEdit::textEdited, this,
          [this] { splat_of_ = workspace_->text().trimmed(); });
  backend_ = new QComboBox;
  backend_->addItem(tr("best available"), "auto");
  for (const std::string& name : AvailableBackends()) {
    backend_->addItem(QString::fromStdString(name).toUpper(), QString::fromStdString(name));
  }
  const int at = backend_->findData(QString::fromStdString(start.options.backend));
  backend_->setCurrentIndex(std::max(0, at));
  form->addRow(tr("&Backend"), backend_);
  holdout_ = new QSpinBox;
  holdout_->setRange(0, 100);
  holdout_->setValue(start.options.holdout);
  holdout_->setSpecialValueText(tr("none"));
  holdout_->setToolTip(tr("Every n-th view is kept out of the fit, to measure quality on it"));
  form->addRow(tr("&Held-out views, every"), holdout_);
  problem_ = new QLabel;
  problem_->setObjectName("open_problem");
  problem_->setTextFormat(Qt::PlainText);
  problem_->setWordWrap(true);
  problem_->setMinimumHeight(problem_->fontMetrics().lineSpacing());
  buttons_ = new QDialogButtonBox(QDialogButtonBox::Open | QDialogButtonBox::Cancel);
  connect(buttons_, &QDialogButtonBox::accepted, this, &QDialog::accept);
  connect(buttons_, &QDialogButtonBox::rejected, this, &QDialog::reject);
  auto* layout = new QVBoxLayout(this);
  layout->addLayout(form);
  layout->addWidget(problem_);
  layout->addWidget(buttons_);
  Check();
}

OpenRequest OpenDialog::request() const {
  OpenRequest request;
  request.workspace = workspace_->text().trimmed().toStdString();
  request.splat = Splat().toStdString();
  request.options.image_folder = photos_->text().trimmed().toStdString();
  request.options.backend = backend_->currentData().toString().toStdString();
  request.options.holdout = holdout_->value() == 1 ? 2 : holdout_->value();
  return request;
}

void OpenDialog::Browse(QLineEdit* edit, bool folder, const QString& title) {
  const QString plain = QString(title).remove('&');
  const QString start = edit->text().isEmpty() ? workspace_->text() : edit->text();
  const QString path = folder ? QFileDialog::getExistingDirectory(this, plain, start)
                              : QFileDialog::getOpenFileName(this, plain, start,
                                                             SplatFilter() + tr(";;All files (*)"));
  if (path.isEmpty()) return;
  edit->setText(path);
  if (edit == splat_) splat_of_ = workspace_->text().trimmed();
}

// A splat that was chosen for another workspace does not go with this one.
void OpenDialog::FollowWorkspace() {
  const QString workspace = workspace_->text().trimmed();
  if (workspace.isEmpty() || workspace == splat_of_ || !HoldsModel(workspace)) return;
  const bool chosen_before = splat_of_.isEmpty() && !splat_->text().isEmpty();
  splat_of_ = workspace;
  if (!chosen_before) splat_->setText(GuessSplat(workspace));
}

QString OpenDialog::Splat() const {
  const QString workspace = workspace_->text().trimmed(), given = splat_->text().trimmed();
  return given.isEmpty() && !workspace.isEmpty() ? GuessSplat(workspace) : given;
}

void OpenDialog::ShowFailure(const QString& message) {
  problem_->setText(QStringLiteral("⚠ ") + message);
}

void OpenDialog::Check() {
  const QString workspace = workspace_->text().trimmed(), splat = Splat();
  splat_->setPlaceholderText(splat.isEmpty() ? tr("file of this scene's Gaussians") : splat);
  QString problem;
  if (workspace.isEmpty() || splat.isEmpty()) {
    problem = tr("A workspace and a splat are needed.");
  } else if (!QFileInfo(workspace).isDir()) {
    problem = tr("The workspace is not a folder.");
  } else if (!HoldsModel(workspace)) {
    problem = tr("The workspace holds no COLMAP model (cameras, images, points3D).");
  } else if (!QFileInfo(splat).isFile()) {
    problem = tr("The splat is not a file.");
  }
  problem_->setText(problem);
  buttons_->button(QDialogButtonBox::Open)->setEnabled(problem.isEmpty());
}

}  // namespace retint
