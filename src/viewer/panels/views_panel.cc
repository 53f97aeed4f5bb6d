// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/views_panel.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include <QApplication>
#include <QComboBox>
#include <QLabel>
#include <QListWidget>
#include <QPainter>
#include <QScrollBar>
#include <QStyledItemDelegate>
#include <QVBoxLayout>

#include "scene/mask_pixels.h"
#include "viewer/canvas/canvas.h"
#include "viewer/canvas/photo_loader.h"
#include "viewer/canvas/uncertainty.h"
#include "viewer/panels/guide.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/post.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/selection/stroke_preview.h"

namespace retint {
namespace {

constexpr int kThumbWidth = 112;  // at least; the columns share the rest of the list's width
constexpr int kThumbMargin = 12;
constexpr int kCountedSide = 1024;  // pixels
constexpr int kRestMs = 800;        // of unchanged colors, before pictures of them are rendered
enum Role { kName = Qt::UserRole, kPicture, kBadge, kShown, kOverlay };

// Coverage of a picture by the masks of its views; nullopt if none has a mask. Several are counted
// in a picture of at most kCountedSide.
std::optional<double> Coverage(const SceneFacts& facts, const UserPicture& picture,
                               const std::map<std::string, Mask>& masks) {
  std::vector<Mask> faces;
  bool any = false;
  for (const View* face : picture.faces) {
    const auto found = masks.find(face->name);
    any |= found != masks.end();
    if (found != masks.end() && picture.faces.size() == 1) return FractionInside(found->second);
    const Camera& camera = facts.workspace->reconstruction.cameras.at(face->camera_id);
    faces.push_back(found != masks.end() ? found->second : Mask(camera.width, camera.height));
  }
  if (!any) return std::nullopt;
  const int side = std::max(picture.width, picture.height);
  const double scale = std::min(1.0, double(kCountedSide) / side);
  const auto scaled = [&](int size) { return std::max(1, int(std::lround(size * scale))); };
  return FractionInside(
      facts.Lens(picture, scaled(picture.width), scaled(picture.height))->Bent(faces));
}

QImage RenderSmall(EditSession& session, const SmallPicture& picture, std::span<const float> sh) {
  RenderRequest request;
  request.cache = false;  // too small for anything else
  session.scene().renderer().SetSh(sh);
  return DrawThrough(picture.lens.get(), picture.camera, [&](const PosedCamera& face) {
    return ToQImage(session.scene().renderer().Render(face, request).rgb);
  });
}

// A thumbnail with its badge, the name below.
class ViewDelegate : public QStyledItemDelegate {
 public:
  using QStyledItemDelegate::QStyledItemDelegate;

  QSize sizeHint(const QStyleOptionViewItem& option, const QModelIndex&) const override {
    const auto* list = qobject_cast<const QListWidget*>(parent());
    const int room = list ? list->viewport()->width() - 2 : 0;
    const int columns = std::max(1, room / (kThumbWidth + kThumbMargin));
    const int width = std::max(room / columns, kThumbWidth + kThumbMargin);
    return {width, Thumb(width).height() + option.fontMetrics.height() + 14};
  }

