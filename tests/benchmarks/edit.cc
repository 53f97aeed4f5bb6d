// SPDX-License-Identifier: BSD-3-Clause
// retint_bench_edit: a whole edit from one painted view to its preview: depth, cloud, registration,
// masks on all views, closed form. The process has only opened the scene. One JSON line per round;
// users wait for the first one, later ones find the views' geometries. Then one line for each
// pointwise operation: its preview with known masks and geometry.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/median.h"
#include "colmap_io/image_io.h"
#include "editing/color_preview.h"
#include "editing/edit_session.h"
#include "recolor/edit_text.h"
#include "tests/benchmarks/main.h"
#include "tests/support/closed_form.h"

namespace retint {
namespace {

double Now() {
  return std::chrono::duration<double, std::milli>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

struct Flags {
  std::filesystem::path workspace, splat, mask;
  std::string view, backend = "auto", complete = "near";
  double paint_slack = ProjectorOptions().paint_slack;
  int rounds = 3;
};

// Values for the operations' options. `to` and `palette` name the colors that they replace, so
// nothing is measured.
constexpr const char* kOperations[][2] = {{"tint", "#3060ff"},
                                          {"matrix", "0,1,0,0,0,0,1,0,1,0,0,0"},
                                          {"exposure", "0.7"},
                                          {"contrast", "1.3"},
                                          {"gamma", "1.4"},
                                          {"white_balance", "50,10"},
                                          {"saturation", "1.5"},
                                          {"invert", ""},
                                          {"gray", ""},
                                          {"adjust", "hue=90,chroma=0.9"},
                                          {"recolor", "#3060ff,from=#b07040"},
                                          {"gradient", "#101030,#a04020,#fff0d0"},
                                          {"palette", "#b07040=#3060ff,#405030"}};

// Closed form, upload and render, as the editor's after a change of a parameter; the medians of
// some, and their worst.
void Previews(EditSession& session, const PosedCamera& camera, const std::vector<float>& shares) {
  constexpr int kRepeats = 9;
  const std::shared_ptr<const GaussianModel> model(std::shared_ptr<void>(),
                                                   &session.scene().original());
  ColorPreview preview(model, session.scene().renderer().shared_backend());
  while (preview.MakeReady()) {
  }
  auto selection = std::make_shared<RegionSelection>();
  selection->shares = shares;
  RegionSet regions;
  regions.regions.resize(1);
  regions.regions[0].selection = selection;
  for (const auto& [name, text] : kOperations) {
    regions.regions[0].edit = ColorEdit{{ParseOperation(*FindOperationType(name), text)}, 1};
    std::vector<double> form, show, whole;
    for (int i = 0; i <= kRepeats; ++i) {
      const double start = Now();
      const ColorPreview::Colors colors = preview.Compose(regions, {});
      const double shown = Now();
      session.scene().renderer().SetSh(*colors.sh);
      session.scene().renderer().Render(camera);
      const double end = Now();
      if (i == 0) continue;  // the first
      form.push_back(shown - start);
      show.push_back(end - shown);
      whole.push_back(end - start);
    }
    std::printf(
        "{\"benchmark\": \"preview\", \"operation\": \"%s\", \"closed_form_ms\": %.2f, "
        "\"show_ms\": %.2f, \"whole_ms\": %.2f, \"worst_ms\": %.2f}\n",
        name, Median(form), Median(show), Median(whole),
        *std::max_element(whole.begin(), whole.end()));
  }
}

std::vector<float> Round(EditSession& session, const Flags& flags, int round) {
  Monitor monitor;
  const View& view = session.scene().workspace().RequireView(flags.view);
  const Camera camera = session.scene().reconstruction().Posed(view).camera;
  const PaintedView painted =
      session.selection().Paint(flags.view, ReadBrushMask(flags.mask, camera.width, camera.height));
  ProjectorOptions project;
  OptionList list;
  project.Describe(list);
  FindOption(list, "completion")->Set(flags.complete);
  project.paint_slack = flags.paint_slack;
  const StageClock& clock = session.scene().clock();
  const auto stages = [&] {
    return std::vector<double>{clock.Get("depth"), clock.Get("cloud"), clock.Get("registration")};
  };
  const std::vector<double> before = stages();
  const double start = Now();
  const SelectionResult selected = session.selection().Select({painted}, {}, monitor);
  const double projecting = Now();
  const ProjectedMasks masks =
      session.selection().Project(selected.cloud, {painted}, project, monitor);
  const double coloring = Now();
  const GaussianModel& model = session.scene().original();
  session.scene().renderer().SetSh(ClosedFormSh(session.scene().renderer().backend(), model.sh,
                                                model.NumShCoeffs(), masks.shares,
                                                ColorEdit::Tint({0.2f, 0.4f, 1})));
  session.scene().renderer().Render(painted.camera);
  const double end = Now();
  const std::vector<double> after = stages();
  std::printf(
      "{\"benchmark\": \"edit\", \"backend\": \"%s\", \"views\": %zu, \"round\": %d, "
      "\"depth_ms\": %.1f, \"cloud_ms\": %.1f, \"registration_ms\": %.1f, \"masks_ms\": %.1f, "
      "\"closed_form_ms\": %.1f, \"whole_ms\": %.1f}\n",
      session.scene().renderer().backend().Description().c_str(), masks.masks.size(), round,
      after[0] - before[0], after[1] - before[1], after[2] - before[2], coloring - projecting,
      end - coloring, end - start);
  return masks.shares;
}

int Main(int argc, char** argv) {
  Flags flags;
  CLI::App app("a whole edit from one painted view to its preview; one JSON line a round");
  app.add_option("--workspace", flags.workspace)->required();
  app.add_option("--splat", flags.splat)->required();
  app.add_option("--view", flags.view, "the painted view")->required();
  app.add_option("--mask", flags.mask, "its brush mask")->required();
  app.add_option("--backend", flags.backend, "auto, cpu or cuda");
  app.add_option("--complete", flags.complete, "off, near or all");
  app.add_option("--paint-slack", flags.paint_slack, "0: the painted border as it is");
  app.add_option("--rounds", flags.rounds);
  CLI11_PARSE(app, argc, argv);
  SessionOptions options;
  options.backend = flags.backend;
  Monitor monitor;
  const auto session = EditSession::Open(flags.workspace, flags.splat, options, monitor);
  std::vector<float> shares;
  for (int round = 0; round < flags.rounds; ++round) shares = Round(*session, flags, round);
  const View& view = session->scene().workspace().RequireView(flags.view);
  if (!shares.empty()) Previews(*session, session->scene().reconstruction().Posed(view), shares);
  return 0;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_bench_edit", retint::Main, argc, argv);
}
