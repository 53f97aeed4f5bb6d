// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/open_dialog.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <QCheckBox>
#include <QComboBox>
#include <QDialogButtonBox>
#include <QDir>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QLabel>
#include <QLineEdit>
#include <QProgressBar>
#include <QPushButton>
#include <QSignalBlocker>
#include <QSpinBox>
#include <QVBoxLayout>

#include "base/error.h"
#include "colmap_io/nerfstudio.h"
#include "opening/find_splat.h"
#include "opening/ocio_space.h"
#include "splat_io/splat_io.h"
#include "viewer/widgets/long_text.h"
#include "viewer/widgets/path_edit.h"

namespace retint {
namespace {

constexpr int kAskAfterMs = 400;
// Size of a splat that is read without a request; larger ones only for Align.
constexpr qint64 kReadUnasked = qint64{400} << 20;

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

// The numbers of a similarity; empty for the identity.
std::string FrameText(const Sim3d& world_from_splat) {
  return IsIdentity(world_from_splat) ? "" : WorldFromSplatToText(world_from_splat);
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

QString SessionOf(const QString& path) {
  constexpr const char* kManifest = "session.json";
  const QFileInfo info(path);
  if (info.isFile()) return info.fileName() == kManifest ? info.absolutePath() : QString();
  const bool is_named = path.endsWith(".retint") || path.endsWith(".retint/");
  const bool is_one = is_named || (QFileInfo::exists(path + "/" + kManifest) && !HoldsModel(path));
  return is_one ? path : QString();
}

DroppedPaths SortPaths(const QStringList& paths) {
  DroppedPaths sorted;
  // Files in a session's folder mean the session.
  QStringList sessions;
  for (const QString& path : paths) {
    if (QFileInfo(path).isFile()) sessions << SessionOf(path);
  }
  const auto take = [&](QString& place, const QString& path) {
    if (!place.isEmpty()) sorted.problem = QObject::tr("%1 and %2: one is enough").arg(place, path);
    place = path;
  };
  for (const QString& path : paths) {
    const QFileInfo info(path);
    const QString session = SessionOf(path);
    if (!info.exists()) {
      sorted.problem = QObject::tr("%1 does not exist").arg(path);
    } else if (!session.isEmpty()) {
      take(sorted.session, session);
    } else if (sessions.contains(QFileInfo(QDir::cleanPath(path)).absolutePath())) {
      continue;
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
  const bool has_more = !sorted.workspace.isEmpty() || !sorted.splat.isEmpty();
  if (!sorted.session.isEmpty() && has_more && sorted.problem.isEmpty()) {
    sorted.problem =
        QObject::tr("%1: a session names its workspace and splat itself").arg(sorted.session);
  }
  return sorted;
}

OpenDialog::OpenDialog(const OpenRequest& start, QWidget* parent) : QDialog(parent), start_(start) {
  setWindowTitle(tr("Open a scene"));
  auto* form = new QFormLayout;
  const auto row = [&](const QString& title, const std::filesystem::path& path, const QString& hint,
                       bool folder) {
    auto* edit = new PathEdit(PathText(path));
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
  workspace_ =
      row(tr("&Workspace"), start.workspace,
          tr("folder of a COLMAP model; without one, views are placed around the splat"), true);
  splat_ = row(tr("&Splat"), start.splat, tr("file of this scene's Gaussians"), false);
  auto* main_form = std::exchange(form, new QFormLayout);
  photos_ = row(tr("&Photos"), start.options.image_folder, tr("found in the workspace"), true);
  frame_ = row(tr("&Frame"), FrameText(start.options.world_from_splat),
               tr("where the splat lies: a JSON file or a matrix; left out: as it is"), false);
  frame_->setObjectName("frame");
  config_ = row(tr("&OpenColorIO config"), start.options.space.config,
                tr("of the color space; left out: that of $OCIO"), false);
  config_->setObjectName("ocio");
  main_form->addRow(QString(), MakeFitLine());
  workspace_->setObjectName("workspace");
  splat_->setObjectName("splat");
  splat_of_ = workspace_->text().trimmed();
  connect(splat_, &QLineEdit::textEdited, this,
          [this] { splat_of_ = workspace_->text().trimmed(); });
  render_model_ = new QComboBox;
  render_model_->setObjectName("render model");
  render_model_->addItem(tr("as the files say"), "");
  for (const RenderModel model : {RenderModel::kDefault, RenderModel::kMip}) {
    const std::string_view name = NameOf(model);
    const QString text = QString::fromUtf8(name.data(), qsizetype(name.size()));
    render_model_->addItem(text, text);
    if (start.options.render_model == model) {
      render_model_->setCurrentIndex(render_model_->count() - 1);
    }
  }
  render_model_->setToolTip(tr("mip: the splat was trained with an antialiasing filter"));
  form->addRow(tr("Render &model"), render_model_);
  space_ = new QComboBox;
  space_->setObjectName("space");
  space_->setEditable(true);
  space_->lineEdit()->setPlaceholderText(tr("as the splat says"));
  space_->setToolTip(tr("Of the splat's colors, such as ACEScct. Edits work on sRGB"));
  ListSpaces();
  space_->setEditText(QString::fromStdString(start.options.space.name));
  connect(config_, &QLineEdit::textChanged, this, &OpenDialog::ListSpaces);
  connect(space_, &QComboBox::editTextChanged, this, &OpenDialog::Check);
  form->addRow(tr("&Color space"), space_);
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
  connect(this, &QDialog::finished, this, [this] {
    ask_.stop();
    finder_.Cancel();
  });
  // Settings that most scenes do not need.
  auto* advanced = new QWidget;
  advanced->setObjectName("open_advanced");
  form->setContentsMargins(0, 0, 0, 0);
  advanced->setLayout(form);
  auto* more =
      new QCheckBox(tr("A&dvanced: photos, frame, color space, backend and held-out views"));
  more->setObjectName("open_more");
  more->setChecked(!photos_->text().isEmpty() || !frame_->text().isEmpty() || at > 0 ||
                   holdout_->value() > 0 || !space_->currentText().isEmpty());
  advanced->setVisible(more->isChecked());
  connect(more, &QCheckBox::toggled, this, [this, advanced](bool shown) {
    advanced->setVisible(shown);
    adjustSize();
  });
  auto* layout = new QVBoxLayout(this);
  layout->addLayout(main_form);
  layout->addWidget(more);
  layout->addWidget(advanced);
  layout->addWidget(problem_);
  layout->addWidget(buttons_);
  Check();
}

QWidget* OpenDialog::MakeFitLine() {
  auto* line = new QWidget;
  fit_ = new QLabel;
  fit_->setObjectName("frame_fit");
  fit_->setTextFormat(Qt::PlainText);
  fit_->setWordWrap(true);
  fit_->setMinimumHeight(2 * fit_->fontMetrics().lineSpacing());
  progress_ = new QProgressBar;
  progress_->setRange(0, 100);
  progress_->setMaximumWidth(140);
  progress_->hide();
  align_ = new QPushButton(tr("&Align"));
  align_->setObjectName("align");
  align_->setAutoDefault(false);
  align_->setToolTip(
      tr("Finds how a splat lies that was centered, scaled or turned, by its renders and the "
         "photos"));
  auto* layout = new QHBoxLayout(line);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(fit_, 1);
  layout->addWidget(progress_);
  layout->addWidget(align_);
  ask_.setSingleShot(true);
  ask_.setInterval(kAskAfterMs);
  connect(&ask_, &QTimer::timeout, this, [this] { finder_.Check(request()); });
  connect(align_, &QPushButton::clicked, this, &OpenDialog::StartOrStopAlign);
  connect(&finder_, &FrameFinder::checked, this, &OpenDialog::ShowFit);
  connect(&finder_, &FrameFinder::aligned, this, &OpenDialog::Take);
  connect(&finder_, &FrameFinder::unreadable, this, [this](const QString& why) {
    valid_ = false;
    EndAlign(QStringLiteral("⚠ ") + why);
  });
  connect(&finder_, &FrameFinder::failed, this,
          [this](const QString& why) { EndAlign(QStringLiteral("⚠ ") + why); });
  connect(&finder_, &FrameFinder::progressed, this,
          [this](double at) { progress_->setValue(int(std::lround(100 * at))); });
  return line;
}

OpenRequest OpenDialog::request() const {
  OpenRequest request;
  request.options = start_.options;
  request.workspace = workspace_->text().trimmed().toStdString();
  if (request.workspace != start_.workspace) request.options.model.clear();
  request.splat = Splat().toStdString();
  request.options.image_folder = photos_->text().trimmed().toStdString();
  request.options.world_from_splat = Frame().value_or(Sim3d{});
  request.options.render_model =
      ChosenRenderModel(render_model_->currentData().toString().toStdString());
  request.options.space = {config_->text().trimmed().toStdString(),
                           space_->currentText().trimmed().toStdString()};
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

// A splat chosen for another workspace does not belong to this one.
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

std::optional<Sim3d> OpenDialog::Frame() const {
  const std::string text = frame_->text().trimmed().toStdString();
  if (text.empty() || workspace_->text().trimmed().isEmpty()) return Sim3d{};
  try {
    return WorldFromSplatOf(text);
  } catch (const Error&) {
    return std::nullopt;
  }
}

void OpenDialog::ShowFailure(const QString& message) {
  problem_->setText(Breakable(QStringLiteral("⚠ ") + message));
}

void OpenDialog::ListSpaces() {
  const QString chosen = space_->currentText();
  space_->clear();
  try {
    for (const std::string& name : OcioSpaceNames(config_->text().trimmed().toStdString())) {
      space_->addItem(QString::fromStdString(name));
    }
  } catch (const Error&) {  // no config, or still being typed
  }
  space_->setEditText(chosen);
}

void OpenDialog::Check() {
  const QString workspace = workspace_->text().trimmed(), splat = Splat();
  splat_->setPlaceholderText(splat.isEmpty() ? tr("file of this scene's Gaussians") : splat);
  QString problem;
  if (splat.isEmpty()) {
    problem = workspace.isEmpty() ? tr("A splat is needed, with or without a workspace.")
                                  : tr("A splat is needed.");
  } else if (!workspace.isEmpty() && !QFileInfo(workspace).isDir()) {
    problem = tr("The workspace is not a folder.");
  } else if (!workspace.isEmpty() && !HoldsModel(workspace)) {
    problem = tr("The workspace holds no COLMAP model (cameras, images, points3D).");
  } else if (!QFileInfo(splat).isFile()) {
    problem = tr("The splat is not a file.");
  } else if (!config_->text().trimmed().isEmpty() && space_->currentText().trimmed().isEmpty()) {
    problem = tr("Choose the splat's color space from the OpenColorIO config.");
  } else if (!Frame()) {
    problem = tr("The frame is neither a file with a similarity nor the 12 or 16 numbers of one.");
  }
  problem_->setText(Breakable(problem));
  valid_ = problem.isEmpty();
  AskFit();
}

void OpenDialog::UpdateButtons() {
  buttons_->button(QDialogButtonBox::Open)->setEnabled(valid_ && !aligning_);
  align_->setEnabled(aligning_ || (valid_ && !workspace_->text().trimmed().isEmpty()));
  align_->setText(aligning_ ? tr("S&top") : tr("&Align"));
  progress_->setVisible(aligning_);
}

void OpenDialog::AskFit() {
  ask_.stop();
  finder_.Cancel();
  EndAlign({});
  if (!align_->isEnabled()) return;
  if (QFileInfo(Splat()).size() > kReadUnasked) {
    return fit_->setText(tr("Align compares the renders of this large splat with the photos."));
  }
  fit_->setText(tr("Comparing renders with the photos…"));
  ask_.start();
}

void OpenDialog::ShowFit(const SceneCheck& check) {
  const QString psnr = QString::number(check.median_psnr, 'f', 1);
  const bool compared = !std::isnan(check.median_psnr);
  if (check.mismatch.empty()) {
    return fit_->setText(compared ? tr("Renders and photos agree: %1 dB.").arg(psnr)
                                  : tr("There are no photos to compare renders with."));
  }
  const QString what = CoversTooLittle(check) ? tr("The splat covers only %1 % of the views")
                                                    .arg(std::lround(100 * check.median_coverage))
                                              : tr("Renders and photos disagree (%1 dB)").arg(psnr);
  fit_->setText(QStringLiteral("⚠ ") + what +
                tr(": the splat seems to be in another frame, which Align finds."));
}

void OpenDialog::StartOrStopAlign() {
  ask_.stop();
  if (aligning_) {
    finder_.Cancel();
    return EndAlign(tr("Stopped; the frame is as it was."));
  }
  aligning_ = true;
  progress_->setValue(0);
  fit_->setText(tr("Aligning the splat…"));
  UpdateButtons();
  finder_.Align(request());
}

void OpenDialog::EndAlign(const QString& text) {
  aligning_ = false;
  fit_->setText(text);
  UpdateButtons();
}

void OpenDialog::Take(const AlignResult& result) {
  const auto decibels = [](double psnr) { return QString::number(psnr, 'f', 1); };
  if (std::isfinite(result.psnr_after) && !(result.psnr_after > result.psnr_before)) {
    return EndAlign(tr("Nothing better was found than the splat as it lies: %1 dB.")
                        .arg(decibels(result.psnr_before)));
  }
  {
    const QSignalBlocker unasked(frame_);
    frame_->setText(QString::fromStdString(FrameText(result.world_from_splat)));
    frame_->setCursorPosition(0);
  }
  if (!std::isfinite(result.psnr_after)) {
    return EndAlign(tr("Aligned by the sparse points: there are no photos to compare with."));
  }
  QString text = tr("Aligned: %1 dB before, %2 dB after.")
                     .arg(decibels(result.psnr_before), decibels(result.psnr_after));
  if (result.psnr_after < SceneCheckOptions().min_psnr) {
    text += tr(" Renders and photos still disagree: the splat seems to be of another scene.");
  }
  EndAlign(text);
}

}  // namespace retint
