// SPDX-License-Identifier: BSD-3-Clause
// `retint run`: the same files as the verbs make, and nothing done twice.
#include <algorithm>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class JobRun : public testing::Test {
 protected:
  JobRun() {
    job_ = {{"retint_job", 1},
            {"scene",
             {{"workspace", TinyWorkspace().string()},
              {"splat", (TinyWorkspace() / "splat.ply").string()}}},
            {"regions",
             {{{"name", "object"},
               {"paint", {{{"view", TinyView()}, {"mask", TinyMask().string()}}}},
               {"edit", {{"operations", {{{"op", "tint"}, {"color", {0.2, 0.4, 1.0}}}}}}}}}},
            {"outputs", {{"splats", {"out.ply"}}}}};
  }
  CommandResult Run(const std::vector<std::string>& more = {}, const CommandOptions& how = {}) {
    WriteFile(temp_ / "job.json", job_.dump(2));
    std::vector<std::string> arguments = {"run", (temp_ / "job.json").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunRetint(arguments, how);
  }
  // The state of each stage that was printed: "select kept, project kept, refit done".
  static std::string States(const std::string& out) {
    std::string states;
    std::istringstream lines(out);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string stage, state;
      words >> stage >> state;
      if (stage == "to" || state.empty() || stage == "look") continue;
      states += (states.empty() ? "" : ", ") + stage + " " + state;
    }
    return states;
  }

  TempFolder temp_;
  json job_;
};

TEST_F(JobRun, MakesTheBytesThatRecolorMakesAndGoesOnFromWhatChanged) {
  const CommandResult recolor = RunRetint(
      {"recolor", TinyWorkspace().string(), "--splat", (TinyWorkspace() / "splat.ply").string(),
       "--view", TinyView(), "--mask", TinyMask().string(), "--tint", "0.2,0.4,1", "--output",
       (temp_ / "recolor.ply").string()});
  ASSERT_EQ(recolor.code, 0) << recolor.err;
  const std::string expected = ReadFile(temp_ / "recolor.ply");

  const CommandResult first = Run();
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_EQ(States(first.out), "select done, project done, refit done");
  EXPECT_TRUE(ReadFile(temp_ / "out.ply") == expected);

  fs::remove(temp_ / "out.ply");
  const CommandResult again = Run();
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(States(again.out), "select kept, project kept, refit kept");
  EXPECT_TRUE(ReadFile(temp_ / "out.ply") == expected);

  job_["regions"][0]["strength"] = 0.5;
  const CommandResult weaker = Run();
  ASSERT_EQ(weaker.code, 0) << weaker.err;
  EXPECT_EQ(States(weaker.out), "select kept, project kept, refit done");
  EXPECT_FALSE(ReadFile(temp_ / "out.ply") == expected);

  job_["regions"][0]["strength"] = 1;
  job_["regions"][0]["options"]["completion"] = "off";
  EXPECT_EQ(States(Run().out), "select kept, project done, refit done");
}

TEST_F(JobRun, InPartsMakesTheBytesOfRecolorInParts) {
  const std::vector<std::string> parts = {"--out-of-core", "on", "--index",
                                          (temp_ / "splat.index").string()};
  std::vector<std::string> recolor = {"recolor",  TinyWorkspace().string(),
                                      "--view",   TinyView(),
                                      "--mask",   TinyMask().string(),
                                      "--tint",   "0.2,0.4,1",
                                      "--output", (temp_ / "recolor.ply").string()};
  recolor.insert(recolor.end(), parts.begin(), parts.end());
  const CommandResult verb = RunRetint(recolor);
  ASSERT_EQ(verb.code, 0) << verb.err;
  EXPECT_THAT(verb.out, HasSubstr("in parts"));
  job_["outputs"]["report"] = "report.json";
  const CommandResult job = Run(parts);
  ASSERT_EQ(job.code, 0) << job.err;
  EXPECT_TRUE(json::parse(ReadFile(temp_ / "report.json")).contains("out_of_core"));
  EXPECT_TRUE(ReadFile(temp_ / "out.ply") == ReadFile(temp_ / "recolor.ply"));
}

