// SPDX-License-Identifier: BSD-3-Clause
// Bands that another program painted on a view of an object, in the real window: they show from
// another view before any fit, follow the strength, and are taken back.
#include <filesystem>

#include <QAbstractButton>
#include <QSlider>

#include "tests/viewer/viewer_scene.h"
#include "viewer/scene/view_editor.h"

namespace retint {

class PaintedTest : public ViewerTest {
  Q_OBJECT

 private:
  static constexpr int kBands = 4;
  static constexpr QRgb kPaint = 0xffe614e6;

  ViewerScene::Subject subject_;
  std::map<std::string, Mask> masks_;  // of the object
  QString opened_;                     // the file that the other program was given

  QImage Shown() { return canvas().frame()->image; }
  const Mask& Object() { return masks_.at(canvas().navigation().view()->name); }
  const Region& First() { return controller().regions().regions.front(); }
  bool Click(const char* name) {
    auto* button = window_->findChild<QAbstractButton*>(name);
    if (button) QTest::mouseClick(button, Qt::LeftButton);
    return button != nullptr;
  }

  // Mean difference of two pictures of a view where `mask` is set, in steps of 1 / 255. Each has a
  // size of its own.
  static double Apart(const QImage& a, const QImage& b, const Mask& mask) {
    const auto at = [&](const QImage& image, int x, int y) {
      return image.pixel((2 * x + 1) * image.width() / (2 * mask.width),
                         (2 * y + 1) * image.height() / (2 * mask.height));
    };
    double sum = 0, count = 0;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        if (mask(x, y) == 0) continue;
        const QRgb p = at(a, x, y), q = at(b, x, y);
        sum += std::abs(qRed(p) - qRed(q)) + std::abs(qGreen(p) - qGreen(q)) +
               std::abs(qBlue(p) - qBlue(q));
        count += 3;
      }
    }
    return count > 0 ? sum / count : 0;
  }

  // Every second one of some bands across the object, from the top.
  static Mask Bands(const Mask& object) {
    int low = object.height, high = 0;
    for (int y = 0; y < object.height; ++y) {
      for (int x = 0; x < object.width; ++x) {
        if (object(x, y) != 0) low = std::min(low, y), high = std::max(high, y + 1);
      }
    }
    Mask bands = object;
    for (int y = low; y < high; ++y) {
      if ((y - low) * kBands / (high - low) % 2 == 0) continue;
      for (int x = 0; x < object.width; ++x) bands(x, y) = 0;
    }
    return bands;
  }

  // Paints the bands on the view that shows and hands it back, as the other program would; the
  // picture.
  QImage PaintElsewhere() {
    auto* editor = window_->findChild<ViewEditor*>();
    editor->SetOpener([this](const QString& path) {
      opened_ = path;
      return true;
    });
    if (!Click("picture_elsewhere")) return {};
    if (!QTest::qWaitFor([&] { return !opened_.isEmpty(); }, kWaitMs)) return {};
    QImage picture = QImage(opened_).convertToFormat(QImage::Format_RGB32);
    const Mask bands = Bands(Object());
    if (picture.width() != bands.width || picture.height() != bands.height) return {};
    for (int y = 0; y < bands.height; ++y) {
      for (int x = 0; x < bands.width; ++x) {
        if (bands(x, y) != 0) picture.setPixel(x, y, kPaint);
      }
    }
    if (!picture.save(opened_ + ".new", "PNG")) return {};
    std::filesystem::rename((opened_ + ".new").toStdString(), opened_.toStdString());
    return picture;
  }
  bool TakenIn() {
    return QTest::qWaitFor(
        [&] {
          const ColorEdit& edit = First().edit;
          return !edit.operations.empty() && !edit.NeedsMainColor();
        },
        kWaitMs);
  }

 private Q_SLOTS:
  void initTestCase() {
    MakeScene(200, 150, 8);
    subject_ = scene_->MostVisible();
    QVERIFY(subject_.object != 0);
    masks_ = scene_->Masks(subject_.object);
  }
  void cleanupTestCase() { scene_.reset(); }
  void init() {
    opened_.clear();
    QVERIFY(ShowScene());
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    controller().AddRegionFromMasks("object", masks_, ColorEdit());
    QVERIFY(added.count() > 0 || added.wait(kWaitMs));
    QTest::keyClick(window_.get(), Qt::Key_1, Qt::AltModifier);
    QVERIFY(Click("mode_picture"));
    QVERIFY(canvas().GoTo(subject_.first));
    QVERIFY(WaitSharp(*window_));
  }
  void cleanup() { window_.reset(); }

  void BandsShowFromAnotherViewBeforeTheFit() {
    const QImage plain_here = Shown();
    PressKey(*window_, Qt::Key_Right);
    QVERIFY(WaitSharp(*window_));
    QVERIFY(canvas().navigation().view()->name != subject_.first);
    const QImage plain = Shown();
    PressKey(*window_, Qt::Key_Left);
    QVERIFY(WaitSharp(*window_));
    const Mask bands = Bands(Object());

    const QImage picture = PaintElsewhere();
    QVERIFY(!picture.isNull());
    QVERIFY(TakenIn());
    QVERIFY(First().edit.HasPaint());
    QVERIFY(!ChangesNothing(First().edit));  // so that the optimizer starts by itself, where it may
    // Where the paint is, the view shows it rather than what was there: nearly all of it, but for
    // the borders, which the Gaussians soften.
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && Apart(Shown(), picture, bands) <
                                                       0.6 * Apart(plain_here, picture, bands),
                             kWaitMs);
    PressKey(*window_, Qt::Key_Right);
    QVERIFY(WaitSharp(*window_));
    const QImage preview = Shown();
    QVERIFY(Apart(preview, plain, Object()) > 5);
    QVERIFY(controller().optimizer().state == BackgroundOptimizer::State::kIdle);
    QVERIFY(!First().fit);

    // The fit makes it sharper, and is nearer to it than to what there was.
    controller().StartRefit();
    QTRY_VERIFY_WITH_TIMEOUT(
        controller().optimizer().state == BackgroundOptimizer::State::kFinished, kWaitMs);
    QVERIFY(Settle(controller()));
    QVERIFY(WaitSharp(*window_));
    QVERIFY(First().fit != nullptr);
    const double before = Apart(plain, Shown(), Object()), now = Apart(preview, Shown(), Object());
    QVERIFY2(before > 5 && now < 0.6 * before, qPrintable(QString("%1 %2").arg(now).arg(before)));
  }

  void TheStrengthAndUndoShow() {
    const QImage plain = Shown();
    QVERIFY(!PaintElsewhere().isNull());
    QVERIFY(TakenIn());
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && Apart(Shown(), plain, Object()) > 5, kWaitMs);
    const QImage whole = Shown();
    const double all = Apart(whole, plain, Object());
    auto* strength = window_->findChild<QSlider*>("strength");
    strength->setFocus();
    for (int i = 0; i < 5; ++i) QTest::keyClick(strength, Qt::Key_PageDown);
    QCOMPARE(First().strength, 0.5F);
    // Half of it; bounds leave room for colors that leave the screen's range.
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && Apart(Shown(), plain, Object()) < 0.75 * all,
                             kWaitMs);
    QVERIFY(Settle(controller()));
    QVERIFY(WaitSharp(*window_));
    QVERIFY(Apart(Shown(), plain, Object()) > 0.25 * all);

    for (int i = 0; i < 5 && First().strength < 1; ++i) {
      PressKey(*window_, Qt::Key_Z, Qt::ControlModifier);
      QVERIFY(Settle(controller()));
    }
    QCOMPARE(First().strength, 1.0F);
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && Apart(Shown(), whole, Object()) < 0.1, kWaitMs);
    PressKey(*window_, Qt::Key_Z, Qt::ControlModifier);
    QVERIFY(Settle(controller()));
    QVERIFY(First().edit.operations.empty());
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && Apart(Shown(), plain, Object()) < 0.1, kWaitMs);
  }
};

}  // namespace retint

QTEST_MAIN(retint::PaintedTest)
#include "painted_test.moc"
