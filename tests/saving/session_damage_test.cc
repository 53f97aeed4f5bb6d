// SPDX-License-Identifier: BSD-3-Clause
// Sessions with truncated, changed or forged files. Derived data is computed again, other damage is
// rejected.
#include <cstdint>
#include <cstring>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files.h"
#include "scene/image_checks.h"
#include "tests/saving/saved_session.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;
using SessionDamage = SavedSession;

void Flip(const fs::path& path) {
  std::string bytes = ReadFile(path);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  WriteFile(path, bytes);
}

// `told`: the message about the part whose bytes are cut, extended, changed or gone.
template <typename Told>
void ExpectEachDamage(const fs::path& part, const Told& told) {
  const std::string bytes = ReadFile(part);
  WriteFile(part, bytes.substr(0, bytes.size() - 1));
  EXPECT_THAT(told(), HasSubstr(part.string() + ": truncated"));
  WriteFile(part, bytes + "x");
  EXPECT_THAT(told(), HasSubstr(part.string() + ": has "));
  WriteFile(part, bytes);
  Flip(part);
  EXPECT_THAT(told(), HasSubstr(part.string() + ": is damaged"));
  fs::remove(part);
  EXPECT_THAT(told(), HasSubstr(part.string() + ": is missing"));
  WriteFile(part, bytes);
}

TEST_F(SessionDamage, RefusesDamagedInputs) {
  Save();
  ExpectEachDamage(FirstPart("selections", "folder") / "painted" / "free view 1.png",
                   [&] { return Refusal(); });
  // Masks that nobody painted.
  const fs::path other = File() / ReadManifest()["selections"][1]["folder"].get<std::string>();
  ExpectEachDamage(other / "masks" / "view2.png", [&] { return Refusal(); });
  EXPECT_TRUE(Load().session->warnings().empty());
}

TEST_F(SessionDamage, OpensWithoutAFitThatIsDamaged) {
  Save();
  const fs::path fit = File() / ReadManifest()["regions"][0]["fit"]["file"].get<std::string>();
  ExpectEachDamage(fit, [&] { return Warning(); });
  Flip(fit);
  EXPECT_THAT(Warning(), HasSubstr("make the fit of region 'left \"100 %\" é' again"));
  const OpenedSession opened = Load();
  EXPECT_EQ(opened.session->store().regions().regions[0].fit, nullptr);
  EXPECT_NE(opened.session->store().regions().regions[1].fit, nullptr);
  Monitor monitor;
  for (EditSession* session : {session_.get(), opened.session.get()}) {
    session->refits().Refit(session->store().job(), monitor);
  }
  EXPECT_TRUE(SameBits(opened.session->refits().CurrentSh(), session_->refits().CurrentSh()));
}

TEST_F(SessionDamage, MakesWhatIsDamagedOfASelectionAgain) {
  Save();
  const fs::path folder = FirstPart("selections", "folder");
  const fs::path shares = folder / "shares.bin", cloud = folder / "cloud.ply";
  const fs::path painted = folder / "masks" / (ViewName(0) + ".png"),
                 mask = folder / "masks" / "view2.png";
  for (const fs::path& part : {shares, cloud, painted, mask}) {
    ExpectEachDamage(part, [&] { return Warning(); });
  }
  const RegionSelection& whole = *session_->store().regions().regions[0].selection;
  const auto opened_without = [&](const std::vector<fs::path>& parts) {
    std::vector<std::string> kept;
    for (const fs::path& part : parts) {
      kept.push_back(ReadFile(part));
      Flip(part);
    }
    const auto selection = Load().session->store().regions().regions[0].selection;
    for (size_t i = 0; i < parts.size(); ++i) WriteFile(parts[i], kept[i]);
    EXPECT_EQ(selection->shares.size(), whole.shares.size());
    EXPECT_EQ(selection->masks.size(), whole.masks.size());
    return selection;
  };
  Monitor monitor;
  const auto by_masks = opened_without({shares});
  EXPECT_EQ(by_masks->shares, session_->store().SharesOf(whole.masks, monitor));
  // The paint itself, and the rendered shares elsewhere.
  EXPECT_EQ(opened_without({painted})->masks.at(ViewName(0)).data, scene_.masks[0].data);
  EXPECT_EQ(opened_without({mask})->masks.at("view2").data,
            session_->selection().SeenFrom(whole, scene_.cameras[2]).data);
  EXPECT_TRUE(AnySet(opened_without({shares, mask})->masks.at("view2")));
  EXPECT_TRUE(opened_without({shares, cloud, painted, mask}) != nullptr);
}

