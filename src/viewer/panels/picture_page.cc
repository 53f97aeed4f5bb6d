// SPDX-License-Identifier: BSD-3-Clause
// The page of pictures that another program edited.
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

#include "viewer/panels/edit_pages.h"

namespace retint {

PicturePage::PicturePage() : EditPage({ColorOperationKind::kPicture}) {
  found_ = new QLabel;
  found_->setObjectName("picture_found");
  found_->setWordWrap(true);
  rows()->addWidget(found_);
  const auto add = [this](const char* name, const QString& text, const QString& tip, bool photo) {
    auto* button = new QPushButton(text);
    button->setObjectName(name);
    button->setToolTip(tip);
    rows()->addWidget(button, 0, Qt::AlignLeft);
    connect(button, &QPushButton::clicked, this, [this, photo] { Q_EMIT elsewhereWanted(photo); });
  };
  add("picture_elsewhere", tr("Edit this view elsewhere…"),
      tr("Open the view that shows in the desktop's program for pictures. What you save there is "
         "taken over"),
      false);
  add("picture_photo_elsewhere", tr("Edit its photo elsewhere…"),
      tr("The same with the photo of this view"), true);
  split_ = new QPushButton(tr("Split large Gaussians…"));
  split_->setObjectName("picture_split");
  split_->setToolTip(tr(
      "Where stripes or letters look torn: write a splat whose painted Gaussians are small enough "
      "to show them, and go on with it"));
  rows()->addWidget(split_, 0, Qt::AlignLeft);
  connect(split_, &QPushButton::clicked, this, &PicturePage::splitWanted);
}

void PicturePage::ShowMore() {
  const ColorOperation* operation = shown(ColorOperationKind::kPicture);
  split_->setEnabled(operation && !operation->picture->layers.empty());
  if (!operation) {
    return found_->setText(
        tr("Paint on a view in another program, or grade it there. The change "
           "is carried to all views."));
  }
  if (operation->NeedsMeasuring()) return found_->setText(tr("Comparing the picture…"));
  const double explained = 100 * double(operation->Get("explained")[0]);
  const QString text = operation->table ? tr("One color map explains %1 % of the selected pixels.")
                                        : tr("%1 % of the selected pixels are unchanged.");
  found_->setText(text.arg(explained, 0, 'f', 1) +
                  (operation->picture->layers.empty()
                       ? QString()
                       : " " + tr("The rest is carried to the other views as paint, which the "
                                  "optimizer makes sharp.")));
}

}  // namespace retint
