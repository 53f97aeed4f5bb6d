// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/match_dialog.h"

#include <algorithm>
#include <initializer_list>

#include <QComboBox>
#include <QDialogButtonBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QLabel>
#include <QListWidget>
#include <QPushButton>
#include <QStyledItemDelegate>
#include <QVBoxLayout>

#include "base/option_name.h"
#include "viewer/canvas/photo_loader.h"
#include "viewer/scene/post.h"
#include "viewer/widgets/long_text.h"
#include "viewer/widgets/path_edit.h"
#include "viewer/window/card_marker.h"
#include "viewer/window/open_dialog.h"

namespace retint {
namespace {

constexpr QSize kThumbnail{72, 54};
constexpr int kListWidth = 190, kLeastWidth = 400;  // pixels

// A thumbnail beside the name; photos are read once they are in sight.
class ThumbnailDelegate : public QStyledItemDelegate {
 public:
  ThumbnailDelegate(PhotoLoader* photos, QObject* parent)
      : QStyledItemDelegate(parent), photos_(photos) {}

  QSize sizeHint(const QStyleOptionViewItem&, const QModelIndex&) const override {
    return kThumbnail + QSize(8, 8);
  }

 protected:
  void initStyleOption(QStyleOptionViewItem* option, const QModelIndex& index) const override {
    QStyledItemDelegate::initStyleOption(option, index);
    const QImage small = photos_->Thumbnail(index.data().toString().toStdString());
    option->features |= QStyleOptionViewItem::HasDecoration;
    option->decorationSize = kThumbnail;
    option->textElideMode = Qt::ElideMiddle;
    if (small.isNull()) return;
    const auto picture =
        QPixmap::fromImage(small.scaled(kThumbnail, Qt::KeepAspectRatio, Qt::SmoothTransformation));
    option->icon = QIcon();
    option->icon.addPixmap(picture, QIcon::Normal);
    option->icon.addPixmap(picture, QIcon::Selected);  // else tinted, which changes its colors
  }

 private:
  PhotoLoader* photos_;
};

// In the middle of a photo, as a color checker is: 3 by 2.
QPolygonF MiddleOf(const QSize& photo) {
  const int width = std::min(photo.width(), photo.height() * 3 / 2) / 2;
  QRect card(0, 0, width, width * 2 / 3);
  card.moveCenter(QRect(QPoint(), photo).center());
  return QPolygonF(QRectF(card)).first(4);
}

}  // namespace

MatchDialog::MatchDialog(std::shared_ptr<const SceneFacts> facts, PhotoLoader* photos,
                         QWidget* parent)
    : QDialog(parent), facts_(std::move(facts)), photos_(photos) {
  setObjectName("match_dialog");
  setWindowTitle(tr("Match colors"));
  pool_.setMaxThreadCount(1);
  reference_ = new QComboBox;
  reference_->setObjectName("match_reference");
  reference_->addItems({tr("The photos"), tr("Another splat"), tr("A gray card in a photo"),
                        tr("A color checker in a photo")});
  auto* form = new QFormLayout;
  form->addRow(tr("Match &to"), reference_);
  hint_ = new QLabel;
  hint_->setObjectName("match_hint");
  hint_->setWordWrap(true);
  hint_->setMinimumWidth(kLeastWidth);
  problem_ = new QLabel;
  problem_->setObjectName("match_problem");
  problem_->setWordWrap(true);
  problem_->setMinimumHeight(problem_->fontMetrics().lineSpacing());
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Cancel);
  match_ = buttons->addButton(tr("&Match…"), QDialogButtonBox::AcceptRole);
  match_->setObjectName("match_go");
  connect(buttons, &QDialogButtonBox::accepted, this, &QDialog::accept);
  connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
  auto* layout = new QVBoxLayout(this);
  layout->addLayout(form);
  layout->addWidget(hint_);
  layout->addWidget(splat_line_ = MakeSplatLine());
  layout->addWidget(card_page_ = MakeCardPage(), 1);
  layout->addWidget(problem_);
  layout->addWidget(buttons);
  match_->setDefault(true);
  connect(reference_, &QComboBox::currentIndexChanged, this, &MatchDialog::ShowReference);
  ShowReference();
}

MatchDialog::~MatchDialog() {
  pool_.clear();
  pool_.waitForDone();
  PoolIsDone();
}

QWidget* MatchDialog::MakeSplatLine() {
  auto* line = new QWidget;
  splat_ = new PathEdit;
  splat_->setObjectName("match_splat");
  splat_->setMinimumWidth(360);
  auto* label = new QLabel(tr("&Splat"));
  label->setBuddy(splat_);
  auto* browse = new QPushButton(tr("&Browse…"));
  browse->setAutoDefault(false);
  auto* layout = new QHBoxLayout(line);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(label);
  layout->addWidget(splat_, 1);
  layout->addWidget(browse);
  connect(splat_, &QLineEdit::textChanged, this, &MatchDialog::Check);
  connect(browse, &QPushButton::clicked, this, [this] {
    const QString start = splat_->text().isEmpty()
                              ? QString::fromStdString(facts_->request.place().string())
                              : splat_->text();
    const QString path = QFileDialog::getOpenFileName(this, tr("Match to another splat"), start,
                                                      SplatFilter() + tr(";;All files (*)"));
    if (!path.isEmpty()) splat_->setText(path);
  });
  return line;
}