// As a forger would: checksums that fit the damage.
TEST_F(SessionDamage, ValuesThatCannotBeAreDamage) {
  Save();
  const auto forge = [&](const fs::path& part, Json& entry, size_t at, auto value) {
    std::string bytes = ReadFile(part);
    std::memcpy(bytes.data() + at, &value, sizeof(value));
    WriteFile(part, bytes);
    entry["xxh64"] = HexText(Xxh64(bytes));
  };
  Json json = ReadManifest();
  const Json good = json;
  const fs::path shares = FirstPart("selections", "folder") / "shares.bin";
  const std::string old_shares = ReadFile(shares);
  forge(shares, json["selections"][0]["shares"], 8, std::numeric_limits<float>::quiet_NaN());
  WriteFile(Manifest(), json.dump());
  EXPECT_THAT(Warning(), HasSubstr("shares.bin: holds a share that is not finite"));
  WriteFile(shares, old_shares);

  const fs::path fit = File() / good["regions"][0]["fit"]["file"].get<std::string>();
  const std::string old_fit = ReadFile(fit);
  for (const int32_t index : {-1, 1 << 30}) {
    json = good;
    forge(fit, json["regions"][0]["fit"], 0, index);
    WriteFile(Manifest(), json.dump());
    EXPECT_THAT(Warning(), HasSubstr("is not ascending or no Gaussian's"));
    WriteFile(fit, old_fit);
  }
  json = good;
  forge(fit, json["regions"][0]["fit"], old_fit.size() - 4, std::numeric_limits<float>::infinity());
  WriteFile(Manifest(), json.dump());
  EXPECT_THAT(Warning(), HasSubstr("holds a coefficient that is not finite"));
}

// Whatever is wrong with session.json, it is either refused as bad input or still a session.
TEST_F(SessionDamage, AnyDamageToTheManifestIsAnswered) {
  Save();
  const std::string good = ReadFile(Manifest());
  TestRandom random(5);
  int refused = 0, accepted = 0;
  const auto attempt = [&](const std::string& bytes) {
    WriteFile(Manifest(), bytes);
    try {
      Load();
      ++accepted;
    } catch (const InputError& error) {
      ++refused;
      EXPECT_THAT(error.what(), HasSubstr(folder_.path().string())) << "names a file";
    }
  };
  for (int i = 0; i < 60; ++i) {  // the last two bytes are "}\n"
    attempt(good.substr(0, static_cast<size_t>(random.Uniform(0, double(good.size() - 2)))));
  }
  EXPECT_EQ(refused, 60);
  for (int i = 0; i < 200; ++i) {
    std::string bytes = good;
    for (int flips = 0; flips < 1 + i % 3; ++flips) {
      bytes[static_cast<size_t>(random.Uniform(0, double(bytes.size())))] =
          static_cast<char>(random.Uniform(0, 256));
    }
    attempt(bytes);
  }
  EXPECT_GT(refused, 100);
  // Every value of the file replaced by each of these.
  const Json odd[] = {nullptr,           -1,  1e300,         0.5,
                      uint64_t{1} << 63, "x", Json::array(), Json::object()};
  const Json flat = Json::parse(good).flatten();
  size_t step = 0;
  for (const auto& [pointer, value] : flat.items()) {
    Json json = Json::parse(good);
    json[Json::json_pointer(pointer)] = odd[step++ % std::size(odd)];
    attempt(json.dump());
  }
  EXPECT_GT(accepted, 0) << "some keys are only for people";
  WriteFile(Manifest(), good);
  EXPECT_NO_THROW(Load());
}

}  // namespace
}  // namespace retint
