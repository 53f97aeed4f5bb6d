// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/scene_panel.h"

#include <algorithm>
#include <map>

#include <QApplication>
#include <QClipboard>
#include <QFileInfo>
#include <QHeaderView>
#include <QLabel>
#include <QListWidget>
#include <QLocale>
#include <QRegularExpression>
#include <QShortcut>
#include <QStyledItemDelegate>
#include <QTreeWidget>
#include <QVBoxLayout>

#include "viewer/panels/guide.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/widgets/long_text.h"

namespace retint {
namespace {

QString Text(const std::filesystem::path& path) { return QString::fromStdString(path.string()); }

QString CameraText(const Camera& camera) {
  static const QRegularExpression kSize("(\\d)x(\\d)");
  return QString::fromStdString(DescribeCamera(camera)).replace(kSize, "\\1×\\2");
}

QString FocalText(const Camera& camera) {
  if (!camera.IsPinhole()) return QStringLiteral("–");
  return ScenePanel::tr("%1 pixels").arg(camera.fx(), 0, 'f', 1);
}

double MeanError(const Reconstruction& reconstruction) {
  double sum = 0;
  size_t count = 0;
  for (const auto& [id, point] : reconstruction.points) {
    if (point.error < 0) continue;
    sum += point.error;
    ++count;
  }
  return count > 0 ? sum / double(count) : -1;
}

// Wraps text anywhere at the end of a line, because a path has no spaces.
class WrappedValue : public QStyledItemDelegate {
 public:
  explicit WrappedValue(QTreeWidget* tree) : QStyledItemDelegate(tree), tree_(tree) {
    QObject::connect(tree->header(), &QHeaderView::sectionResized, tree,
                     [tree] { tree->doItemsLayout(); });
  }
  QSize sizeHint(const QStyleOptionViewItem& option, const QModelIndex& index) const override {
    const int margin = kMargin + tree_->style()->pixelMetric(QStyle::PM_FocusFrameHMargin);
    const QRect room(0, 0, std::max(tree_->columnWidth(1) - 2 * margin, 1), 1 << 16);
    const QRect text = option.fontMetrics.boundingRect(room, Qt::TextWrapAnywhere,
                                                       index.data(Qt::DisplayRole).toString());
    return {0, text.height() + 2 * kMargin};
  }

 protected:
  void initStyleOption(QStyleOptionViewItem* option, const QModelIndex& index) const override {
    QStyledItemDelegate::initStyleOption(option, index);
    option->features |= QStyleOptionViewItem::WrapText;
    option->text = Breakable(option->text);
  }

 private:
  static constexpr int kMargin = 3;
  QTreeWidget* tree_;
};

}  // namespace

ScenePanel::ScenePanel(SceneController* controller) : controller_(controller) {
  setObjectName("scene_panel");
  none_ =
      new QLabel(tr("No scene is open. Open one with Ctrl+O, or drop a COLMAP workspace and "
                    "a splat on the window."));
  none_->setWordWrap(true);
  facts_ = new QTreeWidget;
  facts_->setObjectName("scene_facts");
  facts_->setAccessibleName(tr("What is open"));
  facts_->setToolTip(tr("Ctrl+C copies a line"));
  facts_->setColumnCount(2);
  facts_->setHeaderHidden(true);
  facts_->setRootIsDecorated(false);
  facts_->setUniformRowHeights(false);
  facts_->setWordWrap(true);
  facts_->setTextElideMode(Qt::ElideNone);
  facts_->setItemDelegateForColumn(1, new WrappedValue(facts_));
  facts_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  facts_->header()->setSectionResizeMode(0, QHeaderView::ResizeToContents);
  // As wide as possible: a stretched last section would keep 100 pixels and scroll.
  facts_->header()->setStretchLastSection(false);
  facts_->header()->setSectionResizeMode(1, QHeaderView::Stretch);
  auto* copy = new QShortcut(QKeySequence::Copy, facts_);
  copy->setContext(Qt::WidgetShortcut);
  connect(copy, &QShortcut::activated, this, [this] {
    if (const auto* item = facts_->currentItem()) QApplication::clipboard()->setText(item->text(1));
  });
  warnings_title_ = new QLabel;
  warnings_ = new QListWidget;
  warnings_->setObjectName("scene_warnings");
  warnings_->setAccessibleName(tr("Warnings"));
  warnings_->setWordWrap(true);
  warnings_->setTextElideMode(Qt::ElideNone);
  warnings_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 6, 6, 6);
  layout->addWidget(none_);
  layout->addWidget(MakeGuideButton("Open a scene"), 0, Qt::AlignRight);
  layout->addWidget(facts_, 3);
  layout->addWidget(warnings_title_);
  layout->addWidget(warnings_, 1);
  connect(controller, &SceneController::opened, this, &ScenePanel::Show);
  connect(controller, &SceneController::closed, this, &ScenePanel::Show);
  connect(&controller->results(), &SceneResults::sceneChecked, this, &ScenePanel::AddWarnings);
  Show();
}

