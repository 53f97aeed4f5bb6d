// SPDX-License-Identifier: BSD-3-Clause
#include "saving/session_file.h"

#include <atomic>
#include <fstream>
#include <set>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files.h"
#include "reporting/report.h"
#include "scene/image_checks.h"
#include "tests/saving/saved_session.h"
#include "tests/support/file_size_limit.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::ordered_json;

using SessionFile = SavedSession;

void ExpectSame(const SelectionSource& a, const SelectionSource& b) {
  ASSERT_EQ(a.painted.size(), b.painted.size());
  for (size_t i = 0; i < a.painted.size(); ++i) {
    EXPECT_EQ(a.painted[i].name, b.painted[i].name);
    EXPECT_EQ(a.painted[i].mask.data, b.painted[i].mask.data);
    EXPECT_EQ(a.painted[i].outlined_by, b.painted[i].outlined_by);
    EXPECT_EQ(a.painted[i].camera.camera, b.painted[i].camera.camera);
    EXPECT_EQ(a.painted[i].camera.cam_from_world.rotation.coeffs(),
              b.painted[i].camera.cam_from_world.rotation.coeffs());
    EXPECT_EQ(a.painted[i].camera.cam_from_world.translation,
              b.painted[i].camera.cam_from_world.translation);
  }
  ASSERT_EQ(a.reports.size(), b.reports.size());
  for (size_t i = 0; i < a.reports.size(); ++i) {
    EXPECT_EQ(a.reports[i].outlined_by, b.reports[i].outlined_by);
  }
  EXPECT_EQ(RegistrationsToJson(a.reports), RegistrationsToJson(b.reports));
  EXPECT_EQ(OptionKey(Described(a.select)), OptionKey(Described(b.select)));
  EXPECT_EQ(OptionKey(Described(a.projector)), OptionKey(Described(b.projector)));
  EXPECT_EQ(a.cloud.sources, b.cloud.sources);
  ASSERT_EQ(a.cloud.points.size(), b.cloud.points.size());
  for (size_t i = 0; i < a.cloud.points.size(); ++i) {
    const SelectionPoint &p = a.cloud.points[i], &q = b.cloud.points[i];
    EXPECT_TRUE(p.position == q.position && p.normal == q.normal && p.footprint == q.footprint &&
                p.confidence == q.confidence && p.coverage == q.coverage && p.color == q.color &&
                p.source == q.source && p.x == q.x && p.y == q.y)
        << "point " << i;
  }
}

void ExpectSame(const RegionSet& a, const RegionSet& b) {
  ASSERT_EQ(a.regions.size(), b.regions.size());
  for (size_t i = 0; i < a.regions.size(); ++i) {
    const Region &one = a.regions[i], &two = b.regions[i];
    EXPECT_EQ(one.id, two.id);
    EXPECT_EQ(one.name, two.name);
    EXPECT_EQ(one.visible, two.visible);
    EXPECT_EQ(one.strength, two.strength);
    EXPECT_EQ(one.edit, two.edit);
    EXPECT_EQ(one.selection->id, two.selection->id);
    EXPECT_TRUE(SameBits(one.selection->shares, two.selection->shares));
    ASSERT_EQ(one.selection->masks.size(), two.selection->masks.size());
    for (const auto& [name, mask] : one.selection->masks) {
      EXPECT_EQ(mask.data, two.selection->masks.at(name).data) << name;
    }
    ExpectSame(one.selection->source, two.selection->source);
    ASSERT_EQ(one.fit == nullptr, two.fit == nullptr);
    if (!one.fit) continue;
    EXPECT_EQ(one.fit->key, two.fit->key);
    EXPECT_EQ(one.fit->indices, two.fit->indices);
    EXPECT_TRUE(SameBits(one.fit->sh, two.fit->sh));
    EXPECT_EQ(one.fit->summary.losses, two.fit->summary.losses);
    EXPECT_EQ(one.fit->summary.BriefReport(), two.fit->summary.BriefReport());
  }
}

TEST_F(SessionFile, RestoresEverythingToTheLastBit) {
  Save();
  const OpenedSession opened = Load();
  ExpectSame(opened.session->store().regions(), session_->store().regions());
  EXPECT_TRUE(SameBits(opened.session->refits().CurrentSh(), session_->refits().CurrentSh()));
  EXPECT_FALSE(SameBits(opened.session->refits().CurrentSh(), scene_.model.sh));
  ASSERT_NE(opened.draft, nullptr);
  ExpectSame(*opened.draft, TinySource(scene_));
  EXPECT_EQ(Json::parse(opened.view), Json::parse(Snapshot().view));
  EXPECT_FALSE(opened.session->store().history().CanUndo());
  EXPECT_EQ(opened.session->store().job().options.mm.ridge_dc, 0.1 / 3.0);
}

