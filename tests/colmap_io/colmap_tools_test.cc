// SPDX-License-Identifier: BSD-3-Clause
// COLMAP's own executable reads our files, and we read its files. Reported as skipped if there is
// no `colmap`.
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/sparse.h"
#include "tests/colmap_io/tiny_model.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// COLMAP normalises rotations in reading and in writing; either can turn the last bit.
constexpr double kRotationTolerance = 4e-16;

struct Ran {
  int exit_code = -1;
  std::string output;
};

Ran Colmap(const std::string& arguments) {
  const std::string command = "QT_QPA_PLATFORM=offscreen colmap " + arguments + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  Ran ran;
  if (pipe == nullptr) return ran;
  std::array<char, 4096> buffer;
  for (size_t got; (got = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    ran.output.append(buffer.data(), got);
  }
  const int status = pclose(pipe);
  ran.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

class ColmapToolsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v colmap >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs colmap";
  }
  // Has model_converter rewrite `from` as `type` (TXT or BIN); returns where.
  fs::path Convert(const fs::path& from, const std::string& type) {
    const fs::path to = folder_ / ("converted" + std::to_string(count_++));
    fs::create_directory(to);
    const Ran ran = Colmap("model_converter --input_path '" + from.string() + "' --output_path '" +
                           to.string() + "' --output_type " + type);
    EXPECT_EQ(ran.exit_code, 0) << ran.output;
    return to;
  }
  TempFolder folder_;

 private:
  int count_ = 0;
};

// A model that COLMAP 3.8 can hold whole: its text reader ends names at a blank.
Reconstruction ModelForColmap() {
  Reconstruction model = TinyModel();
  model.views.at(3).name = "sub/b_c.png";
  for (int id = 0; id <= 10; ++id) {  // the camera models of COLMAP 3.8
    Camera camera{static_cast<CameraId>(20 + id), FindCameraModel(id)->id, 640, 480, {}};
    for (int p = 0; p < FindCameraModel(id)->num_params; ++p) camera.params.push_back(0.1 * p + 1);
    model.cameras[camera.id] = camera;
  }
  return model;
}

// The lines of a text file that are not comments, each keyed by the id it begins with; an image's
// second line is keyed by the id and " points".
std::map<std::string, std::string> Records(const fs::path& path, bool two_lines) {
  std::istringstream text(ReadFile(path));
  std::map<std::string, std::string> records;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with('#')) continue;
    const std::string id = line.substr(0, line.find(' '));
    records[id] = line;
    if (two_lines && std::getline(text, line)) records[id + " points"] = line;
  }
  return records;
}

std::string Header(const fs::path& path) {
  std::istringstream text(ReadFile(path));
  std::string header;
  for (std::string line; std::getline(text, line) && line.starts_with('#');) header += line + "\n";
  return header;
}

TEST_F(ColmapToolsTest, ReadsOurBinaryAndText) {
  const Reconstruction model = ModelForColmap();
  WriteReconstructionBinary(folder_ / "b", model);
  WriteReconstructionText(folder_ / "t", model);
  for (const char* ours : {"b", "t"}) {
    for (const char* type : {"BIN", "TXT"}) {
      SCOPED_TRACE(std::string(ours) + " -> " + type);
      ExpectSame(ReadReconstruction(Convert(folder_ / ours, type)), model, kRotationTolerance);
    }
  }
}

TEST_F(ColmapToolsTest, TextIsColmapsCharacterForCharacter) {
  RETINT_REQUIRE_DATA("fox/sparse/0");
  const fs::path theirs = Convert(DataPath("fox/sparse/0"), "TXT");
  const Reconstruction model = ReadReconstruction(DataPath("fox/sparse/0"));
  WriteReconstructionText(folder_ / "ours", model);
  for (const char* part : {"cameras.txt", "images.txt", "points3D.txt"}) {
    const bool images = std::string(part) == "images.txt";
    EXPECT_EQ(Header(folder_ / "ours" / part), Header(theirs / part));
    const auto our_records = Records(folder_ / "ours" / part, images);
    const auto their_records = Records(theirs / part, images);
    ASSERT_EQ(our_records.size(), their_records.size()) << part;
    size_t differing = 0;
    for (const auto& [id, line] : our_records) {
      ASSERT_EQ(their_records.count(id), 1u) << part << " " << id;
      // Poses may differ by the normalisation; everything else must not.
      const bool pose = images && id.find(' ') == std::string::npos;
      differing += !pose && line != their_records.at(id);
    }
    EXPECT_EQ(differing, 0u) << part;
  }
  ExpectSame(ReadReconstruction(theirs), model, kRotationTolerance);
}

TEST_F(ColmapToolsTest, RealModelsGoThereAndBack) {
  RETINT_REQUIRE_DATA("flower/sparse/0");
  const Reconstruction model = ReadReconstruction(DataPath("flower/sparse/0"));
  WriteReconstructionText(folder_ / "ours", model);
  ExpectSame(ReadReconstruction(Convert(folder_ / "ours", "BIN")), model, kRotationTolerance);
}

TEST_F(ColmapToolsTest, AnalyzerCountsWhatWeCount) {
  RETINT_REQUIRE_DATA("fox/sparse/0");
  const Reconstruction model = ReadReconstruction(DataPath("fox/sparse/0"));
  size_t observations = 0;
  for (const auto& [id, point] : model.points) observations += point.track.size();
  WriteReconstructionBinary(folder_ / "b", model);
  WriteReconstructionText(folder_ / "t", model);
  for (const char* ours : {"b", "t"}) {
    const Ran ran = Colmap("model_analyzer --path '" + (folder_ / ours).string() + "'");
    EXPECT_EQ(ran.exit_code, 0);
    for (const auto& [what, count] :
         {std::pair{"Cameras", model.cameras.size()}, std::pair{"Images", model.views.size()},
          std::pair{"Registered images", model.views.size()},
          std::pair{"Points", model.points.size()}, std::pair{"Observations", observations}}) {
      EXPECT_THAT(ran.output, HasSubstr(std::string(what) + ": " + std::to_string(count) + "\n"));
    }
    EXPECT_THAT(ran.output, HasSubstr("Mean reprojection error: 0.69"));
  }
}

}  // namespace
}  // namespace retint