  void paint(QPainter* painter, const QStyleOptionViewItem& option,
             const QModelIndex& index) const override {
    painter->save();
    const QPalette& colors = option.palette;
    const QRect cell = option.rect.adjusted(2, 2, -2, -2);
    const bool selected = option.state & QStyle::State_Selected;
    if (selected) painter->fillRect(cell, colors.color(QPalette::Highlight));
    const QSize thumb = Thumb(option.rect.width());
    const QRect frame({cell.center().x() - thumb.width() / 2, cell.top() + 4}, thumb);
    painter->fillRect(frame, colors.color(QPalette::AlternateBase));
    const auto picture = index.data(kPicture).value<QImage>();
    if (!picture.isNull()) {
      const QSize size = picture.size().scaled(frame.size(), Qt::KeepAspectRatio);
      QRect place(QPoint(), size);
      place.moveCenter(frame.center());
      painter->setRenderHint(QPainter::SmoothPixmapTransform);
      painter->drawImage(place, picture);
      const auto overlay = index.data(kOverlay).value<QImage>();
      if (!overlay.isNull()) painter->drawImage(place, overlay);
    }
    if (index.data(kShown).toBool()) {
      painter->setPen(
          QPen(colors.color(selected ? QPalette::HighlightedText : QPalette::Highlight), 3));
      painter->drawRect(frame.adjusted(1, 1, -2, -2));
    }
    const QString badge = index.data(kBadge).toString();
    if (!badge.isEmpty()) {
      const QFontMetrics metrics(option.font);
      QRect box(0, 0, metrics.horizontalAdvance(badge) + 10, metrics.height() + 2);
      box.moveBottomRight(frame.bottomRight() - QPoint(3, 3));
      painter->setRenderHint(QPainter::Antialiasing);
      painter->setPen(Qt::white);
      painter->setBrush(QColor(0, 0, 0, 200));
      painter->drawRoundedRect(box, 4, 4);
      painter->drawText(box, Qt::AlignCenter, badge);
    }
    const QRect below(cell.left() + 2, frame.bottom() + 3, cell.width() - 4,
                      option.fontMetrics.height());
    painter->setPen(colors.color(selected ? QPalette::HighlightedText : QPalette::Text));
    painter->drawText(below, Qt::AlignCenter,
                      option.fontMetrics.elidedText(index.data(kName).toString(), Qt::ElideMiddle,
                                                    below.width()));
    if (option.state & QStyle::State_HasFocus) {
      painter->setBrush(Qt::NoBrush);
      painter->setPen(QPen(colors.color(QPalette::Text), 1, Qt::DotLine));
      painter->drawRect(cell.adjusted(0, 0, -1, -1));
    }
    painter->restore();
  }

 private:
  static QSize Thumb(int cell) {
    const int width = cell - kThumbMargin;
    return {width, width * 3 / 4};
  }
};

}  // namespace

ViewsPanel::ViewsPanel(SceneController* controller, Canvas* canvas, PhotoLoader* photos,
                       CurrentRegion* current, Uncertainty* uncertainty, StrokePreview* preview)
    : controller_(controller),
      canvas_(canvas),
      photos_(photos),
      current_(current),
      uncertainty_(uncertainty) {
  setObjectName("views_panel");
  pool_.setMaxThreadCount(1);
  rest_.setSingleShot(true);
  rest_.setInterval(kRestMs);
  Build();
  Connect(preview);
  Fill();
}

void ViewsPanel::Build() {
  order_ = new QComboBox;
  order_->setObjectName("views_order");
  order_->addItems({tr("By name"), tr("Largest mask first"), tr("To paint next (computes)"),
                    tr("Worst first (measures)")});
  order_->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  order_->setMinimumContentsLength(9);
  order_->setToolTip(tr(
      "Order of the views. Worst first renders every view to measure the current region; to paint "
      "next, first the views whose paint would settle most of what is uncertain: there Enter goes "
      "on painting the current region (Alt+O)"));
  auto* label = new QLabel(tr("&Order"));
  label->setBuddy(order_);
  list_ = new QListWidget;
  list_->setObjectName("views_list");
  list_->setAccessibleName(tr("Training views"));
  list_->setToolTip(
      tr("Double-click or Return goes there; the badge is the share of the picture "
         "that the current region's mask covers"));
  list_->setViewMode(QListView::IconMode);
  list_->setMovement(QListView::Static);
  list_->setResizeMode(QListView::Adjust);
  list_->setUniformItemSizes(true);
  list_->setLayoutMode(QListView::Batched);
  list_->setItemDelegate(new ViewDelegate(list_));
  list_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  // A bar that comes and goes would change the columns, and those whether it is needed.
  list_->setVerticalScrollBarPolicy(Qt::ScrollBarAlwaysOn);
  note_ = new QLabel;
  note_->setObjectName("views_note");
  note_->setWordWrap(true);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 6, 6, 6);
  auto* line = new QHBoxLayout;
  line->addWidget(label);
  line->addWidget(order_, 1);
  line->addWidget(MakeGuideButton("Recolor an object"));
  layout->addLayout(line);
  layout->addWidget(list_, 1);
  layout->addWidget(note_);
}