// Sessions of version 1 had the options of all solvers side by side, one number of iterations, and
// 0 for the solver's default.
TEST_F(SessionFile, ReadsTheOptionsOfVersionOne) {
  Save();
  const auto with_iterations = [&](int iterations) {
    ChangeManifest([&](Json& json) {
      json["version"] = 1;
      json["refit"] = {{"target", "photo"},        {"solver", "mm"},
                       {"iterations", iterations}, {"closed_form_start", false},
                       {"acceleration", "none"},   {"learning_rate", 0.25},
                       {"lambda_dssim", 0.5},      {"ridge_dc", 0.125},
                       {"ridge_rest", 0.25},       {"outside_weight", 0.75},
                       {"active_threshold", 0.5},  {"min_weight", 0.0625},
                       {"tolerance", 0.375},       {"seed", 9},
                       {"region_cache_bytes", 77}};
    });
    return Load().session->store().job();
  };
  RefitJob job = with_iterations(5);
  const RefitOptions& options = job.options;
  EXPECT_EQ(job.target, TargetKind::kPhoto);
  EXPECT_EQ(options.mm.iterations, 5);
  EXPECT_EQ(options.mm.ridge_dc, 0.125);
  EXPECT_EQ(options.mm.ridge_rest, 0.25);
  EXPECT_EQ(options.mm.outside_weight, 0.75);
  EXPECT_EQ(options.mm.min_weight, 0.0625);
  EXPECT_EQ(options.mm.tolerance, 0.375);
  EXPECT_FALSE(options.adam.closed_form_start);
  EXPECT_EQ(options.adam.learning_rate, 0.25);
  EXPECT_EQ(options.adam.lambda_dssim, 0.5);
  EXPECT_EQ(options.adam.seed, 9u);
  EXPECT_EQ(options.active_threshold, 0.5);
  EXPECT_EQ(options.RegionCacheBytes(), 77u);
  job = with_iterations(0);
  EXPECT_EQ(job.options.mm.iterations, MmOptions().iterations);
  EXPECT_EQ(job.options.adam.iterations, 3000);
}

TEST_F(SessionFile, OptionsThatItDoesNotHoldHaveTheirDefaults) {
  Save();
  ChangeManifest([](Json& json) { json["refit"] = {{"mm", {{"tolerance", 0.5}}}}; });
  const RefitJob job = Load().session->store().job();
  EXPECT_EQ(job.options.mm.tolerance, 0.5);
  RefitJob defaults;
  defaults.options.mm.tolerance = 0.5;
  EXPECT_EQ(OptionKey(Described(job)), OptionKey(Described(defaults)));
}

TEST_F(SessionFile, GoesOnWhereItWas) {
  Save();
  const OpenedSession opened = Load();
  Monitor monitor;
  for (EditSession* session : {session_.get(), opened.session.get()}) {
    session->refits().Refit(session->store().job(), monitor);
    const RegionId added = session->store().Add("new", MasksOf(scene_), scene_.shares,
                                                ColorEdit::Tint({0.5F, 1, 1}), monitor);
    EXPECT_EQ(added, 3u) << "ids go on";
  }
  EXPECT_TRUE(SameBits(opened.session->refits().CurrentSh(), session_->refits().CurrentSh()));
  ASSERT_TRUE(opened.session->store().history().Undo());
  EXPECT_EQ(opened.session->store().regions().regions.size(), 2u);
}

TEST_F(SessionFile, AnOutdatedFitComesBackWhenItFitsAgain) {
  // Undone before saving: the fit of the second region is up to date again.
  const RegionId right = session_->store().regions().regions[1].id;
  const Region now = session_->store().regions().regions[1];
  Save();
  const OpenedSession opened = Load();
  const ColorEdit before = ColorEdit::Tint({1.0F, 0.1F, 0.1F});
  session_->store().Do(SetEdit{right, before, 1});
  opened.session->store().Do(SetEdit{right, before, 1});
  EXPECT_TRUE(SameBits(opened.session->refits().CurrentSh(), session_->refits().CurrentSh()));
  ASSERT_NE(now.fit, nullptr);
  EXPECT_EQ(opened.session->store().regions().regions[1].fit->key,
            opened.session->store().regions().FitKey(1, opened.session->store().job()));
}

