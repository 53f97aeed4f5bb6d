// SPDX-License-Identifier: BSD-3-Clause
// Scenes of spherical and very wide photos in the real window. A photo with several pinhole views
// is one picture, to look at and to paint on.
#include <cmath>
#include <set>

#include <QComboBox>
#include <QLabel>
#include <QListWidget>

#include "scene/camera_projection.h"
#include "scene/undistortion.h"
#include "selection/suggestion.h"
#include "tests/viewer/distorted_fixture.h"
#include "viewer/canvas/uncertainty.h"
#include "viewer/panels/mask_view.h"
#include "viewer/selection/stroke_preview.h"

namespace retint {

class WidePhotosTest : public DistortedFixture {
  Q_OBJECT

 private:
  // Of the items of the Views panel.
  static constexpr int kName = Qt::UserRole, kPicture = kName + 1, kBadge = kName + 2,
                       kShown = kName + 3;

  QListWidget* List() { return window_->findChild<QListWidget*>("views_list"); }
  QListWidgetItem* ItemOf(const std::string& name) {
    for (int row = 0; row < List()->count(); ++row) {
      if (List()->item(row)->data(kName).toString().toStdString() == name) return List()->item(row);
    }
    return nullptr;
  }
  std::vector<std::string> Names() {
    std::vector<std::string> names;
    for (const SyntheticView& view : scene_->scene().views) names.push_back(view.name);
    std::ranges::sort(names);
    return names;
  }
  QSize SmallSize() {
    const Image& photo = scene_->scene().views.front().photo;
    return {160, int(std::lround(160.0 * photo.height / photo.width))};
  }

  struct Spot {
    std::string photo;
    int x = 0, y = 0;
  };
  // The pixel of a photo that two faces show alike, with surfaces all about; no photo: there is
  // none.
  Spot FindBorder() {
    constexpr int kReach = 6;  // pixels
    Spot spot;
    Do([&](EditSession& session, Monitor&) {
      const Pictures pictures = session.scene().pictures();
      RenderRequest request;
      request.rgb = false;
      request.depth_median = true;
      for (const UserPicture& picture : pictures.all()) {
        const DepthMap depth = pictures.ComposeDepth(picture, [&](const View& face) {
          return session.scene()
              .renderer()
              .Render(session.scene().reconstruction().Posed(face), request)
              .depth_median;
        });
        const Undistortion& lens = *picture.photo->lens;
        Mask showing(depth.width, depth.height);  // faces that show a pixel well
        for (size_t f = 0; f < lens.faces.size(); ++f) {
          const PixelMap map = FaceFromPhoto(lens, f);
          for (size_t i = 0; i < showing.data.size(); ++i) {
            const float x = map.xy[2 * i], y = map.xy[2 * i + 1];
            if (!std::isnan(x) && FaceWeight(lens, f, x, y) > 0.8F) ++showing.data[i];
          }
        }
        const auto fits = [&](int x, int y) {
          if (showing(x, y) != 2) return false;
          for (int j = y - kReach; j <= y + kReach; ++j) {
            for (int i = x - kReach; i <= x + kReach; ++i) {
              if (!depth.Contains(i, j) || !(depth(i, j) > 0)) return false;
            }
          }
          return true;
        };
        std::vector<Spot> found;
        for (int y = 0; y < depth.height; ++y) {
          for (int x = 0; x < depth.width; ++x) {
            if (fits(x, y)) found.push_back({picture.name, x, y});
          }
        }
        if (found.empty()) continue;
        spot = found[found.size() / 2];
        return;
      }
    });
    return spot;
  }

  // Where the canvas shows a pixel of its photo.
  QPoint OnCanvas(const Spot& spot) {
    const Image& photo = Photo(spot.photo).photo;
    const QRectF rect = canvas().ImageRect(canvas().navigation().Rendered());
    return {int(rect.left() + (spot.x + 0.5) / photo.width * rect.width()),
            int(rect.top() + (spot.y + 0.5) / photo.height * rect.height())};
  }

  static void Lenses() {
    QTest::addColumn<QString>("lens");
    QTest::newRow("EQUIRECTANGULAR") << "EQUIRECTANGULAR";
    QTest::newRow("WIDE_FISHEYE") << QString::fromStdString(kWideFisheye);
  }

