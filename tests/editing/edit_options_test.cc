// SPDX-License-Identifier: BSD-3-Clause
// The options of an edit as they are described: names, ranges, JSON, presets.
#include "editing/edit_options.h"

#include <cmath>
#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/option_json.h"
#include "recolor/finer_gaussians.h"
#include "synthetic/synthetic_scene.h"

namespace retint {
namespace {

using json::Json;
using json::Node;
using testing::HasSubstr;
using testing::ThrowsMessage;

void Read(const std::string& text, EditOptions& options) {
  const Json json = Json::parse(text);
  const std::filesystem::path path = "options.json";
  OptionList list;
  options.Describe(list);
  json::ReadOptions(Node(json, path, ""), list);
}

std::string Write(const EditOptions& options) {
  return json::OptionsJson(AllSettings(Described(options))).dump();
}

// Every value moved to another one that is allowed.
EditOptions Moved() {
  EditOptions options;
  OptionList list;
  options.Describe(list);
  for (const Option& option : list) {
    if (auto* const* toggle = std::get_if<bool*>(&option.member)) {
      **toggle = !**toggle;
    } else if (const auto* choice = std::get_if<OptionChoice>(&option.member)) {
      choice->set(*choice, (choice->get(*choice) + 1) % choice->names.size());
    } else if (auto* const* number = std::get_if<double*>(&option.member)) {
      **number = **number == 0 ? std::min(1.0 / 3, option.range.max / 3) : **number * (1 - 1.0 / 7);
    } else if (auto* const* whole = std::get_if<int*>(&option.member)) {
      **whole += 2 * option.range.multiple_of;  // odd ones stay odd
    } else {
      *std::get<uint64_t*>(option.member) += (uint64_t{1} << 62) / 3;
    }
  }
  return options;
}

TEST(EditOptions, DefaultsAreInRangeAndDescribedForPeople) {
  EXPECT_NO_THROW(EditOptions().Check());
  EXPECT_NO_THROW(Moved().Check());
  for (const Option& option : Described(EditOptions())) {
    EXPECT_FALSE(option.help.empty()) << option.name;
    EXPECT_FALSE(option.help.ends_with('.')) << option.name;
  }
}

// A number has one unit wherever it is read, written or explained, so its name, its default and its
// range must make sense in it.
TEST(EditOptions, UnitsFitNamesDefaultsAndRanges) {
  struct Plausible {
    double default_most, range_most;
  };
  const std::map<std::string, Plausible> units = {
      {"MiB", {1 << 16, 1 << 22}}, {"pixels", {10'000, 1e6}}, {"pixel footprints", {10, 100}},
      {"percent", {100, 100}},     {"degrees", {360, 360}},   {"m", {10, 1000}}};
  const std::map<std::string, std::string> unit_of_ending = {{"bytes", "bytes"},
                                                             {"mb", "MiB"},
                                                             {"pixels", "pixels"},
                                                             {"percent", "percent"},
                                                             {"degrees", "degrees"}};
  const EditOptions edit;  // the lists point into them
  const RefineOptions refine;
  const SyntheticOptions synthetic;
  OptionList list = Described(edit);
  for (const OptionList& more : {Described(refine), Described(synthetic)}) {
    list.insert(list.end(), more.begin(), more.end());
  }
  size_t with_unit = 0;
  for (const Option& option : list) {
    const auto ending = unit_of_ending.find(option.name.substr(option.name.rfind('_') + 1));
    if (ending != unit_of_ending.end() && option.name != ending->first) {
      EXPECT_EQ(option.unit, ending->second) << option.name;
    }
    if (option.unit.empty()) continue;
    ++with_unit;
    ASSERT_EQ(units.count(option.unit), 1u) << option.name << " is in " << option.unit;
    const auto [default_most, range_most] = units.at(option.unit);
    EXPECT_LE(std::abs(std::stod(option.Text())), default_most) << option.name;
    if (std::isfinite(option.range.max)) {
      EXPECT_LE(option.range.max, range_most) << option.name;
    }
  }
  EXPECT_GT(with_unit, 5u);
}

TEST(EditOptions, NamesAreUniqueInFilesAndOnTheCommandLine) {
  std::set<std::pair<std::string, std::string>> names;
  std::set<std::string> flags;
  for (const Option& option : Described(EditOptions())) {
    EXPECT_TRUE(names.emplace(option.applies, option.name).second)
        << option.applies << "." << option.name;
    EXPECT_EQ(names.count({"", option.applies}), 0u) << "a group is no option";
    if (option.Flag().empty()) continue;
    EXPECT_TRUE(flags.insert(option.Flag()).second) << option.Flag();
  }
  EXPECT_EQ(flags, (std::set<std::string>{"--depth-method", "--completion", "--paint-slack",
                                          "--target", "--outside-weight"}));
}

TEST(EditOptions, ComeBackFromJsonToTheLastBit) {
  const EditOptions moved = Moved();
  const std::string text = Write(moved);
  EditOptions read;
  EXPECT_NE(Write(read), text);
  Read(text, read);
  EXPECT_EQ(Write(read), text);
  for (const Option& option : Described(read)) {
    EXPECT_EQ(option.Get(), FindOption(Described(moved), option.name, option.applies)->Get())
        << option.name;
  }
}

TEST(EditOptions, MissingKeysKeepTheirValuesAndUnknownOnesAreIgnored) {
  EditOptions options;
  Read(R"({"sample_fraction": 0.5, "mm": {"tolerance": 0.25, "brand_new": [1]}, "other": {}})",
       options);
  EXPECT_EQ(options.select.cloud.sample_fraction, 0.5);
  EXPECT_EQ(options.refit.options.mm.tolerance, 0.25);
  options.select.cloud.sample_fraction = EditOptions().select.cloud.sample_fraction;
  options.refit.options.mm.tolerance = MmOptions().tolerance;
  EXPECT_EQ(Write(options), Write(EditOptions())) << "nothing else changed";
}

TEST(EditOptions, BadValuesAreToldByTheirPlaceInTheFile) {
  EditOptions options;
  const auto refuses = [&](const char* text, const char* says) {
    EXPECT_THAT([&] { Read(text, options); }, ThrowsMessage<InputError>(HasSubstr(says)));
  };
  refuses(R"({"mm": {"outside_weight": 8.5}})",
          "options.json: mm.outside_weight: outside weight must be in (0, 8], not 8.5");
  refuses(R"({"mm": {"outside_weight": "much"}})", "mm.outside_weight: is not a number");
  refuses(R"({"mm": {"iterations": 1.5}})", "mm.iterations: is not a whole number");
  refuses(R"({"solver": "magic"})", "solver: solver must be mm or adam, not 'magic'");
  refuses(R"({"seed": -1})", "seed: is not a whole number");
  refuses(R"({"stereo-hv": {"subpixel": 1}})", "stereo-hv.subpixel: is neither true nor false");
  refuses(R"([1])", "is not an object");
  EXPECT_EQ(Write(options), Write(EditOptions()));
}

TEST(Presets, TheDefaultIsTheDefault) {
  EXPECT_EQ(Write(PresetOptions("retint")), Write(EditOptions()));
  EXPECT_THAT([] { PresetOptions("magic"); },
              ThrowsMessage<OptionError>(HasSubstr("'magic' is not retint or paper")));
}

// All values are from the paper, STAG 2025. Values that it does not mention stay.
TEST(Presets, ThePaperSetsWhatItPublished) {
  EXPECT_NO_THROW(PresetOptions("paper").Check());
  const EditOptions paper = PresetOptions("paper"), defaults;
  const OptionList described = Described(paper), usual = Described(defaults);
  std::map<std::string, OptionValue> changed;
  for (size_t i = 0; i < described.size(); ++i) {
    if (described[i].Get() == usual[i].Get()) continue;
    changed[described[i].applies + "." + described[i].name] = described[i].Get();
  }
  const std::map<std::string, OptionValue> expected = {
      {"stereo-hv.both_sides", false},   {"stereo-hv.aggregate", std::string("min")},
      {"stereo-hv.arbitrate", false},    {"stereo-hv.subpixel", false},
      {".register_cloud", false},        {".projector", std::string("quads")},
      {".target", std::string("photo")}, {".solver", std::string("adam")},
      {".active_threshold", 0.0},        {"adam.closed_form_start", false},
      {"adam.iterations", int64_t{0}}};
  EXPECT_EQ(changed, expected);
  EXPECT_EQ(paper.select.depth_method, "stereo-hv");
  EXPECT_EQ(paper.select.cloud.sample_fraction, 0.7);
  EXPECT_EQ(paper.select.cloud.outlier_neighbors, 16);
  EXPECT_EQ(paper.select.cloud.outlier_stddev, 0.007);
  EXPECT_EQ(paper.refit.options.adam.lambda_dssim, 0.2);
}

}  // namespace
}  // namespace retint
