// SPDX-License-Identifier: BSD-3-Clause
// The picker of colors and the pages for tables, gradients and palettes, in the real window, with
// mouse and keys, checked by the session's state.
#include <array>
#include <cmath>

#include <QAction>
#include <QLabel>
#include <QMenu>
#include <QSet>
#include <QToolButton>

#include "base/files.h"
#include "kernels/common/color_spaces.h"
#include "recolor/edit_text.h"
#include "tests/viewer/edit_panel_fixture.h"
#include "viewer/panels/edit_panel.h"
#include "viewer/panels/gradient_bar.h"
#include "viewer/panels/swatch_row.h"
#include "viewer/panels/tone_graph.h"

namespace retint {

class EditPagesTest : public EditPanelFixture {
  Q_OBJECT

 private:
  static std::string GrayCube() {
    std::string cube = "LUT_3D_SIZE 2\n";
    for (int i = 0; i < 8; ++i) cube += "0.5 0.5 0.5\n";
    return cube;
  }

 private Q_SLOTS:
  void initTestCase() { MakeTheme(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { Close(); }

  // For colors outside the gamut, and for the frames of colors.
  void ThePickerFollowsTheTheme() {
    QVERIFY(AddPlain());
    TypeColor("#8090a0");
    Click("swatch_add");
    Click("color_model1");
    auto* square = Find<ColorSquare>("color_square");
    auto* swatches = Find<SwatchRow>("swatches");
    const auto look = [&] {
      QCoreApplication::processEvents();  // the palette is on its way
      const QImage hatched = square->grab().toImage();
      const QImage frame =
          swatches->findChildren<QToolButton*>().front()->icon().pixmap(16, 16).toImage();
      return std::pair(hatched.pixelColor(hatched.width() - 5, 5), frame.pixelColor(0, 0));
    };
    theme_->Choose(ThemeChoice::kDark);
    const auto dark = look();
    theme_->Choose(ThemeChoice::kLight);
    const auto light = look();
    QVERIFY(dark.first.lightness() < 128 && light.first.lightness() > 128);
    QVERIFY(dark.second.lightness() > 128 && light.second.lightness() < 128);
  }

  void OkLchKeepsHueAndLightness() {
    QVERIFY(AddPlain());
    Click("color_model1");
    TypeColor("#4080c0");
    auto* square = Find<ColorSquare>("color_square");
    const auto lch = [&] {
      const QColor color = Find<ColorPicker>("color_picker")->color();
      const float rgb[3] = {color.redF(), color.greenF(), color.blueF()};
      const OkLab lab = OkLabFromSrgb(rgb);
      return std::array{double(lab.lightness), std::hypot(double(lab.a), double(lab.b)),
                        std::atan2(double(lab.b), double(lab.a))};
    };
    const auto before = lch();
    // Far to the right no screen shows a color of this lightness: the nearest one is taken.
    QTest::mouseClick(square, Qt::LeftButton, {},
                      {square->width() - 2, int((1 - before[0]) * (square->height() - 1))});
    const auto after = lch();
    QVERIFY(after[1] > before[1] + 0.01 && after[1] < kMostChroma);
    // A pixel of the area is 1 % of lightness, a step of 1 / 255 less than 0.02 of an angle.
    QVERIFY2(std::abs(after[0] - before[0]) < 0.015, qPrintable(QString::number(after[0])));
    QVERIFY2(std::abs(after[2] - before[2]) < 0.03, qPrintable(QString::number(after[2])));
    QVERIFY(std::abs(square->place().across * kMostChroma - after[1]) < 0.01);
    // Hatched there: not of one color.
    const QImage area = square->grab().toImage();
    QSet<QRgb> colors;
    for (int x = area.width() - 40; x < area.width() - 12; ++x) colors << area.pixel(x, 12);
    QVERIFY(colors.size() > 2);
    Click("color_model0");
  }

  void CurvesAreDrawnOverTheRegionsHistogram() {
    QVERIFY(AddPlain());
    Select(0);
    Click("mode_curves");
    auto* graph = Find<ToneGraph>("curve_graph");
    QTRY_VERIFY_WITH_TIMEOUT(graph->HasHistogram(), kWaitMs);
    Keep(*window_, "curves");
    // A click on a point changes nothing.
    QTest::mouseClick(graph, Qt::LeftButton, {}, graph->PlaceOf({1, 1}).toPoint());
    QVERIFY(Settle(Controller()));
    QVERIFY(Edit().operations.empty());
    // A press on the line makes a point, which is dragged on: one step to undo.
    const auto at = [&](double in, double out) { return graph->PlaceOf({in, out}).toPoint(); };
    DragAlong(graph, {at(0.5, 0.5), at(0.5, 0.6), at(0.5, 0.75)});
    QVERIFY(Settle(Controller()));
    QCOMPARE(Kinds(), std::vector{Kind::kLut});
    const auto tone = Tone::Of(Edit().operations[0]);
    QVERIFY(tone && tone->points.size() == 3);
    const auto out = [&](float in) { return CompiledEdit(Edit()).Apply({in, in, in}).x(); };
    // A pixel of the graph is 1 % of its height.
    QVERIFY2(std::abs(out(0.5F) - 0.75F) < 0.02F, qPrintable(QString::number(out(0.5F))));
    QVERIFY(out(0) < 1e-4F && out(1) > 0.9999F);
    for (float in = 0; in < 1; in += 0.01F) {
      QVERIFY(out(in) <= out(in + 0.01F) + 1e-5F);
      // Between two of 33 nodes.
      QVERIFY(std::abs(double(out(in)) - tone->At(double(in))) < 0.005);
    }
    QCOMPARE(Controller().history().labels.size(), size_t{2});  // with that of the region
    // It is a curve after it was saved too, and no table of a file.
    const ColorEdit saved = EditFromJson(EditToJson(Edit(), /*with_tables=*/true), {});
    QVERIFY(Tone::Of(saved.operations[0])->points == tone->points);
    QVERIFY(Steps()->topLevelItem(0)->text(0).contains("Curves"));
    Click("mode_lut");
    QVERIFY(Find<QLabel>("lut_name")->text().startsWith("No table yet"));
    // By keys: nearer to the straight line, then away with the point.
    Click("mode_curves");
    graph->setFocus();
    QTest::keyClick(graph, Qt::Key_Down, Qt::ShiftModifier);
    QVERIFY(Settle(Controller()));
    QVERIFY2(std::abs(out(0.5F) - 0.65F) < 0.02F, qPrintable(QString::number(out(0.5F))));
    QTest::keyClick(graph, Qt::Key_Delete);
    QVERIFY(Settle(Controller()));
    QVERIFY(std::abs(out(0.5F) - 0.5F) < 1e-4F);
    Click("curve_reset");
    QVERIFY(Settle(Controller()));
    QVERIFY(Edit().operations.empty());
    Controller().colors().CancelRefit();
  }

  void LevelsStretchTheRegion() {
    QVERIFY(AddPlain());
    Select(0);
    Click("mode_curves");
    Click("curve_add");
    Click("mode_levels");
    auto* graph = Find<ToneGraph>("levels_graph");
    Type("levels.black", "0.2");
    Type("levels.white", "0.8");
    QVERIFY(Settle(Controller()));
    QCOMPARE(Kinds(), (std::vector{Kind::kLut, Kind::kLut}));  // beside the curve
    const auto out = [&](float in) { return CompiledEdit(Edit()).Apply({in, in, in}).x(); };
    // Between two of 33 nodes.
    QVERIFY(out(0.15F) < 1e-4F && out(0.85F) > 0.9999F && std::abs(out(0.5F) - 0.5F) < 0.01F);
    QTRY_VERIFY_WITH_TIMEOUT(graph->HasHistogram(), kWaitMs);
    const QPoint middle = graph->PlaceOf({0.5, 0}).toPoint();
    DragAlong(graph, {middle, middle - QPoint(20, 0), middle - QPoint(30, 0)});
    QVERIFY(Settle(Controller()));
    Keep(*window_, "levels");
    QVERIFY2(out(0.5F) > 0.6F, qPrintable(QString::number(out(0.5F))));
    QVERIFY(Find<QDoubleSpinBox>("levels.middle")->value() > 1.2);
    Type("levels.low", "0.3");
    QVERIFY(Settle(Controller()));
    QVERIFY(std::abs(out(0) - 0.3F) < 1e-4F);
    graph->setFocus();
    QTest::keyClick(graph, Qt::Key_PageUp);  // black
    QTest::keyClick(graph, Qt::Key_Left, Qt::ShiftModifier);
    QVERIFY(Settle(Controller()));
    QVERIFY(std::abs(Find<QDoubleSpinBox>("levels.black")->value() - 0.1) < 0.001);
    // All of them back where they were: no step is left.
    for (const char* level : {"black", "middle", "white", "low"}) {
      Click(qPrintable(QStringLiteral("levels.%1_reset").arg(level)));
    }
    QVERIFY(Settle(Controller()));
    QCOMPARE(Kinds(), std::vector{Kind::kLut});
    Controller().colors().CancelRefit();
  }

  void TablesComeFromFiles() {
    QVERIFY(AddRegions());
    Select(0);
    std::string cube = "LUT_3D_SIZE 2\n";
    for (int i = 0; i < 8; ++i) {  // the complement, red fastest
      for (int c = 0; c < 3; ++c) cube += (i >> c & 1) ? "0.0 " : "1.0 ";
      cube += "\n";
    }
    WriteFile(*folder_ / "negative.cube", cube);
    WriteFile(*folder_ / "broken.cube", cube.substr(0, 60));
    Click("mode_lut");
    AnswerFileDialog(*folder_ / "negative.cube");
    Click("lut_open");
    QTRY_COMPARE_WITH_TIMEOUT(Edit().operations.size(), size_t{2}, kWaitMs);
    const ColorEdit edit = Edit();
    QVERIFY(edit.operations[1].kind == Kind::kLut);
    QCOMPARE(edit.operations[1].table->size, 2);
    QVERIFY(Find<QLabel>("lut_name")->text().contains("negative"));
    AnswerFileDialog(*folder_ / "broken.cube");
    Click("lut_open");
    auto* problem = Find<QLabel>("lut_problem");
    QTRY_VERIFY_WITH_TIMEOUT(problem->text().contains("broken.cube"), kWaitMs);
    QVERIFY(Edit() == edit);
  }

  void AnotherTableIsAddedOnlyWhenItIsChosen() {
    QVERIFY(AddRegions());
    Select(0);
    WriteFile(*folder_ / "gray.cube", GrayCube());
    QAction* add = nullptr;
    for (QAction* action : Find<QMenu>("operation_more")->actions()) {
      if (action->objectName() == "lut") add = action;
    }
    QVERIFY(add);
    int came = 0;
    CancelFileDialog(&came);
    add->trigger();
    QCOMPARE(came, 1);
    // The next change replaces it, and does not add another one.
    Click("mode_tint");
    TypeColor("#2040ff");
    QVERIFY(Kinds() == std::vector{Kind::kTint});
    for (size_t count : {2, 3}) {
      AnswerFileDialog(*folder_ / "gray.cube");
      add->trigger();
      QTRY_COMPARE_WITH_TIMEOUT(Edit().operations.size(), count, kWaitMs);
    }
    QVERIFY(Kinds() == (std::vector{Kind::kTint, Kind::kLut, Kind::kLut}));
  }

  void LongNamesDoNotWidenThePanel() {
    QVERIFY(AddRegions());
    Select(0);
    const std::string name(200, 'w');
    WriteFile(*folder_ / (name + ".cube"), GrayCube());
    WriteFile(*folder_ / (name + "_broken.cube"), "LUT_3D_SIZE 2\n0 0 0\n");
    Click("mode_lut");
    auto* panel = Find<EditPanel>("edit_panel");
    const int width = panel->minimumSizeHint().width();
    AnswerFileDialog(*folder_ / (name + ".cube"));
    Click("lut_open");
    QTRY_COMPARE_WITH_TIMEOUT(Edit().operations.size(), size_t{2}, kWaitMs);
    QCOMPARE(panel->minimumSizeHint().width(), width);
    AnswerFileDialog(*folder_ / (name + "_broken.cube"));
    Click("lut_open");
    QTRY_VERIFY_WITH_TIMEOUT(Find<QLabel>("lut_problem")->isVisible(), kWaitMs);
    QCOMPARE(panel->minimumSizeHint().width(), width);
  }

  void AGradientHasStops() {
    QVERIFY(AddRegions());
    Select(0);
    Click("mode_gradient");
    auto* bar = Find<GradientBar>("gradient_bar");
    QCOMPARE(bar->stops().size(), size_t{12});
    // The last of the three.
    const int right = bar->width() - 8, low = bar->height() - 5;
    QTest::mouseClick(bar, Qt::LeftButton, {}, {right, low});
    QCOMPARE(bar->current(), size_t{2});
    TypeColor("#ffe080");
    QVERIFY(Kinds() == (std::vector{Kind::kTint, Kind::kGradient}));
    QCOMPARE(ToColor({&Edit().operations[1].values[9], 3}).name(), QString("#ffe080"));
    // Dragged to the left it stops before its neighbor.
    DragAlong(bar, {{right, low}, {right - 20, low}, {5, low}});
    QVERIFY(Edit().operations[1].values[8] > 0.5F && Edit().operations[1].values[8] < 0.52F);
    QTest::mouseDClick(bar, Qt::LeftButton, {}, {bar->width() / 4, 8});
    QCOMPARE(Edit().operations[1].values.size(), size_t{16});
    QVERIFY(std::abs(Edit().operations[1].values[4] - 0.25F) < 0.03F);  // margins of 7 pixels
    bar->setFocus();
    QTest::keyClick(bar, Qt::Key_Delete);
    QCOMPARE(Edit().operations[1].values.size(), size_t{12});
    QTest::mouseClick(bar, Qt::LeftButton, {}, {7 + int(0.51 * (bar->width() - 14)), low});
    QCOMPARE(bar->current(), size_t{2});
    const QColor last = bar->color();
    Click("gradient_reverse");
    QCOMPARE(ToColor({&Edit().operations[1].values[9], 3}).name(), QString("#000000"));
    // The stop at hand is still the same.
    QCOMPARE(bar->current(), size_t{0});
    QCOMPARE(bar->color(), last);
  }

  void APaletteIsMeasuredAndChanged() {
    QVERIFY(AddPlain());
    Click("mode_palette");
    const std::string before = Controller().history().undo_label;
    QVERIFY(MeasureTwoColors());
    QVERIFY(Edit().operations.empty());  // measuring is no step
    QCOMPARE(Controller().history().undo_label, before);
    Click("palette0");
    TypeColor("#2040ff");
    QCOMPARE(Edit().operations.size(), size_t{1});
    ColorOperation measured = Edit().operations[0];
    std::fill_n(measured.values.begin() + 3, 3, kUnset);
    QVERIFY(measured.kind == Kind::kPalette && measured.values.size() <= 2 * kPairValues);
    const ColorOperation changed = Edit().operations[0];
    QCOMPARE(ToColor({&changed.values[3], 3}).name(), QString("#2040ff"));
    QVERIFY(
        std::equal(changed.values.begin(), changed.values.begin() + 3, measured.values.begin()));
    Click("palette_stay");
    QVERIFY(Edit().operations[0] == measured);
  }

  void FewerColorsThanAskedForAreExplained() {
    QVERIFY(AddPlain());
    Click("mode_palette");
    auto* count = Find<QSpinBox>("palette_count");
    count->setFocus();
    count->selectAll();
    QTest::keyClicks(count, "16");
    QTest::keyClick(count, Qt::Key_Return);
    auto* note = Find<QLabel>("palette_note");
    const auto told = [&] { return note->text().startsWith("Found "); };
    QTRY_VERIFY_WITH_TIMEOUT(told(), kWaitMs);
    QVERIFY2(note->text().contains(" of 16: "), qPrintable(note->text()));
    const QString text = note->text();
    // It is as many that are looked for again.
    Click("palette_measure");
    QVERIFY(Settle(Controller()));
    QTRY_COMPARE_WITH_TIMEOUT(note->text(), text, kWaitMs);
    // One that is as many as were asked for is not worth a word.
    count->setValue(1);
    QTRY_VERIFY_WITH_TIMEOUT(note->text().startsWith("Choose"), kWaitMs);
    TypeColor("#2040ff");
    QVERIFY(Steps()->topLevelItem(0)->text(0).contains("of 1 color"));
    QVERIFY(!Steps()->topLevelItem(0)->text(0).contains("colors"));
  }
};

}  // namespace retint

QTEST_MAIN(retint::EditPagesTest)
#include "edit_pages_test.moc"
