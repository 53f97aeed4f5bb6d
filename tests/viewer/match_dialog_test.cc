// SPDX-License-Identifier: BSD-3-Clause
// Edit > Match colors: to the photos, to another splat, and to cards marked in a photo by mouse.
#include <array>
#include <cmath>

#include <QComboBox>
#include <QDialogButtonBox>
#include <QLabel>
#include <QListWidget>
#include <QPushButton>
#include <QWheelEvent>

#include "colmap_io/image_io.h"
#include "recolor/color_match.h"
#include "splat_io/splat_io.h"
#include "tests/viewer/files_fixture.h"
#include "viewer/window/card_marker.h"
#include "viewer/window/match_dialog.h"

namespace retint {

class MatchDialogTest : public FilesFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() {
    MakeScene();
    const std::array<float, 3> warm = {0.6F, 0.5F, 0.42F};
    EditPhoto(kGrayView, [&](Image& photo) { Paint(photo, kCard, warm.data()); });
    EditPhoto(kCheckerView, [](Image& photo) {
      for (int i = 0; i < 24; ++i) {
        const float* rgb = &CheckerColors()[size_t(3 * i)];
        const std::array<float, 3> yellowish = {rgb[0], 0.95F * rgb[1], 0.8F * rgb[2]};
        const QRect patch(kChecker.x() + 16 * (i % 6), kChecker.y() + 16 * (i / 6), 16, 16);
        Paint(photo, patch, yellowish.data());
      }
    });
  }
  void cleanupTestCase() { scene_.reset(); }
  void init() {
    QVERIFY(ShowScene());
    dialog_ = nullptr;
  }
  void cleanup() { EndCase(); }

