// SPDX-License-Identifier: BSD-3-Clause
// The selection canvas's tools that find the outline.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/error.h"
#include "network/mask_network.h"
#include "scene/mask_pixels.h"
#include "selecting/network_mask.h"
#include "selection/mask_tools/scribbles.h"
#include "viewer/scene/failure_text.h"
#include "viewer/selection/selection_canvas.h"

namespace retint {
namespace {

constexpr double kToleranceStep = 0.005;  // OKLab
constexpr double kTolerancePixels = 4;    // of the widget, for a step
constexpr int kMostReach = 200;           // pixels
constexpr double kLeastDrag = 5;          // widget pixels; below, it is a click

int Floor(double value) { return static_cast<int>(std::floor(value)); }

}  // namespace

void SelectionCanvas::Find(uint64_t gesture, Combine combine, OutlineFinder::Work work) {
  finder_->Find(gesture, std::move(work), [this, gesture, combine](const Mask& mask) {
    // Instead of the earlier result for the same gesture.
    GridRect changed;
    if (applied_ == gesture) changed = editor_.Undo();
    const GridRect filled = editor_.Fill(mask, combine);
    applied_ = filled.Empty() ? 0 : gesture;
    if (applied_ != 0 && gesture == undecided_of_ && !network_of_->empty()) {
      outlined_by_ = *network_of_;
    }
    for (Scribble& scribble : scribbles_) {
      if (scribble.gesture == gesture) scribble.found = true, scribble.step = applied_ == gesture;
    }
    Changed(changed.United(filled));
    Q_EMIT found();
  });
}

void SelectionCanvas::NotFound(const QString& why) {
  std::erase_if(scribbles_, [](const Scribble& scribble) { return !scribble.found; });
  update();
  Q_EMIT notFound(why);
}

// The tolerance for a drag to `cursor`, and the result with it.
void SelectionCanvas::Tune(const QPointF& cursor) {
  const int x = Floor(tuning_->at.x()), y = Floor(tuning_->at.y());
  if (!layers_->color.Contains(x, y)) return;
  OutlineOptions outline = outline_;
  double& tolerance = acts().tolerance(outline);
  const double before = tolerance;
  const double steps = std::round((cursor.x() - tuning_->from.x()) / kTolerancePixels);
  tolerance = std::clamp(tuning_->tolerance + kToleranceStep * steps, 0.0, 1.0);
  if (std::exchange(tuning_->asked, true) && tolerance == before) return;
  outline.wand.x = x, outline.wand.y = y;
  SetOutline(outline);
  Find(tuning_->gesture, tuning_->combine, acts().find({layers_, outline_, {tuning_->at}}));
}

void SelectionCanvas::FindDrawn() {
  if (!acts().find) return;
  const uint64_t gesture = drawing_->gesture;
  if (OutlineFinder::Work work = acts().find({layers_, outline_, drawing_->points})) {
    return Find(gesture, drawing_->combine, std::move(work));
  }
  if (!HasCorners()) return;  // a drag goes on
  finder_->Cancel();
  if (applied_ != gesture) return;
  applied_ = 0;
  Changed(editor_.Undo());
}

// --- Scribbles -----------------------------------------------------------------------------------

void SelectionCanvas::AddStroke(const Drawing& drawing) {
  if (scribbles_.empty()) {
    under_scribbles_ = drawing.combine == Combine::kAdd ? editor_.mask() : Mask();
  }
  undone_.clear();
  Scribble scribble{drawing.points, 2 * outline_.scribble.radius,
                    drawing.combine == Combine::kRemove, drawing.gesture};
  scribble.object = !IsScribble();
  if (scribble.object) {
    const Eigen::Vector2d drag = scribble.points.back() - scribble.points.front();
    const bool is_click = drag.cwiseAbs().minCoeff() * transform_.scale < kLeastDrag;
    if (is_click || scribble.outside) scribble.points.resize(1);
  }
  scribbles_.push_back(std::move(scribble));
  FindScribbled();
}

void SelectionCanvas::SetNetwork(const std::string& name) {
  if (name == network_name_) return;
  network_name_ = name;
  network_.reset();
}

QString SelectionCanvas::NetworkProblem() {
  if (network_name_.empty()) {
    return tr("Name your network in Edit, Preferences: this tool asks it for the object");
  }
  try {
    if (!network_) network_ = MakeMaskNetwork(network_name_);
  } catch (const Error& failure) {
    return FailureText(failure);
  }
  return {};
}

void SelectionCanvas::FindScribbled() {
  const bool any = std::any_of(scribbles_.begin(), scribbles_.end(),
                               [](const Scribble& scribble) { return !scribble.outside; });
  if (!any) {
    scribbles_.back().found = true;  // there is nothing to find yet
    return;
  }
  finder_->Cancel();
  const uint64_t gesture = scribbles_.back().gesture;
  Mask inside(layers_->color.width, layers_->color.height), outside = inside;
  std::shared_ptr<const MaskNetwork> network;
  ObjectPrompt prompt;
  for (Scribble& scribble : scribbles_) {
    if (!scribble.found) scribble.gesture = gesture;
    if (scribble.object) {
      const QString why = NetworkProblem();  // the preferences may have changed
      if (!why.isEmpty()) return NotFound(why);
      network = network_;
      const Eigen::Vector2d a = scribble.points.front(), b = scribble.points.back();
      if (scribble.points.size() > 1) {
        prompt.rectangle = {a.cwiseMin(b), a.cwiseMax(b)};
      } else {
        (scribble.outside ? prompt.outside : prompt.inside).push_back(a);
      }
      continue;
    }
    // If strokes cross, the later one holds.
    Mask stroke(inside.width, inside.height);
    DrawStroke(scribble.points, scribble.width, &stroke);
    for (size_t p = 0; p < stroke.data.size(); ++p) {
      if (stroke.data[p] == 0) continue;
      inside.data[p] = scribble.outside ? 0 : 255;
      outside.data[p] = scribble.outside ? 255 : 0;
    }
  }
  const bool bounded = std::any_of(outside.data.begin(), outside.data.end(),
                                   [](uint8_t value) { return value > 0; });
  if (!bounded) outside = {};
  // Strokes that are only outside take away: colors that they teach must not bring in unselected
  // pixels.
  const bool takes_away =
      std::all_of(scribbles_.begin(), scribbles_.end(),
                  [](const Scribble& scribble) { return scribble.found || scribble.outside; });
  const Mask most = takes_away && scribbles_.front().found ? editor_.mask() : Mask();
  const auto undecided = std::make_shared<Mask>();  // read once the result shows
  undecided_ = undecided;
  undecided_of_ = gesture;
  const auto network_of = std::make_shared<std::string>();  // likewise
  network_of_ = network_of;
  Find(gesture, Combine::kReplace,
       [layers = layers_, drawn = Strokes{inside, outside}, network, prompt, most,
        under = under_scribbles_, undecided, network_of](Monitor& monitor) {
         Strokes strokes = drawn;
         if (network) {
           strokes = StrokesOf(*network, layers->color, drawn, prompt, monitor);
           *network_of = network->Identity();
         }
         Mask mask =
             MaskFromScribbles(*layers, strokes.inside, strokes.outside, monitor, undecided.get());
         for (size_t p = 0; p < most.data.size(); ++p) {
           mask.data[p] = std::min(mask.data[p], most.data[p]);
           if (!IsInside(most.data[p])) undecided->data[p] = 0;  // it was taken away
         }
         for (size_t p = 0; p < under.data.size(); ++p) {
           mask.data[p] = std::max(mask.data[p], under.data[p]);
           if (IsInside(under.data[p])) undecided->data[p] = 0;  // it was selected before
         }
         return mask;
       });
}

// The strokes whose meaning was found together go together.
void SelectionCanvas::UndoScribble() {
  const uint64_t gesture = scribbles_.back().gesture;
  const bool step = scribbles_.back().step;
  while (!scribbles_.empty() && scribbles_.back().gesture == gesture) {
    undone_.push_back(std::move(scribbles_.back()));
    scribbles_.pop_back();
  }
  applied_ = 0;
  Changed(step ? editor_.Undo() : GridRect{});
  Q_EMIT hintChanged();
  update();
}

void SelectionCanvas::RedoScribble() {
  const uint64_t gesture = undone_.back().gesture;
  const bool step = undone_.back().step;
  while (!undone_.empty() && undone_.back().gesture == gesture) {
    scribbles_.push_back(std::move(undone_.back()));
    undone_.pop_back();
  }
  applied_ = 0;
  Changed(step ? editor_.Redo() : GridRect{});
  Q_EMIT hintChanged();
  update();
}

void SelectionCanvas::ForgetScribbles() {
  if (scribbles_.empty() && undone_.empty()) return;
  scribbles_.clear();
  undone_.clear();
  under_scribbles_ = {};
  update();
}

// --- The border ----------------------------------------------------------------------------------

void SelectionCanvas::RefineBorder() {
  CancelDrawing();
  RefineAlong({});
}

void SelectionCanvas::RefineAlong(const std::vector<Eigen::Vector2d>& stroke) {
  if (!editor_.AnyInside()) {
    NotFound(tr("Nothing is selected whose border could be refined"));
    return;
  }
  if (IsFinding()) return;  // the border is about to change
  Mask under(stroke.empty() ? 0 : editor_.mask().width, editor_.mask().height);
  DrawStroke(stroke, 2 * brush_.radius, &under);
  const int reach = std::clamp(static_cast<int>(std::lround(brush_.radius)), 1, kMostReach);
  Find(++gesture_, Combine::kReplace,
       [layers = layers_, mask = editor_.mask(), under, reach](Monitor& monitor) {
         Mask refined = RefineEdge(*layers, mask, reach, monitor);
         for (size_t p = 0; p < under.data.size(); ++p) {
           if (under.data[p] == 0) refined.data[p] = mask.data[p];
         }
         return refined;
       });
}

// --- The next step -------------------------------------------------------------------------------

QString SelectionCanvas::Hint() const {
  if (IsFinding() && !drawing_ && !tuning_) return tr("Finding the outline  ·  Esc stops it");
  const bool by_corners = acts().gesture == Gesture::kCorners;
  const QString combine = tr("  ·  Shift adds, Ctrl removes, Shift+Ctrl intersects");
  if (by_corners && NumCorners() == 0 && editor_.AnyInside()) {  // Enter closes nothing any more
    return tr("Enter accepts what is selected  ·  click for another outline") + combine;
  }
  if (acts().find_hint) return acts().find_hint(*this);
  return acts().combine == CombineByKeys ? tr(acts().hint) + combine : tr(acts().hint);
}

}  // namespace retint