void ScenePanel::Show() {
  const auto facts = controller_->facts();
  none_->setVisible(!facts);
  for (QWidget* widget : std::initializer_list<QWidget*>{facts_, warnings_title_, warnings_}) {
    widget->setVisible(facts != nullptr);
  }
  facts_->clear();
  warnings_->clear();
  if (!facts) return;
  const auto add = [this](const QString& what, const QString& value) {
    auto* item = new QTreeWidgetItem(facts_, {what, value});
    item->setToolTip(1, value);
  };
  const QLocale locale;
  const Reconstruction& model = facts->workspace->reconstruction;
  if (facts->workspace->has_virtual_views) {
    add(tr("Workspace"), tr("none: views were placed around the splat"));
    add(tr("Photos"), tr("none: renders serve"));
  } else {
    add(tr("Workspace"), Text(facts->request.workspace));
    add(tr("Sparse model"), Text(facts->workspace->sparse_folder));
    add(tr("Photos"), Text(facts->workspace->image_folder));
  }
  add(tr("Splat"), Text(facts->request.splat));
  std::map<const Camera*, int> of_camera;
  for (const View* view : facts->Standpoints()) {
    ++of_camera[&facts->workspace->PhotoCamera(*view)];
  }
  std::map<std::pair<QString, QString>, int> cameras;  // texts, number of views
  for (const auto& [camera, count] : of_camera) {
    cameras[{CameraText(*camera), FocalText(*camera)}] += count;
  }
  constexpr int kMostCameras = 6;
  int shown = 0;
  for (const auto& [text, count] : cameras) {
    if (++shown > kMostCameras) {
      add(tr("Cameras"), tr("and %1 more").arg(int(cameras.size()) - kMostCameras));
      break;
    }
    add(tr("Camera"), text.first);
    add(tr("Focal length"), text.second);
    if (cameras.size() > 1) add(tr("… of views"), locale.toString(count));
  }
  const size_t heldout = facts->pictures->Showing(facts->heldout).size();
  const size_t views = facts->pictures->all().size();
  add(tr("Views"), heldout == 0 ? locale.toString(qulonglong(views))
                                : tr("%1, %2 of them held out").arg(views).arg(heldout));
  const double error = MeanError(model);
  QString points = locale.toString(qulonglong(model.points.size()));
  if (error >= 0) points += tr(", mean error %1 pixels").arg(error, 0, 'f', 2);
  add(tr("Sparse points"), points);
  add(tr("Gaussians"), locale.toString(qulonglong(facts->original->NumGaussians())));
  add(tr("SH degree"), tr("%1 (%2 coefficients a channel)")
                           .arg(facts->original->sh_degree)
                           .arg(facts->original->NumShCoeffs()));
  const std::string_view backend = facts->backend->Name();
  add(tr("Backend"), QString::fromUtf8(backend.data(), qsizetype(backend.size())).toUpper() + ": " +
                         QString::fromStdString(facts->backend->Description()));
  add(tr("Loaded in"), tr("%1 s").arg(facts->load_seconds, 0, 'f', 2));

  AddWarnings(facts->warnings);
}

void ScenePanel::AddWarnings(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) {
    auto* item = new QListWidgetItem(QStringLiteral("⚠ ") + QString::fromStdString(warning));
    item->setToolTip(QString::fromStdString(warning));
    warnings_->addItem(item);
  }
  const int count = warnings_->count();
  warnings_title_->setText(count == 0 ? tr("✔ No warnings") : tr("Warnings (%1):").arg(count));
  warnings_->setVisible(count > 0);
}

}  // namespace retint