TEST_F(JobRun, TheSeedOfTheCommandTakesThePlaceOfTheJobs) {
  job_["seed"] = 7;
  ASSERT_EQ(Run().code, 0);
  EXPECT_THAT(Run({"--dry-run", "--seed", "7"}).out, HasSubstr("refit        kept"));
  const CommandResult other = Run({"--dry-run", "--seed", "8"});
  EXPECT_EQ(other.code, 0) << other.err;
  EXPECT_THAT(other.out, Not(HasSubstr("kept")));
}

TEST_F(JobRun, ADamagedResultIsMadeAnew) {
  ASSERT_EQ(Run().code, 0);
  const std::string expected = ReadFile(temp_ / "out.ply");
  for (const auto& entry : fs::recursive_directory_iterator(temp_ / "job.cache")) {
    if (!entry.is_regular_file()) continue;
    std::string bytes = ReadFile(entry.path());
    bytes.resize(bytes.size() / 2);
    WriteFile(entry.path(), bytes);
  }
  const CommandResult again = Run();
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_TRUE(ReadFile(temp_ / "out.ply") == expected);
  EXPECT_EQ(States(again.out), "select done, project done, refit done");
  EXPECT_EQ(States(Run().out), "select kept, project kept, refit kept");
}

TEST_F(JobRun, LaterRegionsStartFromEarlierOnes) {
  json second = job_["regions"][0];
  second["name"] = "again";
  second["edit"] = {{"operations", {{{"op", "gray"}}}}};
  job_["regions"].push_back(second);
  job_["outputs"]["masks"] = "masks";
  job_["outputs"]["report"] = "report.json";
  job_["outputs"]["session"] = "edit.retint";
  ASSERT_EQ(Run({"--no-cache"}).code, 0);
  EXPECT_FALSE(fs::exists(temp_ / "job.cache"));
  const std::string expected = ReadFile(temp_ / "out.ply");
  EXPECT_EQ(json::parse(ReadFile(temp_ / "report.json"))["regions"].size(), 2u);
  EXPECT_TRUE(IsFolder(temp_ / "masks" / "again"));
  EXPECT_TRUE(IsFile(temp_ / "edit.retint" / "session.json"));

  // With results of one region kept, the other's are the same bytes.
  ASSERT_EQ(Run().code, 0);
  EXPECT_TRUE(ReadFile(temp_ / "out.ply") == expected);
  job_["regions"][1]["edit"] = {{"operations", {{{"op", "invert"}}}}};
  EXPECT_EQ(States(Run().out),
            "select kept, project kept, select kept, project kept, refit kept, refit done");
}

TEST_F(JobRun, FinerGaussiansAreThoseOfRecolorAndAreKept) {
  const CommandResult recolor = RunRetint(
      {"recolor", TinyWorkspace().string(), "--splat", (TinyWorkspace() / "splat.ply").string(),
       "--view", TinyView(), "--mask", TinyMask().string(), "--tint", "0.2,0.4,1", "--refine",
       "--set", "refine.pixels=0.5", "--set", "refine.most=3000", "--output",
       (temp_ / "recolor.ply").string()});
  ASSERT_EQ(recolor.code, 0) << recolor.err;
  const std::string expected = ReadFile(temp_ / "recolor.ply");

  job_["regions"][0]["refine"] = {{"pixels", 0.5}, {"most", 3000}};
  job_["outputs"]["report"] = "report.json";
  const CommandResult first = Run();
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_EQ(States(first.out), "select done, project done, refine done, refit done");
  EXPECT_THAT(first.err, HasSubstr("region 'object': parts of 0.5 pixels would be more than 3000"));
  EXPECT_TRUE(ReadFile(temp_ / "out.ply") == expected);
  const json report = json::parse(ReadFile(temp_ / "report.json"));
  EXPECT_GT(report["refine"]["parts"], report["refine"]["split"]);
  EXPECT_EQ(report["regions"][0]["refine"], report["refine"]);

  fs::remove(temp_ / "out.ply");
  EXPECT_EQ(States(Run().out), "select kept, project kept, refine kept, refit kept");
  EXPECT_TRUE(ReadFile(temp_ / "out.ply") == expected);
  // Colors do not change which Gaussians are split, unless they are paint.
  job_["regions"][0]["edit"] = {{"operations", {{{"op", "gray"}}}}};
  EXPECT_EQ(States(Run({"--dry-run"}).out),
            "select kept, project kept, refine kept, refit to");  // "to do"
  job_["regions"][0]["refine"]["share"] = 0.6;
  EXPECT_EQ(States(Run({"--dry-run"}).out), "select kept, project kept, refine to, refit to");
}

