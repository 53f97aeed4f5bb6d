// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/stroke_preview.h"

#include <algorithm>
#include <span>
#include <utility>

#include "base/stopwatch.h"
#include "opening/photo_paint.h"
#include "scene/mask_pixels.h"
#include "selection/paint_shares.h"
#include "viewer/canvas/photo_loader.h"
#include "viewer/scene/post.h"
#include "viewer/selection/selection_mode.h"

namespace retint {
namespace {

// Longest round. Remaining views come first in the next one. In a large scene, a stroke shows in
// one picture after the other, so that accepting does not wait for all.
constexpr double kRoundMs = 400;
// Side of a veil in pixels, about that of a canvas; larger pictures are rendered smaller.
constexpr int kVeilSide = 960;

// A picture over the view's: the inside in `color`, with an opaque border.
QImage Overlay(const Mask& mask, const QColor& color) {
  QImage image(mask.width, mask.height, QImage::Format_ARGB32_Premultiplied);
  image.fill(Qt::transparent);
  const auto inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < mask.width && y < mask.height && IsInside(mask(x, y));
  };
  const QRgb opaque = color.rgba();
  const QRgb faint = qPremultiply(qRgba(color.red(), color.green(), color.blue(), 110));
  for (int y = 0; y < mask.height; ++y) {
    QRgb* row = reinterpret_cast<QRgb*>(image.scanLine(y));
    for (int x = 0; x < mask.width; ++x) {
      if (!inside(x, y)) continue;
      const bool within =
          inside(x - 1, y) && inside(x + 1, y) && inside(x, y - 1) && inside(x, y + 1);
      row[x] = within ? faint : opaque;
    }
  }
  return image;
}

std::vector<float> SharesOf(EditSession& session, const PaintedView& painted,
                            const RegionSelection* before) {
  std::vector<float> shares;
  std::span<const float> base;
  if (before) base = before->shares;
  for (const PaintedView& view : OnViews(session.scene().workspace(), painted)) {
    shares = PaintShares(session.scene().renderer(), view.camera, view.mask, base);
    base = shares;
  }
  return shares;
}

// By nearest pixels.
Mask Enlarged(const Mask& small, int width, int height) {
  if (small.width == width && small.height == height) return small;
  std::vector<int> columns;
  for (int x = 0; x < width; ++x) columns.push_back(x * small.width / width);
  Mask mask(width, height);
  for (int y = 0; y < height; ++y) {
    const int row = y * small.height / height;
    for (int x = 0; x < width; ++x) mask(x, y) = small(columns[size_t(x)], row);
  }
  return mask;
}

Mask Lifted(Renderer& renderer, const PosedCamera& view, const std::vector<float>& shares) {
  const int width = view.camera.width, height = view.camera.height;
  const double scale = std::min(1.0, double(kVeilSide) / std::max(width, height));
  return Enlarged(RenderShares(renderer, Scaled(view, scale), shares, ProjectorOptions()), width,
                  height);
}

// The selection by the Gaussians' shares, in the pixels of the painted picture.
Mask VeilOf(EditSession& session, const PaintedView& painted, const std::vector<float>& shares) {
  Renderer& renderer = session.scene().renderer();
  if (!IsOnPhoto(painted)) return Lifted(renderer, painted.camera, shares);
  const Reconstruction& model = session.scene().workspace().reconstruction;
  std::vector<Mask> faces;
  for (const std::string& name : PaintedNames(session.scene().workspace(), painted)) {
    faces.push_back(Lifted(renderer, model.Posed(*model.FindView(name)), shares));
  }
  return FromViews(session.scene().workspace(), painted, std::move(faces));
}

}  // namespace

// One round of the worker's answers.
struct StrokePreview::Round {
  PaintedView paint;
  std::shared_ptr<const RegionSelection> base;
  std::vector<std::string> views;  // pictures, by name
  QColor color;
  size_t shown = 0;           // number of views done
  std::vector<float> shares;  // for the paint, once computed
};