TEST_F(SessionFile, SharedSelectionsAreWrittenOnceAndStayShared) {
  session_->store().Duplicate(session_->store().regions().regions[0].id);
  Save();
  EXPECT_EQ(ReadManifest()["selections"].size(), 2u);
  const OpenedSession opened = Load();
  const auto& regions = opened.session->store().regions().regions;
  ASSERT_EQ(regions.size(), 3u);
  EXPECT_EQ(regions[0].selection, regions[1].selection);
  EXPECT_EQ(regions[1].name, regions[0].name + " copy");
}

TEST_F(SessionFile, OpensTheAffineEditsOfOlderSessions) {
  Save();
  ChangeManifest([](Json& json) {
    const auto make_old = [&](size_t region, const Json& gain, const Json& offset) {
      json["regions"][region].erase("edit");
      json["regions"][region]["gain"] = gain;
      json["regions"][region]["offset"] = offset;
    };
    make_old(0, {0.5, 0, 0, 0, 0.25, 0, 0, 0, 2}, {0, 0, 0});
    make_old(1, {1, 0.5, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.25});
  });
  const auto opened = Load();
  const auto& regions = opened.session->store().regions().regions;
  ASSERT_EQ(regions.size(), 2u);
  EXPECT_EQ(regions[0].edit, ColorEdit::Tint({0.5F, 0.25F, 2.0F}));
  AffineColor mixing;
  mixing.gain(0, 1) = 0.5F;
  mixing.offset[2] = 0.25F;
  EXPECT_EQ(regions[1].edit, ColorEdit::FromAffine(mixing));
}

TEST_F(SessionFile, SavingAgainWritesOnlyWhatIsNew) {
  Monitor monitor;
  SessionWriter writer(File());
  SessionSnapshot snapshot = Snapshot();
  writer.Write(snapshot, monitor);
  EXPECT_EQ(writer.parts_written(), 5) << "two selections, two fits, the draft";
  session_->store().Do(SetEdit{1, ColorEdit::Tint({0.3F, 0.3F, 0.3F})});
  snapshot.regions = session_->store().regions();
  writer.Write(snapshot, monitor);
  EXPECT_EQ(writer.parts_written(), 0);
  EXPECT_TRUE(SameBits(Load().session->refits().CurrentSh(), session_->refits().CurrentSh()));
  // Unused files are removed.
  session_->store().Do(RemoveRegion{1});
  snapshot.regions = session_->store().regions();
  snapshot.draft = nullptr;
  writer.Write(snapshot, monitor);
  EXPECT_EQ(writer.parts_written(), 0);
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(File())) {
    names.insert(entry.path().filename().string());
  }
  EXPECT_EQ(names.size(), 3u) << "session.json, a selection, a fit";
  EXPECT_EQ(Load().draft, nullptr);
}

TEST_F(SessionFile, SavingOverWhatAnotherSavedKeepsItWhole) {
  Monitor monitor;
  SessionWriter writer(File());
  writer.Write(Snapshot(), monitor);
  const FloatArray saved = Load().session->refits().CurrentSh();
  // The second of the others finds the names of our parts free.
  for (int i = 0; i < 2; ++i) {
    const OpenedSession other = Load();
    SessionSnapshot changed = TakeSnapshot(*other.session);
    auto mine = std::make_shared<RegionSelection>(*changed.regions.regions[0].selection);
    mine->masks.begin()->second(0, 0) ^= 255;
    for (Region& region : changed.regions.regions) region.selection = mine;
    SessionWriter(File()).Write(changed, monitor);
  }
  writer.Write(Snapshot(), monitor);
  EXPECT_TRUE(SameBits(Load().session->refits().CurrentSh(), saved));
}

TEST_F(SessionFile, MovesWithItsScene) {
  Save();
  const FloatArray expected = session_->refits().CurrentSh();
  const TempFolder elsewhere;
  fs::rename(folder_ / "ws", elsewhere / "ws");
  fs::rename(File(), elsewhere / "edit.retint");
  EXPECT_TRUE(SameBits(Load(elsewhere / "edit.retint").session->refits().CurrentSh(), expected));
  // And is found again where only the session moved.
  const TempFolder third;
  fs::rename(elsewhere / "ws", folder_ / "ws");
  fs::create_directory(third / "deep");
  fs::rename(elsewhere / "edit.retint", third / "deep" / "edit.retint");
  EXPECT_TRUE(
      SameBits(Load(third / "deep" / "edit.retint").session->refits().CurrentSh(), expected));
}