TEST_F(JobRun, AllRegionsAreFittedOnTheFinerSplat) {
  json second = job_["regions"][0];
  second["name"] = "again";
  second["edit"] = {{"operations", {{{"op", "gray"}}}}};
  second["refine"] = {{"pixels", 0.5}, {"most", 3000}};
  job_["regions"].push_back(second);
  job_["outputs"]["report"] = "report.json";
  job_["outputs"]["session"] = "edit.retint";
  CommandResult result = Run();
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.err, HasSubstr("outputs.session: needs \"finer_splat\""));
  job_["outputs"]["finer_splat"] = "finer.ply";
  result = Run();
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(States(result.out),
            "select done, project done, select kept, project kept, refine done, refit done, refit "
            "done");
  const std::string expected = ReadFile(temp_ / "out.ply");
  EXPECT_EQ(fs::file_size(temp_ / "finer.ply"), expected.size());
  const json report = json::parse(ReadFile(temp_ / "report.json"));
  EXPECT_FALSE(report.contains("refine"));
  EXPECT_FALSE(report["regions"][0].contains("refine"));
  EXPECT_GT(report["regions"][1]["refine"]["split"], 0);
  const json session = json::parse(ReadFile(temp_ / "edit.retint/session.json"));
  EXPECT_EQ(session["splat"]["relative"], "finer.ply");
  EXPECT_EQ(session["regions"][0]["fit"]["current"], true);
  EXPECT_EQ(session["regions"][1]["fit"]["current"], true);
  // The same bytes from kept results, even if one of them is damaged.
  for (const auto& entry : fs::directory_iterator(temp_ / "job.cache")) {
    if (entry.path().filename().string().starts_with("refine-")) {
      WriteFile(entry.path() / "refined.bin", "damaged");
    }
  }
  result = Run();
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(States(result.out),
            "select kept, project kept, select kept, project kept, refine done, refit kept, refit "
            "kept");
  EXPECT_TRUE(ReadFile(temp_ / "out.ply") == expected);
}

TEST_F(JobRun, WarnsAsRecolorDoes) {
  const fs::path other = temp_ / "other.ply";  // whose colors are not the photos'
  GaussianModel model = ReadSplat(TinyWorkspace() / "splat.ply");
  for (size_t i = 0; i < model.sh.size(); i += size_t(model.NumShCoeffs()) * 3) {
    std::rotate(&model.sh[i], &model.sh[i + 1], &model.sh[i + 3]);
  }
  WriteSplat(other, model);
  job_["scene"]["splat"] = other.string();
  job_["outputs"] = {{"splats", {"out.splat"}}, {"report_html", "page.html"}};
  const CommandResult job = Run({"--progress", "none"});
  ASSERT_EQ(job.code, 0) << job.err;
  const CommandResult recolor =
      RunRetint({"recolor", TinyWorkspace().string(), "--splat", other.string(), "--view",
                 TinyView(), "--mask", TinyMask().string(), "--tint", "0.2,0.4,1", "--output",
                 (temp_ / "out.splat").string(), "--progress", "none", "--report-html",
                 (temp_ / "recolor.html").string()});
  ASSERT_EQ(recolor.code, 0) << recolor.err;
  EXPECT_GT(CountLines(recolor.err), 1);
  EXPECT_EQ(job.err, recolor.err);
  // So do the pages.
  const auto told = [&](const char* page) {
    const std::string html = ReadFile(temp_ / page);
    const size_t from = html.find("<ul class=\"warnings\">");
    return from == html.npos ? "" : html.substr(from, html.find("</ul>", from) - from);
  };
  EXPECT_THAT(told("page.html"), HasSubstr("photo"));
  EXPECT_EQ(told("page.html"), told("recolor.html"));
}

