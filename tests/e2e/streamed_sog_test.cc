// SPDX-License-Identifier: BSD-3-Clause
// Editing a streamed SOG: the edit reaches every level of detail, and nothing else changes.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "splat_io/splat_io.h"
#include "splat_io/streamed_sog.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"
#include "tests/support/folder_contents.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

// Every `step`-th Gaussian of the sample on one side of a plane; the painted object is on the near
// side, and the far one is well away from it.
GaussianModel Part(const GaussianModel& all, size_t step, bool near) {
  constexpr float kPlane = -0.7F;
  const size_t width = static_cast<size_t>(all.NumShCoeffs()) * 3;
  GaussianModel part;
  part.sh_degree = all.sh_degree;
  const auto add = [](const FloatArray& from, size_t size, size_t g, FloatArray& to) {
    to.insert(to.end(), &from[size * g], &from[size * g] + size);
  };
  for (size_t g = 0; g < all.NumGaussians(); g += step) {
    if ((all.means[3 * g] >= kPlane) != near) continue;
    add(all.means, 3, g, part.means);
    add(all.quats_wxyz, 4, g, part.quats_wxyz);
    add(all.log_scales, 3, g, part.log_scales);
    add(all.opacity_logits, 1, g, part.opacity_logits);
    add(all.sh, width, g, part.sh);
  }
  return part;
}

// The sample in two levels of two chunks, the near one first.
void WriteLevels(const fs::path& folder) {
  const GaussianModel all = ReadSplat(TinyWorkspace() / "splat.ply");
  json names = json::array(), leaves = json::array();
  for (size_t level = 0; level < 2; ++level) {
    for (size_t chunk = 0; chunk < 2; ++chunk) {
      const std::string name = std::to_string(level) + "_" + std::to_string(chunk) + "/meta.json";
      const GaussianModel part = Part(all, level == 0 ? 2 : 8, chunk == 0);
      WriteSplat(folder / name, part);
      leaves[chunk]["lods"][std::to_string(level)] = {
          {"file", names.size()}, {"offset", 0}, {"count", part.NumGaussians()}};
      names.push_back(name);
    }
  }
  const json index = {
      {"version", 1}, {"lodLevels", 2}, {"filenames", names}, {"tree", {{"children", leaves}}}};
  WriteFile(folder / "lod-meta.json", index.dump());
}

size_t NumLessRed(const GaussianModel& before, const GaussianModel& after) {
  constexpr float kLess = 0.3F;  // 0.08 of 1
  const size_t width = static_cast<size_t>(before.NumShCoeffs()) * 3;
  size_t count = 0;
  for (size_t g = 0; g < before.NumGaussians(); ++g) {
    count += after.sh[width * g] < before.sh[width * g] - kLess;
  }
  return count;
}

TEST(StreamedSog, AnEditReachesEveryLevelAndNothingElse) {
  const TempFolder temp;
  const fs::path in = temp / "in" / "lod-meta.json", out = temp / "out" / "lod-meta.json";
  WriteLevels(in.parent_path());
  const auto was = FolderContents(in.parent_path());
  const CommandResult result =
      RunRetint({"recolor", TinyWorkspace().string(), "--splat", in.string(), "--output",
                 out.string(), "--completion", "off", "--set", "iterations=2", "--view", TinyView(),
                 "--mask", TinyMask().string(), "--tint", "0.2,0.4,1"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(FolderContents(in.parent_path()), was);
  const auto is = FolderContents(out.parent_path());
  ASSERT_EQ(is.size(), was.size());
  for (const auto& [name, bytes] : was) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(is.contains(name));
    const bool has_colors = name.find("/sh") != std::string::npos || name.ends_with("/meta.json");
    if (name.find("_0/") != std::string::npos && has_colors) {
      EXPECT_NE(is.at(name), bytes);
    } else {
      EXPECT_EQ(is.at(name), bytes);
    }
  }
  const GaussianModel before = ReadSplat(in), after = ReadSplat(out);
  Monitor monitor;
  EXPECT_GT(NumLessRed(before, after), 200U);
  EXPECT_GT(NumLessRed(ReadStreamedLevel(before, 1, monitor), ReadStreamedLevel(after, 1, monitor)),
            40U);
}

TEST(StreamedSog, IsNotMadeFromAnotherFormat) {
  const TempFolder temp;
  const std::string splat = (TinyWorkspace() / "splat.ply").string(),
                    out = (temp / "out" / "lod-meta.json").string();
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"convert", splat, out},
        {"match", TinyWorkspace().string(), "--output", out}}) {
    const CommandResult result = RunRetint(command);
    EXPECT_EQ(result.code, 2);
    EXPECT_THAT(result.err, HasSubstr("only with the Gaussians of the streamed SOG"));
    EXPECT_THAT(FilesBelow(temp.path()), testing::IsEmpty());
  }
}

}  // namespace
}  // namespace retint
