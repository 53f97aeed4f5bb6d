// SPDX-License-Identifier: BSD-3-Clause
// retint palette: the main colors of painted or masked pixels.
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "recolor/palette.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  PaintArguments paint;
  MaskArguments masks;
  std::filesystem::path report, picture;
  int colors = 5;
};

uint8_t Byte(float value) { return static_cast<uint8_t>(std::lround(value * 255)); }

// The most frequent color on the left, each as wide as its share.
Image8 Swatches(const std::vector<PaletteColor>& palette) {
  constexpr int kWidth = 480, kHeight = 80;
  Image8 picture(kWidth, kHeight);
  for (int x = 0; x < kWidth; ++x) {
    size_t at = 0;
    float end = palette[0].share;
    while (at + 1 < palette.size() && (static_cast<float>(x) + 0.5F) / kWidth >= end) {
      end += palette[++at].share;
    }
    for (int y = 0; y < kHeight; ++y) {
      for (int c = 0; c < 3; ++c) {
        picture.data[static_cast<size_t>((y * kWidth + x) * 3 + c)] =
            Byte(palette[at].rgb[static_cast<size_t>(c)]);
      }
    }
  }
  return picture;
}

std::string ToJson(const std::vector<PaletteColor>& palette) {
  nlohmann::ordered_json json = {{"colors", nlohmann::ordered_json::array()}};
  for (size_t i = 0; i < palette.size(); ++i) {
    json["colors"].push_back({{"index", i + 1},
                              {"hex", Hex(palette[i].rgb)},
                              {"color", palette[i].rgb},
                              {"share", palette[i].share}});
  }
  return json.dump(2) + "\n";
}

RegionSelection ReadSelection(const Arguments& arguments, const EditSession& session, Run& run) {
  RegionSelection selection;
  if (arguments.masks.folder.empty()) {
    selection.source.painted = ReadPaint(arguments.paint, session.scene().pictures());
  } else {
    selection.masks = ReadMasksByName(arguments.masks, session.scene().pictures(), run)
                          .OfViews(session.scene().pictures(), session.scene().views());
  }
  return selection;
}

void Palette(const Arguments& arguments, Run& run) {
  CheckOption(arguments.masks.folder.empty() != arguments.paint.views.empty(),
              "give either --view and --mask, or --masks, and not both");
  if (!arguments.report.empty()) CheckOutput(arguments.report);
  if (!arguments.picture.empty()) CheckPicture(arguments.picture);
  const auto session = OpenSession(arguments.scene, 0, run);
  const std::vector<PaletteColor> palette =
      session->store().MeasurePalette(ReadSelection(arguments, *session, run), arguments.colors);
  if (palette.empty()) throw InputError("no pixel is selected");
  StagedOutput staged;
  if (!arguments.report.empty()) {
    staged.Add(arguments.report, [&](const auto& path) { WriteFile(path, ToJson(palette)); });
  }
  if (!arguments.picture.empty()) {
    staged.Add(arguments.picture, [&](const auto& path) { WritePng(path, Swatches(palette)); });
  }
  run.Commit(staged);
  run.FinishProgress();
  for (size_t i = 0; i < palette.size(); ++i) {
    run.Print(
        fmt::format("{:<13}{}   {:5.1f} %", i + 1, Hex(palette[i].rgb), 100 * palette[i].share));
  }
  if (palette.size() < static_cast<size_t>(arguments.colors)) {
    run.Print(fmt::format("{} of at most {} colors found: the rest are shades of these",
                          palette.size(), arguments.colors));
  }
}

}  // namespace

void AddPalette(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      AddVerb(app, globals, "palette", "List the main colors of an object, for --palette");
  AddScene(verb, globals, arguments->scene);
  AddPaint(verb, arguments->paint, /*required=*/false);
  Everyday(verb, AddMasks(verb, arguments->masks));
  Everyday(verb, verb->add_option("--colors", arguments->colors, "Colors to look for")
                     ->check(CLI::Range(1, kMaxPaletteColors)));
  Everyday(verb, AddPath(verb, "--report", arguments->report, "Colors to write (.json)"));
  Everyday(verb, AddPath(verb, "--picture", arguments->picture, "Swatches to write (.png)"));
  AddExamples(verb, {"retint palette sample --masks sample/truth/masks/box --colors 3"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Palette(*arguments, run); }; });
}

}  // namespace retint::cli