void ViewsPanel::Connect(StrokePreview* preview) {
  connect(order_, &QComboBox::activated, this, &ViewsPanel::ChooseOrder);
  connect(list_, &QListWidget::itemActivated, this, &ViewsPanel::Jump);
  list_->setContextMenuPolicy(Qt::CustomContextMenu);
  connect(list_, &QWidget::customContextMenuRequested, this, [this](const QPoint& at) {
    QListWidgetItem* item = list_->itemAt(at);
    if (!item) return;
    Jump(item);
    Q_EMIT menuWanted(list_->viewport()->mapToGlobal(at));
  });
  // The mouse has chosen the view; the next command is for it. Return goes on in the list.
  connect(list_, &QListWidget::itemDoubleClicked, this,
          [this] { canvas_->setFocus(Qt::MouseFocusReason); });
  connect(list_->verticalScrollBar(), &QScrollBar::valueChanged, this, &ViewsPanel::AskThumbnails);
  connect(list_->verticalScrollBar(), &QScrollBar::valueChanged, &rest_, [this] { rest_.start(); });
  connect(&rest_, &QTimer::timeout, this, &ViewsPanel::RenderNext);
  connect(&controller_->colors(), &SceneColors::shChanged, &rest_, [this] { rest_.start(); });
  connect(photos_, &PhotoLoader::thumbnailReady, this, &ViewsPanel::ShowThumbnail);
  connect(controller_, &SceneController::opened, this, &ViewsPanel::Fill);
  connect(controller_, &SceneController::closed, this, &ViewsPanel::Fill);
  connect(controller_, &SceneController::regionsChanged, this, &ViewsPanel::CountCoverage);
  connect(controller_, &SceneController::regionsChanged, this, &ViewsPanel::ForgetQuality);
  connect(&controller_->results(), &SceneResults::qualityReady, this, &ViewsPanel::TakeQuality);
  const auto stopped = [this](quint64 task) {
    const int wanted = order_->currentIndex();
    if (task == 0) return;
    if ((wanted == kWorstFirst && task == controller_->results().measuring()) ||
        (wanted == kToPaintNext && task == uncertainty_->task())) {
      Stay();
    }
  };
  connect(controller_, &SceneController::failed, this,
          [=](const QString&, const QString&, quint64 task) { stopped(task); });
  connect(controller_, &SceneController::cancelled, this,
          [=](const QString&, quint64 task) { stopped(task); });
  // Boards without photos show renders.
  connect(canvas_, &Canvas::stateChanged, &rest_, [this] {
    if (canvas_->frusta()) rest_.start();
  });
  connect(current_, &CurrentRegion::changed, this, &ViewsPanel::CountCoverage);
  connect(current_, &CurrentRegion::changed, this, &ViewsPanel::ForgetQuality);
  connect(uncertainty_, &Uncertainty::changed, this, &ViewsPanel::TakeUncertainty);
  connect(uncertainty_, &Uncertainty::refused, this, [this](const QString& why) {
    if (order_->currentIndex() != kToPaintNext) return;
    Stay();
    note_->setText(why);
    note_->show();
  });
  preview->SetVisible([this] { return Visible(); });
  connect(preview, &StrokePreview::shown, this, [this](const QString& view, const QImage& overlay) {
    if (QListWidgetItem* item = ItemOf(view.toStdString())) item->setData(kOverlay, overlay);
  });
  connect(preview, &StrokePreview::cleared, this, [this] {
    for (const auto& [name, item] : items_) item->setData(kOverlay, {});
  });
  connect(canvas_, &Canvas::cameraChanged, this, &ViewsPanel::Follow);
}

