// SPDX-License-Identifier: BSD-3-Clause
// retint mask: the mask of one view from strokes, a wand, scissors, a solid or a color.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "colmap_io/png_text.h"
#include "retint/common.h"
#include "retint/help.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"
#include "selecting/view_mask.h"
#include "selection/mask_tools/scribbles.h"

namespace retint::cli {
namespace {

constexpr std::string_view kInside = "--scribble", kOutside = "--scribble-outside";

struct Arguments {
  SceneArguments scene;
  std::string view, image = "render";
  std::filesystem::path mask, output;
  std::vector<std::string> inside, outside, points, points_outside;
  std::string network, rectangle, wand, scissors, sphere, box, like;
  double brush = 6;
  int snap = 0;
  bool alone = false;
};

// "1,2.5,3": as many numbers as the caller then asks for.
std::optional<std::vector<double>> ParseNumbers(std::string_view text) {
  std::vector<double> numbers;
  while (true) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
    numbers.push_back(value);
    text.remove_prefix(size_t(end - text.data()));
    if (text.empty()) return numbers;
    if (text[0] != ',') return std::nullopt;
    text.remove_prefix(1);
  }
}

std::vector<double> Numbers(const std::string& flag, const std::string& text, size_t least,
                            size_t most, const char* form) {
  const auto numbers = ParseNumbers(text);
  if (!numbers || numbers->size() < least || numbers->size() > most) {
    throw OptionError(flag + " " + text + ": is not " + form);
  }
  return *numbers;
}

int Pixel(const std::string& flag, double value) {
  CheckOption(value >= 0 && value < 1e6, flag + ": a pixel's position must not be below 0");
  return static_cast<int>(value);
}

// The strokes of a flag: pictures, and polylines X,Y,X,Y...
struct StrokeFlag {
  std::string_view name;
  const std::vector<std::string>& values;
  double brush;
};

Mask DrawValue(const StrokeFlag& flag, const std::string& value, const Pictures& pictures,
               const UserPicture& view) {
  const auto numbers = ParseNumbers(value);
  if (!numbers) return pictures.ReadStrokesOf(view, value, flag.name == kInside);
  CheckOption(numbers->size() % 2 == 0, fmt::format("{} {}: is not X,Y,X,Y...", flag.name, value));
  std::vector<Eigen::Vector2d> points;
  for (size_t i = 0; i < numbers->size(); i += 2) {
    points.emplace_back((*numbers)[i], (*numbers)[i + 1]);
  }
  Mask drawn(view.width, view.height);
  DrawStroke(points, flag.brush, &drawn);
  CheckOption(AnySet(drawn), fmt::format("{} {}: lies outside view {}, which is {}x{} pixels",
                                         flag.name, value, view.name, view.width, view.height));
  return drawn;
}

// All strokes of a flag on one mask.
Mask Strokes(const StrokeFlag& flag, const Pictures& pictures, const UserPicture& view) {
  Mask all(view.width, view.height);
  for (const std::string& value : flag.values) {
    const Mask drawn = DrawValue(flag, value, pictures, view);
    for (size_t p = 0; p < all.data.size(); ++p) {
      all.data[p] = std::max(all.data[p], drawn.data[p]);
    }
  }
  return all;
}

// Says how many pixels of strokes lie beside the view, where they are cut.
void WarnOfCutStrokes(const StrokeFlag& flag, const UserPicture& view, Run& run) {
  const Eigen::Vector2d size(view.width, view.height);
  size_t cut = 0;
  for (const std::string& value : flag.values) {
    const auto numbers = ParseNumbers(value);
    if (!numbers) continue;  // a picture of the view's size
    std::vector<Eigen::Vector2d> points;
    for (size_t i = 0; i < numbers->size(); i += 2) {
      points.emplace_back((*numbers)[i], (*numbers)[i + 1]);
    }
    // The view in the middle of nine.
    Mask inside(view.width, view.height), around(3 * view.width, 3 * view.height);
    DrawStroke(points, flag.brush, &inside);
    for (Eigen::Vector2d& point : points) point += size;
    DrawStroke(points, flag.brush, &around);
    cut += CountInside(around) - CountInside(inside);
  }
  if (cut == 0) return;
  run.Warn(
      fmt::format("{} pixels of {} lie outside view {}, which is {}x{} pixels, and are left out",
                  cut, flag.name, view.name, view.width, view.height));
}

// OptionError naming two strokes that cross. A picture that covers most of the view is no stroke:
// MaskFromScribbles() reports that.
void CheckCrossings(const ViewMaskRequest& request, const StrokeFlag& inside,
                    const StrokeFlag& outside, const Pictures& pictures, const UserPicture& view) {
  if (request.inside.Empty()) return;  // a network finds the inside
  if (2 * CountInside(request.outside) > request.outside.NumPixels()) return;
  size_t pixel = 0;
  while (!(IsInside(request.inside.data[pixel]) && IsInside(request.outside.data[pixel]))) {
    if (++pixel == request.inside.data.size()) return;
  }
  const auto stroke_at = [&](const StrokeFlag& flag) {
    const auto value = std::ranges::find_if(flag.values, [&](const std::string& one) {
      return IsInside(DrawValue(flag, one, pictures, view).data[pixel]);
    });
    constexpr size_t kShown = 40;
    return fmt::format("{} {}", flag.name, value->substr(0, kShown)) +
           (value->size() > kShown ? "..." : "");
  };
  const size_t width = static_cast<size_t>(view.width);
  throw OptionError(fmt::format("{} and {} cross at pixel {},{}: move or shorten one of them",
                                stroke_at(inside), stroke_at(outside), pixel % width,
                                pixel / width));
}

// Which object the network outlines.
ObjectPrompt ToPrompt(const Arguments& arguments) {
  const auto points = [](const std::string& flag, const std::vector<std::string>& values) {
    std::vector<Eigen::Vector2d> all;
    for (const std::string& value : values) {
      const auto at = Numbers(flag, value, 2, 2, "X,Y");
      all.emplace_back(at[0], at[1]);
    }
    return all;
  };
  ObjectPrompt prompt;
  prompt.inside = points("--point", arguments.points);
  prompt.outside = points("--point-outside", arguments.points_outside);
  if (arguments.rectangle.empty()) return prompt;
  const auto at = Numbers("--rectangle", arguments.rectangle, 4, 4, "X,Y,X,Y");
  const Eigen::Vector2d a(at[0], at[1]), b(at[2], at[3]);
  prompt.rectangle = {a.cwiseMin(b), a.cwiseMax(b)};
  return prompt;
}

// The tool that selects, and its limits.
ViewMaskRequest ToRequest(const Arguments& arguments, const Pictures& pictures,
                          const UserPicture& view) {
  ViewMaskRequest request;
  request.photo = arguments.image == "photo";
  request.snap_edge = arguments.snap;
  request.this_view_alone = arguments.alone;
  if (!arguments.network.empty()) request.network = MakeMaskNetwork(arguments.network);
  request.prompt = ToPrompt(arguments);
  const StrokeFlag inside{kInside, arguments.inside, arguments.brush};
  const StrokeFlag outside{kOutside, arguments.outside, arguments.brush};
  if (!arguments.mask.empty()) {
    request.mask = pictures.ReadBrushOf(view, arguments.mask);
  }
  if (!arguments.inside.empty()) {
    request.inside = Strokes(inside, pictures, view);
  }
  if (!arguments.outside.empty()) {
    request.outside = Strokes(outside, pictures, view);
    CheckCrossings(request, inside, outside, pictures, view);
  }
  if (!arguments.wand.empty()) {
    const auto at = Numbers("--wand", arguments.wand, 2, 5, "X,Y[,COLOR[,DEPTH[,NORMAL]]]");
    WandOptions& wand = request.wand.emplace();
    wand.x = Pixel("--wand", at[0]);
    wand.y = Pixel("--wand", at[1]);
    if (at.size() > 2) wand.color = at[2];
    if (at.size() > 3) wand.depth = at[3];
    if (at.size() > 4) wand.normal = at[4];
  }
  if (!arguments.scissors.empty()) {
    const auto at = Numbers("--scissors", arguments.scissors, 6, 100'000, "X,Y,X,Y,X,Y...");
    CheckOption(at.size() % 2 == 0, "--scissors " + arguments.scissors + ": is not X,Y,X,Y,X,Y...");
    for (size_t i = 0; i < at.size(); i += 2) {
      request.scissors.emplace_back(Pixel("--scissors", at[i]), Pixel("--scissors", at[i + 1]));
    }
  }
  if (!arguments.sphere.empty()) {
    const auto at = Numbers("--sphere", arguments.sphere, 4, 4, "X,Y,Z,RADIUS");
    request.sphere = {{at[0], at[1], at[2]}, at[3]};
  }
  if (!arguments.box.empty()) {
    const auto at = Numbers("--box", arguments.box, 6, 6, "X,Y,Z,X,Y,Z");
    request.box = {{at[0], at[1], at[2]}, {at[3], at[4], at[5]}};
  }
  if (!arguments.like.empty()) {
    const auto at = Numbers("--like", arguments.like, 2, 3, "X,Y[,TOLERANCE]");
    auto& like = request.like.emplace();
    like.x = Pixel("--like", at[0]);
    like.y = Pixel("--like", at[1]);
    if (at.size() > 2) like.tolerance = at[2];
  }
  return request;
}

void CheckArguments(const Arguments& arguments) {
  const bool outlined = !arguments.network.empty() || !arguments.inside.empty();
  const int sources =
      !arguments.mask.empty() + outlined + !arguments.wand.empty() + !arguments.scissors.empty();
  const bool limited =
      !arguments.sphere.empty() || !arguments.box.empty() || !arguments.like.empty();
  CheckOption(sources <= 1, "give one of --mask, --scribble, --network, --wand and --scissors");
  CheckOption(sources == 1 || limited,
              "there is nothing to select by: give --mask, --scribble, --network, --wand, "
              "--scissors, --sphere, --box or --like");
  const bool prompted = !arguments.points.empty() || !arguments.points_outside.empty() ||
                        !arguments.rectangle.empty();
  CheckOption(!prompted || !arguments.network.empty(),
              "--point, --point-outside and --rectangle need --network");
  CheckOption(arguments.outside.empty() || outlined,
              "--scribble-outside needs --scribble or --network");
  CheckOption(!arguments.alone || outlined, "--this-view-alone needs --scribble or --network");
  CheckPicture(arguments.output);
}

// Whose outline strokes have, where the scene has another one than the view alone.
void PrintWhose(const std::optional<SceneAnswer>& asked, const Run& run) {
  if (!asked || asked->changed < SceneAnswer::kNoticed) return;
  if (!asked->may_stand) {
    run.Print("the other views show another outline there: yours was kept");
    return;
  }
  run.Print(
      fmt::format("the other views decided {:.0f} % of the outline, which your strokes left "
                  "open; --this-view-alone keeps what this view shows",
                  100 * asked->changed));
}

void MakeMask(const Arguments& arguments, Run& run) {
  CheckArguments(arguments);
  const auto session = OpenSession(arguments.scene, 0, run);
  const Pictures pictures = session->scene().pictures();
  const UserPicture& view = pictures.RequireOne(arguments.view);
  std::optional<SceneAnswer> asked;
  const ViewMaskRequest request = ToRequest(arguments, pictures, view);
  WarnOfCutStrokes({kInside, arguments.inside, arguments.brush}, view, run);
  WarnOfCutStrokes({kOutside, arguments.outside, arguments.brush}, view, run);
  const Mask mask = MakeViewMask(session->selection(), view, request, run.monitor(), &asked);
  WarnOfMismatch({arguments.view}, *session, run);
  const size_t inside = CountInside(mask);
  StagedOutput staged;
  const std::string outlined_by = request.network ? request.network->Identity()
                                  : arguments.mask.empty()
                                      ? ""
                                      : ReadPngText(arguments.mask, kOutlinedBy);
  staged.Add(arguments.output, [&](const auto& path) {
    const std::string png = EncodePng(mask);
    WriteFile(path, outlined_by.empty() ? png : WithPngText(png, kOutlinedBy, outlined_by));
  });
  run.monitor().ThrowIfCancelled();
  run.Commit(staged);
  run.FinishProgress();
  constexpr auto kFew = 100;  // pixels
  if (!arguments.wand.empty() && inside < kFew) {
    run.Warn(
        fmt::format("the wand took {} of the view's pixels: larger tolerances take more", inside));
  }
  if (request.network) run.Print("outlined by " + outlined_by);
  run.Print(fmt::format("wrote a mask of {:.2f} % of view {} to {}",
                        100.0 * double(inside) / double(mask.NumPixels()), view.name,
                        arguments.output.string()));
  PrintWhose(asked, run);
}

}  // namespace

void AddMask(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      AddVerb(app, globals, "mask",
              "Make the mask of a view from strokes, a network, a wand, scissors, a solid "
              "or a color");
  AddScene(verb, globals, arguments->scene);
  verb->add_option("--view", arguments->view, "Name of the view")->required()->type_name("NAME");
  AddPath(verb, "-o,--output", arguments->output,
          "Mask to write (.png), for --mask of `retint recolor` and others")
      ->required();
  verb->add_option("--image", arguments->image, "Picture to read edges and colors in")
      ->check(CLI::IsMember({"render", "photo"}));
  constexpr const char* kOne = "Select by one of";
  Everyday(verb, AddPath(verb, "--mask", arguments->mask, "A mask that you have")->group(kOne));
  Everyday(verb, AddRepeated(verb, "--scribble", arguments->inside,
                             "Strokes on the object: a picture that is black elsewhere, or "
                             "X,Y,X,Y... in pixels; repeatable")
                     ->type_name("FILE|POINTS")
                     ->group(kOne));
  Everyday(verb, AddRepeated(verb, "--scribble-outside", arguments->outside,
                             "Strokes on the background. Without any, the view's edge is outside")
                     ->type_name("FILE|POINTS")
                     ->group(kOne));
  Everyday(verb, verb->add_option("--network", arguments->network,
                                  "The object that your own network outlines: onnx:FILE (such as "
                                  "ISNet), onnx:ENCODER.onnx,DECODER.onnx (such as SAM, with "
                                  "--point or --rectangle) or exec:COMMAND (a program). Strokes "
                                  "correct it")
                     ->type_name("NAME")
                     ->group(kOne));
  AddRepeated(verb, "--point", arguments->points,
              "For the network: a pixel of the object; repeatable")
      ->type_name("X,Y")
      ->group(kOne);
  AddRepeated(verb, "--point-outside", arguments->points_outside,
              "For the network: a pixel beside the object; repeatable")
      ->type_name("X,Y")
      ->group(kOne);
  verb->add_option("--rectangle", arguments->rectangle,
                   "For the network: two corners of a rectangle about the object")
      ->type_name("X,Y,X,Y")
      ->group(kOne);
  AddOnnxRuntime(verb, kOne);
  verb->add_flag("--this-view-alone", arguments->alone,
                 "With strokes or a network: do not look at other views")
      ->group(kOne);
  verb->add_option("--brush", arguments->brush, "Width of strokes that are points, pixels")
      ->check(CLI::Range(0.1, 10000.0))
      ->group(kOne);
  Everyday(verb, verb->add_option("--wand", arguments->wand,
                                  "Connected pixels like this one. Tolerances: of the color "
                                  "(OKLab, 0.08), of steps in depth (relative, 0.02) and of the "
                                  "direction of the surface (degrees, 90)")
                     ->type_name("X,Y[,COLOR[,DEPTH[,NORMAL]]]")
                     ->group(kOne));
  Everyday(verb, verb->add_option("--scissors", arguments->scissors,
                                  "The inside of an outline, which runs along edges from point to "
                                  "point")
                     ->type_name("X,Y,X,Y,X,Y...")
                     ->group(kOne));
  constexpr const char* kLimits = "Keep of it (or, without it, of the whole view)";
  Everyday(verb, verb->add_option("--sphere", arguments->sphere,
                                  "Surfaces in a sphere, in the world's unit")
                     ->type_name("X,Y,Z,RADIUS")
                     ->group(kLimits));
  Everyday(verb, verb->add_option("--box", arguments->box,
                                  "Surfaces between two corners, in the world's unit")
                     ->type_name("X,Y,Z,X,Y,Z")
                     ->group(kLimits));
  Everyday(verb,
           verb->add_option("--like", arguments->like,
                            "Pixels of the color of a pixel, within a tolerance (OKLab, 0.08)")
               ->type_name("X,Y[,TOLERANCE]")
               ->group(kLimits));
  Everyday(verb, verb->add_option("--snap-edge", arguments->snap,
                                  "Move the border to edges of color and depth up to N pixels "
                                  "away. It becomes as soft as they are")
                     ->check(CLI::Range(0, 200))
                     ->group("Border"));
  AddExamples(verb,
              {"retint mask sample --view 023.png --wand 381,306 -o mask.png",
               "retint mask sample --view 023.png --scribble 340,290,420,310 -o mask.png",
               "retint mask sample --view 023.png --mask sample/masks/023.png.png --snap-edge 3 "
               "-o mask.png"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { MakeMask(*arguments, run); }; });
}

}  // namespace retint::cli