 private Q_SLOTS:
  void cleanup() { Close(); }

  void EveryPhotoIsOnePicture_data() { Lenses(); }
  void EveryPhotoIsOnePicture() {
    QFETCH(QString, lens);
    QVERIFY(Open(lens.toStdString()));
    const auto facts = controller().facts();
    const std::vector<std::string> names = Names();
    QCOMPARE(facts->pictures->all().size(), names.size());
    QVERIFY(facts->views.size() >= 4 * names.size());

    // The Views panel has a row a photo, with the photo as it is.
    QCOMPARE(List()->count(), int(names.size()));
    for (const std::string& name : names) {
      QListWidgetItem* item = ItemOf(name);
      QVERIFY2(item, name.c_str());
      QTRY_VERIFY_WITH_TIMEOUT(!item->data(kPicture).value<QImage>().isNull(), kWaitMs);
      QCOMPARE(item->data(kPicture).value<QImage>().size(), SmallSize());
    }

    // The canvas shows the library's picture of the faces.
    Keep(*window_, qPrintable("wide-canvas-" + lens));
    const std::string first = subject_.first;
    QCOMPARE(canvas().picture()->name, first);
    const QImage render = canvas().frame()->image;
    QCOMPARE(canvas().ImageRect(canvas().navigation().Rendered()).size().toSize(), render.size());
    QImage expected;
    QVERIFY(Do([&](EditSession& session, Monitor&) {
      const Pictures pictures = session.scene().pictures();
      session.scene().renderer().SetSh(session.scene().original().sh);
      expected = ToQImage(pictures.Compose(pictures.RequireOne(first), [&](const View& face) {
        return session.scene().renderer().Render(session.scene().reconstruction().Posed(face)).rgb;
      }));
    }));
    expected = expected.scaled(render.size(), Qt::IgnoreAspectRatio, Qt::SmoothTransformation);
    const double same = Difference(render, expected);
    const double other = Difference(render, expected.mirrored(true, false));
    QVERIFY2(same < 0.4 * other, qPrintable(QString("%1 %2").arg(same).arg(other)));

    // From photo to photo.
    QVERIFY(canvas().GoTo(names[0]));
    for (size_t i = 1; i <= names.size(); ++i) {
      PressKey(*window_, Qt::Key_Right);
      QCOMPARE(canvas().picture()->name, names[i % names.size()]);
    }
    PressKey(*window_, Qt::Key_Left);
    QCOMPARE(canvas().picture()->name, names.back());
    QVERIFY(canvas().GoTo(names[2] + "@left"));
    QCOMPARE(canvas().picture()->name, names[2]);
    QVERIFY(!canvas().GoTo(names[2] + "@nowhere"));
    for (const std::string& name : names) {
      QCOMPARE(ItemOf(name)->data(kShown).toBool(), name == names[2]);
    }
    const std::string state = canvas().CameraState();
    QVERIFY(canvas().GoTo(names[0]));
    QVERIFY(canvas().RestoreCamera(state));
    QCOMPARE(canvas().picture()->name, names[2]);

    // P shows the photo, and the eyedropper takes its colors, here from beside the front face.
    QVERIFY(WaitSharp(*window_));
    canvas().setFocus();
    QTest::keyPress(&canvas(), Qt::Key_P);
    QTRY_VERIFY_WITH_TIMEOUT(canvas().showing_photo(), kWaitMs);
    const Image& photo = Photo(names[2]).photo;
    const QPoint at = OnCanvas({names[2], int(0.8 * photo.width), int(0.5 * photo.height)});
    const QRectF rect = canvas().ImageRect(canvas().navigation().Rendered());
    canvas().SetPicking(true);
    QSignalSpy picked(&canvas(), &Canvas::picked);
    QTest::mouseClick(&canvas(), Qt::LeftButton, Qt::NoModifier, at);
    QCOMPARE(picked.count(), 1);
    const int x = int((at.x() - rect.left()) / rect.width() * photo.width);
    const int y = int((at.y() - rect.top()) / rect.height() * photo.height);
    QVERIFY(Apart(picked.at(0).at(0).value<QColor>().rgb(), ToQImage(photo).pixel(x, y)) <= 1);
    QTest::keyRelease(&canvas(), Qt::Key_P);
  }

