// SPDX-License-Identifier: BSD-3-Clause
// The pages of curves and levels.
#include <QHBoxLayout>
#include <QToolButton>
#include <QVBoxLayout>

#include "recolor/lut.h"
#include "viewer/panels/edit_pages.h"
#include "viewer/panels/parameter_row.h"
#include "viewer/panels/tone_graph.h"

namespace retint {

TonePage::TonePage(Tone::Kind kind) : EditPage({ColorOperationKind::kLut}), kind_(kind) {
  graph_ = new ToneGraph(kind);
  graph_->setObjectName(kind == Tone::Kind::kCurve ? "curve_graph" : "levels_graph");
  rows()->addWidget(graph_);
  connect(graph_, &ToneGraph::changed, this,
          [this](bool dragging) { Send(graph_->tone(), dragging); });
  if (kind == Tone::Kind::kCurve) {
    AddButtons();
  } else {
    AddLevels();
  }
}

void TonePage::AddButtons() {
  auto* line = new QHBoxLayout;
  const auto add = [&](const char* name, const QString& text, const QString& tip, auto act) {
    auto* button = new QToolButton;
    button->setObjectName(name);
    button->setText(text);
    button->setToolTip(tip);
    button->setFocusPolicy(Qt::StrongFocus);
    connect(button, &QToolButton::clicked, this, act);
    line->addWidget(button);
    return button;
  };
  add("curve_add", tr("Add a point"), tr("In the widest gap (or click the graph)"),
      [this] { graph_->AddPoint(); });
  remove_ = add("curve_remove", tr("Remove point"), tr("Take the current point away (Del)"),
                [this] { graph_->RemovePoint(); });
  add("curve_reset", tr("Reset"), tr("Back to the straight line"), [this] {
    if (shown(ColorOperationKind::kLut)) Q_EMIT removed(ColorOperationKind::kLut);
  });
  line->addStretch();
  rows()->addLayout(line);
  connect(graph_, &ToneGraph::currentChanged, this,
          [this] { remove_->setEnabled(graph_->CanRemove()); });
}

void TonePage::AddLevels() {
  const auto add = [this](const char* name, const QString& text, const QString& tip,
                          const ParameterRow::Range& range, auto get, auto set) {
    auto* row = new ParameterRow(name, text, range, {}, tip);
    rows()->addWidget(row);
    levels_.push_back({row, get});
    const auto change = [this, set](double value, bool dragging) {
      Tone tone = graph_->tone();
      set(tone, value);
      Send(tone, dragging);
    };
    connect(row, &ParameterRow::changed, this, change);
    connect(row, &ParameterRow::reset, this, [=] { change(range.initial, false); });
  };
  const auto place = [&](const char* name, const QString& text, const QString& tip, size_t point,
                         bool out) {
    const double initial = point == 0 ? 0 : 1;
    add(
        name, text, tip, {0, 1, 0, 1, 0.01, initial},
        [=](const Tone& tone) { return out ? tone.points[point].out : tone.points[point].in; },
        [=](Tone& tone, double value) {
          TonePoint to = tone.points[point];
          (out ? to.out : to.in) = value;
          tone.Move(point, to);
        });
  };
  place("levels.black", tr("Black"), tr("Darker colors become as dark as Darkest"), 0, false);
  add(
      "levels.middle", tr("Middle"), tr("Above 1: brighter between black and white"),
      {0.1, 10, 0.1, 10, 0.05, 1, true}, [](const Tone& tone) { return tone.gamma(); },
      [](Tone& tone, double value) { tone.SetGamma(value); });
  place("levels.white", tr("White"), tr("Brighter colors become as bright as Brightest"), 2, false);
  place("levels.low", tr("Darkest"), tr("How bright black becomes"), 0, true);
  place("levels.high", tr("Brightest"), tr("How bright white becomes"), 2, true);
  int width = 0;
  for (const Level& level : levels_) width = std::max(width, level.row->LabelWidth());
  for (const Level& level : levels_) level.row->SetLabelWidth(width);
}

bool TonePage::Shows(const ColorOperation& operation) const {
  const auto tone = Tone::Of(operation);
  return tone && tone->kind == kind_;
}

void TonePage::SetHistogram(const std::vector<float>& bins) { graph_->SetHistogram(bins); }

void TonePage::Send(const Tone& tone, bool dragging) {
  const ColorOperation* old = shown(ColorOperationKind::kLut);
  // An operation without effect leaves the list.
  if (old && tone.kind == Tone::Kind::kLevels && tone.IsNeutral() && !dragging) {
    return Q_EMIT removed(ColorOperationKind::kLut);
  }
  ColorOperation operation = ColorOperation::Lut(tone.Table());
  if (old) operation.strength = old->strength;
  Q_EMIT changed(operation, dragging);
}

void TonePage::ShowMore() {
  const ColorOperation* operation = shown(ColorOperationKind::kLut);
  const auto tone = operation ? Tone::Of(*operation) : std::nullopt;
  graph_->SetTone(tone.value_or(Tone::Neutral(kind_)));
  for (const Level& level : levels_) level.row->SetValue(level.get(graph_->tone()));
  if (remove_) remove_->setEnabled(graph_->CanRemove());
}

}  // namespace retint
