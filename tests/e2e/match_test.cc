// SPDX-License-Identifier: BSD-3-Clause
// retint match on the sample workspace.
#include <cmath>

#include <nlohmann/json.hpp>

#include "splat_io/splat_io.h"
#include "tests/e2e/bad_input.h"

namespace retint {
namespace {

constexpr float kY0 = 0.28209479F;  // color = 0.5 + kY0 sh + ...

// The splat with 2^stops times the light.
void Expose(const fs::path& from, double stops, const fs::path& to) {
  GaussianModel model = ReadSplat(from);
  const float gain = std::exp2(float(stops) / 2.4F);
  for (float& value : model.sh) value *= gain;
  const auto stride = size_t(3 * model.NumShCoeffs());
  for (size_t i = 0; i < model.sh.size(); ++i) {
    if (i % stride < 3) model.sh[i] += (gain - 1) * 0.555F / kY0;
  }
  WriteSplat(to, model);
}

// Mean difference of the colors without direction.
double Difference(const GaussianModel& a, const GaussianModel& b) {
  const auto stride = size_t(3 * a.NumShCoeffs());
  double sum = 0;
  for (size_t i = 0; i < a.sh.size(); ++i) {
    if (i % stride < 3) sum += double(kY0 * std::abs(a.sh[i] - b.sh[i]));
  }
  return sum / double(3 * a.NumGaussians());
}

TEST(Match, BringsASplatBackToItsPhotosAndToAnother) {
  Place place;
  const GaussianModel truth = ReadSplat(place.In("splat.ply"));
  Expose(place.In("splat.ply"), 0.5, place.In("bright.ply"));
  const double damage = Difference(ReadSplat(place.In("bright.ply")), truth);
  ASSERT_GT(damage, 0.05);

  const Arguments common = {"match", place.in.string(), "--splat", place.In("bright.ply"),
                            "--map", "exposure"};
  Arguments arguments = common;
  arguments.insert(arguments.end(),
                   {"--output", place.Out("out.ply"), "--report", place.Out("match.json"),
                    "--report-html", place.Out("match.html"), "--progress", "none"});
  CommandResult result = RunRetint(arguments);
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, testing::HasSubstr("in 2 held-out views"));
  EXPECT_THAT(FilesBelow(place.out), testing::ElementsAre("match.html", "match.json", "out.ply"));
  const GaussianModel matched = ReadSplat(place.Out("out.ply"));
  EXPECT_EQ(matched.means, truth.means);
  EXPECT_LT(Difference(matched, truth), damage / 4);  // the photos are no renders of the splat
  const auto report = nlohmann::json::parse(ReadFile(place.Out("match.json")));
  EXPECT_EQ(report["map"], "exposure");
  EXPECT_NEAR(report["gray_stops"][0].get<double>(), -0.5, 0.15);
  EXPECT_LT(report["after"], report["before"]);
  EXPECT_THAT(ReadFile(place.Out("match.html")), testing::HasSubstr("Photo of " + TinyView()));

  arguments = common;
  arguments.insert(arguments.end(), {"--like", place.In("splat.ply"), "--output",
                                     place.Out("like.ply"), "--progress", "none"});
  result = RunRetint(arguments);
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_LT(Difference(ReadSplat(place.Out("like.ply")), truth), damage / 50);

