// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/stroke_preview.h"

#include <algorithm>
#include <span>
#include <utility>

#include "base/stopwatch.h"
#include "selection/paint_shares.h"
#include "session/photo_paint.h"
#include "viewer/photo_loader.h"
#include "viewer/post.h"
#include "viewer/selection/selection_mode.h"

namespace retint {
namespace {

constexpr uint8_t kInside = 128;  // of a soft mask
// Of a round. What is left for a later one then comes first: of a large scene a stroke shows in one
// picture after the other, and whoever accepts need not wait for all of them.
constexpr double kRoundMs = 400;

// A picture that is laid over the view's: the inside in `color`, its border opaque.
QImage Overlay(const Mask& mask, const QColor& color) {
  QImage image(mask.width, mask.height, QImage::Format_ARGB32_Premultiplied);
  image.fill(Qt::transparent);
  const auto inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < mask.width && y < mask.height && mask(x, y) >= kInside;
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

}  // namespace

// One answer of the worker's, as it comes to be.
struct StrokePreview::Round {
  PaintedView paint;
  std::shared_ptr<const RegionSelection> base;
  std::vector<std::string> views;  // pictures, by name
  QColor color;
  size_t shown = 0;  // of the views
};

StrokePreview::StrokePreview(SceneController* controller, SelectionMode* mode, QObject* parent)
    : QObject(parent), controller_(controller), mode_(mode) {
  connect(&mode_->canvas(), &SelectionCanvas::edited, this, &StrokePreview::Ask);
  for (const auto over : {&SelectionMode::left, &SelectionMode::ready}) {
    connect(mode_, over, this, &StrokePreview::Ask);
  }
  connect(mode_, &SelectionMode::accepted, this, &StrokePreview::Ask);
  connect(controller_, &SceneController::closed, this, [this] {
    busy_ = false;  // nobody answers for a scene that is gone
    Ask();
  });
}

void StrokePreview::Ask() {
  const bool painting = controller_->IsOpen() && visible_ &&
                        mode_->state() == SelectionMode::State::kPainting &&
                        mode_->canvas().editor().AnyInside();
  if (!painting) {
    again_ = false;
    // What is being accepted stays until it is.
    if (mode_->state() == SelectionMode::State::kComputing) return;
    if (std::exchange(any_, false)) Q_EMIT cleared();
    return;
  }
  if (busy_) {
    again_ = true;
    return;
  }
  const auto round = std::make_shared<Round>();
  round->views = visible_();
  if (round->views.empty()) return;
  first_ %= round->views.size();
  std::rotate(round->views.begin(), round->views.begin() + std::ptrdiff_t(first_),
              round->views.end());
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
          std::span<const float> base =
              round->base ? std::span<const float>(round->base->shares) : std::span<const float>();
          std::vector<float> shares;
          for (const PaintedView& paint : OnViews(session.workspace(), round->paint)) {
            shares = PaintShares(session.renderer(), paint.camera, paint.mask, base);
            base = shares;
          }
          for (const std::string& name : round->views) {
            if (clock.Milliseconds() > kRoundMs && round->shown > 0) break;
            ++round->shown;
            const UserPicture* picture = facts->FindPicture(name);
            if (!picture) continue;
            const SmallPicture small = SmallPictureOf(*facts, *picture);
            const Mask mask =
                DrawThrough(small.lens.get(), small.camera, [&](const PosedCamera& face) {
                  return RenderShares(session.renderer(), face, shares, ProjectorOptions());
                });
            const QImage overlay = Overlay(mask, round->color);
            Post(this, [this, facts, name, overlay] {
              if (any_ && facts == controller_->facts()) {
                Q_EMIT shown(QString::fromStdString(name), overlay);
              }
            });
          }
        } catch (const std::exception&) {
          // A look ahead that nobody waits for; accepting says what is wrong.
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
