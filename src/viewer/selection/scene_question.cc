// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/scene_question.h"

#include <exception>
#include <optional>
#include <utility>

#include "viewer/scene/scene_controller.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/widgets/banner.h"

namespace retint {
namespace {

constexpr int kRestMs = 500;

}  // namespace

SceneQuestion::SceneQuestion(SceneController* controller, SelectionMode* mode)
    : QObject(mode), controller_(controller), mode_(mode), banner_(new Banner(&mode->canvas())) {
  rest_.setSingleShot(true);
  rest_.setInterval(kRestMs);
  connect(&rest_, &QTimer::timeout, this, &SceneQuestion::AskTheScene);
  connect(&mode_->canvas(), &SelectionCanvas::edited, this, &SceneQuestion::Look);
  connect(mode_, &SelectionMode::ready, this, &SceneQuestion::Look);  // strokes of the last visit
}

SceneQuestion::~SceneQuestion() {
  if (running_) running_->Cancel();
}

bool SceneQuestion::IsAsking() const { return banner_->IsShown(); }

void SceneQuestion::Withdraw() {
  rest_.stop();
  if (running_) std::exchange(running_, nullptr)->Cancel();
  mode_->canvas().SetHatched({});
  banner_->Close();
}

void SceneQuestion::Look() {
  Withdraw();
  // The scene makes masks only of views, and a free camera is not a view.
  const bool asks = mode_->state() == SelectionMode::State::kPainting &&
                    mode_->canvas().undecided() && !mode_->entry().view.isEmpty();
  if (asks) rest_.start();
}

void SceneQuestion::AskTheScene() {
  const auto undecided = mode_->canvas().undecided();
  if (!undecided) return;
  const auto monitor = running_ = std::make_shared<Monitor>();
  const auto answer = std::make_shared<std::optional<SceneAnswer>>();
  controller_->Run(
      {},
      [=, own = mode_->canvas().editor().mask(), name = mode_->entry().view.toStdString()](
          EditSession& session, Monitor&) {
        try {
          monitor->ThrowIfCancelled();
          const Pictures pictures = session.scene().pictures();
          const UserPicture* picture = pictures.Find(name);
          if (picture && picture->width == own.width && picture->height == own.height) {
            *answer = AskScene(session.selection(), *picture, own, *undecided, *monitor);
          }
        } catch (const std::exception&) {
          // Nobody waits for this answer: without it, the user's outline counts.
        }
      },
      [=, this] {
        if (running_ != monitor) return;  // it was withdrawn
        running_.reset();
        if (*answer && (*answer)->IsWorthAsking()) AskTheUser(**answer);
        Q_EMIT answered();
      });
}

void SceneQuestion::AskTheUser(const SceneAnswer& answer) {
  mode_->canvas().SetHatched(answer.differs);
  banner_->Show(
      {.text = tr("Other views show %1 % of this outline otherwise (hatched). Whose outline holds?")
                   .arg(100 * answer.changed, 0, 'f', 0),
       .answers = {{tr("Keep mine"), tr("The outline stays as you see it (Enter accepts it)")},
                   {tr("Use the scene's"),
                    tr("The outline becomes the one of the other views (Ctrl+Z undoes)"),
                    [this, mask = answer.mask] {
                      SelectionCanvas& canvas = mode_->canvas();
                      canvas.Edited(canvas.editor().Fill(mask, Combine::kReplace));
                    }}},
       .closed = [this] { mode_->canvas().SetHatched({}); }});
}

}  // namespace retint
