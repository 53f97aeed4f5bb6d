// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/edit_text.h"

#include <algorithm>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "recolor/color_name.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using Eigen::Vector3f;
using ::testing::HasSubstr;
using Kind = ColorOperationKind;

ColorOperation Parse(Kind kind, std::string_view text) {
  return ParseOperation(TypeOf(kind), text);
}

std::string FaultOf(Kind kind, std::string_view text) {
  try {
    Parse(kind, text);
  } catch (const OptionError& error) {
    return error.what();
  }
  return "";
}

std::string FaultOf(std::string_view json) {
  try {
    EditFromJson(json, "");
  } catch (const OptionError& error) {
    return error.what();
  }
  return "";
}

TEST(ParseOperationTest, FillsParametersInOrderAndByName) {
  EXPECT_EQ(Parse(Kind::kExposure, "1.5"), ColorOperation::Make(Kind::kExposure, {1.5f}));
  EXPECT_EQ(Parse(Kind::kContrast, "1.2"), ColorOperation::Make(Kind::kContrast, {1.2f, 0.5f}));
  EXPECT_EQ(Parse(Kind::kContrast, "1.2,pivot=0.4"),
            ColorOperation::Make(Kind::kContrast, {1.2f, 0.4f}));
  EXPECT_EQ(Parse(Kind::kWhiteBalance, "20, -5"),
            ColorOperation::Make(Kind::kWhiteBalance, {20, -5}));
  EXPECT_EQ(Parse(Kind::kInvert, ""), ColorOperation::Make(Kind::kInvert));
  EXPECT_EQ(Parse(Kind::kMatrix, "1,2,3,4,5,6,7,8,9,10,11,12"),
            ColorOperation::Make(Kind::kMatrix, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
  EXPECT_EQ(Parse(Kind::kRecolor, "#ff0000"), ColorOperation::Make(Kind::kRecolor, {1, 0, 0}));
  EXPECT_EQ(Parse(Kind::kRecolor, "#ff0000,keep-lightness=0.5,from=#00ff00"),
            ColorOperation::Make(Kind::kRecolor, {1, 0, 0, 0.5f, 0, 1, 0}));
  EXPECT_EQ(Parse(Kind::kExposure, "1,strength=0.5").strength, 0.5f);

  ColorOperation adjust = ColorOperation::Make(Kind::kAdjust, {120, 1.2f});
  adjust.Get("hues")[0] = 20;
  adjust.Get("hues")[1] = 60;
  EXPECT_EQ(Parse(Kind::kAdjust, "hue=120,chroma=1.2,hues=20:60"), adjust);

  EXPECT_EQ(Parse(Kind::kGradient, "#000000,#ff0000,#ffffff").values,
            (std::vector<float>{0, 0, 0, 0, 0.5f, 1, 0, 0, 1, 1, 1, 1}));
  EXPECT_EQ(Parse(Kind::kGradient, "0.25:#000000,0.75:#ffffff").values,
            (std::vector<float>{0.25f, 0, 0, 0, 0.75f, 1, 1, 1}));
}

TEST(ParseOperationTest, ReadsPalettes) {
  ColorOperation measured = ColorOperation::Palette(3);
  std::fill_n(measured.values.begin() + 9, 3, 0.0f);
  measured.values[9 + 2] = 1;
  EXPECT_EQ(Parse(Kind::kPalette, "3, 2=#0000ff"), measured);
  EXPECT_EQ(EditFromJson(EditToJson({{measured}, 1}, true), "").operations[0], measured);
  EXPECT_EQ(Parse(Kind::kPalette, "#ff0000=#0000ff,#00ff00,strength=0.5").values,
            (std::vector<float>{1, 0, 0, 0, 0, 1, 0, 1, 0, kUnset, kUnset, kUnset}));
  EXPECT_EQ(Parse(Kind::kPalette, "1,1=#ff0000,strength=0.5").strength, 0.5f);
  EXPECT_THAT(FaultOf(Kind::kPalette, ""), HasSubstr("is not a number"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "5"), HasSubstr("changes no color"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "17,1=#ff0000"), HasSubstr("from 1 to 16, not 17"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "nan,1=#ff0000"), HasSubstr("'nan' is not a color"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "2.5,1=#ff0000"), HasSubstr("from 1 to 16, not 2.5"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "3,4=#ff0000"), HasSubstr("an index must be from 1 to 3"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "3,2"), HasSubstr("'2' has no color"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "3,2=bluw"), HasSubstr("is not a color; did you mean blue?"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "#ff0000=#00ff00,2=#0000ff"), HasSubstr("is not a color"));
}

TEST(ParseOperationTest, TakesColorsByName) {
  EXPECT_EQ(Parse(Kind::kRecolor, "SteelBlue"), Parse(Kind::kRecolor, "#4682b4"));
  EXPECT_EQ(Parse(Kind::kRecolor, "teal,from=gray"), Parse(Kind::kRecolor, "#008080,from=#808080"));
  EXPECT_EQ(Parse(Kind::kPalette, "red=blue,white"),
            Parse(Kind::kPalette, "#ff0000=#0000ff,#ffffff"));
  EXPECT_EQ(Parse(Kind::kGradient, "0:black,0.5:tomato"),
            Parse(Kind::kGradient, "0:#000000,0.5:#ff6347"));
  EXPECT_EQ(EditFromJson(R"({"operations": [{"op": "recolor", "to": "rebeccapurple"}]})", "")
                .operations[0],
            Parse(Kind::kRecolor, "#663399"));
  const std::vector<std::string_view> names = ColorNames();
  EXPECT_TRUE(std::ranges::is_sorted(names));
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
}

TEST(ParseOperationTest, SaysWhatIsWrong) {
  EXPECT_THAT(FaultOf(Kind::kExposure, "bright"),
              HasSubstr("`exposure` 'bright': 'bright' is not"));
  EXPECT_THAT(FaultOf(Kind::kExposure, "1,2"), HasSubstr("too many values"));
  EXPECT_THAT(FaultOf(Kind::kExposure, "11"), HasSubstr("stops must be from -10 to 10, not 11"));
  EXPECT_THAT(FaultOf(Kind::kMatrix, "1,2,3"), HasSubstr("needs 12 values"));
  EXPECT_THAT(FaultOf(Kind::kRecolor, "bluish"), HasSubstr("'bluish' is not a color"));
  EXPECT_THAT(FaultOf(Kind::kRecolor, "#ff0000,from=ruddy"), HasSubstr("'ruddy' is not a color"));
  EXPECT_THAT(FaultOf(Kind::kContrast, "1e300"), HasSubstr("'1e300' is out of range"));
  EXPECT_THAT(FaultOf(Kind::kContrast, "high"), HasSubstr("'high' is not a number"));
  EXPECT_THAT(FaultOf(Kind::kRecolor, "keep-lightness=1"), HasSubstr("needs 3 values"));
  EXPECT_THAT(FaultOf(Kind::kAdjust, ""), HasSubstr("adjust"));
  EXPECT_THAT(FaultOf(Kind::kAdjust, "hue"), HasSubstr("'hue' has no value; give it as hue=VALUE"));
  EXPECT_THAT(FaultOf(Kind::kLut, ""), HasSubstr("`lut` '': names no file"));
  EXPECT_THAT(FaultOf(Kind::kAdjust, "hew=3"), HasSubstr("there is no 'hew'"));
  EXPECT_THAT(FaultOf(Kind::kAdjust, "hue=3,hues=40:40"), HasSubstr("hues is empty"));
  EXPECT_THAT(FaultOf(Kind::kAdjust, "hue=3,lightnesses=0.9:0.2"),
              HasSubstr("lightnesses is empty"));
  EXPECT_THAT(FaultOf(Kind::kAdjust, "hues=40"), HasSubstr("hues needs 2 values"));
  EXPECT_THAT(FaultOf(Kind::kGradient, "#000000"), HasSubstr("needs 2 to 16 colors"));
  EXPECT_THAT(FaultOf(Kind::kGradient, "#000000,0.5:#ffffff"), HasSubstr("either all"));
  EXPECT_THAT(FaultOf(Kind::kGradient, "0.5:#000000,0.2:#ffffff"), HasSubstr("do not ascend"));
  EXPECT_THAT(FaultOf(Kind::kGamma, "2,strength=3"), HasSubstr("strength must be from 0 to 1"));
  EXPECT_THROW(Parse(Kind::kLut, "/nowhere/a.cube"), InputError);
}

TEST(ParseOperationTest, RefusesWhatContradictsItself) {
  EXPECT_THAT(FaultOf(Kind::kAdjust, "hue=30,hue=90"), HasSubstr("has 'hue' twice"));
  EXPECT_THAT(FaultOf(Kind::kExposure, "1,strength=0.5,strength=1"),
              HasSubstr("has 'strength' twice"));
  EXPECT_THAT(FaultOf(Kind::kContrast, "1.2,0.5,pivot=0.4"), HasSubstr("has 'pivot' twice"));
  EXPECT_THAT(FaultOf(Kind::kRecolor, "#3060ff,keep-lightness=0.5,keep-lightness=1"),
              HasSubstr("has 'keep_lightness' twice"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "5,1=#ffffff,1=#000000"), HasSubstr("changes color 1 twice"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "#d0a020=#3060ff,#d0a020=#000000"), HasSubstr("named twice"));
  EXPECT_THAT(FaultOf(Kind::kPalette, "1,1=#ffffff,strength=1,strength=0"),
              HasSubstr("has 'strength' twice"));
  EXPECT_THAT(FaultOf(Kind::kAdjust, "hue=3,chromas=6:5"), HasSubstr("chromas is empty"));
}

TEST(ParseOperationTest, BalancesWhatShouldBeGray) {
  const Vector3f warm(208 / 255.0f, 200 / 255.0f, 176 / 255.0f);  // #d0c8b0
  const ColorOperation op = Parse(Kind::kWhiteBalance, "gray=#d0c8b0,strength=0.5");
  EXPECT_EQ(op.strength, 0.5f);
  ColorOperation whole = op;
  whole.strength = 1;
  const Vector3f gray = CompiledEdit({{whole}, 1}).Apply(warm);
  // Temperature and tint are found in steps of a half, which are a thousandth of a channel.
  EXPECT_NEAR(gray[0], gray[1], 0.003f);
  EXPECT_NEAR(gray[2], gray[1], 0.003f);
  EXPECT_EQ(EditFromJson(R"({"operations": [{"op": "white_balance", "gray": "#d0c8b0"}]})", "")
                .operations[0],
            whole);
  EXPECT_THAT(FaultOf(Kind::kWhiteBalance, "20,gray=#d0c8b0"), HasSubstr("gray stands for"));
  EXPECT_THAT(FaultOf(Kind::kWhiteBalance, "gray=#d0c8b0,tint=3"), HasSubstr("gray stands for"));
  EXPECT_THAT(FaultOf(Kind::kWhiteBalance, "gray=20"), HasSubstr("'20' is not a color"));
  EXPECT_THAT(FaultOf(Kind::kExposure, "gray=#d0c8b0"), HasSubstr("there is no 'gray'"));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "white_balance", "gray": "#d0c8b0", "tint": 1}]})"),
              HasSubstr("stands for temperature and tint"));
  for (const char* color : {"[5, 0.5, 0.5]", "[0.5, -0.1, 0.5]", "[1e30, 0.5, 0.5]"}) {
    const std::string balance = R"({"op": "white_balance", "gray": )" + std::string(color) + "}";
    EXPECT_THAT(FaultOf("{\"operations\": [" + balance + "]}"),
                HasSubstr("operations[0].gray is not from 0 to 1"));
  }
}

