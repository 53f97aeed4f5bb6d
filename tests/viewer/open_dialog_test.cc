// SPDX-License-Identifier: BSD-3-Clause
// A splat in another frame than its workspace: the open dialog tells it and finds how it lies.
#include <cmath>

#include <QCheckBox>
#include <QComboBox>
#include <QDialogButtonBox>
#include <QLabel>
#include <QPushButton>
#include <QRegularExpression>

#include "base/files.h"
#include "scene/transform.h"
#include "splat_io/splat_io.h"
#include "tests/support/ocio_config.h"
#include "tests/viewer/files_fixture.h"
#include "viewer/window/recent_files.h"

namespace retint {

class OpenDialogTest : public FilesFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() {
    MakeScene(160, 120, 8);
    moved_ = scene_->folder() / "moved.ply";
    GaussianModel model = ReadSplat(scene_->workspace() / "splat.ply");
    Transform(kSplatFromWorld, model);
    WriteSplat(moved_, model);
  }
  void cleanupTestCase() { scene_.reset(); }
  void init() {
    window_ = std::make_unique<MainWindow>(theme_.get());
    window_->resize(1330, 680);
    window_->show();
    QVERIFY(Activate(*window_));
    window_->controller().colors().SetAutomaticRefit(false);
  }
  void cleanup() { EndCase(); }

  void ASplatThatFitsIsToldSo() {
    QVERIFY(OpenForm(scene_->workspace() / "splat.ply"));
    QVERIFY(Says("Renders and photos agree: "));
    QVERIFY(open()->isEnabled());
    // Without a workspace there is nothing to compare or to align.
    Type(dialog_, "workspace", "");
    QTRY_VERIFY_WITH_TIMEOUT(fit()->text().isEmpty(), kWaitMs);
    QVERIFY(!align()->isEnabled());
  }

  void AlignByMouseFindsTheFrame() {
    QVERIFY(OpenForm(moved_));
    QVERIFY(Says("another frame, which Align finds"));
    QVERIFY(open()->isEnabled());  // it may be opened all the same
    Keep(*dialog_, "open_dialog_mismatch");
    QTest::mouseClick(align(), Qt::LeftButton);
    QCOMPARE(align()->text().remove('&'), QString("Stop"));
    QVERIFY(!open()->isEnabled());
    QTRY_VERIFY_WITH_TIMEOUT(open()->isEnabled(), kWaitMs);
    const auto said =
        QRegularExpression("Aligned: ([0-9.]+) dB before, ([0-9.]+) dB after").match(fit()->text());
    QVERIFY2(said.hasMatch(), qPrintable(fit()->text()));
    QVERIFY(said.captured(2).toDouble() > said.captured(1).toDouble() + 5);
    QVERIFY(!frame()->text().isEmpty());
    Keep(*dialog_, "open_dialog_aligned");
    QSignalSpy opened(&controller(), &SceneController::opened);
    QTest::mouseClick(open(), Qt::LeftButton);
    QVERIFY(Opened(opened));
    const Sim3d found = controller().facts()->request.options.world_from_splat;
    // Photos of 160 x 120 pixels say the scale to about a percent.
    QVERIFY(std::abs(found.scale * kSplatFromWorld.scale - 1) < 0.02);
    QVERIFY(found.rotation.angularDistance(kSplatFromWorld.rotation.conjugate()) < 0.02);
    // The form comes back as it was taken, and says that it fits.
    PressKey(*window_, Qt::Key_O, Qt::ControlModifier);
    dialog_ = window_->findChild<QDialog*>("open_dialog");
    QVERIFY(dialog_ && !frame()->text().isEmpty());
    QVERIFY(Says("Renders and photos agree: "));
  }