  void TheCameraTurnsToWhatAnyFaceShows_data() { Lenses(); }
  void TheCameraTurnsToWhatAnyFaceShows() {
    QFETCH(QString, lens);
    QVERIFY(Open(lens.toStdString()));
    const Spot spot = FindBorder();
    QVERIFY(!spot.photo.empty());
    QVERIFY(canvas().GoTo(spot.photo));
    QVERIFY(WaitSharp(*window_));
    const QSize size = canvas().frame()->image.size();
    canvas().SetDepth(true);
    QVERIFY(WaitSharp(*window_));
    const QImage depth = canvas().frame()->image;
    QCOMPARE(depth.size(), size);
    const QPoint at = OnCanvas(spot);
    const PosedCamera shown = canvas().navigation().Rendered();
    const QPointF pixel = at - canvas().ImageRect(shown).topLeft();
    QVERIFY(depth.pixel(int(pixel.x()), int(pixel.y())) != qRgb(0, 0, 0));
    canvas().SetDepth(false);
    QVERIFY(WaitSharp(*window_));

    const auto ray = CameraProjection(shown.camera).CamFromImg({pixel.x(), pixel.y()});
    QVERIFY(ray.has_value());
    const Eigen::Vector3d toward = shown.cam_from_world.rotation.conjugate() * *ray;
    QTest::mouseDClick(&canvas(), Qt::LeftButton, {}, at);
    QTRY_VERIFY_WITH_TIMEOUT(!canvas().navigation().view(), kWaitMs);
    QVERIFY(!canvas().picture());
    const Navigation& navigation = canvas().navigation();
    QVERIFY((navigation.Rendered().Center() - shown.Center()).norm() < 1e-6);
    const Eigen::Vector3d turned = (navigation.focus() - shown.Center()).normalized();
    QVERIFY2(turned.dot(toward) > 0.9995, qPrintable(QString::number(turned.dot(toward))));
    QVERIFY(WaitSharp(*window_));
    QVERIFY(canvas().frame()->camera.camera.IsPinhole());
    // Back to the photo that was taken here.
    PressKey(*window_, Qt::Key_Right);
    QCOMPARE(canvas().picture()->name, spot.photo);
  }