ViewsPanel::~ViewsPanel() {
  pool_.waitForDone();
  PoolIsDone();
}

void ViewsPanel::Fill() {
  list_->clear();
  items_.clear();
  coverage_.clear();
  quality_.clear();
  settles_.clear();
  rendered_.clear();
  rendering_ = false;
  counted_ = 0;
  in_force_ = kByName;
  Stay();
  const auto facts = controller_->facts();
  order_->setEnabled(facts != nullptr);
  note_->setText(facts ? QString() : tr("No scene is open."));
  note_->setVisible(!note_->text().isEmpty());
  if (!facts) return;
  for (const UserPicture& picture : facts->pictures->all()) {
    auto* item = new QListWidgetItem(list_);
    item->setData(kName, QString::fromStdString(picture.name));
    items_.emplace(picture.name, item);
    Label(item);
  }
  // PhotoLoader hears of the scene from the same signal as this panel.
  QTimer::singleShot(0, this, &ViewsPanel::AskThumbnails);
  CountCoverage();
  Follow();
}

// All of them, those on the screen first: the loader reads in the order in which it was asked.
void ViewsPanel::AskThumbnails() {
  const QRect shown = list_->viewport()->rect();
  for (const bool visible : {true, false}) {
    for (const auto& [name, item] : items_) {
      if (list_->visualItemRect(item).intersects(shown) != visible) continue;
      if (!item->data(kPicture).value<QImage>().isNull()) continue;
      const QImage picture = photos_->Thumbnail(name);
      if (!picture.isNull()) item->setData(kPicture, picture);
    }
  }
}

void ViewsPanel::ShowThumbnail(const QString& name) {
  QListWidgetItem* item = ItemOf(name.toStdString());
  if (!item || rendered_.contains(name.toStdString())) return;
  const QImage picture = photos_->Thumbnail(name.toStdString());
  if (picture.isNull()) return rest_.start();  // a render serves
  item->setData(kPicture, picture);
}

void ViewsPanel::RenderNext() {
  if (!controller_->IsOpen() || rendering_) return;
  if (controller_->IsBusy() || controller_->colors().optimizer().Active()) return rest_.start();
  const ShPointer sh = controller_->colors().sh();
  const uint64_t version = controller_->colors().sh_version();
  const QRect shown = list_->viewport()->rect();
  for (const auto& [name, item] : items_) {
    const auto found = rendered_.find(name);
    if (controller_->colors().ShowsOriginal() && !photos_->IsMissing(name)) {
      if (found == rendered_.end()) continue;
      rendered_.erase(found);
      item->setData(kPicture, photos_->Thumbnail(name));
      continue;
    }
    const bool listed = list_->isVisible() && list_->visualItemRect(item).intersects(shown);
    if (!listed && !(canvas_->frusta() && photos_->IsMissing(name))) continue;
    if (found != rendered_.end() && found->second == version) continue;
    rendering_ = true;
    const auto picture = std::make_shared<QImage>();
    const auto facts = controller_->facts();
    const bool asked = controller_->Run(
        {},
        [=, of = facts->FindPicture(name)](EditSession& session, Monitor&) {
          try {
            *picture = RenderSmall(session, SmallPictureOf(*facts, *of), *sh);
          } catch (const std::exception&) {
            // The photo stays: nobody waits for this picture.
          }
        },
        [=, this, of = name] {
          rendering_ = false;
          rendered_[of] = version;
          QListWidgetItem* one = ItemOf(of);
          if (one && !picture->isNull()) {
            one->setData(kPicture, *picture);
            canvas_->SetBoard(of, *picture);
          }
          RenderNext();
        });
    if (!asked) rendering_ = false;
    return;
  }
}

QListWidgetItem* ViewsPanel::ItemOf(const std::string& name) const {
  const auto found = items_.find(name);
  return found == items_.end() ? nullptr : found->second;
}