  // Of a splat that is too bright.
  void ThePhotosAreMatchedOnceTheUserAgrees() {
    OpenRequest request = scene_->Request();
    request.splat = WriteBright();
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenScene(request);
    QVERIFY(Opened(opened));
    QVERIFY(OpenDialog());
    QCOMPARE(reference()->currentIndex(), int(MatchDialog::kPhotos));
    QVERIFY(go()->isDefault() && go()->isEnabled());
    Keep(*dialog_, "match_photos");
    QTest::keyClick(dialog_, Qt::Key_Return);
    QVERIFY(!dialog_->isVisible());
    const QMessageBox* box = WaitDialog(*window_);
    QVERIFY(box && box->informativeText().contains("held-out views"));
    QVERIFY(box->defaultButton() == box->button(QMessageBox::Cancel));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialogs().box());
    QVERIFY(Settle(controller()));
    QVERIFY(Regions().empty());
    QVERIFY(OpenDialog());
    QVERIFY(Match());
    for (const double change : Change()) QVERIFY(change < 0);
    controller().Undo();
    QTRY_VERIFY_WITH_TIMEOUT(controller().colors().ShowsOriginal(), kWaitMs);
  }

  void AnotherSplatIsMatched() {
    GaussianModel large = scene_->scene().model;
    for (float& value : large.means) value *= 2;
    for (float& value : large.log_scales) value += std::log(2.0F);
    const fs::path elsewhere = Fresh() / "large.ply";
    WriteSplat(elsewhere, large);
    QVERIFY(OpenDialog());
    reference()->setCurrentIndex(MatchDialog::kSplat);
    auto* splat = dialog_->findChild<QLineEdit*>("match_splat");
    QVERIFY(splat->isVisible() && !marker()->isVisible());
    QVERIFY(!go()->isEnabled());
    Type(dialog_, "match_splat", elsewhere.parent_path() / "none.ply");
    QCOMPARE(problem(), QString("The splat is not a file."));
    QVERIFY(!go()->isEnabled());
    Type(dialog_, "match_splat", elsewhere);
    Keep(*dialog_, "match_splat");
    QTest::keyClick(splat, Qt::Key_Return);
    const QString error = ReadError(*window_);
    QVERIFY2(error.startsWith("\"Another splat\": only"), qPrintable(error));
    QVERIFY2(error.contains("same depth"), qPrintable(error));
    // The form is still there.
    QVERIFY(dialog_->isVisible());
    QCOMPARE(splat->text(), QString::fromStdString(elsewhere.string()));
    Type(dialog_, "match_splat", WriteBright());
    QVERIFY(Match());
    for (const double change : Change()) QVERIFY2(std::abs(change - kBrighter) < 0.05, "the same");
  }

  void AGrayCardIsMarkedInAPhoto() {
    QVERIFY(canvas().GoTo(NameOf(kGrayView)));
    QVERIFY(OpenDialog());
    reference()->setCurrentIndex(MatchDialog::kGray);
    QVERIFY(HasPhoto(kGrayView));  // of the view that shows
    QVERIFY(!go()->isEnabled());
    DragCard({2, 2}, {158, 118});
    QVERIFY(go()->isEnabled());
    Keep(*dialog_, "match_gray_badly");
    QTest::mouseClick(go(), Qt::LeftButton);
    const QString error = ReadError(*window_);
    QVERIFY2(error.startsWith("The gray card in " + QString::fromStdString(NameOf(kGrayView))),
             qPrintable(error));
    QVERIFY2(error.contains("several colors"), qPrintable(error));
    QVERIFY(Regions().empty());
    QVERIFY(dialog_->isVisible());
    QCOMPARE(dialog_->recipe().gray, NameOf(kGrayView) + ":2,2,156,116");
    // A click marks nothing, and the wheel zooms to the pointer.
    DragCard({80, 60}, {80, 60});
    QCOMPARE(dialog_->recipe().gray, NameOf(kGrayView) + ":2,2,156,116");
    const QPointF middle = QRectF(kCard).center(), at = marker()->ToWidget(middle);
    const double before = Zoom();
    QWheelEvent wheel(at, marker()->mapToGlobal(at), {}, {0, 240}, Qt::NoButton, Qt::NoModifier,
                      Qt::NoScrollPhase, false);
    QCoreApplication::sendEvent(marker(), &wheel);
    QVERIFY(std::abs(Zoom() / before - 1.44) < 1e-6);
    const QPointF moved = marker()->ToWidget(middle) - at;
    QVERIFY(std::hypot(moved.x(), moved.y()) < 1e-6);
    // Drawn from the bottom right; then a corner is moved.
    DragCard({59, 58}, {20, 30});
    DragCard({59, 58}, {60, 60});
    QCOMPARE(dialog_->recipe().gray, NameOf(kGrayView) + ":20,30,40,30");
    Keep(*dialog_, "match_gray");
    QVERIFY(Match());
    const auto change = Change();
    QVERIFY(change[0] < -0.05 && change[2] > 0.05);
  }

  void AColorCheckerIsMarkedByItsCorners() {
    QVERIFY(OpenDialog());
    reference()->setCurrentIndex(MatchDialog::kChecker);
    QVERIFY(ChoosePhoto(kCheckerView));
    QCOMPARE(dialog_->recipe().checker, NameOf(kCheckerView) + ":40,33,120,33,120,86,40,86");
    QTest::mouseClick(go(), Qt::LeftButton);
    const QString error = ReadError(*window_);
    QVERIFY2(error.startsWith("The color checker in "), qPrintable(error));
    QVERIFY2(error.contains("no ColorChecker of 24 patches"), qPrintable(error));
    const QRectF place(kChecker);
    DragCard({40, 33}, place.topLeft());
    DragCard({120, 33}, place.topRight());
    DragCard({120, 86}, place.bottomRight());
    Keep(*dialog_, "match_checker_skewed");
    DragCard({40, 86}, place.bottomLeft());
    const std::string marked = NameOf(kCheckerView) + ":20,16,116,16,116,80,20,80";
    QCOMPARE(dialog_->recipe().checker, marked);
    // It is still there after a look at another photo and another reference.
    QVERIFY(ChoosePhoto(kGrayView));
    reference()->setCurrentIndex(MatchDialog::kGray);
    QVERIFY(!go()->isEnabled());
    reference()->setCurrentIndex(MatchDialog::kChecker);
    QVERIFY(ChoosePhoto(kCheckerView));
    QCOMPARE(dialog_->recipe().checker, marked);
    for (const auto& [theme, name] : {std::pair{ThemeChoice::kDark, "match_checker_dark"},
                                      std::pair{ThemeChoice::kLight, "match_checker_light"}}) {
      theme_->Choose(theme);
      QCoreApplication::processEvents();
      Keep(*dialog_, name);
    }
    QVERIFY(Match());
    const auto change = Change();
    QVERIFY(change[2] - change[0] > 0.1);
  }

  void EscapeChangesNothing() {
    QVERIFY(OpenDialog());
    reference()->setCurrentIndex(MatchDialog::kGray);
    QVERIFY(HasPhoto(0));
    // Around by Tab.
    reference()->setFocus();
    auto* buttons = dialog_->findChild<QDialogButtonBox*>();
    const std::array<QWidget*, 2> stops = {list(), buttons->button(QDialogButtonBox::Cancel)};
    for (QWidget* stop : stops) {
      QTest::keyClick(QApplication::focusWidget(), Qt::Key_Tab);
      QCOMPARE(QApplication::focusWidget(), stop);
    }
    QTest::keyClick(QApplication::focusWidget(), Qt::Key_Tab);
    QCOMPARE(QApplication::focusWidget(), static_cast<QWidget*>(reference()));
    DragCard({10, 10}, {50, 40});
    QTest::keyClick(dialog_, Qt::Key_Escape);
    QTRY_VERIFY(!dialog_->isVisible());
    QVERIFY(!controller().IsBusy());
    QVERIFY(Settle(controller()));
    QVERIFY(Regions().empty() && controller().colors().ShowsOriginal());
    // The entries are there again; in another scene they are not.
    QVERIFY(OpenDialog());
    QCOMPARE(dialog_->recipe().gray, NameOf(0) + ":10,10,40,30");
    QTest::keyClick(dialog_, Qt::Key_Escape);
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenScene(scene_->Request());
    QVERIFY(Opened(opened));
    QVERIFY(OpenDialog());
    QCOMPARE(reference()->currentIndex(), int(MatchDialog::kPhotos));
  }

  // Photos that are gone leave another splat.
  void WithoutPhotosThereIsASentence() {
    const fs::path images = scene_->workspace() / "images", away = scene_->folder() / "away";
    fs::rename(images, away);
    QVERIFY(OpenDialog());
    const bool says = problem().contains("No view has a photo") && !go()->isEnabled();
    fs::rename(away, images);
    QVERIFY(says);
  }

 private:
  static constexpr size_t kGrayView = 1, kCheckerView = 2;
  static constexpr QRect kCard{20, 30, 40, 30}, kChecker{20, 16, 96, 64};
  static constexpr double kBrighter = 0.3;  // of the coefficients without direction

  std::string NameOf(size_t view) const { return scene_->scene().views[view].name; }
  void EditPhoto(size_t view, const std::function<void(Image&)>& edit) const {
    const fs::path path = scene_->workspace() / "images" / NameOf(view);
    Image photo = ReadImage(path);
    edit(photo);
    WritePng(path, photo);
  }
  static void Paint(Image& photo, const QRect& place, const float* rgb) {
    for (int y = place.top(); y <= place.bottom(); ++y) {
      for (int x = place.left(); x <= place.right(); ++x) {
        std::copy_n(rgb, 3, &photo.data[photo.Index(x, y)]);
      }
    }
  }
  fs::path WriteBright() {
    GaussianModel bright = scene_->scene().model;
    const auto stride = size_t(3 * bright.NumShCoeffs());
    for (size_t i = 0; i < bright.sh.size(); ++i) {
      bright.sh[i] += i % stride < 3 ? float(kBrighter) : 0;
    }
    const fs::path path = Fresh() / "bright.ply";
    WriteSplat(path, bright);
    return path;
  }
  // Of the coefficients without direction: mean change of red, green and blue on the screen.
  std::array<double, 3> Change() {
    const GaussianModel& original = *controller().facts()->original;
    const FloatArray& sh = *controller().colors().sh();
    const auto stride = size_t(3 * original.NumShCoeffs());
    std::array<double, 3> change{};
    for (size_t i = 0; i < sh.size(); ++i) {
      if (i % stride < 3) change[i % stride] += double(sh[i] - original.sh[i]);
    }
    for (double& one : change) one /= double(original.NumGaussians());
    return change;
  }

  bool OpenDialog() {
    window_->findChild<QAction*>("match")->trigger();
    dialog_ = window_->findChild<MatchDialog*>();
    return dialog_ && QTest::qWaitForWindowExposed(dialog_) && Activate(*dialog_);
  }
  QComboBox* reference() { return dialog_->findChild<QComboBox*>("match_reference"); }
  QListWidget* list() { return dialog_->findChild<QListWidget*>("match_views"); }
  CardMarker* marker() { return dialog_->findChild<CardMarker*>("match_photo"); }
  QPushButton* go() { return dialog_->findChild<QPushButton*>("match_go"); }
  QString problem() { return dialog_->findChild<QLabel*>("match_problem")->text(); }
  double Zoom() { return marker()->ToWidget({1, 0}).x() - marker()->ToWidget({0, 0}).x(); }
  bool HasPhoto(size_t view) {
    const QListWidgetItem* item = list()->currentItem();
    return item && item->text().toStdString() == NameOf(view) &&
           QTest::qWaitFor([&] { return !marker()->photo().isNull(); }, kWaitMs);
  }
  bool ChoosePhoto(size_t view) {
    QListWidgetItem* item = list()->item(int(view));
    list()->scrollToItem(item);
    QTest::mouseClick(list()->viewport(), Qt::LeftButton, {},
                      list()->visualItemRect(item).center());
    return HasPhoto(view);
  }
  // From a pixel of the photo to another one.
  void DragCard(QPointF from, QPointF to) {
    DragAlong(marker(),
              {marker()->ToWidget(from).toPoint(), marker()->ToWidget((from + to) / 2).toPoint(),
               marker()->ToWidget(to).toPoint()});
  }
  // Presses the button, agrees, and waits for the colors.
  bool Match() {
    QTest::mouseClick(go(), Qt::LeftButton);
    QMessageBox* box = WaitDialog(*window_);
    // A mouse that comes before the box is laid out misses the button.
    return box && QTest::qWaitForWindowExposed(box, kWaitMs) &&
           ClickRole(*window_, QMessageBox::DestructiveRole) &&
           QTest::qWaitFor([&] { return Regions().size() == 1; }, kWaitMs) &&
           QTest::qWaitFor([&] { return !controller().colors().ShowsOriginal(); }, kWaitMs);
  }

  MatchDialog* dialog_ = nullptr;
};

}  // namespace retint

QTEST_MAIN(retint::MatchDialogTest)
#include "match_dialog_test.moc"
