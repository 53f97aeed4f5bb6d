// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/scene_results.h"

#include <algorithm>
#include <utility>

#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "opening/scene_check.h"
#include "reporting/export.h"
#include "viewer/scene/scene_controller.h"

namespace retint {
namespace {

constexpr size_t kGlancedViews = 4;
constexpr int kBetween = 8;  // white pixels between the sides of a comparison

// The colors of an exported splat, which ignore solo().
FloatArray ColorsToExport(EditSession& session) {
  session.refits().CollectFits();
  return session.refits().CurrentSh();
}

std::string EditKeyOf(const RegionSet& regions, RegionId id) {
  const auto found = std::ranges::find(regions.regions, id, &Region::id);
  if (found == regions.regions.end()) return {};
  return regions.FitKey(size_t(found - regions.regions.begin()), RefitJob());
}

// The quality of an edit, and the key of that edit.
struct Measured {
  QualityReport report;
  std::string edit;
};

}  // namespace

SceneResults::SceneResults(SceneController* scene) : QObject(scene), scene_(*scene) {}

std::string SceneResults::EditKey(RegionId id) const { return EditKeyOf(scene_.regions(), id); }

void SceneResults::Evaluate(RegionId id) {
  measuring_ = scene_.Ask(
      tr("Measuring quality"),
      [=, target = scene_.colors().refit_job().target](EditSession& session, Monitor& monitor) {
        session.refits().CollectFits();
        return Measured{EvaluateRegion(session, id, target, monitor),
                        EditKeyOf(session.store().regions(), id)};
      },
      [=, this](const Measured& measured) {
        const bool changed = scene_.regions().Find(id) && EditKey(id) != measured.edit;
        if (changed) return Evaluate(id);  // the edit changed in the meantime
        Q_EMIT qualityReady(id, measured.report);
      });
}

void SceneResults::Glance(RegionId id) {
  scene_.Ask(
      {},
      [=, target = scene_.colors().refit_job().target](EditSession& session, Monitor& monitor) {
        session.refits().CollectFits();
        if (!session.store().regions().Find(id)) return Measured();  // deleted in the meantime
        return Measured{EvaluateRegion(session, id, target, monitor, kGlancedViews),
                        EditKeyOf(session.store().regions(), id)};
      },
      [=, this](const Measured& measured) {
        const bool is_its = measured.report.train.views > 0 && EditKey(id) == measured.edit;
        if (is_its) Q_EMIT qualityGlanced(id, measured.report);
      });
}

void SceneResults::Check() {
  scene_.Ask(
      {},
      [](EditSession& session, Monitor& monitor) { return CheckScene(session.scene(), monitor); },
      [this](const SceneCheck& check) { Q_EMIT sceneChecked(check.warnings); });
}

void SceneResults::RunWrite(const QString& label, const std::filesystem::path& path, Work work,
                            std::function<void()> done) {
  scene_.Run(label, std::move(work), [=, this] {
    Q_EMIT written(QString::fromStdString(path.string()));
    if (done) done();
  });
}

void SceneResults::WriteSplat(const std::filesystem::path& path) {
  RunWrite(tr("Saving the splat"), path, [=](EditSession& session, Monitor& monitor) {
    CheckOutput(path);
    session.refits().CollectFits();
    session.WriteSplat(path, monitor);
  });
}

void SceneResults::WriteMasks(const std::filesystem::path& folder, RegionId id) {
  RunWrite(tr("Saving masks"), folder, [=](EditSession& session, Monitor& monitor) {
    StagedOutput output;
    output.AddFolder(folder, [&](const auto& staged) { session.WriteMasks(staged, id, monitor); });
    output.Commit();
  });
}

void SceneResults::WriteReport(const std::filesystem::path& path) {
  RunWrite(tr("Saving the report"), path,
           [=, job = scene_.colors().refit_job()](EditSession& session, Monitor& monitor) {
             session.refits().CollectFits();
             ExportReport(session, job, path, monitor);
           });
}

void SceneResults::WriteViews(const std::filesystem::path& folder,
                              const std::vector<std::string>& names) {
  RunWrite(tr("Saving views"), folder, [=](EditSession& session, Monitor& monitor) {
    std::vector<const View*> views = session.scene().reconstruction().ViewsByName();
    if (!names.empty()) {
      std::erase_if(views, [&](const View* view) {
        return std::find(names.begin(), names.end(), view->name) == names.end();
      });
    }
    ExportViews(session, views, ColorsToExport(session), folder, monitor);
  });
}

void SceneResults::WriteFrames(const std::filesystem::path& folder,
                               std::vector<PosedCamera> cameras, std::function<void()> done,
                               std::vector<std::filesystem::path> replaced) {
  RunWrite(
      tr("Saving frames"), folder,
      [=, cameras = std::move(cameras), replaced = std::move(replaced)](EditSession& session,
                                                                        Monitor& monitor) {
        ExportFrames(session, cameras, ColorsToExport(session), folder, monitor, replaced);
      },
      std::move(done));
}

void SceneResults::WriteComparison(const std::filesystem::path& path, const PosedCamera& camera,
                                   std::shared_ptr<const LensPicture> lens) {
  RunWrite(tr("Saving the comparison"), path, [=](EditSession& session, Monitor&) {
    CheckOutput(path);
    const int width = camera.camera.width, height = camera.camera.height;
    Image both(2 * width + kBetween, height);
    std::fill(both.data.begin(), both.data.end(), 1.0F);
    const FloatArray edited = ColorsToExport(session);
    int left = 0;
    for (const FloatArray* colors : {&session.scene().original().sh, &edited}) {
      session.scene().renderer().SetSh(*colors);
      const Image side = DrawThrough(lens.get(), camera, [&](const PosedCamera& face) {
        return std::move(session.scene().renderer().Render(face).rgb);
      });
      for (int y = 0; y < height; ++y) {
        std::copy_n(side.data.begin() + std::ptrdiff_t(side.Index(0, y)), 3 * width,
                    both.data.begin() + std::ptrdiff_t(both.Index(left, y)));
      }
      left += width + kBetween;
    }
    WritePng(path, both);
  });
}

}  // namespace retint