TEST_F(SessionFile, RefusesAnotherSplat) {
  Save();
  GaussianModel other = scene_.model;
  other.sh[5] += 0.25F;
  WriteSplat(folder_ / "ws" / "splat.ply", other);
  EXPECT_THAT(Refusal(), HasSubstr("splat.ply: is not the splat that the session edit.retint"));
  fs::remove(folder_ / "ws" / "splat.ply");
  EXPECT_THAT(Refusal(), HasSubstr("its splat is not there"));
  fs::remove_all(folder_ / "ws");
  EXPECT_THAT(Refusal(), HasSubstr("its workspace is not there"));
}

// A SOG's own file names the pictures that its values are in.
TEST_F(SessionFile, RefusesASplatOfWhichAnotherFileChanged) {
  const fs::path splat = folder_ / "ws/sog/meta.json";
  WriteSplat(splat, scene_.model);
  SessionOptions options;
  options.backend = "cpu";
  Monitor monitor;
  session_ = EditSession::Open(folder_ / "ws", splat, options, monitor);
  Save();
  Load();
  // As programs saved it that knew the sum of the named file alone.
  const std::string saved = ReadFile(Manifest());
  Json earlier = Json::parse(saved);
  earlier["splat"]["xxh64"] = HexText(ChecksumFile(splat).xxh64);
  WriteFile(Manifest(), earlier.dump());
  Load();
  WriteFile(Manifest(), saved);
  GaussianModel turned = scene_.model;
  for (size_t i = 1; i < turned.quats_wxyz.size(); i += 4) turned.quats_wxyz[i] += 0.5F;
  WriteSplat(folder_ / "turned/meta.json", turned);
  fs::copy_file(folder_ / "turned/quats.webp", folder_ / "ws/sog/quats.webp",
                fs::copy_options::overwrite_existing);
  EXPECT_THAT(Refusal(), HasSubstr("meta.json: is not the splat that the session edit.retint"));
}

TEST_F(SessionFile, RefusesWhatIsNoSession) {
  EXPECT_THAT(Refusal(), HasSubstr("no such folder"));
  fs::create_directory(File());
  EXPECT_THAT(Refusal(), HasSubstr("holds no session.json"));
  WriteFile(Manifest(), "{}");
  EXPECT_THAT(Refusal(), HasSubstr("session.json: is not a session"));
  WriteFile(Manifest(), R"({"format": "a", "format": "b"})");
  EXPECT_THAT(Refusal(), HasSubstr("session.json: has \"format\" twice in one object"));
  WriteFile(Manifest(), "");
  EXPECT_THAT(Refusal(), HasSubstr("session.json: is not JSON"));
  WriteFile(Manifest(), std::string(100000, '['));
  EXPECT_THAT(Refusal(), HasSubstr("session.json: is not JSON"));
}

TEST_F(SessionFile, RefusesOtherVersions) {
  Save();
  ChangeManifest([](Json& json) { json["version"] = 3; });
  EXPECT_THAT(Refusal(), HasSubstr("session.json: is of version 3"));
  EXPECT_THAT(Refusal(), HasSubstr("a newer one is needed"));
  ChangeManifest([](Json& json) { json["version"] = 0; });
  EXPECT_THAT(Refusal(), HasSubstr("is of version 0"));
}