TEST_F(JobRun, WhereTheSessionCannotBeNothingIsWritten) {
  WriteFile(temp_ / "mine/notes.txt", "not a session");
  job_["outputs"]["session"] = "mine";
  const CommandResult result = Run();
  EXPECT_EQ(result.code, 4);
  EXPECT_THAT(result.err, HasSubstr("something else has this name"));
  EXPECT_FALSE(fs::exists(temp_ / "out.ply"));
}

TEST_F(JobRun, MasksThatAreReadStay) {
  for (const std::string folder : {"made/object", "views"}) {
    const fs::path mask = temp_ / folder / (TinyView() + ".png");
    fs::create_directories(mask.parent_path());
    fs::copy_file(TinyMask(), mask);
    job_["regions"][0]["paint"][0]["mask"] = mask.string();
    job_["outputs"] = {{"splats", {"out.ply"}}, {"masks", "made"}, {"views", "views"}};
    const CommandResult result = Run();
    EXPECT_EQ(result.code, 3);
    EXPECT_THAT(result.err, HasSubstr(" would replace " + mask.string() + ", which is an input"));
    EXPECT_EQ(ReadFile(mask), ReadFile(TinyMask()));
    fs::remove(mask);
  }
}

TEST_F(JobRun, WarnsOfViewsWithoutAMask) {
  job_["regions"][0].erase("paint");
  job_["regions"][0]["masks"] = (TinyWorkspace() / "masks").string();
  const CommandResult result = Run({"--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("region 'object': 7 of 8 views have no mask and take no part"));
}

TEST_F(JobRun, ADryRunWritesNothing) {
  const CommandResult result = Run({"--dry-run"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(States(result.out), "select to, project to, refit to");  // "to do"
  EXPECT_EQ(FilesBelow(temp_.path()), std::vector<std::string>{"job.json"});
}

TEST_F(JobRun, WhatWasFinishedBeforeAnInterruptionStays) {
  CommandOptions interrupt;
  interrupt.interrupt_when = [](const std::string& err) {
    return err.find("refit") != std::string::npos;
  };
  const CommandResult cut = Run({"--progress", "json"}, interrupt);
  ASSERT_EQ(cut.code, 130) << cut.err;
  EXPECT_FALSE(fs::exists(temp_ / "out.ply"));
  EXPECT_EQ(States(Run().out), "select kept, project kept, refit done");
}

TEST_F(JobRun, BadInputIsOneLine) {
  job_["regions"][0]["paint"][0]["view"] = "nowhere.jpg";
  CommandResult result = Run();
  EXPECT_EQ(result.code, 3);
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
  EXPECT_THAT(result.err, HasSubstr("nowhere.jpg"));
  job_["regions"][0]["paint"][0]["view"] = TinyView();
  job_["outputs"]["splats"][0] = "out.what";
  result = Run();
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
  job_["outputs"]["splats"][0] = "out.ply";
  job_["scene"]["holdout"] = -1;
  result = Run();
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.err, HasSubstr("scene.holdout"));
  EXPECT_EQ(RunRetint({"run"}).code, 2);
  EXPECT_THAT(FilesBelow(temp_.path()), Not(testing::Contains(HasSubstr("out."))));
}

}  // namespace
}  // namespace retint
