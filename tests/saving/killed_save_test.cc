// SPDX-License-Identifier: BSD-3-Clause
// Saves that are killed on the way: afterwards there is the old file, whole, or the new one, whole.
#include <algorithm>
#include <fstream>
#include <map>

#include <gmock/gmock.h>

#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "selecting/selection_files.h"
#include "tests/saving/saved_scene.h"
#include "tests/support/killed_child.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr int kMostKills = 100;  // of a save

// Kills `save` at stops that are spread over all of it, and lets it come to its end once; calls
// `check` after each.
void KillAllAlong(const std::function<void()>& prepare, const std::function<void()>& save,
                  const std::function<void()>& check) {
  prepare();
  const KilledChild whole = KillAtStop(0, save);
  if (!whole.allowed) GTEST_SKIP() << "this machine forbids watching a process";
  ASSERT_GT(whole.stops, 4);
  const int kills = std::min(kMostKills, whole.stops);
  int killed = 0;
  for (int i = 0; i < kills; ++i) {
    const int stop = whole.stops - i * whole.stops / kills;  // from the last one
    SCOPED_TRACE("killed at stop " + std::to_string(stop) + " of " + std::to_string(whole.stops));
    prepare();
    killed += KillAtStop(stop, save).killed ? 1 : 0;
    check();
    if (testing::Test::HasFatalFailure()) return;
  }
  // A save takes some calls more or less than it did at first: threads wait for each other.
  EXPECT_GT(killed, kills / 4);
  prepare();
  EXPECT_FALSE(KillAtStop(0, save).killed);
  check();
}

struct Writer {
  const char* name;  // of the file, with the extension that it needs
  std::function<void(const fs::path&, int version)> write;
};

GaussianModel Splat(int version) {
  GaussianModel model = TinyScene(21).model;
  for (float& value : model.sh) value += 0.1F * static_cast<float>(version);
  return model;
}

std::vector<Writer> Writers() {
  std::vector<Writer> writers;
  for (const char* name : {"a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.sog", "a.glb",
                           "a.gltf", "a.usda", "a.usdc", "a.usdz"}) {
    writers.push_back(
        {name, [](const fs::path& path, int version) { WriteSplat(path, Splat(version)); }});
  }
  writers.push_back({"mask.png", [](const fs::path& path, int version) {
                       WritePng(path, Mask(30, 20, static_cast<uint8_t>(100 + version)));
                     }});
  writers.push_back({"depth.bin", [](const fs::path& path, int version) {
                       WriteDepthMap(path, DepthMap(30, 20, static_cast<float>(1 + version)));
                     }});
  writers.push_back({"cloud.ply", [](const fs::path& path, int version) {
                       SelectionCloud cloud;
                       cloud.points.resize(static_cast<size_t>(100 + version));
                       WriteCloud(path, cloud);
                     }});
  writers.push_back({"report.json", [](const fs::path& path, int version) {
                       WriteFile(path, std::string(3 << 20, static_cast<char>('a' + version)));
                     }});
  return writers;
}

class KilledSave : public testing::TestWithParam<size_t> {};

TEST_P(KilledSave, LeavesOneFileOrTheOther) {
  const Writer writer = Writers()[GetParam()];
  TempFolder folder;
  const fs::path path = folder / writer.name;
  std::array<std::string, 2> bytes;
  for (int version = 0; version < 2; ++version) {
    const fs::path other = folder / ("other" + std::to_string(version)) / writer.name;
    writer.write(other, version);
    bytes[size_t(version)] = ReadFile(other);
  }
  ASSERT_NE(bytes[0], bytes[1]);
  int is_new = 0;
  KillAllAlong([&] { WriteFile(path, bytes[0]); }, [&] { writer.write(path, 1); },
               [&] {
                 const std::string now = ReadFile(path);
                 ASSERT_TRUE(now == bytes[0] || now == bytes[1]);
                 is_new += now == bytes[1] ? 1 : 0;
               });
  if (IsSkipped()) return;
  EXPECT_GT(is_new, 0) << "a save that comes to its end leaves the new file";
}

