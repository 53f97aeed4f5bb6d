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
#include "selection/depth_sampling.h"
#include "selection/mask_tools/scissors.h"
#include "selection/mask_tools/scribbles.h"
#include "viewer/scene/failure_text.h"
#include "viewer/selection/selection_canvas.h"

namespace retint {
namespace {

constexpr double kToleranceStep = 0.005;  // OKLab
constexpr double kTolerancePixels = 4;    // of the widget, for a step
constexpr double kLeastMargin = 1e-3;     // of a box, so that a flat surface is in it
constexpr int kMostReach = 200;           // pixels
constexpr double kLeastDrag = 5;          // widget pixels; below, it is a click

int Floor(double value) { return static_cast<int>(std::floor(value)); }

// The box about the dragged box, `margin` of its size larger on each side.
std::optional<std::array<Eigen::Vector3d, 2>> BoxAbout(const std::vector<Eigen::Vector3d>& points,
                                                       double margin) {
  if (points.empty()) return std::nullopt;
  Eigen::Vector3d low = points[0], high = points[0];
  for (const Eigen::Vector3d& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Vector3d size = high - low;
  if (size.maxCoeff() <= 0) return std::nullopt;
  const Eigen::Vector3d pad = (margin * size).cwiseMax(kLeastMargin * size.maxCoeff());
  return std::array<Eigen::Vector3d, 2>{low - pad, high + pad};
}

// Sets `mask` to 0 outside the rectangle of `points` (pixels). `margin` as above, relative to its
// longer side, and at least one pixel.
void ClipToDrag(const std::vector<Eigen::Vector2d>& points, double margin, Mask* mask) {
  Eigen::Array2d low = points.front(), high = low;
  for (const Eigen::Vector2d& point : points) {
    low = low.min(point.array());
    high = high.max(point.array());
  }
  const double pad = std::max(1.0, margin * (high - low).maxCoeff());
  for (int y = 0; y < mask->height; ++y) {
    for (int x = 0; x < mask->width; ++x) {
      const Eigen::Array2d at(x + 0.5, y + 0.5);
      if ((at < low - pad).any() || (at > high + pad).any()) (*mask)(x, y) = 0;
    }
  }
}

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

std::optional<Eigen::Vector3d> SelectionCanvas::SurfaceAt(const Eigen::Vector2d& at) const {
  const int x = Floor(at.x()), y = Floor(at.y());
  if (!layers_->Surface().Contains(x, y) || !HasDepth(layers_->Surface(), x, y))
    return std::nullopt;
  const Eigen::Vector3d in_cam = double(layers_->Surface()(x, y)) * RayAt(*layers_, at);
  return layers_->camera.cam_from_world.Inverse() * in_cam;
}

// --- Wand and color ------------------------------------------------------------------------------

void SelectionCanvas::Tune(const QPointF& cursor) {
  const int x = Floor(tuning_->at.x()), y = Floor(tuning_->at.y());
  if (!layers_->color.Contains(x, y)) return;
  OutlineOptions outline = outline_;
  double& tolerance = tool_ == SelectionTool::kLike ? outline.like : outline.wand.color;
  const double before = tolerance;
  const double steps = std::round((cursor.x() - tuning_->from.x()) / kTolerancePixels);
  tolerance = std::clamp(tuning_->tolerance + kToleranceStep * steps, 0.0, 1.0);
  if (std::exchange(tuning_->asked, true) && tolerance == before) return;
  outline.wand.x = x, outline.wand.y = y;
  SetOutline(outline);
  if (tool_ == SelectionTool::kLike) {
    Find(tuning_->gesture, tuning_->combine,
         [layers = layers_, x, y, tolerance = outline.like](Monitor&) {
           return LikeColor(*layers, ColorAt(*layers, x, y), tolerance);
         });
  } else {
    Find(tuning_->gesture, tuning_->combine,
         [layers = layers_, wand = outline.wand](Monitor&) { return MagicWand(*layers, wand); });
  }
}

// --- Shapes that show while they are drawn -------------------------------------------------------

void SelectionCanvas::FindDrawn() {
  const std::vector<Eigen::Vector2d>& points = drawing_->points;
  const uint64_t gesture = drawing_->gesture;
  if (drawing_->tool == SelectionTool::kSphere) {
    const auto center = SurfaceAt(points.front());
    const double depth = layers_->Surface()(Floor(points.front().x()), Floor(points.front().y()));
    const double radius =
        depth * (RayAt(*layers_, points.back()) - RayAt(*layers_, points.front())).norm();
    if (radius <= 0) return;
    Find(gesture, drawing_->combine, [layers = layers_, center = *center, radius](Monitor&) {
      return InSphere(*layers, center, radius);
    });
  } else if (drawing_->tool == SelectionTool::kBox) {
    std::vector<Eigen::Vector3d> surface;
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      const Eigen::Vector2d step = points[i + 1] - points[i];
      const int count = std::max(1, static_cast<int>(std::ceil(step.norm())));
      for (int k = 0; k <= count; ++k) {
        if (const auto at = SurfaceAt(points[i] + step * k / count)) surface.push_back(*at);
      }
    }
    const auto box = BoxAbout(surface, outline_.box_margin);
    if (!box) return;
    Find(gesture, drawing_->combine,
         [layers = layers_, box = *box, points, margin = outline_.box_margin](Monitor&) {
           Mask mask = InBox(*layers, box[0], box[1]);
           ClipToDrag(points, margin, &mask);
           return mask;
         });
  } else if (drawing_->tool == SelectionTool::kScissors) {
    std::vector<Eigen::Vector2i> anchors;  // the last point follows the cursor
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      anchors.emplace_back(std::clamp(Floor(points[i].x()), 0, layers_->color.width - 1),
                           std::clamp(Floor(points[i].y()), 0, layers_->color.height - 1));
      if (i > 0 && anchors.back() == anchors[anchors.size() - 2]) anchors.pop_back();
    }
    if (anchors.size() >= 3) {
      Find(gesture, drawing_->combine,
           [layers = layers_, anchors](Monitor&) { return CutOut(layers->color, anchors); });
      return;
    }
    finder_->Cancel();
    if (applied_ != gesture) return;
    applied_ = 0;
    Changed(editor_.Undo());
  }
}

// --- Scribbles -----------------------------------------------------------------------------------

void SelectionCanvas::AddScribble(const Drawing& drawing) {
  if (scribbles_.empty()) {
    under_scribbles_ = drawing.combine == Combine::kAdd ? editor_.mask() : Mask();
  }
  undone_.clear();
  Scribble scribble{drawing.points, 2 * outline_.scribble.radius,
                    drawing.combine == Combine::kRemove, drawing.gesture};
  scribble.object = drawing.tool == SelectionTool::kObject;
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

bool SelectionCanvas::HasNetwork() {
  try {
    if (network_name_.empty()) {
      NotFound(tr("Name your network in Edit, Preferences: this tool asks it for the object"));
    } else if (!network_) {
      network_ = MakeMaskNetwork(network_name_);
    }
  } catch (const Error& failure) {
    NotFound(FailureText(failure));
  }
  return network_ != nullptr;
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
      if (!HasNetwork()) return;  // the preferences may have changed
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
  FindRefined({});
}

void SelectionCanvas::FindRefined(const std::vector<Eigen::Vector2d>& stroke) {
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

// The first part is short: it shows if there is little room.
QString SelectionCanvas::Hint() const {
  if (IsFinding() && !drawing_ && !tuning_) return tr("Finding the outline  ·  Esc stops it");
  const QString combine = tr("  ·  Shift adds, Ctrl removes, Shift+Ctrl intersects");
  const size_t corners = HasCorners() ? drawing_->points.size() - 1 : 0;
  const bool by_corners = tool_ == SelectionTool::kPolygon || tool_ == SelectionTool::kScissors;
  if (by_corners && corners == 0 && editor_.AnyInside()) {  // Enter closes nothing any more
    return tr("Enter accepts what is selected  ·  click for another outline") + combine;
  }
  switch (tool_) {
    case SelectionTool::kBrush:
      return tr("Drag to paint, Ctrl erases  ·  [ ] size  ·  Shift+Ctrl intersects");
    case SelectionTool::kEraser:
      return tr("Drag to erase  ·  [ ] or Alt+wheel changes the size");
    case SelectionTool::kRectangle:
      return tr("Drag a rectangle") + combine;
    case SelectionTool::kLasso:
      return tr("Drag around it") + combine;
    case SelectionTool::kPolygon:
      return tr("Click corners, Enter closes  ·  Backspace takes one back");
    case SelectionTool::kScribble:
      if (scribbles_.empty()) {
        return tr("Draw a stroke on the object") +
               tr("  ·  its outline is found  ·  Shift adds it to what is selected");
      }
      if (scribbles_.size() == 1 && !scribbles_[0].outside) {
        return tr("Too much? Draw there with Ctrl") + tr("  ·  Enter accepts");
      }
      return tr("Draw what is missing, Ctrl removes") +
             tr("  ·  Enter accepts  ·  Ctrl+Z takes a stroke back");
    case SelectionTool::kObject:
      if (scribbles_.empty()) {
        return tr("Click the object") +
               tr("  ·  or drag a rectangle about it  ·  your network outlines it");
      }
      return tr("Click what is missing, Ctrl removes") +
             tr("  ·  Enter accepts  ·  Scribbles correct it, too");
    case SelectionTool::kWand:
      return tr("Click a surface  ·  drag right for more, left for less") + combine;
    case SelectionTool::kScissors:
      if (corners == 0) return tr("Click on the outline, then along it  ·  it follows the edges");
      if (corners < 3) {
        return tr("Click on along the outline") +
               tr("  ·  three points at least  ·  Backspace takes one back");
      }
      return tr("Click on, Enter closes  ·  Backspace takes one back");
    case SelectionTool::kSphere:
      return tr("Drag from the object  ·  as far as the sphere reaches") + combine;
    case SelectionTool::kBox:
      return tr("Drag across the object  ·  the box holds what was under the cursor") + combine;
    case SelectionTool::kLike:
      return tr("Click the color that stays") +
             tr("  ·  drag right or left for more or less  ·  Shift adds, Ctrl removes");
    case SelectionTool::kRefine:
      return tr("Drag along the border") +
             tr("  ·  it moves to the edges  ·  [ ] size  ·  Shift+F: the whole border");
  }
  return {};
}

}  // namespace retint
