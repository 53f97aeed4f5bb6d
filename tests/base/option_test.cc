// SPDX-License-Identifier: BSD-3-Clause
#include "base/option.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"

namespace retint {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

enum class Engine { kSteam, kDiesel };

struct SteamOptions {
  double pressure = 4;
  bool whistle = true;
  void Describe(OptionList& list) {
    list.push_back({.name = "pressure",
                    .member = &pressure,
                    .range = OptionRange::AboveTo(0, 16),
                    .help = "of the boiler",
                    .unit = "bar",
                    .tier = OptionTier::kOccasional});
    list.push_back({.name = "whistle", .member = &whistle});
  }
};

struct TrainOptions {
  Engine engine = Engine::kSteam;
  std::string color = "green";
  int wagons = 3;
  uint64_t parcels = uint64_t{5} << 40;
  SteamOptions steam;
  void Describe(OptionList& list) {
    list.push_back({.name = "engine", .member = ChoiceOf(engine, {"steam", "diesel"})});
    list.push_back({.name = "color", .member = ChoiceOf(color, {"green", "black"})});
    list.push_back(
        {.name = "wagons", .member = &wagons, .range = {.min = -2, .max = 40, .multiple_of = 1}});
    list.push_back({.name = "parcels_on_board", .member = &parcels});
    DescribePart(steam, "steam", list);
  }
};

const Option& Require(const OptionList& list, const std::string& name) {
  const Option* option = FindOption(list, name);
  if (!option) throw std::runtime_error("no option " + name);
  return *option;
}

TEST(OptionRange, HoldsItsEndsOrLeavesThemOut) {
  EXPECT_TRUE(OptionRange::Closed(0, 1).Contains(0));
  EXPECT_TRUE(OptionRange::Closed(0, 1).Contains(1));
  EXPECT_FALSE(OptionRange::Closed(0, 1).Contains(std::nextafter(1.0, 2.0)));
  EXPECT_FALSE(OptionRange::AboveTo(0, 1).Contains(0));
  EXPECT_TRUE(OptionRange::AboveTo(0, 1).Contains(1));
  EXPECT_TRUE(OptionRange::UpTo(0, 1).Contains(0));
  EXPECT_FALSE(OptionRange::UpTo(0, 1).Contains(1));
  EXPECT_FALSE(OptionRange::Between(0, 1).Contains(0));
  EXPECT_FALSE(OptionRange::Between(0, 1).Contains(1));
  EXPECT_TRUE(OptionRange::Between(0, 1).Contains(0.5));
  EXPECT_FALSE(OptionRange::Above(0).Contains(0));
  EXPECT_TRUE(OptionRange::AtLeast(0).Contains(1e300));
  const OptionRange sixteens = {.min = 16, .max = 64, .multiple_of = 16};
  EXPECT_TRUE(sixteens.Contains(48));
  EXPECT_FALSE(sixteens.Contains(40));
}

TEST(OptionRange, HoldsNothingThatIsNotFinite) {
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(OptionRange().Contains(value));
    EXPECT_FALSE(OptionRange::AtLeast(0).Contains(value));
  }
}

TEST(OptionRange, IsToldInWords) {
  EXPECT_EQ(OptionRange::Closed(0, 1).Text(), "in [0, 1]");
  EXPECT_EQ(OptionRange::AboveTo(0, 0.5).Text(), "in (0, 0.5]");
  EXPECT_EQ(OptionRange::UpTo(0, 1).Text(), "in [0, 1)");
  EXPECT_EQ(OptionRange::AtLeast(2).Text(), "at least 2");
  EXPECT_EQ(OptionRange::Above(0).Text(), "above 0");
  EXPECT_EQ(OptionRange().Text(), "finite");
  EXPECT_EQ((OptionRange{.min = 16, .max = 64, .multiple_of = 16}).Text(),
            "in [16, 64], a multiple of 16");
}

TEST(Option, ReadsTheMember) {
  TrainOptions train;
  OptionList list;
  train.Describe(list);
  EXPECT_EQ(Require(list, "engine").Get(), OptionValue(std::string("steam")));
  EXPECT_EQ(Require(list, "color").Get(), OptionValue(std::string("green")));
  EXPECT_EQ(Require(list, "wagons").Get(), OptionValue(int64_t{3}));
  EXPECT_EQ(Require(list, "parcels_on_board").Get(), OptionValue(uint64_t{5} << 40));
  EXPECT_EQ(Require(list, "pressure").Get(), OptionValue(4.0));
  EXPECT_EQ(Require(list, "whistle").Get(), OptionValue(true));
  EXPECT_EQ(Require(list, "parcels_on_board").Text(), "5497558138880");
  EXPECT_EQ(Require(list, "parcels_on_board").Label(), "parcels on board");
  train.steam.pressure = 0.1;
  EXPECT_EQ(Require(list, "pressure").Text(), "0.1");
}

