// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/panel_table.h"

#include <QCoreApplication>

#include "viewer/panels/optimizer_panel.h"
#include "viewer/panels/quality_panel.h"
#include "viewer/panels/regions_panel.h"
#include "viewer/panels/scene_panel.h"
#include "viewer/panels/selection_panel.h"
#include "viewer/panels/views_panel.h"
#include "viewer/window/dialogs.h"

namespace retint {
namespace {

QWidget* MakeRegions(const WindowParts& parts) {
  return new RegionsPanel(parts.controller, parts.canvas, parts.current);
}

QWidget* MakeOptimizer(const WindowParts& parts) {
  auto* panel = new OptimizerPanel(parts.controller, parts.current);
  QObject::connect(panel, &OptimizerPanel::refused, parts.dialogs, &Dialogs::ShowError);
  return panel;
}

QWidget* MakeQuality(const WindowParts& parts) {
  return new QualityPanel(parts.controller, parts.canvas, parts.current);
}

QWidget* MakeViews(const WindowParts& parts) {
  return new ViewsPanel(parts.controller, parts.canvas, parts.photos, parts.current,
                        parts.uncertainty, parts.preview);
}

QWidget* MakeScene(const WindowParts& parts) { return new ScenePanel(parts.controller); }

QWidget* MakeSelection(const WindowParts& parts) {
  auto* panel = new SelectionPanel(parts.controller, parts.selection, parts.canvas, parts.current);
  QObject::connect(panel, &SelectionPanel::refused, parts.dialogs, &Dialogs::ShowError);
  return panel;
}

}  // namespace

QString WindowPanel::Aim() const {
  return QCoreApplication::translate("retint::MainWindow", "Go to the %1 panel").arg(title);
}

const std::vector<WindowPanel>& WindowPanels() {
  constexpr auto kLeft = Qt::LeftDockWidgetArea, kRight = Qt::RightDockWidgetArea;
  static const std::vector<WindowPanel> panels = {
      {"regions", "Regions", Qt::Key_1, kRight, false, true, MakeRegions},
      {"optimizer", "Optimizer", Qt::Key_2, kRight, false, true, MakeOptimizer},
      {"quality", "Quality", Qt::Key_3, kRight, true, true, MakeQuality},
      {"views", "Views", Qt::Key_4, kLeft, false, false, MakeViews},
      {"scene", "Scene", Qt::Key_5, kLeft, true, false, MakeScene},
      {"selection", "Selection", Qt::Key_6, kRight, true, true, MakeSelection},
  };
  return panels;
}

}  // namespace retint