QWidget* MatchDialog::MakeCardPage() {
  auto* page = new QWidget;
  list_ = new QListWidget;
  list_->setObjectName("match_views");
  list_->setAccessibleName(tr("Photos"));
  list_->setItemDelegate(new ThumbnailDelegate(photos_, list_));
  list_->setUniformItemSizes(true);
  list_->setVerticalScrollMode(QAbstractItemView::ScrollPerPixel);
  list_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  list_->setFixedWidth(kListWidth);
  for (const UserPicture& picture : facts_->pictures->all()) {
    if (facts_->workspace->HasPhoto(*picture.faces.front())) {
      list_->addItem(QString::fromStdString(picture.name));
    }
  }
  marker_ = new CardMarker;
  marker_->setObjectName("match_photo");
  auto* layout = new QHBoxLayout(page);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(list_);
  layout->addWidget(marker_, 1);
  connect(photos_, &PhotoLoader::thumbnailReady, list_->viewport(),
          [this] { list_->viewport()->update(); });
  connect(list_, &QListWidget::currentRowChanged, this, &MatchDialog::ShowPhoto);
  connect(marker_, &CardMarker::changed, this, [this] {
    cards_[{reference_->currentIndex(), read_}] = marker_->corners();
    Check();
  });
  return page;
}

bool MatchDialog::NeedsCard() const { return reference_->currentIndex() >= kGray; }

std::string MatchDialog::Picture() const {
  const QListWidgetItem* item = list_->currentItem();
  return item ? item->text().toStdString() : std::string();
}

void MatchDialog::Propose(const std::string& picture) {
  if (!cards_.empty()) return;
  const auto found = list_->findItems(QString::fromStdString(picture), Qt::MatchExactly);
  if (!found.empty()) {
    list_->setCurrentItem(found.front());
  } else if (!list_->currentItem()) {
    list_->setCurrentRow(0);
  }
  list_->scrollToItem(list_->currentItem(), QAbstractItemView::PositionAtCenter);
}

MatchRecipe MatchDialog::recipe() const {
  MatchRecipe recipe;
  const auto card = [this](std::initializer_list<double> numbers) {
    QStringList texts;
    for (const double number : numbers) texts << QString::number(qRound(number));
    return read_ + ":" + texts.join(',').toStdString();
  };
  const QPolygonF& corners = marker_->corners();
  const QRectF around = corners.boundingRect();
  switch (reference_->currentIndex()) {
    case kSplat:
      recipe.like = splat_->text().trimmed().toStdString();
      break;
    case kGray:
      recipe.gray = card({around.x(), around.y(), around.width(), around.height()});
      break;
    case kChecker:
      recipe.checker = card({corners[0].x(), corners[0].y(), corners[1].x(), corners[1].y(),
                             corners[2].x(), corners[2].y(), corners[3].x(), corners[3].y()});
      break;
    default:
      break;
  }
  return recipe;
}

void MatchDialog::ShowReference() {
  const QString hints[] = {
      tr("Removes a drift of all colors, such as a blue cast, by comparing renders with photos."),
      tr("A splat of the same place, in the same frame as this one."),
      tr("Drag a rectangle inside the card. The wheel zooms."),
      tr("Drag the corners to the outer corners of the 24 patches, in any turn. The wheel zooms.")};
  hint_->setText(hints[reference_->currentIndex()]);
  const bool had_card = !card_page_->isHidden();
  splat_line_->setVisible(reference_->currentIndex() == kSplat);
  card_page_->setVisible(NeedsCard() && list_->count() > 0);
  ShowPhoto();
  if (had_card && NeedsCard()) return;  // as large as the user made it
  layout()->activate();
  adjustSize();
}

void MatchDialog::ShowPhoto() {
  const std::string picture = Picture();
  if (!NeedsCard() || picture.empty()) return Check();
  if (picture == read_) return ShowCard();
  read_ = picture;
  marker_->SetPhoto({}, tr("Reading the photo…"));
  Check();
  pool_.clear();
  PostToPool(pool_, [this, facts = facts_, picture] {
    const View& view = *facts->FindPicture(picture)->faces.front();
    const QImage photo = ReadPicture(facts->workspace->PhotoPath(view), 0);
    Post(this, [this, picture, photo] {
      if (picture != read_) return;  // another one was chosen
      marker_->SetPhoto(photo, tr("The photo cannot be read."));
      ShowCard();
    });
  });
}

void MatchDialog::ShowCard() {
  if (!marker_->photo().isNull()) {
    const bool patches = reference_->currentIndex() == kChecker;
    const auto marked = cards_.find({reference_->currentIndex(), read_});
    const QPolygonF first = patches ? MiddleOf(marker_->photo().size()) : QPolygonF();
    marker_->SetCard(patches ? CardMarker::Shape::kPatches : CardMarker::Shape::kRectangle,
                     marked != cards_.end() ? marked->second : first);
  }
  Check();
}

void MatchDialog::Check() {
  QString problem;
  const QString splat = splat_->text().trimmed();
  bool ready = true;
  if (reference_->currentIndex() == kSplat) {
    ready = QFileInfo(splat).isFile();
    if (!ready) problem = splat.isEmpty() ? tr("Choose a splat.") : tr("The splat is not a file.");
  } else if (list_->count() == 0) {
    ready = false;
    problem = tr("No view has a photo. Match to another splat instead.");
  } else if (NeedsCard()) {
    ready = !marker_->corners().boundingRect().isEmpty();
  }
  problem_->setText(Breakable(problem));
  match_->setEnabled(ready);
}

QString MatchDialog::Spelled(const QString& message) {
  return QString::fromStdString(SpellOptions(
      message.toStdString(), [](std::string_view name, std::string_view) -> std::string {
        if (name == "gray") return tr("The gray card in").toStdString();
        if (name == "checker") return tr("The color checker in").toStdString();
        if (name == "like") return tr("\"Another splat\"").toStdString();
        return tr("\"Photos\" of the form that opens a scene").toStdString();
      }));
}

}  // namespace retint