TEST(Option, SetsTheMember) {
  TrainOptions train;
  OptionList list;
  train.Describe(list);
  Require(list, "engine").Set(std::string("diesel"));
  Require(list, "color").Set(std::string("black"));
  Require(list, "wagons").Set(int64_t{-2});
  Require(list, "parcels_on_board").Set(uint64_t{7});
  Require(list, "pressure").Set(int64_t{16});  // a whole number is a number
  Require(list, "whistle").Set(false);
  EXPECT_EQ(train.engine, Engine::kDiesel);
  EXPECT_EQ(train.color, "black");
  EXPECT_EQ(train.wagons, -2);
  EXPECT_EQ(train.parcels, 7u);
  EXPECT_EQ(train.steam.pressure, 16);
  EXPECT_FALSE(train.steam.whistle);
}

TEST(Option, RefusesWhatDoesNotFitAndChangesNothing) {
  TrainOptions train;
  OptionList list;
  train.Describe(list);
  const auto refuses = [&](const char* name, const OptionValue& value, const char* says) {
    const std::string before = OptionKey(list);
    EXPECT_THAT([&] { Require(list, name).Set(value); },
                ThrowsMessage<OptionError>(HasSubstr(says)));
    EXPECT_EQ(OptionKey(list), before);
  };
  refuses("pressure", 16.5, "pressure must be in (0, 16] bar, not 16.5");
  refuses("pressure", 0.0, "not 0");
  refuses("pressure", std::numeric_limits<double>::quiet_NaN(), "not nan");
  refuses("pressure", std::string("much"), "another kind");
  refuses("pressure", true, "another kind");
  refuses("wagons", int64_t{41}, "wagons must be in [-2, 40], not 41");
  refuses("wagons", 2.5, "another kind");
  refuses("wagons", uint64_t{1} << 40, "another kind");
  refuses("parcels_on_board", int64_t{-1}, "another kind");
  refuses("engine", std::string("sail"), "engine must be steam or diesel, not 'sail'");
  refuses("engine", int64_t{1}, "engine must be steam or diesel");
  refuses("whistle", int64_t{1}, "whistle is either true or false");
}

TEST(Option, ChecksWhatIsThere) {
  TrainOptions train;
  EXPECT_NO_THROW(CheckRanges(train));
  train.steam.pressure = -1;
  EXPECT_THAT([&] { CheckRanges(train); },
              ThrowsMessage<OptionError>(HasSubstr("pressure must be in (0, 16] bar, not -1")));
  train = {};
  train.color = "pink";
  EXPECT_THAT([&] { CheckRanges(train); },
              ThrowsMessage<OptionError>(HasSubstr("color must be green or black")));
  train = {};
  train.engine = static_cast<Engine>(7);
  EXPECT_THAT([&] { CheckRanges(train); }, ThrowsMessage<OptionError>(HasSubstr("engine")));
}

TEST(Option, AppliesWhereItsChoiceIsMade) {
  TrainOptions train;
  OptionList list;
  train.Describe(list);
  EXPECT_TRUE(Applies(list, Require(list, "pressure")));
  EXPECT_TRUE(Applies(list, Require(list, "wagons")));
  train.engine = Engine::kDiesel;
  EXPECT_FALSE(Applies(list, Require(list, "pressure")));
  EXPECT_TRUE(Applies(list, Require(list, "wagons")));
}

TEST(Option, KeyTellsSettingsThatApplyApart) {
  TrainOptions train;
  const std::string key = OptionKey(Described(train));
  EXPECT_EQ(key, OptionKey(Described(TrainOptions())));
  train.steam.pressure = std::nextafter(4.0, 5.0);
  EXPECT_NE(OptionKey(Described(train)), key) << "to the last bit";
  train = {};
  train.parcels += 1;
  EXPECT_NE(OptionKey(Described(train)), key);
  train = {};
  train.engine = Engine::kDiesel;
  const std::string diesel = OptionKey(Described(train));
  EXPECT_NE(diesel, key);
  train.steam.pressure = 9;
  EXPECT_EQ(OptionKey(Described(train)), diesel) << "steam does not matter to a diesel";
}

}  // namespace
}  // namespace retint