INSTANTIATE_TEST_SUITE_P(Writers, KilledSave, testing::Range(size_t{0}, Writers().size()),
                         [](const auto& one) {
                           std::string name = Writers()[one.param].name;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

// Several files that belong together: each of them is whole.
TEST(KilledOutputs, AreWholeOneByOne) {
  TempFolder folder;
  const std::vector<std::string> names = {"a.txt", "b.txt", "c/d.txt"};
  const auto text = [](const std::string& name, int version) {
    return name + std::string(100000, static_cast<char>('0' + version));
  };
  KillAllAlong(
      [&] {
        for (const std::string& name : names) WriteFile(folder / name, text(name, 0));
      },
      [&] {
        StagedOutput staged;
        for (const std::string& name : names) {
          staged.Add(folder / name, [&](const fs::path& path) { WriteFile(path, text(name, 1)); });
        }
        staged.Commit();
      },
      [&] {
        for (const std::string& name : names) {
          const std::string now = ReadFile(folder / name);
          ASSERT_TRUE(now == text(name, 0) || now == text(name, 1)) << name;
        }
      });
}

// The moment of the final renames, which no timer hits. If it is killed before each of them,
// earlier files are new, and the others old. The next run puts all in place and leaves nothing
// else.
TEST(KilledOutputs, BetweenTheFinalRenames) {
  TempFolder folder;
  const std::vector<std::string> names = {"a.txt", "b.txt", "c/d.txt", "c/e.txt"};
  const auto prepare = [&] {
    for (const std::string& name : names) WriteFile(folder / name, "old");
  };
  const auto save = [&] {
    StagedOutput staged;
    for (const std::string& name : names) {
      staged.Add(folder / name, [](const fs::path& path) {
        // Without a rename of its own, so that those of Commit() are the only ones.
        fs::create_directories(path.parent_path());
        std::ofstream(path) << "new";
      });
    }
    staged.Commit();
  };
  prepare();
  const KilledChild whole = KillAtStop(0, save, IsRename);
  if (!whole.allowed) GTEST_SKIP() << "this machine forbids watching a process";
  ASSERT_EQ(whole.stops, static_cast<int>(names.size()));
  for (int stop = 1; stop <= whole.stops; ++stop) {
    SCOPED_TRACE("killed before rename " + std::to_string(stop));
    prepare();
    EXPECT_TRUE(KillAtStop(stop, save, IsRename).killed);
    for (size_t i = 0; i < names.size(); ++i) {
      EXPECT_EQ(ReadFile(folder / names[i]), i + 1 < static_cast<size_t>(stop) ? "new" : "old");
    }
    const KilledChild next = KillAtStop(0, save);  // a process of its own, as the next run is
    EXPECT_FALSE(next.killed);
    for (const std::string& name : names) EXPECT_EQ(ReadFile(folder / name), "new");
    size_t files = 0;
    for (const fs::path& path : ListBelow(folder.path())) files += IsFile(path) ? 1 : 0;
    EXPECT_EQ(files, names.size()) << "what the killed run left is gone";
  }
}

// A session is one thing of many files: the old one opens, or the new one.
TEST(KilledSession, OpensAsItWasOrAsItIs) {
  TempFolder folder;
  const TinyScene scene(21);
  WriteTinyScene(scene, folder.path());
  const auto session = OpenTinyScene(folder.path());
  EditTinyScene(scene, *session);
  Monitor monitor;
  const fs::path saved = folder / "a.retint", old = folder / "old";
  SessionWriter(saved).Write(TakeSnapshot(*session), monitor);
  fs::copy(saved, old, fs::copy_options::recursive);
  session->store().Do(RenameRegion{session->store().regions().regions[0].id, "renamed"});
  const SessionSnapshot after = TakeSnapshot(*session);
  SessionOptions options;
  options.backend = "cpu";
  KillAllAlong(
      [&] {
        fs::remove_all(saved);
        fs::copy(old, saved, fs::copy_options::recursive);
      },
      [&] {
        Monitor quiet;
        SessionWriter(saved).Write(after, quiet);
      },
      [&] {
        const OpenedSession opened = OpenSession(saved, options, monitor);
        const auto& regions = opened.session->store().regions().regions;
        ASSERT_EQ(regions.size(), 2u);
        ASSERT_TRUE(regions[0].name == "renamed" || regions[0].name == "left \"100 %\" \xC3\xA9")
            << regions[0].name;
        EXPECT_TRUE(SameBits(opened.session->refits().CurrentSh(), session->refits().CurrentSh()));
      });
}

}  // namespace
}  // namespace retint
