// SPDX-License-Identifier: BSD-3-Clause
// The banner over a canvas, by mouse and keys.
#include "viewer/widgets/banner.h"

#include <memory>

#include <QLabel>
#include <QPushButton>
#include <QSignalSpy>
#include <QTest>
#include <QToolButton>

#include "tests/viewer/viewer_scene.h"

namespace retint {

class BannerTest : public QObject {
  Q_OBJECT

 private:
  std::unique_ptr<QWidget> canvas_;
  Banner* banner_ = nullptr;
  QStringList chosen_;

  Banner::Message Question() {
    return {"Whose outline holds?",
            {{"Keep mine", {}, [this] { chosen_ << "mine"; }},
             {"Use the scene's", {}, [this] { chosen_ << "scene"; }}}};
  }
  QPushButton* Button(int answer) {
    return banner_->findChild<QPushButton*>(QString("banner_answer%1").arg(answer));
  }

 private Q_SLOTS:
  void init() {
    chosen_.clear();
    canvas_ = std::make_unique<QWidget>();
    canvas_->setFocusPolicy(Qt::StrongFocus);
    canvas_->resize(600, 400);
    banner_ = new Banner(canvas_.get());
    canvas_->show();
    QVERIFY(Activate(*canvas_));
    canvas_->setFocus();
  }

  void ItLiesAtTheLowerEdgeAndStaysThere() {
    QVERIFY(!banner_->IsShown() && banner_->text().isEmpty());
    banner_->Show(Question());
    QVERIFY(banner_->IsShown());
    QCOMPARE(banner_->text(), QString("Whose outline holds?"));
    for (const QSize& size : {QSize(600, 400), QSize(1200, 700), QSize(300, 300)}) {
      canvas_->resize(size);
      QTest::qWait(20);
      QVERIFY(canvas_->rect().contains(banner_->geometry()));
      QVERIFY(banner_->geometry().center().y() > size.height() / 2);
      auto* text = banner_->findChild<QLabel*>("banner_text");
      QVERIFY(text->height() >= text->heightForWidth(text->width()));
    }
    QVERIFY2(canvas_->hasFocus(), "it takes no keys from the canvas");
  }

  void AClickAnswersAndCloses() {
    banner_->Show(Question());
    QTest::mouseClick(Button(1), Qt::LeftButton);
    QCOMPARE(chosen_, QStringList{"scene"});
    QVERIFY(!banner_->IsShown());
    QVERIFY(canvas_->hasFocus());
  }

  void KeysAnswerToo() {
    banner_->Show(Question());
    QVERIFY(Button(0)->isDefault() && !Button(1)->isDefault());
    Button(1)->setFocus();
    QTest::keyClick(Button(1), Qt::Key_Return);
    QCOMPARE(chosen_, QStringList{"scene"});
    QVERIFY2(canvas_->hasFocus(), "the keyboard goes back");
    banner_->Show(Question());
    Button(0)->setFocus();
    QTest::keyClick(Button(0), Qt::Key_Escape);
    QVERIFY(!banner_->IsShown());
    QCOMPARE(chosen_.size(), 1);  // nothing was chosen
  }

  void WithoutAnswersItCanBeClosed() {
    banner_->Show({"All of your paint is in"});
    auto* close = banner_->findChild<QToolButton*>("banner_close");
    QVERIFY(close->isVisible() && !Button(0));
    QTest::mouseClick(close, Qt::LeftButton);
    QVERIFY(!banner_->IsShown());
    banner_->Show(Question());
    QVERIFY(!close->isVisible());
  }

  void AnAnswerMayAskAgain() {
    banner_->Show({"One?", {{"Yes", {}, [this] { banner_->Show(Question()); }}}});
    QTest::mouseClick(Button(0), Qt::LeftButton);
    QCOMPARE(banner_->text(), QString("Whose outline holds?"));
    QVERIFY(banner_->IsShown());
  }

  void ItsPictureOpens() {
    int opened = 0;
    QImage picture(640, 480, QImage::Format_RGB32);
    picture.fill(Qt::green);
    banner_->Show({"All of your paint is in", {}, picture, [&] { ++opened; }});
    auto* small = banner_->findChild<QToolButton*>("banner_picture");
    QVERIFY(small->isVisible());
    QTest::mouseClick(small, Qt::LeftButton);
    QCOMPARE(opened, 1);
    QVERIFY(banner_->IsShown());
    banner_->Show(Question());
    QVERIFY(!small->isVisible());
  }

  void AClickOnItDoesNotReachTheCanvas() {
    struct Counter : QObject {
      int presses = 0;
      bool eventFilter(QObject*, QEvent* event) override {
        presses += event->type() == QEvent::MouseButtonPress;
        return false;
      }
    } counter;
    canvas_->installEventFilter(&counter);
    banner_->Show(Question());
    QTest::mouseClick(banner_, Qt::LeftButton, {}, {2, 2});
    QCOMPARE(counter.presses, 0);
  }
};

}  // namespace retint

QTEST_MAIN(retint::BannerTest)
#include "banner_test.moc"