TEST(ParseOperationTest, SaysWhatABalanceCannotMakeGray) {
  std::vector<std::string> warnings;
  const ColorOperationType& type = TypeOf(Kind::kWhiteBalance);
  ParseOperation(type, "gray=#d0c8b0", &warnings);
  ParseOperation(type, "100", &warnings);
  EXPECT_TRUE(warnings.empty());
  ParseOperation(type, "gray=#ff2020", &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("cannot make #ff2020 fully gray"));
  EditFromJson(R"({"operations": [{"op": "white_balance", "gray": "#ff2020"}]})", "", &warnings);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_EQ(warnings[1], warnings[0]);
  ParseOperation(type, "gray=#000000", &warnings);
  ASSERT_EQ(warnings.size(), 3u);
  EXPECT_THAT(warnings[2], HasSubstr("black"));
}

TEST(ParseOperationTest, TakesAStrengthAfterAFile) {
  const TempFolder temp;
  const std::string table = (temp / "one.cube").string(), odd = table + ",strength=2";
  std::ofstream(table) << "LUT_1D_SIZE 2\n1 1 1\n0 0 0\n";
  EXPECT_EQ(Parse(Kind::kLut, table).strength, 1);
  EXPECT_EQ(Parse(Kind::kLut, table + ",strength=0.5").strength, 0.5f);
  EXPECT_THAT(FaultOf(Kind::kLut, odd), HasSubstr("strength must be from 0 to 1"));
  const ColorOperation picture = Parse(Kind::kPicture, "a.png=" + table + ",strength=0.5");
  EXPECT_EQ(picture.strength, 0.5f);
  EXPECT_EQ(picture.picture->pictures[0].file, table);
  std::ofstream(odd) << "a file whose name ends so";
  EXPECT_EQ(Parse(Kind::kPicture, "a.png=" + odd).picture->pictures[0].file, odd);
}

ColorEdit EveryOperation() {
  auto table = std::make_shared<ColorTable>();
  table->size = 3;
  table->name = "film.cube";
  for (int i = 0; i < 81; ++i) table->values.push_back(float(i) / 81);
  ColorEdit edit;
  edit.operations = {ColorOperation::Make(Kind::kTint, {0.1f, 0.2f, 1.7f}),
                     ColorOperation::Make(Kind::kMatrix, {1, 0, 0, 0.1f, 0, 1, 0, 0, 0, 0, 1, 0}),
                     ColorOperation::Make(Kind::kExposure, {-0.3f}),
                     ColorOperation::Make(Kind::kContrast, {1.1f}),
                     ColorOperation::Make(Kind::kGamma, {0.7f}),
                     ColorOperation::Make(Kind::kWhiteBalance, {11, -3}),
                     ColorOperation::Make(Kind::kSaturation, {1.4f}),
                     ColorOperation::Make(Kind::kInvert),
                     ColorOperation::Make(Kind::kGray),
                     ColorOperation::Make(Kind::kAdjust, {33, 1.2f, 0.9f}),
                     ColorOperation::Make(Kind::kRecolor, {0.1f, 0.3f, 0.9f, 0.25f}),
                     ColorOperation::Make(Kind::kRecolor, {0.1f, 0.3f, 0.9f, 0, 0.8f, 0.1f, 0, 2}),
                     ColorOperation::Make(Kind::kGradient, {0, 0, 0, 0.1f, 1, 0.9f, 1, 1}),
                     Parse(Kind::kPalette, "#d0a020=#3060ff,#204010"),
                     ColorOperation::Lut(table),
                     ColorOperation::Make(Kind::kSoftClip)};
  edit.operations[3].strength = 0.6f;
  edit.strength = 0.9f;
  return edit;
}

TEST(EditJsonTest, EveryOperationComesBackBitForBit) {
  const ColorEdit edit = EveryOperation();
  ASSERT_NO_THROW(edit.Check());
  EXPECT_EQ(EditFromJson(EditToJson(edit, /*with_tables=*/true), ""), edit);
  EXPECT_THAT(EditToJson(edit, /*with_tables=*/false), HasSubstr("\"file\":\"film.cube\"}"));
}

// By their points, also where tables are left out.
TEST(EditJsonTest, CurvesAndLevelsComeBack) {
  const Tone curve{Tone::Kind::kCurve, {{0, 0.1}, {0.3, 0.123456}, {1, 0.9}}};
  Tone levels = Tone::Neutral(Tone::Kind::kLevels);
  levels.Move(0, {0.2, 0});
  levels.Move(2, {0.8, 1});
  levels.SetGamma(2);
  ColorEdit edit;
  for (const Tone& tone : {curve, levels}) {
    edit.operations.push_back(ColorOperation::Lut(tone.Table()));
  }
  const std::string json = EditToJson(edit, /*with_tables=*/false);
  EXPECT_EQ(json, EditToJson(edit, /*with_tables=*/true));
  EXPECT_THAT(json, HasSubstr("\"curve\":[[0.0,0.1],[0.3,0.12346],[1.0,0.9]]}"));
  EXPECT_THAT(json, HasSubstr("\"levels\":[[0.2,0.0],[0.35,0.5],[0.8,1.0]]}"));
  const ColorEdit again = EditFromJson(json, "");
  EXPECT_EQ(again, edit);
  EXPECT_EQ(Tone::Of(again.operations[1])->kind, Tone::Kind::kLevels);
  // 0.35 is a quarter of the way from 0.2 to 0.8, and the root of a quarter is a half.
  EXPECT_NEAR(Tone::Of(again.operations[1])->At(0.35), 0.5, 1e-9);
  EXPECT_NEAR(CompiledEdit(again).Apply(Vector3f::Ones()).x(), 1, 1e-5f);
  EXPECT_NEAR(CompiledEdit(again).Apply(Vector3f::Zero()).x(), 0, 1e-5f);
}

TEST(EditJsonTest, RefusesCurvesThatAreNone) {
  const auto fault = [](const std::string& keys) {
    return FaultOf(R"({"operations": [{"op": "lut", )" + keys + "}]}");
  };
  EXPECT_THAT(fault(R"("curve": 1)"), HasSubstr("operations[0].curve is not a list of points"));
  EXPECT_THAT(fault(R"("curve": [[0, 0], [1]])"), HasSubstr("a point is not [in, out]"));
  EXPECT_THAT(fault(R"("curve": [[0, 0]])"), HasSubstr("a curve needs 2 to 16 points"));
  EXPECT_THAT(fault(R"("curve": [[0, 0], [1, 2]])"), HasSubstr("a point is not from 0 to 1"));
  EXPECT_THAT(fault(R"("curve": [[0, 0], [0.5, 1], [0.5, 0]])"), HasSubstr("0.01 apart"));
  EXPECT_THAT(fault(R"("levels": [[0, 0], [1, 1]])"), HasSubstr("levels need 3 points"));
  EXPECT_THAT(fault(R"("levels": [[0, 0], [0, 0], [1, 1]])"), HasSubstr("must ascend"));
  EXPECT_THAT(fault(R"("levels": [[0.5, 0], [0.505, 0], [0.51, 1]])"), HasSubstr("0.02 apart"));
  EXPECT_THAT(fault(R"("curve": [[0, 0], [1, 1]], "file": "a.cube")"),
              HasSubstr("operations[0].curve stands for the whole table"));
}

// An image's or a file's name is bytes, a JSON text is UTF-8.
TEST(EditJsonTest, NamesThatAreNotUtf8ComeBack) {
  const TempFolder temp;
  const std::string view = "caf\xE9 100%41.png";
  const std::string file = temp / "\xE9%20.png";
  ColorEdit edit{{ColorOperation::Picture({{view, file, {}}})}, 1};
  std::ofstream(file) << "there";
  for (const bool with_tables : {true, false}) {
    const std::string text = EditToJson(edit, with_tables);
    EXPECT_TRUE(nlohmann::json::accept(text));
    EXPECT_EQ(EditFromJson(text, ""), edit);
  }
  // A typed name is used as it is if such a file exists.
  std::ofstream(temp / "a%20b.png") << "there";
  const ColorEdit by_hand = EditFromJson(
      R"({"operations": [{"op": "picture", "pictures": [{"view": "v", "file": "a%20b.png"}]}]})",
      temp.path());
  EXPECT_EQ(by_hand.operations[0].picture->pictures[0].file, (temp / "a%20b.png").string());

  auto compared = std::make_shared<PictureEdit>();
  compared->pictures.push_back({view, file, {}});
  compared->pictures[0].compared = true;
  PaintLayer layer{view, 1, 2, Image8(1, 1), Mask(1, 1)};
  compared->layers.push_back(layer);
  edit.operations[0].picture = compared;
  std::ranges::fill(edit.operations[0].values, 0.5F);
  EXPECT_EQ(EditFromJson(EditToJson(edit, true), ""), edit);
}

TEST(EditJsonTest, TakesHexColorsAndDefaults) {
  const ColorEdit edit = EditFromJson(
      R"({"operations": [{"op": "recolor", "to": "#ff0000"}, {"op": "adjust", "hue": 30}]})", "");
  ASSERT_EQ(edit.operations.size(), 2u);
  EXPECT_EQ(edit.operations[0], ColorOperation::Make(Kind::kRecolor, {1, 0, 0}));
  EXPECT_EQ(edit.operations[1], ColorOperation::Make(Kind::kAdjust, {30}));
}

TEST(EditJsonTest, SaysWhereAFaultIs) {
  EXPECT_THAT(FaultOf("{\"operations\": [{"), HasSubstr("is not JSON, or cut off"));
  EXPECT_THAT(FaultOf("[]"), HasSubstr("is not an edit"));
  EXPECT_THAT(FaultOf(R"({"operations": [3]})"), HasSubstr("operations[0] is not an object"));
  EXPECT_THAT(FaultOf(R"({"operations": [], "color": 1})"), HasSubstr("no \"color\""));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "paint"}]})"),
              HasSubstr("operations[0]: there is no operation \"paint\""));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "gray"}, {"op": "tint"}]})"),
              HasSubstr("operations[1]: tint needs \"color\""));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "gamma", "gamma": "big"}]})"),
              HasSubstr("operations[0].gamma is not a finite number"));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "gamma", "gamma": 2, "pivot": 2}]})"),
              HasSubstr("gamma has no \"pivot\""));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "gamma", "gamma": 100}]})"),
              HasSubstr("operations[0]: gamma: gamma must be from 0.1 to 10"));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "tint", "color": [1, 2]}]})"),
              HasSubstr("list of 3 numbers"));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "tint", "color": "bluish"}]})"),
              HasSubstr("is not a color"));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "palette"}]})"), HasSubstr("needs \"colors\""));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "palette", "colors": []}]})"),
              HasSubstr("needs 1 to 16 colors"));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "palette", "colors": [{"into": [1, 0, 0]}]}]})"),
              HasSubstr("a color has no \"into\""));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "lut"}]})"), HasSubstr("has no \"file\""));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "lut", "size": 3, "table": "AAAA"}]})"),
              HasSubstr("color table"));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "lut", "size": 1e9, "table": ""}]})"),
              HasSubstr("\"size\""));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "lut", "size": 100000, "table": "AAAA"}]})"),
              HasSubstr("operations[0].size is 100000, not from 2 to 129"));
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "adjust", "hue": 20, "hue": 30}]})"),
              HasSubstr("has \"hue\" twice in one object"));
  EXPECT_EQ(FaultOf(R"({"operations": [{"op": "gray"}, {"op": "gray"}]})"), "");
  EXPECT_THAT(FaultOf(R"({"operations": [{"op": "palette", "colors":
                  [{"from": "#d0a020", "to": "#3060ff"}, {"from": "#d0a020"}]}]})"),
              HasSubstr("named twice"));
}

