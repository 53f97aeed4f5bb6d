// SPDX-License-Identifier: BSD-3-Clause
// Bands that another program painted on a view of an object, in the real window: they show from
// another view before any fit, follow the strength, and are taken back.
#include <filesystem>

#include <QAbstractButton>
#include <QAction>
#include <QFile>
#include <QLabel>
#include <QSlider>

#include "base/files.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/scene/view_editor.h"
#include "viewer/widgets/banner.h"

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

  ViewEditor* editor() { return window_->findChild<ViewEditor*>(); }
  // The view that shows, as the other program gets it.
  QImage OpenElsewhere() {
    opened_.clear();
    editor()->SetOpener([this](const QString& path) {
      opened_ = path;
      return true;
    });
    if (!Click("picture_elsewhere")) return {};
    if (!QTest::qWaitFor([&] { return !opened_.isEmpty(); }, kWaitMs)) return {};
    return QImage(opened_).convertToFormat(QImage::Format_RGB32);
  }
  bool HandBack(const QImage& picture) {
    if (!picture.save(opened_ + ".new", "PNG")) return false;
    std::filesystem::rename((opened_ + ".new").toStdString(), opened_.toStdString());
    return true;
  }

  // Paints the bands on the view that shows and hands it back, as the other program would; the
  // picture.
  QImage PaintElsewhere() {
    QImage picture = OpenElsewhere();
    const Mask bands = Bands(Object());
    if (picture.width() != bands.width || picture.height() != bands.height) return {};
    for (int y = 0; y < bands.height; ++y) {
      for (int x = 0; x < bands.width; ++x) {
        if (bands(x, y) != 0) picture.setPixel(x, y, kPaint);
      }
    }
    return HandBack(picture) ? picture : QImage();
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
    AddRegionFromMasks(controller(), "object", masks_, ColorEdit());
    QVERIFY(added.count() > 0 || added.wait(kWaitMs));
    QTest::keyClick(window_.get(), Qt::Key_1, Qt::AltModifier);
    window_->findChild<QAction*>("mode_picture")->trigger();
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
    // In painted pixels, the view shows nearly all of the paint, except for borders, which the
    // Gaussians soften.
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && Apart(Shown(), picture, bands) <
                                                       0.6 * Apart(plain_here, picture, bands),
                             kWaitMs);
    PressKey(*window_, Qt::Key_Right);
    QVERIFY(WaitSharp(*window_));
    const QImage preview = Shown();
    QVERIFY(Apart(preview, plain, Object()) > 5);
    QVERIFY(controller().colors().optimizer().state == BackgroundOptimizer::State::kIdle);
    QVERIFY(!First().fit);

    // The fit makes it sharper, and closer to the paint than to the old colors.
    controller().colors().StartRefit();
    QTRY_VERIFY_WITH_TIMEOUT(
        controller().colors().optimizer().state == BackgroundOptimizer::State::kFinished, kWaitMs);
    QVERIFY(Settle(controller()));
    QVERIFY(WaitSharp(*window_));
    QVERIFY(First().fit != nullptr);
    const double before = Apart(plain, Shown(), Object()), now = Apart(preview, Shown(), Object());
    QVERIFY2(before > 5 && now < 0.6 * before, qPrintable(QString("%1 %2").arg(now).arg(before)));
  }

  // The picture does not include later steps, so they are applied once. Unpainted pixels do not
  // change.
  void ASecondPictureChangesNothingElse() {
    QVERIFY(!PaintElsewhere().isNull());
    QVERIFY(TakenIn());
    ColorEdit edit = First().edit;
    edit.operations.push_back(ColorOperation::Make(ColorOperationKind::kExposure, {-1}));
    controller().Do(SetEdit{First().id, edit});
    QVERIFY(Settle(controller()));
    const auto painted = [&] {
      size_t pixels = 0;
      for (const PaintLayer& layer : First().edit.operations[0].picture->layers) {
        for (const uint8_t alpha : layer.alpha.data) pixels += alpha != 0 ? 1 : 0;
      }
      return pixels;
    };
    const size_t before = painted();
    QImage picture = OpenElsewhere();
    QVERIFY(!picture.isNull());
    const Mask bands = Bands(Object());
    int dot = 0;  // the first pixels of the object that are in no band
    for (int y = 0; y < bands.height && dot < 30; ++y) {
      for (int x = 0; x < bands.width && dot < 30; ++x) {
        if (Object()(x, y) == 0 || bands(x, y) != 0) continue;
        picture.setPixel(x, y, 0xff10e010);
        ++dot;
      }
    }
    QSignalSpy taken(editor(), &ViewEditor::taken);
    QVERIFY(HandBack(picture));
    QVERIFY(taken.wait(kWaitMs));
    QCOMPARE(First().edit.operations.size(), size_t(2));
    QVERIFY(!First().edit.operations[0].table);
    // The dot, and some pixels around it; and the bands as they were.
    QVERIFY2(painted() >= before && painted() < before + 150,
             qPrintable(QString("%1 after %2").arg(painted()).arg(before)));
  }

  void TornPaintOffersToSplit() {
    Banner& banner = window_->banner();
    QVERIFY(!banner.IsShown());
    Q_EMIT editor()->taken(First().id, "painted.png", PaintDetail{0.3, 4});
    QVERIFY(!banner.IsShown());
    Q_EMIT editor()->taken(First().id, "painted.png", PaintDetail{0.9, 8.4});
    QVERIFY(banner.IsShown());
    QVERIFY2(banner.text().contains("90 %") && banner.text().contains("7 times as fine"),
             qPrintable(banner.text()));
    Keep(*window_, "torn");
    int dialogs = 0;
    CancelFileDialog(&dialogs);
    QVERIFY(Click("banner_answer0"));
    QCOMPARE(dialogs, 1);
    QVERIFY(!banner.IsShown());
  }

  // The regions work on the finer splat, and so does the picture in the other program.
  void LargeGaussiansAreSplit() {
    QVERIFY(!window_->findChild<QAbstractButton*>("picture_split")->isEnabled());
    QVERIFY(!PaintElsewhere().isNull());
    QVERIFY(TakenIn());
    const QString file = opened_;
    const size_t before = controller().facts()->original->NumGaussians();
    const auto open = controller().facts()->request.splat, finer = scene_->folder() / "finer.ply";
    // Not over the splat that is open.
    AnswerFileDialog(open);
    QVERIFY(Click("picture_split"));
    QVERIFY(WaitDialog(*window_));
    window_->dialogs().box()->close();
    // Strokes that were left would be lost with the scene.
    window_->EnterSelection();
    QVERIFY(WaitPainting(*window_));
    SelectionCanvas& paper = window_->selection().canvas();
    DragAlong(&paper, {paper.rect().center(), paper.rect().center() + QPoint(30, 0)});
    QTest::keyClick(&paper, Qt::Key_Escape);
    // None of these is larger than the parts would be.
    AnswerFileDialog(finer);
    QVERIFY(Click("picture_split"));
    const QMessageBox* box = WaitDialog(*window_);
    QVERIFY(box && box->informativeText().contains("has not been accepted"));
    QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
    QTRY_VERIFY_WITH_TIMEOUT(
        window_->findChild<QLabel*>("message")->text().contains("stays as it is"), kWaitMs);
    QVERIFY(!std::filesystem::exists(finer));
    // After another question, too.
    WriteFile(finer, "mine");
    AnswerFileDialog(finer);
    QVERIFY(Click("picture_split"));
    box = WaitDialog(*window_);
    QVERIFY(box && box->informativeText().contains("already holds finer.ply"));
    QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
    QTRY_VERIFY(window_->dialogs().box() && window_->dialogs().box() != box);
    QTest::qWait(50);
    QVERIFY(window_->dialogs().box() && window_->dialogs().box()->isVisible());
    QVERIFY(window_->dialogs().box()->informativeText().contains("has not been accepted"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialogs().box());
    QCOMPARE(ReadFile(finer), std::string("mine"));
    RefineOptions fine;
    fine.pixels = 0.5;
    QSignalSpy opened(&controller(), &SceneController::opened);
    controller().SplitGaussians(First().id, fine, finer, [](const RefineSummary&) {});
    QVERIFY(opened.wait(kWaitMs));
    QVERIFY(Settle(controller()));
    QCOMPARE(controller().facts()->request.splat, finer);
    QVERIFY(controller().facts()->original->NumGaussians() > before);
    QCOMPARE(controller().regions().regions.size(), size_t(1));
    QVERIFY(First().edit.HasPaint());
    QVERIFY(First().paint != nullptr);
    QVERIFY(window_->isWindowModified());  // no session holds it
    // Saved once more in the other program.
    const auto layers = [&] { return First().edit.operations[0].picture->pictures.size(); };
    QCOMPARE(layers(), size_t(1));
    QImage more = QImage(file).convertToFormat(QImage::Format_RGB32);
    const Mask bands = Bands(Object());
    for (int y = 0; y < bands.height; ++y) {
      for (int x = 0; x < bands.width; ++x) {
        if (bands(x, y) != 0) more.setPixel(x, y, 0xff10e010);
      }
    }
    QSignalSpy taken(editor(), &ViewEditor::taken);
    opened_ = file;
    QVERIFY(HandBack(more));
    QVERIFY(taken.wait(kWaitMs));
    QCOMPARE(layers(), size_t(1));
  }

  // A message says that it was rejected, and the old picture stays.
  void APictureOfAnotherSizeIsRefused() {
    QVERIFY(!PaintElsewhere().isNull());
    QVERIFY(TakenIn());
    const ColorEdit edit = First().edit;
    const std::string key = controller().results().EditKey(First().id);
    QSignalSpy taken(editor(), &ViewEditor::taken);
    QSignalSpy changed(&controller(), &SceneController::failed);
    QVERIFY(HandBack(QImage(20, 20, QImage::Format_RGB32)));
    QVERIFY(changed.wait(kWaitMs));
    QVERIFY(changed.first().at(1).toString().contains("20 x 20"));
    QCOMPARE(taken.count(), 0);
    QVERIFY(First().edit == edit);
    QCOMPARE(controller().results().EditKey(First().id), key);
  }

  void APictureThatStaysCutOffIsReported() {
    QVERIFY(!OpenElsewhere().isNull());
    QSignalSpy failed(editor(), &ViewEditor::failed);
    QFile file(opened_);
    QVERIFY(file.open(QIODevice::ReadOnly));
    const QByteArray bytes = file.readAll();
    file.close();
    QVERIFY(file.open(QIODevice::WriteOnly));
    file.write(bytes.left(30));
    file.close();
    QVERIFY(failed.wait(kWaitMs));
    QVERIFY(!failed.wait(1500));  // once
    QVERIFY(First().edit.operations.empty());
    // The whole one comes after all.
    QSignalSpy taken(editor(), &ViewEditor::taken);
    QImage picture = QImage::fromData(bytes).convertToFormat(QImage::Format_RGB32);
    const Mask bands = Bands(Object());
    for (int y = 0; y < bands.height; ++y) {
      for (int x = 0; x < bands.width; ++x) {
        if (bands(x, y) != 0) picture.setPixel(x, y, kPaint);
      }
    }
    QVERIFY(HandBack(picture));
    QVERIFY(taken.wait(kWaitMs));
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
