// SPDX-License-Identifier: BSD-3-Clause
// Asks which colors the splat is to have: those of the photos, of another splat, or of a card that
// the user marks in a photo. It keeps all entries while it is hidden.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include <QDialog>
#include <QPolygonF>
#include <QThreadPool>

#include "editing/match_scene.h"
#include "viewer/scene/scene_controller.h"

class QComboBox;
class QLabel;
class QLineEdit;
class QListWidget;
class QPushButton;

namespace retint {

class CardMarker;
class PhotoLoader;

class MatchDialog : public QDialog {
  Q_OBJECT

 public:
  enum Reference { kPhotos, kSplat, kGray, kChecker };

  // `photos` outlives it.
  MatchDialog(std::shared_ptr<const SceneFacts> facts, PhotoLoader* photos, QWidget* parent);
  ~MatchDialog() override;

  // Chooses a photo for the card, unless the user has marked one.
  void Propose(const std::string& picture);
  MatchRecipe recipe() const;
  // A message of a match in the words of this dialog.
  static QString Spelled(const QString& message);

 private:
  QWidget* MakeSplatLine();
  QWidget* MakeCardPage();
  bool NeedsCard() const;
  std::string Picture() const;  // the chosen one; empty: none
  void ShowReference();
  void ShowPhoto();
  void ShowCard();
  void Check();

  std::shared_ptr<const SceneFacts> facts_;
  PhotoLoader* photos_;
  QComboBox* reference_;
  QWidget *splat_line_, *card_page_;
  QLineEdit* splat_;
  QListWidget* list_;
  CardMarker* marker_;
  QLabel *hint_, *problem_;
  QPushButton* match_;
  std::string read_;  // the picture of the marker's photo, also while that is read
  // Marked by the user, by reference and picture.
  std::map<std::pair<int, std::string>, QPolygonF> cards_;
  QThreadPool pool_;
};

}  // namespace retint