TEST(EditJsonTest, FilesLookForTablesBesideThemselves) {
  const TempFolder temp;
  std::ofstream(temp / "one.cube") << "LUT_1D_SIZE 2\n1 1 1\n0 0 0\n";
  std::ofstream(temp / "edit.json") << R"({"operations": [{"op": "lut", "file": "one.cube"}]})";
  const ColorEdit edit = ReadEdit(temp / "edit.json");
  ASSERT_EQ(edit.operations.size(), 1u);
  EXPECT_EQ(edit.operations[0].table->name, "one.cube");
  // A report has the same, in whatever folder it is.
  std::filesystem::create_directory(temp / "reports");
  const auto report = temp / "reports/report.json";
  ColorEdit written = edit;
  written.strength = 0.5f;
  written.operations.push_back(
      ColorOperation::Picture({{"a.png", (temp / "sub/../p.png").string(), {}}}));
  std::ofstream(report) << R"({"version": "1", "edit": )" << EditToJson(written, false) << "}";
  const ColorEdit again = ReadEdit(report);
  EXPECT_EQ(again.strength, 0.5f);
  ASSERT_EQ(again.operations.size(), 2u);
  EXPECT_EQ(again.operations[0], edit.operations[0]);
  EXPECT_EQ(again.operations[1].picture->pictures[0].file, (temp / "p.png").string());
  std::ofstream(report) << R"({"version": "1", "edit": null, "regions": []})";
  try {
    ReadEdit(report);
    FAIL() << "was read";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("without an edit of its own"));
  }
  std::ofstream(temp / "bad.json") << "{";
  EXPECT_THROW(ReadEdit(temp / "bad.json"), InputError);
  EXPECT_THROW(ReadEdit(temp / "none.json"), InputError);
}

}  // namespace
}  // namespace retint