TEST_F(SessionFile, NamesTheFaultOfAValue) {
  Save();
  const Json good = ReadManifest();
  const auto expect = [&](const std::function<void(Json&)>& change, const std::string& fault) {
    Json json = good;
    change(json);
    WriteFile(Manifest(), json.dump());
    EXPECT_THAT(Refusal(), HasSubstr("session.json: " + fault));
  };
  expect([](Json& j) { j["regions"][1]["strength"] = nullptr; },
         "regions[1].strength: is not a number");
  expect([](Json& j) { j["regions"][1]["strength"] = 2; }, "regions[1].strength: is not between");
  const auto operation = [](Json& j) -> Json& { return j["regions"][0]["edit"]["operations"][0]; };
  expect([&](Json& j) { operation(j)["color"][1] = 1e300; },
         "regions[0].edit: operations[0].color is not a finite");
  expect([&](Json& j) { operation(j)["color"][0] = -1; }, "regions[0].edit: operations[0]: tint:");
  expect([&](Json& j) { operation(j)["color"].push_back(1); },
         "regions[0].edit: operations[0].col");
  expect([&](Json& j) { operation(j)["op"] = "paint"; },
         "regions[0].edit: operations[0]: there is");
  expect(
      [&](Json& j) {
        operation(j) = {{"op", "recolor"}, {"to", {0, 0, 1}}};
      },
      "regions[0].edit: its colors were not measured: \"from\" is missing");
  expect([&](Json& j) { j["regions"][0].erase("edit"); }, "regions[0]: has no \"edit\"");
  expect([](Json& j) { j["regions"][0].erase("name"); }, "regions[0]: has no \"name\"");
  expect([](Json& j) { j["regions"][1]["id"] = 1; }, "regions[1].id: comes twice");
  expect([](Json& j) { j["regions"][1]["selection"] = 7; }, "regions[1].selection: there is no");
  expect([](Json& j) { j["refit"]["solver"] = "magic"; },
         "refit.solver: solver must be mm or adam, not 'magic'");
  expect([](Json& j) { j["refit"]["mm"]["tolerance"] = -1; },
         "refit.mm.tolerance: tolerance must be at least 0, not -1");
  expect([](Json& j) { j["selections"][0]["folder"] = "selection-/../.."; },
         "selections[0].folder: 'selection-/../..' is not the name of a part");
  expect([](Json& j) { j["selections"][0]["masks"][0]["view"] = "nowhere"; },
         "selections[0].masks[0]: the workspace has no view nowhere");
  expect([](Json& j) { j["regions"][0]["fit"]["count"] = 1000000; }, "regions[0].fit.count: is");
  expect([](Json& j) { j["draft"]["painted"][0]["camera"]["params"][0] = 0; },
         "draft.painted[0].camera.params: focal length");
  expect(
      [](Json& j) {
        Json& camera = j["draft"]["painted"][0]["camera"];
        camera["model"] = 2;
      },
      "draft.painted[0].camera: the workspace has no distorted photo");
  expect([](Json& j) { j["view"] = 3; }, "view: is not an object");
  expect([](Json& j) { j["splat"]["xxh64"] = "12"; }, "splat.xxh64: is not sixteen");
}

TEST_F(SessionFile, AFullDiskLeavesTheOldSession) {
  Save();
  const FloatArray saved = Load().session->refits().CurrentSh();
  session_->store().history().Undo();
  Monitor monitor;
  RefitJob job = session_->store().job();
  job.options.mm.iterations = 2;
  session_->refits().Refit(job, monitor);
  {
    const FileSizeLimit limit(2000);
    EXPECT_THROW(SessionWriter(File()).Write(Snapshot(), monitor), RunError);
    try {
      SessionWriter(folder_ / "new.retint").Write(Snapshot(), monitor);
      ADD_FAILURE() << "the disk is full";
    } catch (const RunError& error) {
      EXPECT_THAT(error.what(), HasSubstr("new.retint"));
    }
  }
  EXPECT_TRUE(SameBits(Load().session->refits().CurrentSh(), saved));
  EXPECT_FALSE(fs::exists(folder_ / "new.retint"));
  size_t entries = 0;
  for (const auto& entry : fs::directory_iterator(folder_.path())) entries += entry.exists();
  EXPECT_EQ(entries, 2u) << "the workspace and the session, nothing left behind";
}

TEST_F(SessionFile, SaysWhyItsFolderCannotBeMade) {
  fs::create_directory_symlink(folder_ / "missing", folder_ / "link");
  Monitor monitor;
  try {
    SessionWriter(folder_ / "link" / "new.retint").Write(Snapshot(), monitor);
    ADD_FAILURE() << "there is no such folder";
  } catch (const RunError& error) {
    EXPECT_THAT(error.what(), HasSubstr("new.retint"));
    // The first fault, not its consequence, a missing file.
    EXPECT_THAT(error.what(), Not(HasSubstr("No such file")));
  }
}