  // A job does the same, and the edit of a later region starts from it.
  nlohmann::json job = {
      {"retint_job", 1},
      {"scene",
       {{"workspace", place.in.string()}, {"splat", place.In("bright.ply")}, {"holdout", 4}}},
      {"regions", {{{"name", "colors"}, {"match", {{"map", "exposure"}}}}}},
      {"outputs", {{"splats", {place.Out("job.ply")}}, {"report", place.Out("job.json")}}}};
  WriteFile(place.In("job.json"), job.dump());
  result = RunRetint({"run", place.In("job.json"), "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, testing::HasSubstr("match        done     colors"));
  EXPECT_THAT(result.out, testing::HasSubstr("in 2 held-out views"));
  EXPECT_TRUE(ReadFile(place.Out("job.ply")) == ReadFile(place.Out("out.ply")));
  const auto found = nlohmann::json::parse(ReadFile(place.Out("job.json")))["regions"][0]["match"];
  EXPECT_EQ(found["views"], report["views"]);
  EXPECT_EQ(found["edit"], report["edit"]);

  const nlohmann::json gray = {{"operations", {{{"op", "gray"}}}}};
  job["regions"].push_back({{"name", "one"}, {"masks", place.In("masks")}, {"edit", gray}});
  job["outputs"] = {{"splats", {place.Out("two.ply")}}};
  WriteFile(place.In("job.json"), job.dump());
  result = RunRetint({"run", place.In("job.json"), "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  const GaussianModel two = ReadSplat(place.Out("two.ply"));
  EXPECT_FALSE(two.sh == matched.sh);
  EXPECT_LT(Difference(two, matched), damage / 2) << "most Gaussians are only matched";
}

// Twice as large: another frame.
Arguments LikeTwiceAsLarge(Place& place) {
  GaussianModel model = ReadSplat(place.In("splat.ply"));
  for (float& value : model.means) value *= 2;
  for (float& value : model.log_scales) value += std::log(2.0F);
  WriteSplat(place.In("large.ply"), model);
  return With(place, "match", {"--like", place.In("large.ply"), "--output", place.Out("o.ply")});
}

Arguments WithCard(const Place& place, const std::string& option, const std::string& card) {
  return With(place, "match", {option, card, "--output", place.Out("o.ply")});
}

const Row kMatchRows[] = {
    {"MatchWithoutPhotos", 3, "0 of 8 views have a photo, and a match needs two. --images names",
     [](Place& p) {
       fs::remove_all(p.in / "images");
       return With(p, "match", {"--output", p.Out("o.ply")});
     }},
    {"MatchOfASplatAlone", 3, "views have a photo, and a match needs two",
     [](Place& p) {
       return Arguments{"match", p.In("splat.ply"), "--output", p.Out("o.ply")};
     }},
    {"LikeInAnotherFrame", 3, "of the pixels that both splats cover have the same depth",
     LikeTwiceAsLarge},
    {"LikeCutOff", 3, "like.ply",
     [](Place& p) {
       fs::copy(p.in / "splat.ply", p.in / "like.ply");
       Truncate(p.in / "like.ply", 0.5);
       return With(p, "match", {"--like", p.In("like.ply"), "--output", p.Out("o.ply")});
     }},
    {"MatchInPlaceOfLike", 2, "--output would replace what --like names",
     [](Place& p) {
       fs::copy(p.in / "splat.ply", p.in / "like.ply");
       return With(p, "match", {"--like", p.In("like.ply"), "--output", p.In("like.ply")});
     }},
    {"GrayOutsideThePhoto", 3, "lies outside the photo, which has 160x120 pixels",
     [](Place& p) { return WithCard(p, "--gray", TinyView() + ":150,10,20,20"); }},
    {"GrayWithoutAnArea", 3, "name the corners in turn around an area of at least 16 pixels",
     [](Place& p) { return WithCard(p, "--gray", TinyView() + ":10,10,20,20,30,30,40,40"); }},
    {"GrayWithCrossedCorners", 3, "name the corners in turn",
     [](Place& p) { return WithCard(p, "--gray", TinyView() + ":10,10,60,60,60,10,10,60"); }},
    {"GrayInNoView", 3, "no view is named \"nowhere.png\"",
     [](Place& p) { return WithCard(p, "--gray", "nowhere.png:10,10,20,20"); }},
    {"GrayWithoutAPlace", 2, "--gray is VIEW:X,Y,WIDTH,HEIGHT",
     [](Place& p) { return WithCard(p, "--gray", TinyView()); }},
    {"CheckerThatIsNone", 3, "no ColorChecker of 24 patches is recognized there",
     [](Place& p) { return WithCard(p, "--checker", TinyView() + ":0,0,160,120"); }},
    {"MapOfUnknownKind", 2, "--map",
     [](Place& p) {
       return With(p, "match", {"--map", "curve", "--output", p.Out("o.ply")});
     }},
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Match, BadInput, testing::ValuesIn(kMatchRows), RowName);

}  // namespace retint
