// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/export_dialog.h"

#include <algorithm>
#include <cmath>

#include <QCheckBox>
#include <QComboBox>
#include <QDialogButtonBox>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSpinBox>
#include <QStandardItemModel>

#include "base/error.h"
#include "base/staged_output.h"
#include "viewer/scene/video_maker.h"
#include "viewer/widgets/long_text.h"
#include "viewer/widgets/path_edit.h"

namespace retint {
namespace {

constexpr double kTurntableSeconds = 4;
constexpr int kTurntableRate = 30;  // frames a second

}  // namespace

ExportDialog::ExportDialog(Kind kind, const QString& subject, const QString& folder,
                           QWidget* parent)
    : QDialog(parent) {
  setObjectName("export_dialog");
  setAttribute(Qt::WA_DeleteOnClose);
  switch (kind) {
    case Kind::kViews:
      setWindowTitle(tr("Export edited views"));
      break;
    case Kind::kTurntable:
      setWindowTitle(tr("Export a turntable"));
      break;
    case Kind::kMasks:
      setWindowTitle(tr("Export the masks of %1").arg(subject));
      break;
  }
  auto* form = new QFormLayout(this);
  if (kind != Kind::kMasks) AddChoice(form, kind, subject);
  AddFolder(form, folder);
  problem_ = new QLabel;
  problem_->setObjectName("export_problem");
  problem_->setWordWrap(true);
  form->addRow(problem_);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Cancel);
  write_ = buttons->addButton(tr("&Export"), QDialogButtonBox::AcceptRole);
  write_->setObjectName("export_write");
  form->addRow(buttons);
  write_->setDefault(true);  // once it is in the dialog, which else takes the first button
  connect(buttons, &QDialogButtonBox::accepted, this, &QDialog::accept);
  connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
  connect(folder_, &QLineEdit::textChanged, this, &ExportDialog::Check);
  Check();
}

void ExportDialog::AddChoice(QFormLayout* form, Kind kind, const QString& view) {
  const bool views = kind == Kind::kViews;
  choice_ = new QComboBox;
  choice_->setObjectName("export_choice");
  if (views) {
    choice_->addItem(tr("Every view"));
    choice_->addItem(view.isEmpty() ? tr("The view that shows") : tr("Only %1").arg(view));
    choice_->setToolTip(tr("PNG files named after the photos, at the photos' size"));
    if (view.isEmpty()) {
      qobject_cast<QStandardItemModel*>(choice_->model())->item(kShownView)->setEnabled(false);
    }
  } else {
    choice_->addItems({tr("Once around the focus"), tr("Through the training views")});
    choice_->setToolTip(tr("The path of the camera; double-click the picture to set the focus"));
  }
  form->addRow(views ? tr("&Views") : tr("&Path"), choice_);
  if (!views) AddTurntable(form);
}

void ExportDialog::AddTurntable(QFormLayout* form) {
  size_ = new QComboBox;
  size_->setObjectName("export_size");
  size_->addItem(tr("As on the screen"), QSize());
  for (const QSize& size : {QSize(1280, 720), QSize(1920, 1080), QSize(3840, 2160)}) {
    size_->addItem(tr("%1 × %2").arg(size.width()).arg(size.height()), size);
  }
  size_->setToolTip(tr("Through the training views, frames are as large as those"));
  connect(choice_, &QComboBox::currentIndexChanged, size_,
          [this](int path) { size_->setEnabled(path == kOrbit); });
  form->addRow(tr("&Size"), size_);
  seconds_ = new QDoubleSpinBox;
  seconds_->setObjectName("export_seconds");
  seconds_->setDecimals(1);
  seconds_->setRange(0.1, 3600);
  seconds_->setValue(kTurntableSeconds);
  seconds_->setSuffix(tr(" s"));
  seconds_->setToolTip(tr("How long the whole path takes"));
  form->addRow(tr("&Length"), seconds_);
  rate_ = new QSpinBox;
  rate_->setObjectName("export_rate");
  rate_->setRange(1, 120);
  rate_->setValue(kTurntableRate);
  rate_->setSuffix(tr(" a second"));
  form->addRow(tr("F&rames"), rate_);
  auto* count = new QLabel;
  count->setObjectName("export_count");
  const auto show = [this, count] { count->setText(tr("%L1 pictures").arg(frames())); };
  connect(seconds_, &QDoubleSpinBox::valueChanged, this, show);
  connect(rate_, &QSpinBox::valueChanged, this, show);
  show();
  form->addRow(QString(), count);
  video_ = new QCheckBox(tr("Make a v&ideo of them (mp4)"));
  video_->setObjectName("export_video");
  const bool ffmpeg = !VideoMaker::Program().isEmpty();
  video_->setEnabled(ffmpeg);
  video_->setToolTip(ffmpeg ? tr("Made by the program ffmpeg")
                            : tr("The program ffmpeg was not found. Install it to make videos"));
  form->addRow(video_);
}

void ExportDialog::AddFolder(QFormLayout* form, const QString& folder) {
  folder_ = new PathEdit(folder);
  folder_->setObjectName("export_folder");
  folder_->setMinimumWidth(360);
  folder_->setToolTip(tr("The folder is made where it does not exist"));
  auto* browse = new QPushButton(tr("&Browse…"));
  browse->setAutoDefault(false);
  connect(browse, &QPushButton::clicked, this, [this] {
    const QString chosen =
        QFileDialog::getExistingDirectory(this, tr("Export to a folder"), folder_->text());
    if (!chosen.isEmpty()) folder_->setText(chosen);
  });
  auto* line = new QHBoxLayout;
  line->addWidget(folder_, 1);
  line->addWidget(browse);
  // A form finds the label's control only where that is the whole row.
  auto* label = new QLabel(tr("F&older"));
  label->setBuddy(folder_);
  form->addRow(label, line);
}

int ExportDialog::choice() const { return choice_ ? choice_->currentIndex() : 0; }
bool ExportDialog::video() const { return video_ && video_->isChecked(); }
int ExportDialog::frames() const {
  return seconds_ ? std::max(2, int(std::lround(seconds_->value() * rate_->value()))) : 0;
}
int ExportDialog::frames_per_second() const { return rate_ ? rate_->value() : 0; }
QSize ExportDialog::frame_size() const {
  return size_ && size_->isEnabled() ? size_->currentData().toSize() : QSize();
}

std::filesystem::path ExportDialog::folder() const { return folder_->text().toStdString(); }

void ExportDialog::Check() {
  QString problem;
  if (folder_->text().isEmpty()) {
    problem = tr("Choose a folder.");
  } else {
    try {
      CheckOutput(folder(), /*as_folder=*/true);
    } catch (const Error& error) {
      problem = QStringLiteral("⚠ ") + QString::fromUtf8(error.what());
    }
  }
  problem_->setText(Breakable(problem));
  write_->setEnabled(problem.isEmpty());
}

}  // namespace retint