  void AlignByKeysIsStopped() {
    QVERIFY(OpenForm(moved_));
    align()->setFocus();
    QTest::keyClick(align(), Qt::Key_Space);
    QVERIFY(Says("Aligning the splat"));
    QTest::keyClick(align(), Qt::Key_Space);
    QVERIFY(Says("Stopped; the frame is as it was."));
    QVERIFY(frame()->text().isEmpty() && open()->isEnabled());
    // A change of the form ends it as well, and asks anew.
    align()->setFocus();
    QTest::keyClick(align(), Qt::Key_Space);
    QVERIFY(Says("Aligning the splat"));
    Type(dialog_, "splat", scene_->workspace() / "splat.ply");
    QCOMPARE(align()->text().remove('&'), QString("Align"));
    QVERIFY(Says("Renders and photos agree: "));
    QVERIFY(frame()->text().isEmpty());
    // Nor does it keep the dialog from closing.
    align()->setFocus();
    QTest::keyClick(align(), Qt::Key_Space);
    QPointer<QDialog> closing = dialog_;
    QTest::keyClick(dialog_, Qt::Key_Escape);
    QTRY_VERIFY_WITH_TIMEOUT(!closing, kWaitMs);
  }

  void WhatCannotBeReadIsTold() {
    const fs::path cut = scene_->folder() / "cut.ply";
    fs::copy_file(moved_, cut);
    fs::resize_file(cut, 5000);
    QVERIFY(OpenForm(cut));
    QVERIFY(Says("cut.ply"));
    QVERIFY(!open()->isEnabled());
    Type(dialog_, "splat", scene_->workspace() / "splat.ply");
    QVERIFY(Says("Renders and photos agree: "));
    QVERIFY(open()->isEnabled());
  }

  void AColorSpaceOfAConfigIsChosen() {
    const fs::path config = scene_->folder() / "config.ocio";
    WriteFile(config, kOcioConfig);
    QVERIFY(OpenForm(scene_->workspace() / "splat.ply"));
    dialog_->findChild<QCheckBox*>("open_more")->setChecked(true);
    Type(dialog_, "ocio", config);
    auto* problem = dialog_->findChild<QLabel*>("open_problem");
    QVERIFY(problem->text().contains("Choose the splat's color space"));
    auto* space = dialog_->findChild<QComboBox*>("space");
    QCOMPARE(space->count(), 4);
    space->setEditText("film-log");
    QVERIFY(Says("Nearest of its 4: film log"));
    QVERIFY(!open()->isEnabled());
    space->setCurrentText("light");
    QVERIFY(Says("Renders and photos disagree"));  // the sample is in sRGB
    Keep(*dialog_, "open_dialog_space");
    QSignalSpy opened(&controller(), &SceneController::opened);
    QTest::mouseClick(open(), Qt::LeftButton);
    QVERIFY(Opened(opened));
    const OcioSpace chosen{config.string(), "light"};
    QVERIFY(controller().facts()->request.options.space == chosen);
    QVERIFY(RecentRequest(RecentFiles().value(0)).options.space == chosen);
  }

 private:
  bool OpenForm(const fs::path& splat) {
    PressKey(*window_, Qt::Key_O, Qt::ControlModifier);
    dialog_ = window_->findChild<QDialog*>("open_dialog");
    if (!dialog_ || !dialog_->isVisible()) return false;
    Type(dialog_, "workspace", scene_->workspace());
    Type(dialog_, "splat", splat);
    return true;
  }
  QLabel* fit() { return dialog_->findChild<QLabel*>("frame_fit"); }
  QLineEdit* frame() { return dialog_->findChild<QLineEdit*>("frame"); }
  QPushButton* align() { return dialog_->findChild<QPushButton*>("align"); }
  QPushButton* open() {
    return dialog_->findChild<QDialogButtonBox*>()->button(QDialogButtonBox::Open);
  }
  bool Says(const QString& part) {
    const bool said = QTest::qWaitFor([&] { return fit()->text().contains(part); }, kWaitMs);
    if (!said) qWarning("it says: %s", qPrintable(fit()->text()));
    return said;
  }

  inline static const Sim3d kSplatFromWorld{
      0.3, Eigen::Quaterniond(0.2, -0.5, 0.6, 0.4).normalized(), {4, -1, 2}};
  fs::path moved_;
  QDialog* dialog_ = nullptr;
};

}  // namespace retint

QTEST_MAIN(retint::OpenDialogTest)
#include "open_dialog_test.moc"