TEST_F(SessionFile, ACancelledSaveLeavesTheOldSession) {
  Save();
  const std::string before = ReadFile(Manifest());
  Monitor cancelled;
  cancelled.Cancel();
  EXPECT_THROW(SessionWriter(File()).Write(Snapshot(), cancelled), Cancelled);
  EXPECT_THROW(SessionWriter(folder_ / "new.retint").Write(Snapshot(), cancelled), Cancelled);
  EXPECT_EQ(ReadFile(Manifest()), before);
  EXPECT_FALSE(fs::exists(folder_ / "new.retint"));
  EXPECT_NO_THROW(Load());
}

TEST_F(SessionFile, DoesNotWriteOverOtherThings) {
  Monitor monitor;
  fs::create_directory(File());
  WriteFile(File() / "mine.txt", "precious");
  EXPECT_THROW(SessionWriter(File()).Write(Snapshot(), monitor), RunError);
  EXPECT_EQ(ReadFile(File() / "mine.txt"), "precious");
  WriteFile(folder_ / "file", "precious");
  EXPECT_THROW(SessionWriter(folder_ / "file").Write(Snapshot(), monitor), RunError);
  // A file of the user's in a session stays.
  fs::remove(File() / "mine.txt");
  Save();
  WriteFile(File() / "notes.txt", "precious");
  Save();
  EXPECT_EQ(ReadFile(File() / "notes.txt"), "precious");
}

TEST_F(SessionFile, RefusesToSaveWhatItCannot) {
  Monitor monitor;
  EXPECT_THROW(TakeSnapshot(*MakeSession(scene_)), InputError);
  SessionSnapshot snapshot = Snapshot();
  snapshot.view = "[1";
  EXPECT_THROW(SessionWriter(File()).Write(snapshot, monitor), OptionError);
  EXPECT_FALSE(fs::exists(File()));
}

TEST_F(SessionFile, AReaderSeesOneSessionOrTheOther) {
  Save();
  const FloatArray one = session_->refits().CurrentSh();
  const SessionSnapshot first = Snapshot();
  session_->store().Do(RemoveRegion{1});
  const SessionSnapshot second = Snapshot();
  const FloatArray two = session_->refits().CurrentSh();
  std::atomic<bool> stop = false;
  std::thread writer([&] {
    Monitor monitor;
    // A writer of its own each time: every part is written anew and the old ones are removed.
    for (int i = 0; !stop; ++i) SessionWriter(File()).Write(i % 2 == 0 ? second : first, monitor);
  });
  int seen_one = 0, seen_two = 0, other = 0;
  for (int i = 0; i < 30; ++i) {
    try {
      const FloatArray sh = Load().session->refits().CurrentSh();
      (SameBits(sh, one) ? seen_one : SameBits(sh, two) ? seen_two : other) += 1;
    } catch (const InputError&) {
      // Overtaken four times in a row.
    }
  }
  stop = true;
  writer.join();
  EXPECT_EQ(other, 0);
  EXPECT_GT(seen_one + seen_two, 0);
}

// Notes about the scene's own files are no reason to read a session again.
TEST_F(SessionFile, OneThatIsWholeIsReadOnce) {
  const fs::path splat = folder_ / "ws" / "splat.ply";
  std::ofstream(splat, std::ios::app) << "xyz";
  session_ = OpenTinyScene(folder_.path());
  ASSERT_EQ(session_->warnings().size(), session_->scene().workspace().warnings.size() + 1);
  Save();
  int saves = 0;
  // Saved again whenever it is read: whoever reads it again never comes to an end.
  Monitor monitor([&](const Progress& progress) {
    if (progress.stage != "load") return;
    ++saves;
    const fs::path manifest = File() / "session.json";
    fs::last_write_time(manifest, fs::last_write_time(manifest) + std::chrono::seconds(1));
  });
  SessionOptions options;
  options.backend = "cpu";
  EXPECT_THAT(OpenSession(File(), options, monitor).session->warnings(),
              testing::Contains(testing::HasSubstr("3 bytes after the last")));
  EXPECT_GT(saves, 0);
}

TEST_F(SessionFile, TellsAboutItselfWithoutItsParts) {
  Save();
  fs::remove_all(FirstPart("selections", "folder"));
  const SessionInfo info = ReadSessionInfo(File());
  EXPECT_EQ(info.splat, folder_ / "ws" / "splat.ply");
  EXPECT_EQ(info.workspace, folder_ / "ws");
  EXPECT_EQ(info.regions, 2u);
  EXPECT_TRUE(info.saved.empty());
}

}  // namespace
}  // namespace retint
