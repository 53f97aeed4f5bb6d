// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/lut.h"

#include <fstream>
#include <functional>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "kernels/common/color_ops.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::HasSubstr;

class LutTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& name, const std::string& text) {
    std::ofstream(temp_ / name) << text;
    return temp_ / name;
  }
  std::string Fault(const std::filesystem::path& path) {
    try {
      ReadLut(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  TempFolder temp_;
};

// Swaps red and blue.
std::string Cube3d(int size, const std::string& last = "1 1 1") {
  std::ostringstream text;
  text << "TITLE \"swap\"\nLUT_3D_SIZE " << size << "\n";
  const auto at = [&](int i) { return float(i) / float(size - 1); };
  for (int b = 0; b < size; ++b) {
    for (int g = 0; g < size; ++g) {
      for (int r = 0; r < size; ++r) {
        if (r + 1 == size && g + 1 == size && b + 1 == size) break;
        text << at(b) << " " << at(g) << " " << at(r) << "\n";
      }
    }
  }
  text << last << "\n";
  return text.str();
}

void ExpectColor(const ColorTable& table, std::initializer_list<float> in,
                 std::initializer_list<float> out, double tolerance) {
  float color[3];
  std::copy(in.begin(), in.end(), color);
  TableColor(table.values.data(), table.size, color);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(color[c], out.begin()[c], tolerance);
}

TEST_F(LutTest, Reads3dCubesNodeByNode) {
  const auto table = ReadLut(Write("swap.cube", Cube3d(5)));
  EXPECT_EQ(table->size, 5);
  EXPECT_EQ(table->name, "swap.cube");
  // A linear map on nodes of five digits.
  ExpectColor(*table, {0.1f, 0.6f, 0.9f}, {0.9f, 0.6f, 0.1f}, 1e-5);
  ExpectColor(*table, {1, 0, 0.33f}, {0.33f, 0, 1}, 1e-5);
}

TEST_F(LutTest, ReadsACubeAfterAByteOrderMark) {
  const auto path = Write("marked.cube", "\xef\xbb\xbf" + Cube3d(5));
  const auto table = ReadLut(path);
  EXPECT_EQ(table->name, "marked.cube");
  EXPECT_EQ(table->file, std::filesystem::absolute(path));
  EXPECT_EQ(table->values, ReadLut(Write("swap.cube", Cube3d(5)))->values);
  EXPECT_THAT(Fault(Write("cut.cube", "\xef\xbb\xbfLUT_3D_SIZE 3\n0 0 0\n")),
              HasSubstr((temp_ / "cut.cube").string() + ": is not a lookup table"));
}

TEST_F(LutTest, ReadsCurvesAndCdl) {
  const auto curve = ReadLut(Write("half.cube", "LUT_1D_SIZE 3\n0 0 0\n0.25 0.5 0.5\n0.5 1 1\n"));
  // Half of red; piecewise linear with its knot on one of the 65 nodes.
  ExpectColor(*curve, {0.8f, 0.3f, 0.6f}, {0.4f, 0.3f, 0.6f}, 1e-5);
  const auto cdl = ReadLut(
      Write("grade.cc",
            "<ColorCorrection id=\"one\"><SOPNode><Slope>0.5 1 1</Slope><Offset>0.1 0 0</Offset>"
            "<Power>1 1 1</Power></SOPNode><SatNode><Saturation>1</Saturation></SatNode>"
            "</ColorCorrection>\n"));
  ExpectColor(*cdl, {0.8f, 0.3f, 0.6f}, {0.5f, 0.3f, 0.6f}, 1e-5);
  const auto clf = ReadLut(
      Write("matrix.clf",
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<ProcessList compCLFversion=\"3.0\" "
            "id=\"1\"><Matrix inBitDepth=\"32f\" outBitDepth=\"32f\"><Array dim=\"3 3\">0 0 1\n0 1 "
            "0\n1 0 0\n</Array></Matrix></ProcessList>\n"));
  ExpectColor(*clf, {0.8f, 0.3f, 0.6f}, {0.6f, 0.3f, 0.8f}, 1e-5);
}

// A correction that multiplies red; `id` as an attribute, or nothing.
std::string Correction(const std::string& slope, const std::string& id) {
  return "<ColorCorrection" + id + "><SOPNode><Slope>" + slope +
         " 1 1</Slope><Offset>0 0 0</Offset><Power>1 1 1</Power></SOPNode><SatNode><Saturation>1"
         "</Saturation></SatNode></ColorCorrection>\n";
}

// .ccc
std::string Collection(const std::string& corrections) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<ColorCorrectionCollection "
         "xmlns=\"urn:ASC:CDL:v1.2\">\n" +
         corrections + "</ColorCorrectionCollection>\n";
}

// .cdl
std::string DecisionList(const std::vector<std::string>& corrections) {
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<ColorDecisionList "
      "xmlns=\"urn:ASC:CDL:v1.2\">\n";
  for (const std::string& one : corrections) text += "<ColorDecision>" + one + "</ColorDecision>";
  return text + "</ColorDecisionList>\n";
}

TEST_F(LutTest, TakesTheFirstOfSeveralCorrections) {
  // The second has the id that OpenColorIO understands as the place of the first.
  const std::pair<std::string, std::string> ids[] = {{"", ""},
                                                     {" id=\"shot_1\"", " id=\"shot_2\""},
                                                     {" id=\"1\"", " id=\"0\""},
                                                     {"", " id=\"x\""}};
  int number = 0;
  for (const auto& [first, second] : ids) {
    const std::string a = Correction("0.5", first), b = Correction("0.25", second);
    const std::string name = "grade" + std::to_string(number++);
    for (const auto& path :
         {Write(name + ".ccc", Collection(a + b)), Write(name + "_one.ccc", Collection(a)),
          Write(name + ".cdl", DecisionList({a, b})), Write(name + "_one.cdl", DecisionList({a})),
          Write(name + ".cc", a)}) {
      SCOPED_TRACE(path.string() + first + second);
      ASSERT_EQ(Fault(path), "");
      // A linear map on the 65 nodes.
      ExpectColor(*ReadLut(path), {0.8f, 0.3f, 0.6f}, {0.4f, 0.3f, 0.6f}, 1e-5);
    }
  }
}

TEST_F(LutTest, ReadsWhatStandsThereNow) {
  const auto path = Write("one.cube", "LUT_1D_SIZE 2\n0 0 0\n1 1 1\n");
  ExpectColor(*ReadLut(path), {0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, 1e-5);
  Write("one.cube", "LUT_1D_SIZE 2\n1 1 1\n0 0 0\n");
  ExpectColor(*ReadLut(path), {0.75f, 0.5f, 0.5f}, {0.25f, 0.5f, 0.5f}, 1e-5);
}

TEST_F(LutTest, RefusesDamageInOneLine) {
  const std::string whole = Cube3d(5);
  const std::pair<std::filesystem::path, std::string> cases[] = {
      {temp_ / "none.cube", "is not a file"},
      {Write("kind.txt", whole), "is not a .cube"},
      {Write("empty.cube", ""), "has neither LUT_1D_SIZE nor"},
      {Write("cut.cube", whole.substr(0, whole.size() / 2)),
       ": is not a lookup table that can be read: At line ("},
      {Write("few.cube", "LUT_3D_SIZE 2\n0 0 0\n1 0 0\n"),
       "can be read: Incorrect number of 3D LUT entries. Found 2, expected 8."},
      {Write("domain.cube", "DOMAIN_MIN 0 1 0\nDOMAIN_MAX 1 1 1\n" + whole),
       "has a DOMAIN_MIN that is not below its DOMAIN_MAX"},
      {Write("above.cube", "DOMAIN_MIN 2 2 2\n" + whole), "has a DOMAIN_MIN that is not below"},
      {Write("nan.clf",
             "<?xml version=\"1.0\"?>\n<ProcessList compCLFversion=\"3\" id=\"a\"><Matrix "
             "inBitDepth=\"32f\" outBitDepth=\"32f\"><Array dim=\"3 3\">nan 0 0 0 1 0 0 0 1"
             "</Array></Matrix></ProcessList>\n"),
       "turns colors into values that are not finite"},
      {Write("junk.clf", "junk\n"), "can be read: is not a CTF/CLF file."},
      {Write("huge.cube", "LUT_3D_SIZE 100000\n0 0 0\n"), "LUT_3D_SIZE 100000"},
      {Write("long.cube", "LUT_1D_SIZE 1000000000\n0 0 0\n"), "LUT_1D_SIZE 1000000000"},
      {Write("none.size.cube", "LUT_3D_SIZE -3\n0 0 0\n"), "LUT_3D_SIZE -3"},
      {Write("values.cube", std::string(118, '6') + "\nLUT_1D_SIZE 2\n0 0 0\n1 1 1\n"),
       "has values before LUT_1D_SIZE or LUT_3D_SIZE"},
      {Write("title.cube", "# a comment\n\nTITLE \"x\"\n"), "has neither LUT_1D_SIZE nor"},
      {Write("nan.cube", Cube3d(5, "nan 1 1")), ""},
      {Write("inf.cube", Cube3d(5, "1 inf 1")), ""},
      {Write("words.cube", Cube3d(5, "red green blue")), "is not a lookup table"},
      {Write("cut.clf", "<?xml version=\"1.0\"?>\n<ProcessList compCLFversion=\"3.0\" id=\"1\">"),
       "is not a lookup table"},
      {Write("bad.3dl", "0 1 2\nnothing\n"), "is not a lookup table"},
      {Write("empty.ccc", ""), "is not a lookup table"},
      {Write("none.ccc", Collection("")), "is not a lookup table"},
      {Write("none.cdl", DecisionList({})), "is not a lookup table"},
      {Write("cut.ccc", Collection(Correction("0.5", "")).substr(0, 200)), "is not a lookup table"},
      {Write("cut.cdl", DecisionList({Correction("0.5", "")}).substr(0, 200)),
       "is not a lookup table"},
      {Write("words.ccc", Collection(Correction("red", ""))), "is not a lookup table"},
      {Write("nan.cdl", DecisionList({Correction("nan", "")})), ""},
      {Write("inf.ccc", Collection(Correction("inf", ""))), ""},
      {Write("cube.cdl", whole), "is not a lookup table"},
  };
  for (const auto& [path, expected] : cases) {
    const std::string fault = Fault(path);
    EXPECT_EQ(fault.rfind(path.string() + ": ", 0), 0u) << path << " gave '" << fault << "'";
    EXPECT_NE(fault.find(expected), std::string::npos) << fault;
    EXPECT_EQ(fault.find('\n'), std::string::npos) << fault;
    EXPECT_EQ(fault.find("formats"), std::string::npos) << fault;  // the attempts of OpenColorIO
    EXPECT_LT(fault.size(), path.string().size() + 250) << fault;
  }
}

TEST(ColorTableTest, ChecksItself) {
  ColorTable table;
  EXPECT_THROW(table.Check(), OptionError);
  table.size = 2;
  table.values.assign(24, 0.5f);
  EXPECT_NO_THROW(table.Check());
  table.values[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(table.Check(), OptionError);
  table.values.resize(23);
  EXPECT_THROW(table.Check(), OptionError);
}

}  // namespace
}  // namespace retint
