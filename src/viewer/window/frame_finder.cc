// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/frame_finder.h"

#include <system_error>
#include <utility>

#include "base/error.h"
#include "opening/ocio_space.h"
#include "splat_io/splat_io.h"
#include "viewer/scene/failure_text.h"
#include "viewer/scene/post.h"
#include "viewer/scene/scene_worker.h"

namespace retint {

struct FrameFinder::Splat {
  std::filesystem::path path;
  std::filesystem::file_time_type time;
  GaussianModel model;

  const GaussianModel& Read(const OpenRequest& asked, Monitor& monitor) {
    const std::filesystem::path& wanted = asked.splat;
    std::error_code none;
    const auto changed = std::filesystem::last_write_time(wanted, none);
    if (path != wanted || time != changed) {
      *this = {};
      model = ReadSplat(wanted, monitor);
      path = wanted;
      time = changed;
    }
    model.traits.chosen_space = nullptr;
    ChooseSpace(asked.options.space, model);
    return model;
  }
};

FrameFinder::FrameFinder(QObject* parent)
    : QObject(parent),
      splat_(std::make_shared<Splat>()),
      worker_(std::make_unique<SceneWorker>(
          [this](const Progress& progress) {
            // Reading is fast; the stages "points" and "align" alternate.
            if (progress.stage != "align") return;
            retint::Post(this, [this, at = progress.fraction] { Q_EMIT progressed(at); });
          },
          [](const QString&) {})) {}

FrameFinder::~FrameFinder() = default;

template <typename Ask, typename Answer>
void FrameFinder::Post(const OpenRequest& request, Ask ask, Answer answer) {
  worker_->Cancel();
  using Result =
      decltype(ask(request, std::declval<const GaussianModel&>(), std::declval<Monitor&>()));
  const auto result = std::make_shared<Result>();
  const auto is_read = std::make_shared<bool>(false);
  const auto on_gui = [this, question = ++question_](auto tell) {
    retint::Post(this, [this, question, tell] {
      if (question == question_) tell();
    });
  };
  worker_->Post({tr("Comparing"),
                 [=, splat = splat_](Monitor& monitor) {
                   const GaussianModel& model = splat->Read(request, monitor);
                   *is_read = true;
                   *result = ask(request, model, monitor);
                 },
                 [=, this](std::exception_ptr error) {
                   try {
                     if (error) std::rethrow_exception(error);
                     on_gui([=] { answer(*result); });
                   } catch (const Cancelled&) {
                   } catch (const std::exception& failure) {
                     on_gui([this, why = FailureText(failure), read = *is_read] {
                       Q_EMIT(read ? failed(why) : unreadable(why));
                     });
                   }
                 }});
}

void FrameFinder::Check(const OpenRequest& request) {
  Post(
      request,
      [](const OpenRequest& asked, const GaussianModel& model, Monitor& monitor) {
        EditSession session(OpenWorkspace(asked.workspace, asked.options), model, asked.options);
        return CheckScene(session.scene(), monitor);
      },
      [this](const SceneCheck& check) { Q_EMIT checked(check); });
}

void FrameFinder::Align(const OpenRequest& request) {
  Post(
      request,
      [](const OpenRequest& asked, const GaussianModel& model, Monitor& monitor) {
        SessionOptions as_it_is = asked.options;
        as_it_is.world_from_splat = {};
        AlignOptions options;
        options.given = asked.options.world_from_splat;
        return retint::Align(OpenBackend(asked.options.backend),
                             OpenWorkspace(asked.workspace, as_it_is), model,
                             FindTransformFiles(asked.workspace, asked.splat), options, monitor);
      },
      [this](const AlignResult& result) { Q_EMIT aligned(result); });
}

void FrameFinder::Cancel() {
  ++question_;
  worker_->Cancel();
  worker_->Post({{}, [splat = splat_](Monitor&) { *splat = {}; }, {}});
}

}  // namespace retint
