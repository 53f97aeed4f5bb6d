// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/job_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr char kJob[] = R"({
  "retint_job": 1,
  "scene": {"workspace": "scene", "splat": "../splat.ply", "holdout": 8},
  "options": {
    "active_threshold": 0.1,
    "mm": {"iterations": 3}
  },
  "regions": [
    {
      "name": "toy",
      "paint": [{"view": "0001.jpg", "mask": "paint.png"}],
      "edit": {"operations": [{"op": "recolor", "to": [0.2, 0.4, 1]}]},
      "options": {"depth_method": "gaussian"}
    },
    {
      "name": "wall",
      "masks": "walls",
      "strength": 0.5,
      "edit": {"operations": [{"op": "gray"}]}
    }
  ],
  "outputs": {"splats": ["out.ply", "/tmp/out.spz"], "report": "report.json"}
}
)";

class JobFile : public testing::Test {
 protected:
  EditRecipe Read(const std::string& text) {
    WriteFile(temp_ / "job.json", text);
    return ReadJob(temp_ / "job.json");
  }
  // The text with its first `from` replaced.
  static std::string With(const std::string& from, const std::string& to) {
    std::string text = kJob;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  // The message about a rejected text, without the folder.
  std::string Fault(const std::string& text) {
    try {
      Read(text);
    } catch (const InputError& error) {
      const std::string what = error.what();
      return what.substr(what.find("job.json"));
    }
    ADD_FAILURE() << "was accepted: " << text;
    return "";
  }

  TempFolder temp_;
};

TEST_F(JobFile, WarnsOfAnEditThatCannotDoWhatItSays) {
  EXPECT_TRUE(Read(kJob).warnings.empty());
  const EditRecipe job =
      Read(With(R"({"op": "gray"})", R"({"op": "white_balance", "gray": "#ff2020"})"));
  ASSERT_EQ(job.warnings.size(), 1u);
  EXPECT_THAT(job.warnings[0], HasSubstr("region 'wall': white balance cannot make #ff2020"));
}

TEST_F(JobFile, IsRead) {
  const EditRecipe job = Read(kJob);
  EXPECT_EQ(job.workspace, temp_ / "scene");
  EXPECT_EQ(job.splat, (temp_ / "../splat.ply").lexically_normal());
  EXPECT_EQ(job.holdout, 8);
  EXPECT_EQ(job.options.refit.options.active_threshold, 0.1);
  EXPECT_EQ(job.options.refit.options.mm.iterations, 3);
  ASSERT_EQ(job.regions.size(), 2u);
  EXPECT_EQ(job.regions[0].paint[0].mask, temp_ / "paint.png");
  EXPECT_EQ(job.regions[0].options.select.depth_method, "gaussian");
  EXPECT_EQ(job.regions[0].edit.operations[0].kind, ColorOperationKind::kRecolor);
  EXPECT_EQ(job.regions[1].options.select.depth_method, SelectOptions().depth_method);
  EXPECT_EQ(job.regions[1].mask_folder, temp_ / "walls");
  EXPECT_EQ(job.regions[1].strength, 0.5f);
  EXPECT_EQ(job.outputs.splats[0], temp_ / "out.ply");
  EXPECT_EQ(job.outputs.splats[1], "/tmp/out.spz");
  EXPECT_TRUE(job.outputs.masks.empty());
}

TEST_F(JobFile, ARegionMayBeAMatch) {
  const auto with = [](const std::string& region) {
    return R"({"retint_job": 1, "scene": {"workspace": "scene", "splat": "s.ply"},
      "regions": [)" +
           region + R"(], "outputs": {"splats": ["out.ply"]}})";
  };
  const EditRecipe job = Read(with(R"({"name": "a", "match": {"like": "b.ply"}})"));
  ASSERT_TRUE(job.regions[0].match);
  EXPECT_EQ(job.regions[0].match->like, temp_ / "b.ply");
  EXPECT_EQ(job.regions[0].match->map, "auto");
  EXPECT_THAT(Fault(with(R"({"name": "a", "match": {"map": "curve"}})")),
              HasSubstr("regions[0].match: `map` is auto, exposure, balance, matrix or table"));
  EXPECT_THAT(Fault(with(R"({"name": "a", "match": {"like": "b.ply", "gray": "v:1,2,3,4"}})")),
              HasSubstr("only one of `like`, `gray` and `checker`"));
  EXPECT_THAT(Fault(with(R"({"name": "a", "match": {}, "masks": "m"})")), HasSubstr("masks"));
  EXPECT_THAT(Fault(with(R"({"name": "a", "match": {"like": "out.ply"}})")),
              HasSubstr("would replace what the splat of \"like\" names"));
}

TEST_F(JobFile, ScenesMayLieElsewhereOrHaveNoWorkspace) {
  WriteFile(temp_ / "t.json", "{}");
  const EditRecipe moved =
      Read(With("\"holdout\": 8", R"("model": "1", "world_from_splat": "t.json")"));
  EXPECT_EQ(moved.model, "1");
  EXPECT_EQ(moved.world_from_splat, temp_ / "t.json");
  const EditRecipe numbers = Read(With("\"holdout\": 8", R"("world_from_splat": "1 0 0 0")"));
  EXPECT_EQ(numbers.world_from_splat, "1 0 0 0");
  const std::string many(400, '1');  // longer than a file's name can be
  EXPECT_EQ(Read(With("\"holdout\": 8", "\"world_from_splat\": \"" + many + "\"")).world_from_splat,
            many);
  const EditRecipe alone = Read(With("\"workspace\": \"scene\"", "\"views\": 12"));
  EXPECT_TRUE(alone.workspace.empty());
  EXPECT_EQ(alone.views, 12);
  EXPECT_THAT(Fault(With("\"workspace\": \"scene\"", "\"model\": \"1\"")),
              HasSubstr("scene.model: needs a workspace"));
  EXPECT_THAT(Fault(With("\"holdout\": 8", "\"views\": 12")),
              HasSubstr("scene.views: a workspace has its own views"));
  EXPECT_THAT(Fault(With("\"holdout\": 8", "\"holdout\": 1")),
              HasSubstr("scene.holdout: must be 0 (none) or at least 2"));
}

TEST_F(JobFile, NoOutputReplacesAnotherOrAnInput) {
  EXPECT_THAT(Fault(With("report.json", "out.ply")),
              HasSubstr("outputs: one of splats and report name one file"));
  EXPECT_THAT(Fault(With("report.json", "paint.png")),
              HasSubstr("outputs: report would replace what a mask names"));
  EXPECT_THAT(Fault(With("report.json", "job.json")), HasSubstr("what this job names"));
  EXPECT_THAT(Fault(With("report.json", "../splat.ply")),
              HasSubstr("what the scene's splat names"));
  EXPECT_THAT(Fault(With("report.json", "scene/images/0001.png")),
              HasSubstr("outputs.report: is not a .json"));
  EXPECT_THAT(Fault(With("\"report\": \"report.json\"", "\"report_html\": \"cameras.bin\"")),
              HasSubstr("outputs.report_html: is not an .html"));
  EXPECT_EQ(Read(With("out.ply", "../splat.ply")).outputs.splats[0],
            (temp_ / "../splat.ply").lexically_normal())
      << "the recolored splat may take its place";
  for (const char* session : {"x", "x/", "x/a.retint"}) {
    EXPECT_THAT(Fault(With("\"report\": \"report.json\"",
                           R"("masks": "x", "session": ")" + std::string(session) + '"')),
                HasSubstr("job.json:22: outputs.session: lies in the folder of masks"));
  }
  EXPECT_EQ(
      Read(With("\"report\": \"report.json\"", R"("masks": "x", "session": "xa")")).outputs.session,
      temp_ / "xa");
}

TEST_F(JobFile, PresetsAndSeedsApply) {
  const EditRecipe job =
      Read(With("\"options\": {", "\"preset\": \"paper\", \"seed\": 7, \"options\": {"));
  EXPECT_EQ(job.options.refit.options.solver, Solver::kAdam);
  EXPECT_GT(job.options.refit.options.adam.iterations, 0) << "nobody stops a job";
  EXPECT_EQ(job.options.select.cloud.seed, 7u);
  EXPECT_EQ(job.regions[1].options.projector.kind, ProjectorKind::kQuads);
}

TEST_F(JobFile, RegionsMayBeRefined) {
  const auto with = [&](const std::string& refine) {
    return With("\"strength\": 0.5", "\"strength\": 0.5, \"refine\": " + refine);
  };
  const EditRecipe job = Read(with(R"({"pixels": 2})"));
  EXPECT_FALSE(job.regions[0].refine);
  ASSERT_TRUE(job.regions[1].refine);
  EXPECT_EQ(job.regions[1].refine->pixels, 2);
  EXPECT_EQ(job.regions[1].refine->most, RefineOptions().most);
  EXPECT_TRUE(Read(with("{}")).regions[1].refine);
  EXPECT_THAT(Fault(with("true")), HasSubstr("job.json:18: regions[1].refine: is not an object"));
  EXPECT_THAT(Fault(with(R"({"pixels": 0})")), HasSubstr("regions[1].refine.pixels: "));
  EXPECT_THAT(Fault(with(R"({"size": 2})")), HasSubstr("refine.size: there is no such option"));
  EXPECT_THAT(Fault(With("\"report\": \"report.json\"", R"("finer_splat": "finer.ply")")),
              HasSubstr("outputs.finer_splat: no region has \"refine\""));
}

TEST_F(JobFile, FaultsAreToldWithLineAndKey) {
  EXPECT_THAT(Fault(With("0.1", "7")), HasSubstr("job.json:5: options.active_threshold: "));
  EXPECT_THAT(Fault(With("\"iterations\"", "\"iteration\"")),
              HasSubstr("job.json:6: options.mm.iteration: there is no such option"));
  EXPECT_THAT(Fault(With("\"mm\": {\"iterations\": 3}", "\"mm\": 3")),
              HasSubstr("job.json:6: options.mm: is not an object"));
  EXPECT_THAT(Fault(With("\"strength\"", "\"strenght\"")),
              HasSubstr("job.json:18: regions[1].strenght: there is no such key here"));
  EXPECT_THAT(Fault(With("0.5", "1.5")), HasSubstr("job.json:18: regions[1].strength: "));
  EXPECT_THAT(Fault(With("\"gray\"", "\"grey\"")), HasSubstr("job.json:19: regions[1].edit: "));
  EXPECT_THAT(Fault(With("\"wall\"", "\"toy\"")),
              HasSubstr("job.json:16: regions[1].name: comes twice"));
  EXPECT_THAT(Fault(With("\"wall\"", "\"a/b\"")), HasSubstr("job.json:16: regions[1].name: "));
  EXPECT_THAT(Fault(With("\"masks\": \"walls\",", "")), HasSubstr("either \"paint\" or \"masks\""));
  EXPECT_THAT(Fault(With("\"retint_job\": 1", "\"retint_job\": 2")), HasSubstr("job.json:2: "));
  EXPECT_THAT(Fault(With("\"out.ply\"", "3")),
              HasSubstr("job.json:22: outputs.splats[0]: is not a text"));
  EXPECT_THAT(Fault(With("\"holdout\": 8", "\"holdout\": 1")),
              HasSubstr("job.json:3: scene.holdout: must be 0 (none) or at least 2"));
  EXPECT_THAT(Fault(With("[{\"op\": \"gray\"}]", "[]")),
              HasSubstr("job.json:19: regions[1].edit: has no operation"));
  EXPECT_THAT(Fault(With("\"wall\"", '"' + std::string(201, 'w') + '"')),
              HasSubstr("job.json:16: regions[1].name: has more than 200 bytes"));
  EXPECT_THAT(Fault(With("\"report\": \"report.json\"", "\"views\": \"out.ply/views\"")),
              HasSubstr("job.json:22: outputs: views lies below one of splats, which is a file"));
  EXPECT_THAT(Fault(With("\"splat\": ", "\"spalt\": ")), HasSubstr("job.json:3: scene.spalt: "));
}

TEST_F(JobFile, TextThatIsNotJsonIsToldWithItsLine) {
  EXPECT_THAT(Fault(With("\"edit\": {", "\"edit\" {")), HasSubstr("job.json:12: is not JSON at"));
  EXPECT_THAT(Fault(std::string(kJob).substr(0, 300)), HasSubstr("is cut off"));
  EXPECT_THAT(Fault(With("\"strength\": 0.5", "\"name\": \"c\"")),
              HasSubstr("job.json:18: regions[1].name comes twice"));
  EXPECT_THAT(Fault(""), HasSubstr("is cut off"));
  EXPECT_THAT(Fault("[]"), HasSubstr("is not an object"));
  // A nested value's name contains the names of all its parents.
  EXPECT_THAT(Fault(std::string(2000, '[')), HasSubstr("job.json:1: is nested too deeply"));
  EXPECT_THAT(Fault("{\"" + std::string(10000, 'k') + "\": 1}"),
              HasSubstr("job.json:1: has a key that is too long"));
  EXPECT_THAT(Fault(With("0.5", "1e999")), HasSubstr("is out of range"));
}

TEST_F(JobFile, TheSchemaNamesEveryOption) {
  const json schema = json::parse(JobSchema());
  const json& options = schema["properties"]["options"]["properties"];
  for (const Option& option : Described(EditOptions())) {
    const json& place =
        option.applies.empty() ? options : options.at(option.applies).at("properties");
    EXPECT_TRUE(place.contains(option.name)) << option.applies << " " << option.name;
  }
  // Each key that the example uses is in the schema too.
  const json job = json::parse(kJob);
  for (const auto& [key, value] : job.items()) {
    EXPECT_TRUE(schema["properties"].contains(key)) << key;
  }
  const json& region = schema["properties"]["regions"]["items"]["properties"];
  for (const char* key : {"name", "paint", "masks", "edit", "strength", "options", "refine"}) {
    EXPECT_TRUE(region.contains(key)) << key;
  }
}

TEST_F(JobFile, TheSchemaInTheDocumentationIsThisOne) {
  EXPECT_EQ(ReadFile(std::filesystem::path(RETINT_SOURCE_DIR) / "docs/job.schema.json"),
            JobSchema())
      << "retint run --schema > docs/job.schema.json";
}

}  // namespace
}  // namespace retint
