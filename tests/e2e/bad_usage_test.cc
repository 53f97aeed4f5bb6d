// SPDX-License-Identifier: BSD-3-Clause
// Options and edits that make no sense.
#include "tests/e2e/bad_input.h"

namespace retint {
namespace {

const Row kUsageRows[] = {
    // Usage.
    {"NegativeTint", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "-1,0,0"});
     }},
    {"NanTint", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "nan,0,0"});
     }},
    {"TintOfTwo", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "1,0"});
     }},
    {"TintInWords", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "bluish"});
     }},
    {"ShortHexTint", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "#30f"});
     }},
    {"UnknownOperation", 3, "operations[0]: there is no operation \"paint\"",
     [](Place& p) {
       WriteFile(p.in / "edit.json", R"({"operations": [{"op": "paint"}]})");
       return Recolor(p, {"--edit", p.In("edit.json")});
     }},
    {"EditCutOff", 3, "is not JSON, or cut off",
     [](Place& p) {
       WriteFile(p.in / "edit.json", R"({"operations": [{"op": "gray")");
       return Recolor(p, {"--edit", p.In("edit.json")});
     }},
    {"EmptyRange", 2, "the range of hues is empty",
     [](Place& p) {
       return Recolor(p, {"--adjust", "hue=20,hues=40:40"});
     }},
    {"ColorThatIsNone", 2, "--to 'bluw': 'bluw' is not a color; did you mean blue?",
     [](Place& p) {
       return Recolor(p, {"--to", "bluw"});
     }},
    {"ColorWithoutItsSign", 2, "'3060ff' is not a color (expected #rrggbb",
     [](Place& p) {
       return Recolor(p, {"--to", "3060ff"});
     }},
    {"NumberBeyondFloats", 2, "'1e300' is out of range",
     [](Place& p) {
       return Recolor(p, {"--contrast", "1e300"});
     }},
    {"SweepsInHalves", 2, "--set iterations=1.5: iterations: '1.5' is not a whole number",
     [](Place& p) {
       return Recolor(p, {"--set", "iterations=1.5"});
     }},
    {"SweepsBeyondIntegers", 2, "iterations: '30000000000' is out of range",
     [](Place& p) {
       return Recolor(p, {"--set", "iterations=30000000000"});
     }},
    {"AFlagThatOnlySetTakes", 2, "; write --set ridge_rest=VALUE",
     [](Place& p) {
       return Recolor(p, {"--ridge-rest", "1e-2"});
     }},
    {"AFlagOfOtherVerbs", 2, "--holdout; recolor, refit, match and evaluate have it",
     [](Place& p) {
       return With(p, "select", {"--holdout", "--view", "a", "--mask", "b", "-o", p.Out("c.ply")});
     }},
    {"AWorkspaceAsAFlag", 2, "; SCENE is an argument without a flag",
     [](Place& p) {
       return Arguments{"info", "--workspace", p.In(".")};
     }},
    {"AMisspelledOptionWithItsGroup", 2,
     "there is no option 'mm.ridge_rset'; did you mean ridge_rest?",
     [](Place& p) {
       return Recolor(p, {"--set", "mm.ridge_rset=1"});
     }},
    {"AShortNameOfNothing", 2, "there is no option 'abc'; `retint options` lists them",
     [](Place& p) {
       return Recolor(p, {"--set", "abc=1"});
     }},
    {"AnOptionOfOtherVerbs", 2,
     "there is no option 'ridge_rest' of this command; recolor and refit have it",
     [](Place& p) {
       return With(p, "project",
                   {"--set", "ridge_rest=1", "--view", "a", "--mask", "b", "-o", p.Out("m")});
     }},
    {"ASceneWithANameTooLong", 3, ": File name too long",
     [](Place&) {
       return Arguments{"info", std::string(5000, 'a')};
     }},
    {"ASceneThatIsAFileOfAWorkspace", 3,
     "transforms.json: is not a job of Retint: name the folder that it is in",
     [](Place& p) {
       WriteFile(p.in / "transforms.json", R"({"frames": []})");
       return Arguments{"info", p.In("transforms.json")};
     }},
    {"ToleranceInWords", 2, "tolerance: 'small' is not a number",
     [](Place& p) {
       return Recolor(p, {"--set", "tolerance=small"});
     }},
    {"OptionTwice", 2, "--seed is given 2 times; give it once",
     [](Place& p) {
       Arguments arguments = Recolor(p, {"--seed", "1"});
       arguments.insert(arguments.end(), {"--seed", "2"});
       return arguments;
     }},
    {"MisspelledVerb", 2, "there is no command 'recolour'; did you mean recolor?",
     [](Place&) { return Arguments{"recolour"}; }},
    {"HoldoutOfEveryView", 2, "--holdout must be 0 (none) or at least 2",
     [](Place& p) {
       return Recolor(p, {"--holdout", "1"});
     }},
    {"StagesInThePlaceOfTheSplat", 2, "--output and --save-stages name one file, ",
     [](Place& p) {
       return Recolor(p, {"--save-stages", p.Out("out.ply")});
     }},
    {"StagesBelowTheReport", 2, "--save-stages lies below --report, which is a file, ",
     [](Place& p) {
       return Recolor(p, {"--save-stages", p.Out("r.json/stages")});
     }},
    {"StrokeBesideTheView", 2, "--scribble -5,-5,-9,-9: lies outside view",
     [](Place& p) {
       return With(p, "mask",
                   {"--view", TinyView(), "--scribble", "-5,-5,-9,-9", "--output", p.Out("m.png")});
     }},
    {"PointBesideTheView", 2, "the point -5,5 lies outside view",
     [](Place& p) {
       return With(p, "mask",
                   {"--view", TinyView(), "--network", "exec:false", "--point=-5,5", "--output",
                    p.Out("m.png")});
     }},
    {"RectangleWithoutAnArea", 2, "the rectangle holds no pixel",
     [](Place& p) {
       return With(p, "mask",
                   {"--view", TinyView(), "--network", "exec:false", "--rectangle", "5,5,30,5",
                    "--output", p.Out("m.png")});
     }},
    {"StrokesThatCross", 2,
     "--scribble 60,60,100,60 and --scribble-outside 80,40,80,80 cross at pixel 7",
     [](Place& p) {
       return With(p, "mask",
                   {"--view", TinyView(), "--scribble", "20,20,30,20", "--scribble", "60,60,100,60",
                    "--scribble-outside", "10,90,20,90", "--scribble-outside", "80,40,80,80",
                    "--output", p.Out("m.png")});
     }},
    {"ExposureOutOfRange", 2, "stops must be from -10 to 10",
     [](Place& p) {
       return Recolor(p, {"--exposure", "40"});
     }},
    {"LightnessOfNothing", 2, "--keep-lightness requires --to",
     [](Place& p) {
       return Recolor(p, {"--keep-lightness", "0.5"});
     }},
    {"LightnessTwice", 2, "has 'keep_lightness' twice",
     [](Place& p) {
       return Recolor(p, {"--to", "#3060ff,keep-lightness=0.5", "--keep-lightness", "1"});
     }},
    {"StrengthsOfAListAndOfMore", 3, "edit.json: has a strength of its whole list",
     [](Place& p) {
       WriteFile(p.in / "edit.json", R"({"operations": [{"op": "gray"}], "strength": 0.5})");
       return Recolor(p, {"--edit", p.In("edit.json")});
     }},
    {"AnUnchangedPicture", 3, "p.png: nothing was changed in this picture",
     [](Place& p) {
       fs::copy(p.in / "images" / TinyView(), p.in / "p.png");
       return With(p, "recolor",
                   {"--view", TinyView(), "--mask", MaskOf(p).string(), "--edited",
                    TinyView() + "=" + p.In("p.png"), "--output", p.Out("o.ply")});
     }},
    {"AlbedoOfNothing", 2, "--albedo 'ball=': expected OBJECT=COLOR or OBJECT=FILE",
     [](Place& p) {
       return Arguments{"synth", "--albedo", "ball=", "--output", p.Out("s")};
     }},
    {"AlbedoInWords", 2, "'ruddy' is neither a color nor a picture file",
     [](Place& p) {
       return Arguments{"synth", "--albedo", "ball=ruddy", "--output", p.Out("s")};
     }},
    {"ShortAlbedo", 2, "--albedo 'ball=#30f': a color needs six",
     [](Place& p) {
       return Arguments{"synth", "--albedo", "ball=#30f", "--output", p.Out("s")};
     }},
    {"PaletteColorTwice", 2, "changes color 1 twice",
     [](Place& p) {
       return Recolor(p, {"--palette", "5,1=#ffffff,1=#000000"});
     }},
    {"EditKeyTwice", 3, "edit.json: has \"hue\" twice in one object",
     [](Place& p) {
       WriteFile(p.in / "edit.json", R"({"operations": [{"op": "adjust", "hue": 1, "hue": 2}]})");
       return Recolor(p, {"--edit", p.In("edit.json")});
     }},
    {"PicturesOfTwoStrengths", 2, "give all the same strength",
     [](Place& p) {
       Arguments arguments = Recolor(p, {"--edited", "a.png=a.png,strength=0.5"});
       arguments.insert(arguments.end(), {"--edited", "b.png=b.png"});
       return arguments;
     }},
    {"ComparisonOverThePictureWithAStrength", 2, "would replace what --edited names",
     [](Place& p) {
       return Recolor(p, {"--edited", TinyView() + "=" + p.In("p.png") + ",strength=0.5",
                          "--comparison", p.In("p.png")});
     }},
    {"ComparisonOfAnotherKind", 2, "c.jpg: pictures are written as .png",
     [](Place& p) {
       return Recolor(p, {"--comparison", p.Out("c.jpg")});
     }},
    {"MaskOfAnotherKind", 2, "m.jpg: pictures are written as .png",
     [](Place& p) {
       return With(p, "mask",
                   {"--view", TinyView(), "--wand", "80,60", "--output", p.Out("m.jpg")});
     }},
    {"SwatchesOfAnotherKind", 2, "s.bmp: pictures are written as .png",
     [](Place& p) {
       return With(p, "palette", {"--masks", p.In("masks"), "--picture", p.Out("s.bmp")});
     }},
    {"DepthPictureOfAnotherKind", 2, "d: pictures are written as .png",
     [](Place& p) {
       return With(p, "depth", {"--view", TinyView(), "--png", p.Out("d")});
     }},
    {"RenderIntoAPicture", 2, "r.jpg: names a picture, and renders go into a folder",
     [](Place& p) {
       return With(p, "render", {"--view", TinyView(), "--output", p.Out("r.jpg")});
     }},
    {"WandOfThisViewAlone", 2, "--this-view-alone needs --scribble",
     [](Place& p) {
       return With(p, "mask",
                   {"--view", TinyView(), "--wand", "80,60", "--this-view-alone", "--output",
                    p.Out("m.png")});
     }},
    {"NegativeSeed", 2, "--seed",
     [](Place& p) {
       return Recolor(p, {"--seed", "-1"});
     }},
    {"NoEdit", 2, "there is no edit",
     [](Place& p) {
       return With(p, "refit", {"--masks", p.In("masks"), "--output", p.Out("o.ply")});
     }},
    {"BaselineOfAnotherScale", 2, "more than its width: take one from",
     [](Place& p) {
       return With(p, "depth",
                   {"--view", TinyView(), "--set", "baseline=1000", "--png", p.Out("d.png")});
     }},
    {"LutCutOff", 3, "film.cube: is not a lookup table",
     [](Place& p) {
       WriteFile(p.in / "film.cube", "LUT_3D_SIZE 3\n0 0 0\n0.5 0 0\n1 0");
       return Recolor(p, {"--lut", p.In("film.cube")});
     }},
    {"LutOfAbsurdSize", 3, "LUT_3D_SIZE 4000000 is not a size",
     [](Place& p) {
       WriteFile(p.in / "film.cube", "LUT_3D_SIZE 4000000\n0 0 0\n");
       return Recolor(p, {"--lut", p.In("film.cube")});
     }},
    {"LutWithNan", 3, "film.cube",
     [](Place& p) {
       WriteFile(p.in / "film.cube", "LUT_1D_SIZE 2\n0 nan 0\n1 1 1\n");
       return Recolor(p, {"--lut", p.In("film.cube")});
     }},
    {"NoLut", 3, "gone.cube: is not a file",
     [](Place& p) {
       return Recolor(p, {"--lut", p.In("gone.cube")});
     }},
    {"PaletteOfTooManyColors", 2, "the number of colors must be from 1 to 16, not 99",
     [](Place& p) {
       return Recolor(p, {"--palette", "99,1=#ff0000"});
     }},
    {"PaletteWithNan", 2, "palette 'nan,1=#ff0000': 'nan' is not a color",
     [](Place& p) {
       return Recolor(p, {"--palette", "nan,1=#ff0000"});
     }},
    {"PaletteOfNothing", 2, "give either --view and --mask, or --masks",
     [](Place& p) {
       return With(p, "palette", {"--picture", p.Out("swatches.png")});
     }},
    {"PaletteOfZeroColors", 2, "--colors",
     [](Place& p) {
       return With(p, "palette", {"--colors", "0", "--masks", p.In("masks")});
     }},
    {"PictureOfAnotherSize", 3, "painted.png is 7x5, the view is 160x120",
     [](Place& p) {
       WritePng(p.in / "painted.png", Image(7, 5));
       return Recolor(p, {"--edited", TinyView() + "=" + p.In("painted.png")});
     }},
    {"PictureWithHoles", 3, "layer.pam: has transparent pixels",
     [](Place& p) {
       WriteFile(p.in / "layer.pam",
                 "P7\nWIDTH 160\nHEIGHT 120\nDEPTH 4\nMAXVAL 255\nTUPLTYPE RGB_ALPHA\nENDHDR\n" +
                     std::string(size_t{160} * 120 * 4, '\0'));
       return Recolor(p, {"--edited", TinyView() + "=" + p.In("layer.pam")});
     }},
    {"PictureThatIsNone", 3, "painted.png",
     [](Place& p) {
       WriteFile(p.in / "painted.png", "no picture");
       return Recolor(p, {"--edited", TinyView() + "=" + p.In("painted.png")});
     }},
    {"PictureOfNoView", 3, "nowhere.png",
     [](Place& p) {
       return Recolor(p, {"--edited", "nowhere.png=" + MaskOf(p).string()});
     }},
    {"PictureWithoutView", 2, "names no view and picture",
     [](Place& p) {
       return Recolor(p, {"--edited", "painted.png"});
     }},
    {"NeitherMaskNorPicture", 2, "--view and --mask are required",
     [](Place& p) {
       return With(p, "recolor", {"--tint", "1,0,0", "--output", p.Out("o.ply")});
     }},
    {"PictureWithoutAChange", 3, "nothing was changed",
     [](Place& p) {
       return With(p, "recolor",
                   {"--edited", TinyView() + "=" + p.In("images/" + TinyView()), "--output",
                    p.Out("o.ply")});
     }},
    {"MaskWithoutView", 2, "--view",
     [](Place& p) {
       Arguments arguments = Recolor(p);
       arguments.insert(arguments.end(), {"--mask", MaskOf(p).string()});
       return arguments;
     }},
    {"ViewTwice", 2, "twice",
     [](Place& p) {
       Arguments arguments = Recolor(p);
       arguments.insert(arguments.end(), {"--view", TinyView(), "--mask", MaskOf(p).string()});
       return arguments;
     }},
    {"UnknownOption", 2, "--frobnicate",
     [](Place& p) {
       return Recolor(p, {"--frobnicate", "1"});
     }},
    {"MisspelledOption", 2, "; did you mean --output?",
     [](Place& p) {
       return With(p, "recolor",
                   {"--view", TinyView(), "--tint", "1,0,0", "--outptu", p.Out("o.ply")});
     }},
    {"UnknownVerb", 2, "there is no command 'frobnicate'",
     [](Place&) {
       return Arguments{"frobnicate", "--help"};
     }},
    {"ViewsOfAWorkspace", 2, "--views places views around a splat alone",
     [](Place& p) {
       return Recolor(p, {"--views", "9"});
     }},
    {"ModelOfNoWorkspace", 2, "--images and --model are parts of a workspace",
     [](Place& p) {
       return Arguments{"render", p.In("splat.ply"), "--model", "0", "--output", p.Out("r")};
     }},
    {"ScoreOfAColorThatIsMeasured", 2,
     "the region's main color is not measured here: name it, as in --to '#3060ff,from=#c8b478', or "
     "take the edit from a report, --edit report.json",
     [](Place& p) {
       return Arguments{"score",   "--truth",     p.In("masks"), "--before", p.In("masks"),
                        "--after", p.In("masks"), "--to",        "#3060ff"};
     }},
    {"ScoreOfAColorThatIsMeasuredBeforeAFileThatIsMissing", 2,
     "the region's main color is not measured here",
     [](Place& p) {
       return Arguments{"score",   "--truth",    p.In("masks"), "--before", p.In("gone"),
                        "--after", p.In("gone"), "--to",        "#3060ff"};
     }},
    {"ScoreOfAnEditWithoutPictures", 2, "an edit is of pictures before and after it",
     [](Place& p) {
       return Arguments{"score",       "--truth", p.In("masks"), "--masks",
                        p.In("masks"), "--tint",  "1,0,0"};
     }},
    {"ScoreWithinAnAngleOfNoView", 2, "--within requires --cameras",
     [](Place& p) {
       return Arguments{"score",       "--truth",  p.In("masks"), "--masks",
                        p.In("masks"), "--within", "20"};
     }},
    {"ScoreOfABorderWithoutPictures", 2, "--border requires --after",
     [](Place& p) {
       return Arguments{"score",    "--truth", p.In("masks"), "--masks", p.In("masks"),
                        "--border", "4"};
     }},
    {"ValueOfAnOperationWithoutOne", 2, "--invert takes no value, not 'false'",
     [](Place& p) {
       return With(p, "refit",
                   {"--masks", p.In("masks"), "--invert=false", "--output", p.Out("o.ply")});
     }},
    {"ExtraArgumentsAsTyped", 2, "not expected: c.ply d.ply e.ply",
     [](Place&) { return Arguments{"convert", "a.ply", "b.ply", "c.ply", "d.ply", "e.ply"}; }},
    {"FrameOfNoSplat", 2, "--world-from-splat needs a splat",
     [](Place& p) {
       fs::remove(p.in / "splat.ply");
       return Arguments{"info", p.in.string(), "--world-from-splat", "t.json"};
     }},
    {"ReportOverTheSplat", 2, "--report would replace what --splat names",
     [](Place& p) {
       return Recolor(p, {"--report", p.In("splat.ply")});
     }},
    {"ReportOverTheModel", 2, "--report writes JSON: ",
     [](Place& p) {
       return Recolor(p, {"--report", p.In("sparse/0/cameras.bin")});
     }},
    {"PageOverAPhoto", 2, "--report-html writes a page: ",
     [](Place& p) {
       return Recolor(p, {"--report-html", p.In("images/001.png")});
     }},
    {"ComparisonOverAPhoto", 2, "images/001.png, which is an input: name another file",
     [](Place& p) {
       return Recolor(p, {"--comparison", p.In("images/001.png")});
     }},
    {"ReportOverTheCameras", 2, "transforms.json, which is an input: name another file",
     [](Place& p) {
       fs::remove_all(p.in / "sparse");
       WriteFile(p.in / "transforms.json",
                 R"({"fl_x": 150, "w": 160, "h": 120, "frames": [{"file_path": "images/000.png",)"
                 R"( "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]})");
       return Recolor(p, {"--report", p.In("transforms.json")});
     }},
    {"StagesOverTheWorkspace", 2, "the folder of the stages is the workspace",
     [](Place& p) {
       fs::rename(MaskOf(p), p.in / "paint.png");
       return Recolor(p, {"--mask", p.In("paint.png"), "--save-stages", p.in.string()});
     }},
    {"ReportOverTheOutput", 2, "--output and --report name one file",
     [](Place& p) {
       return Recolor(p, {"--output", p.Out("o.ply"), "--report", p.Out("./o.ply")});
     }},
    {"ComparisonOverTheMask", 2, "--comparison would replace what --mask names",
     [](Place& p) {
       return Recolor(p, {"--comparison", MaskOf(p).string()});
     }},
    {"OutputOverThePicture", 2, "--output would replace what --edited names",
     [](Place& p) {
       return Recolor(p, {"--edited", TinyView() + "=" + p.In("painted.png"), "--output",
                          p.In("painted.png")});
     }},
    {"CloudOverTheMask", 2, "--output would replace what --mask names",
     [](Place& p) {
       return With(
           p, "select",
           {"--view", TinyView(), "--mask", MaskOf(p).string(), "--output", MaskOf(p).string()});
     }},
    {"StagesOverTheMask", 2, "--save-stages would replace what --mask names",
     [](Place& p) {
       return Recolor(p, {"--save-stages", p.in.string()});
     }},
    {"StagesOverTheMaskOfAViewInAFolder", 2, "--save-stages would replace what --mask names",
     [](Place& p) {
       return With(p, "recolor",
                   {"--view", "cam/000.png", "--mask", p.In("masks/cam/000.png.png"), "--tint",
                    "#3060ff", "--output", p.Out("o.ply"), "--save-stages", p.in.string()});
     }},
    {"ConvertedOverItsReport", 2, "OUTPUT and --report name one file",
     [](Place& p) {
       return Arguments{"convert", p.In("splat.ply"), p.Out("o.spz"), "--report", p.Out("o.spz")};
     }},
    {"NoVerb", 2, "", [](Place&) { return Arguments{}; }},
    {"RequiredOptionMissing", 2, "SCENE", [](Place&) { return Arguments{"recolor"}; }},
    {"NotANumber", 2, "--threads",
     [](Place& p) {
       return Recolor(p, {"--threads", "many"});
     }},
    {"UnknownSolver", 2, "solver must be mm or adam, not 'newton'",
     [](Place& p) {
       return Recolor(p, {"--set", "solver=newton"});
     }},
    {"UnknownOptionOfSet", 2, "there is no option 'ridge_rust'; did you mean ridge_rest?",
     [](Place& p) {
       return Recolor(p, {"--set", "ridge_rust=1"});
     }},
    {"OptionWithoutValue", 2, "--set: 'ridge_rest' has no value: write NAME=VALUE",
     [](Place& p) {
       return Recolor(p, {"--set", "ridge_rest"});
     }},
    {"UnknownBackend", 2, "--backend",
     [](Place& p) {
       return Recolor(p, {"--backend", "abacus"});
     }},
    {"SampleAboveOne", 2, "sample fraction must be in (0, 1], not 1.5",
     [](Place& p) {
       return Recolor(p, {"--set", "sample_fraction=1.5"});
     }},
    {"HoldoutOfOne", 2, "--holdout",
     [](Place& p) {
       return Recolor(p, {"--holdout", "1"});
     }},
    {"OutsideWeightOfZero", 2, "--outside-weight: must be in (0, 8], not 0",
     [](Place& p) {
       return Recolor(p, {"--outside-weight", "0"});
     }},
    {"OddDisparities", 2, "max disparities must be in [16, 1024], a multiple of 16 pixels, not 100",
     [](Place& p) {
       return Recolor(p, {"--set", "max_disparities=100"});
     }},
    {"NotANumberAtAll", 2, "tolerance must be at least 0, not nan",
     [](Place& p) {
       return Recolor(p, {"--set", "tolerance=nan"});
     }},
    {"UnknownPresetOfOptions", 2, "--preset",
     [](Place& p) {
       return Recolor(p, {"--preset", "magic"});
     }},
    {"NegativeIterations", 2, "iterations must be at least 0, not -5",
     [](Place& p) {
       return Recolor(p, {"--set", "iterations=-5"});
     }},
    {"RenderOfNothing", 2, "--view",
     [](Place& p) {
       return With(p, "render", {"--output", p.Out("r")});
     }},
    {"SplatOfUnknownKind", 2, "out.xyz",
     [](Place& p) {
       return Recolor(p, {"--output", p.Out("out.xyz")});
     }},
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Usage, BadInput, testing::ValuesIn(kUsageRows), RowName);

TEST_P(BadInput, IsToldInOneLine) {
  Place place;
  Arguments arguments = GetParam().prepare(place);
  if (arguments.size() > 1) {
    arguments.insert(arguments.end(), {"--progress", "none"});
  }
  const auto before = FilesBelow(place.temp.path());
  ExpectRefused(RunRetint(arguments), place, GetParam().code, GetParam().says);
  EXPECT_EQ(FilesBelow(place.temp.path()), before);
}

}  // namespace retint