StrokePreview::StrokePreview(SceneController* controller, SelectionMode* mode, QObject* parent)
    : QObject(parent), controller_(controller), mode_(mode) {
  connect(&mode_->canvas(), &SelectionCanvas::edited, this, &StrokePreview::Ask);
  for (const auto over : {&SelectionMode::left, &SelectionMode::ready}) {
    connect(mode_, over, this, &StrokePreview::Ask);
  }
  connect(mode_, &SelectionMode::accepted, this, &StrokePreview::Ask);
  connect(controller_, &SceneController::closed, this, [this] {
    busy_ = false;  // a closed scene gives no answer
    Ask();
  });
}

void StrokePreview::SetEnabled(bool enabled) {
  enabled_ = enabled;
  Ask();
}

void StrokePreview::Ask() {
  const bool painting = controller_->IsOpen() && enabled_ &&
                        mode_->state() == SelectionMode::State::kPainting &&
                        mode_->canvas().editor().AnyInside();
  if (!painting) {
    again_ = false;
    // During accepting, the preview stays.
    if (enabled_ && mode_->state() == SelectionMode::State::kComputing) return;
    if (std::exchange(any_, false)) {
      mode_->canvas().veil().Fade();
      Q_EMIT cleared();
    }
    return;
  }
  if (busy_) {
    again_ = true;
    return;
  }
  const auto round = std::make_shared<Round>();
  if (visible_) round->views = visible_();
  if (!round->views.empty()) {
    first_ %= round->views.size();
    std::rotate(round->views.begin(), round->views.begin() + std::ptrdiff_t(first_),
                round->views.end());
  }
  const SelectionEntry& entry = mode_->entry();
  round->paint = {entry.view.toStdString(), entry.camera, mode_->canvas().editor().mask()};
  const Region* region = entry.region ? controller_->regions().Find(entry.region) : nullptr;
  if (region) round->base = region->selection;
  round->color = mode_->canvas().overlay_color();
  Take(round);
}

void StrokePreview::Take(const std::shared_ptr<Round>& round) {
  const auto facts = controller_->facts();
  busy_ = any_ = true;
  again_ = false;
  const bool asked = controller_->Run(
      {},
      [this, facts, round](EditSession& session, Monitor&) {
        const Stopwatch clock;
        try {
          if (round->shares.empty()) {
            round->shares = SharesOf(session, round->paint, round->base.get());
            Post(this, [this, facts, veil = VeilOf(session, round->paint, round->shares)] {
              if (any_ && facts == controller_->facts()) mode_->canvas().veil().Show(veil);
            });
          }
          const std::vector<float>& shares = round->shares;
          for (const std::string& name : round->views) {
            if (clock.Milliseconds() > kRoundMs && round->shown > 0) break;
            ++round->shown;
            const UserPicture* picture = facts->FindPicture(name);
            if (!picture) continue;
            const SmallPicture small = SmallPictureOf(*facts, *picture);
            const Mask mask =
                DrawThrough(small.lens.get(), small.camera, [&](const PosedCamera& face) {
                  return RenderShares(session.scene().renderer(), face, shares, ProjectorOptions());
                });
            const QImage overlay = Overlay(mask, round->color);
            Post(this, [this, facts, name, overlay] {
              if (any_ && facts == controller_->facts()) {
                Q_EMIT shown(QString::fromStdString(name), overlay);
              }
            });
          }
        } catch (const std::exception&) {
          // Only a preview: the fault shows when the user accepts.
          round->shown = round->views.size();
        }
      },
      [this, round] {
        busy_ = false;
        ++rounds_;
        first_ += round->shown;
        if (again_) {
          Ask();
        } else if (round->shown < round->views.size() && any_) {
          round->views.erase(round->views.begin(),
                             round->views.begin() + std::ptrdiff_t(round->shown));
          round->shown = 0;
          Take(round);
        } else {
          Q_EMIT finished();
        }
      });
  if (!asked) busy_ = false;
}

}  // namespace retint