void ViewsPanel::CountCoverage() {
  const Region* region = controller_->regions().Find(current_->id());
  const auto selection = region ? region->selection : nullptr;
  const uint64_t id = selection ? selection->id : 0;
  if (id == counted_) return;
  counted_ = id;
  coverage_.clear();
  quality_.clear();
  if (in_force_ >= kToPaintNext) in_force_ = kByName;  // the others are of another selection
  Stay();
  Sort();
  if (!selection) return;
  PostToPool(pool_, [this, selection, facts = controller_->facts()] {
    std::map<std::string, double> coverage;
    for (const UserPicture& picture : facts->pictures->all()) {
      const auto covered = Coverage(*facts, picture, selection->masks);
      if (covered) coverage[picture.name] = *covered;
    }
    Post(this, [=, this] { TakeCoverage(selection->id, coverage); });
  });
}

void ViewsPanel::TakeCoverage(uint64_t selection, std::map<std::string, double> coverage) {
  if (selection != counted_) return;
  coverage_ = std::move(coverage);
  Sort();
}

void ViewsPanel::TakeQuality(RegionId id, const QualityReport& report) {
  if (id != current_->id()) return;
  quality_.clear();
  const auto facts = controller_->facts();
  // Of a photo's views the worst, which come first.
  for (const ViewQuality& view : report.views) {
    const UserPicture* picture = facts->FindPicture(view.name);
    if (picture) quality_.emplace(picture->name, view);
  }
  measured_edit_ = controller_->results().EditKey(id);
  SetOrder(order_->currentIndex() == kWorstFirst ? kWorstFirst : in_force_);
}

void ViewsPanel::ForgetQuality() {
  if (quality_.empty() || controller_->results().EditKey(current_->id()) == measured_edit_) return;
  quality_.clear();
  SetOrder(in_force_ == kWorstFirst ? kByName : in_force_);
}

void ViewsPanel::TakeUncertainty() {
  settles_.clear();
  const auto found = uncertainty_->found();
  if (found) {
    for (const ViewSuggestion& one : found->views) settles_[one.view] = one.fraction;
  }
  const bool wanted = found && order_->currentIndex() == kToPaintNext;
  if (wanted && !SettlesAnything(found->views)) {
    Stay();
    note_->setText(
        tr("No view would settle anything: the paint shows the whole object, or covers too few "
           "Gaussians to complete the selection from them."));
    note_->show();
    return;
  }
  SetOrder(wanted ? kToPaintNext : in_force_);
}

std::vector<std::string> ViewsPanel::Visible() const {
  std::vector<std::string> names;
  if (!list_->isVisible()) return names;
  const QRect shown = list_->viewport()->rect();
  for (const auto& [name, item] : items_) {
    if (list_->visualItemRect(item).intersects(shown)) names.push_back(name);
  }
  return names;
}

void ViewsPanel::ChooseOrder(int order) {
  const RegionId id = current_->id();
  if (order == kWorstFirst && quality_.empty()) {
    if (id == 0) {
      Stay();
      note_->setText(tr("Choose a region to measure first."));
      note_->show();
    } else {
      controller_->results().Evaluate(id);  // SetOrder() when it is there
    }
    return;
  }
  if (order == kToPaintNext) {
    if (!uncertainty_->found()) return uncertainty_->Find();  // SetOrder() when it is there
    return TakeUncertainty();
  }
  SetOrder(Order(order));
}

// The box goes on naming an order that is on its way.
void ViewsPanel::SetOrder(Order order) {
  const bool waits = order_->currentIndex() != in_force_ && order == in_force_;
  const bool other = order != in_force_;
  in_force_ = order;
  if (!waits) Stay();
  Sort();
  if (other) list_->scrollToTop();
}

void ViewsPanel::Stay() { order_->setCurrentIndex(in_force_); }

