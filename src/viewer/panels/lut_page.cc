// SPDX-License-Identifier: BSD-3-Clause
// The page of lookup tables.
#include <QFileDialog>
#include <QFileInfo>
#include <QLabel>
#include <QPushButton>
#include <QSettings>
#include <QVBoxLayout>

#include "base/error.h"
#include "recolor/lut.h"
#include "viewer/panels/edit_pages.h"
#include "viewer/scene/failure_text.h"
#include "viewer/scene/post.h"
#include "viewer/widgets/long_text.h"

namespace retint {

LutPage::LutPage() : EditPage({ColorOperationKind::kLut}) {
  name_ = new QLabel;
  name_->setObjectName("lut_name");
  name_->setWordWrap(true);
  problem_ = new QLabel;
  problem_->setObjectName("lut_problem");
  problem_->setWordWrap(true);
  problem_->hide();
  open_ = new QPushButton(tr("Open a table…"));
  open_->setObjectName("lut_open");
  open_->setToolTip(tr("A .cube, .3dl, .clf, .cdl, .cc or .ccc for colors as a screen shows them"));
  rows()->addWidget(name_);
  rows()->addWidget(problem_);
  rows()->addWidget(open_, 0, Qt::AlignLeft);
  pool_.setMaxThreadCount(1);
  connect(open_, &QPushButton::clicked, this, [this] { Choose(false); });
}

LutPage::~LutPage() {
  pool_.clear();
  pool_.waitForDone();
  PoolIsDone();
}

bool LutPage::Shows(const ColorOperation& operation) const {
  return operation.kind == ColorOperationKind::kLut && !Tone::Of(operation);
}

void LutPage::Choose(bool another) {
  QSettings settings;
  const QString path = QFileDialog::getOpenFileName(
      this, tr("Open a lookup table"), settings.value("lut_folder").toString(),
      tr("Lookup tables (*.cube *.3dl *.clf *.cdl *.cc *.ccc);;All files (*)"));
  if (path.isEmpty()) return;
  settings.setValue("lut_folder", QFileInfo(path).absolutePath());
  Read(path, another);
}

void LutPage::Read(const QString& path, bool another) {
  open_->setEnabled(false);
  problem_->hide();
  PostToPool(pool_, [this, path, another, subject = subject_] {
    std::shared_ptr<const ColorTable> table;
    QString problem;
    try {
      table = ReadLut(path.toStdString());
    } catch (const std::exception& error) {
      problem = FailureText(error);
    }
    Post(this, [this, table, problem, another, subject] {
      open_->setEnabled(true);
      if (subject != subject_) return;  // the user has chosen another region
      problem_->setText(Breakable(problem));
      problem_->setVisible(!problem.isEmpty());
      if (!table) return;
      ColorOperation operation = ColorOperation::Lut(table);
      if (another) return Q_EMIT added(operation);
      if (const ColorOperation* old = shown(ColorOperationKind::kLut)) {
        operation.strength = old->strength;
      }
      Q_EMIT changed(operation, false);
    });
  });
}

void LutPage::ShowMore() {
  const ColorOperation* operation = shown(ColorOperationKind::kLut);
  if (!operation || !operation->table) {
    name_->setText(tr("No table yet. Open one that was made for colors as a screen shows them."));
    return;
  }
  const QString name = QString::fromStdString(operation->table->name);
  name_->setText(tr("%1, %2 nodes a side").arg(Breakable(name)).arg(operation->table->size));
}

}  // namespace retint