  void PaintAcrossFacesSelectsAsTheCommandLineDoes_data() { Lenses(); }
  void PaintAcrossFacesSelectsAsTheCommandLineDoes() {
    QFETCH(QString, lens);
    QVERIFY(Open(lens.toStdString()));
    const Spot spot = FindBorder();
    QVERIFY(!spot.photo.empty());
    subject_.first = spot.photo;
    QVERIFY(canvas().GoTo(spot.photo));
    QVERIFY(WaitSharp(*window_));
    std::map<std::string, QImage> overlays;
    auto* preview = window_->findChild<StrokePreview*>();
    connect(preview, &StrokePreview::shown, this, [&](const QString& name, const QImage& overlay) {
      overlays[name.toStdString()] = overlay;
    });

    QVERIFY(EnterPainting());
    QCOMPARE(selection().entry().view.toStdString(), spot.photo);
    const Image& photo = Photo(spot.photo).photo;
    QCOMPARE(paper().editor().mask().width, photo.width);
    QCOMPARE(paper().editor().mask().height, photo.height);
    paper().SetBrush({6, 1});
    QTest::mouseClick(&paper(), Qt::LeftButton, Qt::NoModifier,
                      OnPaper(spot.x + 0.5, spot.y + 0.5));
    const Mask painted = paper().editor().mask();
    QVERIFY((Middle(painted) - Eigen::Vector2d(spot.x + 0.5, spot.y + 0.5)).norm() < 2);
    QTest::keyClick(&paper(), Qt::Key_Z, Qt::ControlModifier);
    QVERIFY(!paper().editor().AnyInside());
    QTest::keyClick(&paper(), Qt::Key_Z, Qt::ControlModifier | Qt::ShiftModifier);
    QVERIFY(paper().editor().mask().data == painted.data);
    Keep(*window_, qPrintable("wide-paint-" + lens));
    const auto facts = controller().facts();
    const PosedCamera camera = facts->Shown(*facts->FindPicture(spot.photo));
    const std::vector<PaintedView> paint = {{spot.photo, camera, painted}};
    QVERIFY(OnViews(*facts->workspace, paint).size() >= 2);
    QTRY_VERIFY_WITH_TIMEOUT(!preview->IsBusy() && overlays.contains(spot.photo), kWaitMs);
    QCOMPARE(overlays.at(spot.photo).size(), SmallSize());
    for (const auto& [name, overlay] : overlays) QVERIFY2(ItemOf(name), name.c_str());

    QVERIFY(Accept());
    Keep(*window_, qPrintable("wide-accepted-" + lens));
    const auto& source = Selection()->source;
    QCOMPARE(source.painted.size(), size_t{1});
    QCOMPARE(source.painted[0].name, spot.photo);
    QVERIFY(source.painted[0].mask.data == painted.data);
    WhatTheCommandLineFinds(painted);

    // The badge counts the photo's pixels.
    const Mask selected = facts->pictures->FromViews(Selection()->masks).at(spot.photo);
    const auto inside = std::ranges::count_if(selected.data, [](uint8_t v) { return v >= 128; });
    const double covered = 100.0 * double(inside) / double(selected.data.size());
    const auto badge = [&] { return ItemOf(spot.photo)->data(kBadge).toString(); };
    QTRY_VERIFY_WITH_TIMEOUT(badge().endsWith("%"), kWaitMs);
    const double shown = badge().split(' ').front().toDouble();
    // Rounded to a tenth; the border's pixels may round otherwise.
    QVERIFY2(std::abs(shown - covered) < 0.1, qPrintable(badge() + QString(" %1").arg(covered)));

    // The selection lies over the canvas where it was painted.
    canvas().SetCloudShown(false);
    QVERIFY(WaitSharp(*window_));
    auto* mask_view = window_->findChild<MaskView*>("mask_view");
    mask_view->SetShown(true);
    QTRY_VERIFY_WITH_TIMEOUT(mask_view->IsReady(), kWaitMs);
    const QImage overlaid = canvas().grab().toImage();
    mask_view->SetShown(false);
    const QImage plain = canvas().grab().toImage();
    int changed = 0;
    const QPoint at = OnCanvas(spot);
    for (int y = at.y() - 3; y <= at.y() + 3; ++y) {
      for (int x = at.x() - 3; x <= at.x() + 3; ++x) {
        changed += overlaid.pixel(x, y) != plain.pixel(x, y);
      }
    }
    QVERIFY2(changed > 20, qPrintable(QString::number(changed)));

    // Photos are suggested to be painted next.
    auto* order = window_->findChild<QComboBox*>("views_order");
    order->setFocus();
    for (int i = 0; i < 2; ++i) QTest::keyClick(order, Qt::Key_Down);
    QTRY_VERIFY_WITH_TIMEOUT(window_->uncertainty().found() != nullptr, kWaitMs);
    const auto& suggested = window_->uncertainty().found()->views;
    std::set<std::string> others;
    for (const std::string& name : Names()) {
      if (name != spot.photo) others.insert(name);
    }
    QCOMPARE(suggested.size(), others.size());
    // A dot on a plain box stays a dot: then no order is better than another.
    QVERIFY(!SettlesAnything(suggested));
    auto* note = window_->findChild<QLabel*>("views_note");
    QTRY_VERIFY(note->text().contains("settle"));
    for (const auto& next : suggested) QVERIFY(others.contains(next.view));

    controller().Undo();
    QTRY_VERIFY_WITH_TIMEOUT(controller().regions().regions.empty(), kWaitMs);
    controller().Redo();
    QTRY_COMPARE_WITH_TIMEOUT(controller().regions().regions.size(), size_t{1}, kWaitMs);
  }
};

}  // namespace retint

using retint::WidePhotosTest;
QTEST_MAIN(WidePhotosTest)
#include "wide_photos_test.moc"
