// SPDX-License-Identifier: BSD-3-Clause
// The views of one run shared among the processes of mpirun: the same bytes as one process writes.
#include <cctype>
#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

// Empty without mpirun, or if retint was built without MPI.
std::vector<std::string> Launcher(int ranks) {
#ifdef RETINT_HAVE_MPI
  if (std::system("command -v mpirun >/dev/null") == 0) {
    // -q: no banner of mpirun about a failed run, because the test reads the messages of retint.
    return {"mpirun", "-q", "--allow-run-as-root", "--oversubscribe", "-n", std::to_string(ranks)};
  }
#endif
  return {};
}

#define SKIP_WITHOUT_MPIRUN() \
  if (Launcher(1).empty()) GTEST_SKIP() << "mpirun was not found, or retint is built without MPI"

// Smaller than the workspace of the other tests: every rank reads and selects on its own.
const fs::path& Workspace() {
  static const TempFolder temp;
  static const fs::path folder = [] {
    const fs::path made = temp / "scene";
    const CommandResult result = RunRetint({"synth", "--output", made.string(), "--width", "80",
                                            "--height", "60", "--photos", "6", "--quiet"});
    if (result.code != 0) throw std::runtime_error(result.err);
    return made;
  }();
  return folder;
}

std::vector<std::string> Arguments(const fs::path& output, const std::vector<std::string>& more) {
  const fs::path mask = fs::directory_iterator(Workspace() / "masks")->path();
  std::vector<std::string> arguments = {"recolor",       Workspace().string(),
                                        "--splat",       (Workspace() / "splat.ply").string(),
                                        "--view",        mask.stem().string(),
                                        "--mask",        mask.string(),
                                        "--output",      (output / "out.ply").string(),
                                        "--report",      (output / "report.json").string(),
                                        "--save-stages", (output / "stages").string(),
                                        "--backend",     "cpu"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// Without measurements of the run itself.
json Figures(const fs::path& report) {
  json figures = json::parse(ReadFile(report));
  for (const char* key : {"ranks", "sent_mb", "exchange", "stages_ms", "peak_rss_mb"}) {
    figures.erase(key);
  }
  if (figures["backend"] == "cuda") figures.erase("peak_device_mb");
  return figures;
}

void ExpectSameFiles(const fs::path& a, const fs::path& b) {
  ASSERT_EQ(FilesBelow(a), FilesBelow(b));
  for (const std::string& name : FilesBelow(a)) {
    if (fs::is_directory(a / name)) continue;
    if (name == "report.json") {
      EXPECT_EQ(Figures(a / name), Figures(b / name));
    } else {
      EXPECT_EQ(ReadFile(a / name), ReadFile(b / name)) << name;
    }
  }
}

void ExpectSameAsAlone(int ranks, const std::vector<std::string>& edit) {
  TempFolder temp;
  fs::create_directory(temp / "alone");
  fs::create_directory(temp / "shared");
  const CommandResult alone = RunRetint(Arguments(temp / "alone", edit));
  ASSERT_EQ(alone.code, 0) << alone.err;
  CommandOptions options;
  options.launcher = Launcher(ranks);
  const CommandResult shared = RunRetint(Arguments(temp / "shared", edit), options);
  ASSERT_EQ(shared.code, 0) << shared.err;
  ExpectSameFiles(temp / "alone", temp / "shared");
  const json report = json::parse(ReadFile(temp / "shared" / "report.json"));
  EXPECT_EQ(report["ranks"], ranks);
  EXPECT_EQ(report["exchange"], ranks > 1 ? json("mpi") : json());
  // One of them prints.
  EXPECT_EQ(CountLines(shared.out), CountLines(alone.out));
}

class Cluster : public testing::TestWithParam<int> {};

TEST_P(Cluster, RanksWriteTheBytesOfOneProcess) {
  SKIP_WITHOUT_MPIRUN();
  ExpectSameAsAlone(GetParam(), {"--tint", "0.2,0.4,1.0", "--holdout", "3"});
}

INSTANTIATE_TEST_SUITE_P(Ranks, Cluster, testing::Values(1, 2, 3, 4, 8));

TEST(ClusterEdits, PhotosAndALookupAreFittedAlike) {
  SKIP_WITHOUT_MPIRUN();
  ExpectSameAsAlone(2, {"--gamma", "1.6", "--target", "photo"});
}

TEST(ClusterEdits, GaussiansAreSplitAlike) {
  SKIP_WITHOUT_MPIRUN();
  ExpectSameAsAlone(2, {"--tint", "0.2,0.4,1.0", "--refine", "--set", "refine.pixels=0.5"});
}

TEST(ClusterJobs, RanksWriteTheBytesOfOneProcess) {
  SKIP_WITHOUT_MPIRUN();
  const fs::path mask = fs::directory_iterator(Workspace() / "masks")->path();
  json region = {{"name", "object"},
                 {"paint", {{{"view", mask.stem().string()}, {"mask", mask.string()}}}},
                 {"edit", {{"operations", {{{"op", "tint"}, {"color", {0.2, 0.4, 1.0}}}}}}}};
  json second = region;
  second["name"] = "again";
  second["edit"] = {{"operations", {{{"op", "gray"}}}}};
  TempFolder temp;
  const auto run = [&](const std::string& folder, int ranks) {
    fs::create_directory(temp / folder);
    WriteFile(
        temp / folder / "job.json",
        json{{"retint_job", 1},
             {"scene",
              {{"workspace", Workspace().string()},
               {"splat", (Workspace() / "splat.ply").string()}}},
             {"regions", {region, second}},
             {"outputs", {{"splats", {"out.ply"}}, {"masks", "masks"}, {"report", "report.json"}}}}
            .dump());
    CommandOptions options;
    if (ranks > 1) options.launcher = Launcher(ranks);
    const CommandResult result = RunRetint(
        {"run", (temp / folder / "job.json").string(), "--no-cache", "--backend", "cpu"}, options);
    EXPECT_EQ(result.code, 0) << result.err;
    fs::remove(temp / folder / "job.json");
  };
  run("alone", 1);
  run("shared", 3);
  EXPECT_EQ(json::parse(ReadFile(temp / "shared" / "report.json"))["ranks"], 3);
  ExpectSameFiles(temp / "alone", temp / "shared");
}

// One line of retint's, an exit code, nothing written.
void ExpectOneLine(const CommandResult& result, const fs::path& output) {
  EXPECT_NE(result.code, 0);
  std::string lines;
  for (size_t at = result.err.find("retint:"); at != std::string::npos;
       at = result.err.find("retint:", at + 1)) {
    lines += result.err.substr(at, result.err.find('\n', at) + 1 - at);
  }
  EXPECT_EQ(CountLines(lines), 1) << result.err;
  EXPECT_TRUE(FilesBelow(output).empty());
}

TEST(ClusterFaults, AWrongFlagIsToldOnce) {
  SKIP_WITHOUT_MPIRUN();
  TempFolder temp;
  CommandOptions options;
  options.launcher = Launcher(3);
  const CommandResult result = RunRetint(Arguments(temp.path(), {"--no-such-flag"}), options);
  ExpectOneLine(result, temp.path());
  EXPECT_EQ(result.code, 2);
}

TEST(ClusterFaults, AFileThatNoRankCanReadIsToldOnce) {
  SKIP_WITHOUT_MPIRUN();
  TempFolder temp;
  CommandOptions options;
  options.launcher = Launcher(3);
  auto arguments = Arguments(temp.path(), {"--tint", "1,0,0"});
  arguments[3] = "/nonexistent/splat.ply";
  const CommandResult result = RunRetint(arguments, options);
  ExpectOneLine(result, temp.path());
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.err, HasSubstr("/nonexistent/splat.ply"));
}

// mpirun starts this as rank 0, and retint as rank 1.
std::vector<std::string> BesideAShell(const std::string& script) {
  std::vector<std::string> launcher = Launcher(1);
  for (const char* word : {"sh", "-c"}) launcher.emplace_back(word);
  launcher.push_back(script);
  launcher.insert(launcher.end(), {":", "-n", "1"});
  return launcher;
}

std::string Line(const std::vector<std::string>& arguments) {
  std::string line = "'" RETINT_EXECUTABLE "'";
  for (const std::string& argument : arguments) line += " '" + argument + "'";
  return line;
}

TEST(ClusterFaults, AFileThatOneRankCannotReadEndsAll) {
  SKIP_WITHOUT_MPIRUN();
  TempFolder temp;
  const auto good = Arguments(temp.path(), {"--tint", "1,0,0"});
  auto bad = good;
  bad[3] = "/nonexistent/splat.ply";
  CommandOptions options;
  options.launcher = BesideAShell(Line(good));
  const CommandResult result = RunRetint(bad, options);
  ExpectOneLine(result, temp.path());
  EXPECT_THAT(result.err, HasSubstr("retint: rank 1: /nonexistent/splat.ply"));
}

TEST(ClusterFaults, ARankThatIsKilledEndsAll) {
  SKIP_WITHOUT_MPIRUN();
  TempFolder temp;
  // A fit without end.
  const auto arguments = Arguments(temp.path(), {"--tint", "1,0,0", "--set", "solver=adam", "--set",
                                                 "iterations=1000000000", "--quiet"});
  CommandOptions options;
  options.launcher = BesideAShell(Line(arguments) + " & sleep 1; kill -9 $!; wait $!; exit 137");
  const CommandResult result = RunRetint(arguments, options);
  EXPECT_NE(result.code, 0);
  EXPECT_TRUE(FilesBelow(temp.path()).empty()) << result.err;
}

int CountDevices() {
  int count = 0;
  for (const auto& entry : fs::directory_iterator("/dev")) {
    const std::string name = entry.path().filename().string();
    count += name.size() == 7 && name.starts_with("nvidia") && std::isdigit(name.back());
  }
  return count;
}

// A run on the GPUs, into `output`; its report.
json RunOnDevices(const fs::path& output, int ranks, const std::vector<std::string>& variables,
                  const std::vector<std::string>& edit) {
  fs::create_directory(output);
  std::vector<std::string> arguments = Arguments(output, {});
  arguments.back() = "cuda";  // of --backend
  arguments.insert(arguments.end(), edit.begin(), edit.end());
  CommandOptions options;
  options.launcher = {"env"};
  options.launcher.insert(options.launcher.end(), variables.begin(), variables.end());
  for (const std::string& word : Launcher(ranks)) options.launcher.push_back(word);
  const CommandResult result = RunRetint(arguments, options);
  EXPECT_EQ(result.code, 0) << result.err;
  return result.code == 0 ? json::parse(ReadFile(output / "report.json")) : json();
}

// The same bytes whichever way the sums take, by NCCL or through the hosts, and run after run.
// RETINT_NCCL says where the library lies, if the loader does not find it.
void ExpectSameEitherWay(int ranks, const std::vector<std::string>& edit) {
  TempFolder temp;
  std::vector<fs::path> outputs;
  const auto run = [&](const std::string& name, const std::vector<std::string>& variables,
                       const char* exchange) {
    outputs.push_back(temp / name);
    EXPECT_EQ(RunOnDevices(temp / name, ranks, variables, edit)["exchange"], exchange) << name;
  };
  run("nccl", {}, "nccl");
  run("again", {}, "nccl");
  run("off", {"RETINT_NCCL=off"}, "mpi");
  run("missing", {"RETINT_NCCL=/nonexistent/libnccl.so.2"}, "mpi");
  run("shared", {"CUDA_VISIBLE_DEVICES=0"}, "mpi");
  for (const fs::path& output : outputs) ExpectSameFiles(outputs.front(), output);
}

class ClusterDevices : public testing::TestWithParam<std::vector<std::string>> {};

TEST_P(ClusterDevices, SumTheSameByNcclAndThroughTheHosts) {
  SKIP_WITHOUT_MPIRUN();
  if (CountDevices() < 2) GTEST_SKIP() << "two GPUs are needed";
  ExpectSameEitherWay(2, GetParam());
}

INSTANTIATE_TEST_SUITE_P(Edits, ClusterDevices,
                         testing::Values(std::vector<std::string>{"--tint", "0.2,0.4,1.0"},
                                         std::vector<std::string>{"--gamma", "1.6"},
                                         std::vector<std::string>{"--tint", "0.2,0.4,1.0", "--set",
                                                                  "solver=adam", "--set",
                                                                  "iterations=60"}));

}  // namespace
}  // namespace retint
