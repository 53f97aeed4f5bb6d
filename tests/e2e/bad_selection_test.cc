// SPDX-License-Identifier: BSD-3-Clause
// Masks, views and selections that do not fit the scene.
#include "scene/mask_pixels.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/bad_input.h"

namespace retint {
namespace {

const Row kSelectionRows[] = {
    // Masks.
    {"EmptyMask", 3, ".png",
     [](Place& p) {
       WritePng(MaskOf(p), Mask(160, 120));
       return Recolor(p);
     }},
    {"MaskOfAnotherSize", 3, "160",
     [](Place& p) {
       WritePng(MaskOf(p), Mask(80, 60, 255));
       return Recolor(p);
     }},
    {"PhotoAsMask", 3, "a mask is black or transparent outside",
     [](Place& p) {
       Image8 photo = ReadImage8(p.in / ("images/" + TinyView()));
       for (int y = 40; y < 80; ++y) {
         for (int x = 50; x < 100; ++x) photo(x, y) = 255;
       }
       WritePng(MaskOf(p), photo);
       return Recolor(p);
     }},
    {"RefitMaskOfAnotherSize", 3, "001.png.png",
     [](Place& p) {
       WritePng(p.in / "m/001.png.png", Mask(80, 60, 255));
       return With(p, "refit",
                   {"--masks", p.In("m"), "--tint", "1,0,0", "--output", p.Out("o.ply")});
     }},
    {"RefitMasksAllEmpty", 3, "no mask has a selected pixel",
     [](Place& p) {
       for (int i = 0; i < 8; ++i) {
         WritePng(p.in / ("m/00" + std::to_string(i) + ".png.png"), Mask(160, 120));
       }
       return With(p, "refit",
                   {"--masks", p.In("m"), "--tint", "1,0,0", "--output", p.Out("o.ply")});
     }},
    {"RefitMasksOfNoView", 3, "m",
     [](Place& p) {
       WritePng(p.in / "m/other.png.png", Mask(160, 120, 255));
       return With(p, "refit",
                   {"--masks", p.In("m"), "--tint", "1,0,0", "--output", p.Out("o.ply")});
     }},
    // Views and selections.
    {"NoSuchView", 3, "001.png",
     [](Place& p) {
       return Recolor(p, {"--view", "001.pgn"});
     }},
    {"NoSuchViewToRender", 3, "003.png",
     [](Place& p) {
       return With(p, "render", {"--view", "0003.png", "--output", p.Out("r")});
     }},
    {"SelectionErasedWhole", 3, "empty",
     [](Place& p) {
       WritePng(p.in / "all.png", Mask(160, 120, 255));
       RunRetint(With(p, "select",
                      {"--view", TinyView(), "--mask", MaskOf(p).string(), "--output",
                       p.In("cloud.ply"), "--depth-method", "gaussian"}));
       EXPECT_FALSE(ReadCloud(p.in / "cloud.ply").points.empty());
       return With(p, "select",
                   {"--view", TinyView(), "--append", p.In("cloud.ply"), "--erase", p.In("all.png"),
                    "--output", p.Out("c.ply"), "--depth-method", "gaussian"});
     }},
    {"CloudWithoutPoints", 3, "cloud.ply",
     [](Place& p) {
       WriteCloud(p.in / "cloud.ply", SelectionCloud{});
       return With(p, "project", {"--cloud", p.In("cloud.ply"), "--output", p.Out("masks")});
     }},
    {"SelectionThatReachesNoView", 3, "no view",
     [](Place& p) {
       WriteCloud(p.in / "cloud.ply", CloudAt({0, 0, -1e6F}));
       return With(p, "project",
                   {"--cloud", p.In("cloud.ply"), "--output", p.Out("masks"), "--set",
                    "projector=surfels"});
     }},
    {"EvaluateOfAnotherSplat", 3, "other.ply",
     [](Place& p) {
       GaussianModel model = ReadSplat(p.in / "splat.ply");
       model.Resize(100, model.sh_degree);
       model.source = {};
       WriteSplat(p.in / "other.ply", model);
       return Arguments{"evaluate", p.in.string(),     "--splat",  p.In("splat.ply"),
                        "--after",  p.In("other.ply"), "--masks",  p.In("masks"),
                        "--tint",   "1,0,0",           "--report", p.Out("r.json")};
     }},
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Selections, BadInput, testing::ValuesIn(kSelectionRows), RowName);

TEST(BadView, AViewThatDoesNotExistGetsTheNearestNames) {
  Place place;
  const CommandResult result = RunRetint(Recolor(place, {"--view", "005.jpg"}));
  ExpectRefused(result, place, 3, "005.png");
  EXPECT_THAT(result.err, testing::HasSubstr("005.jpg"));
}

}  // namespace retint