void ViewsPanel::Sort() {
  const auto facts = controller_->facts();
  if (!facts) return;
  std::vector<const UserPicture*> pictures;
  for (const UserPicture& picture : facts->pictures->all()) pictures.push_back(&picture);
  const auto covered = [&](const UserPicture* picture) {
    const auto found = coverage_.find(picture->name);
    return found == coverage_.end() ? 0.0 : found->second;
  };
  const auto inside = [&](const UserPicture* picture) {
    const auto found = quality_.find(picture->name);
    return found == quality_.end() ? 1e9 : found->second.psnr_inside;
  };
  // Those that were suggested one after the other, in that order; painted ones at the end.
  std::map<std::string, size_t> places;
  const auto found = uncertainty_->found();
  for (size_t i = 0; found && i < found->views.size(); ++i) places[found->views[i].view] = i;
  const auto place = [&](const UserPicture* picture) {
    const auto at = places.find(picture->name);
    return at == places.end() ? places.size() : at->second;
  };
  const int order = in_force_;
  std::ranges::stable_sort(pictures, [&](const UserPicture* a, const UserPicture* b) {
    if (order == kByCoverage) return covered(a) > covered(b);
    if (order == kWorstFirst) return inside(a) < inside(b);
    if (order == kToPaintNext) return place(a) < place(b);
    return false;
  });
  QListWidgetItem* current = list_->currentItem();
  for (int row = 0; row < int(pictures.size()); ++row) {
    QListWidgetItem* item = ItemOf(pictures[size_t(row)]->name);
    if (!item) return;  // a scene that was opened just now: Fill() has not heard of it yet
    const int now = list_->row(item);
    if (now != row) list_->insertItem(row, list_->takeItem(now));
    Label(item);
  }
  if (current) list_->setCurrentItem(current);
  note_->hide();
  rest_.start();  // others show now
}

void ViewsPanel::Label(QListWidgetItem* item) {
  const QString name = item->data(kName).toString();
  const auto covered = coverage_.find(name.toStdString());
  const auto quality = quality_.find(name.toStdString());
  QString badge, tip = name;
  if (covered != coverage_.end()) {
    badge = covered->second > 0 ? tr("%1 %").arg(100 * covered->second, 0, 'f', 1) : tr("none");
    tip += tr("\nMask: %1 of the picture").arg(badge);
  }
  if (quality != quality_.end()) {
    badge = tr("%1 dB").arg(quality->second.psnr_inside, 0, 'f', 1);
    tip += tr("\nPSNR inside %1, outside %2 dB")
               .arg(quality->second.psnr_inside, 0, 'f', 2)
               .arg(quality->second.psnr_outside, 0, 'f', 2);
  }
  const auto settles = settles_.find(name.toStdString());
  if (settles != settles_.end() && in_force_ == kToPaintNext) {
    badge = tr("settles %1 %").arg(100 * settles->second, 0, 'f', 1);
    tip += tr("\nPainted next, it would settle %1 % of what is uncertain")
               .arg(100 * settles->second, 0, 'f', 1);
  }
  const auto facts = controller_->facts();
  const bool heldout =
      facts && std::any_of(facts->heldout.begin(), facts->heldout.end(), [&](const View* view) {
        return facts->PictureOf(*view).name == name.toStdString();
      });
  if (heldout) tip += tr("\nHeld out of the fit");
  item->setData(kBadge, badge);
  item->setToolTip(tip);
  item->setData(Qt::AccessibleTextRole, badge.isEmpty() ? name : name + ", " + badge);
}

void ViewsPanel::Follow() {
  const UserPicture* shown = canvas_->picture();
  for (const auto& [name, item] : items_) {
    const bool is = shown && name == shown->name;
    if (item->data(kShown).toBool() != is) item->setData(kShown, is);
    if (is && !list_->hasFocus()) list_->scrollToItem(item);
  }
}

void ViewsPanel::Jump(QListWidgetItem* item) {
  canvas_->GoTo(item->data(kName).toString().toStdString());
}

}  // namespace retint
