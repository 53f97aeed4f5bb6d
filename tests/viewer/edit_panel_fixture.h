// SPDX-License-Identifier: BSD-3-Clause
// Shared by the tests of the panel that edits a region's colors.
#pragma once

#include <string_view>

#include <QAbstractButton>
#include <QAction>
#include <QCheckBox>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>

#include "tests/viewer/panels_fixture.h"
#include "viewer/panels/operation_views.h"

namespace retint {

class EditPanelFixture : public PanelsFixture {
 protected:
  using Kind = ColorOperationKind;

  // A region whose color was not chosen yet.
  bool AddPlain(const char* name = "new") {
    QSignalSpy added(&Controller(), &SceneController::regionAdded);
    AddRegionFromMasks(Controller(), name, MasksOf(scene_), ColorEdit());
    return QTest::qWaitFor([&] { return added.count() == 1; }, kWaitMs);
  }
  ColorEdit Edit(size_t region = 0) { return SessionRegions().regions[region].edit; }
  std::vector<Kind> Kinds() {
    std::vector<Kind> kinds;
    for (const ColorOperation& operation : Edit().operations) kinds.push_back(operation.kind);
    return kinds;
  }
  void Click(const char* name) {
    if (std::string_view(name).starts_with("mode_")) return Find<QAction>(name)->trigger();
    auto* button = Find<QAbstractButton>(name);
    // A box is at the left of its row.
    const QPoint at = qobject_cast<QCheckBox*>(button) ? QPoint(8, button->height() / 2)
                                                       : button->rect().center();
    QTest::mouseClick(button, Qt::LeftButton, {}, at);
  }
  void Type(const char* box, const char* text) {
    auto* field = Find<QDoubleSpinBox>(box);
    field->setFocus();
    field->selectAll();
    QTest::keyClicks(field, text);
    QTest::keyClick(field, Qt::Key_Return);
  }
  void TypeColor(const char* color) {
    auto* text = Find<QLineEdit>("color_text");
    text->setFocus();
    text->selectAll();
    QTest::keyClicks(text, color);
    QTest::keyClick(text, Qt::Key_Return);
  }
  RowTree* Steps() { return Find<RowTree>("operation_list"); }
  QString Problem() {
    auto* label = Find<QLabel>("edit_problem");
    return label->isVisibleTo(window_.get()) ? label->text() : QString();
  }
  // As the worker, who measures, has it.
  bool MeasureTwoColors() {
    auto* count = Find<QSpinBox>("palette_count");
    count->setFocus();
    count->selectAll();
    QTest::keyClicks(count, "2");
    QTest::keyClick(count, Qt::Key_Return);
    const auto* note = Find<QLabel>("palette_note");
    return QTest::qWaitFor([=] { return note->text().contains("Choose a main color"); }, kWaitMs);
  }

  bool Measured() {
    return QTest::qWaitFor([&] { return !Regions()[0].edit.NeedsMainColor(); }, kWaitMs) &&
           !Edit().operations.empty();
  }
};

}  // namespace retint
