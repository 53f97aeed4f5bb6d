// SPDX-License-Identifier: BSD-3-Clause
// Splats whose colors are in a space of an OpenColorIO config, against OpenColorIO itself.
#include <cmath>

#include <OpenColorIO/OpenColorIO.h>
#include <nlohmann/json.hpp>

#include "base/color_difference.h"
#include "colmap_io/workspace.h"
#include "kernels/common/sh.h"
#include "render/renderer.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/bad_input.h"
#include "tests/support/ocio_config.h"

namespace retint {
namespace {

namespace ocio = OCIO_NAMESPACE;
using testing::HasSubstr;

class Config {
 public:
  explicit Config(const std::string& file) : config_(ocio::Config::CreateFromFile(file.c_str())) {}
  // Colors [*, 3], in place.
  void Convert(const char* from, const char* to, float* rgb, size_t count) const {
    ocio::PackedImageDesc colors(rgb, long(count), 1, 3);
    config_->getProcessor(from, to)->getDefaultCPUProcessor()->apply(colors);
  }

 private:
  ocio::ConstConfigRcPtr config_;
};

struct Differences {
  double median = 0, most = 0;  // the latter of 95 % of the pixels
};

// CIEDE2000 of pictures, as a screen shows them.
Differences Compare(const Image& a, const Image& b) {
  std::vector<double> all;
  for (size_t i = 0; i < a.data.size(); i += 3) {
    float shown[2][3];
    for (size_t c = 0; c < 3; ++c) {
      shown[0][c] = std::clamp(a.data[i + c], 0.0F, 1.0F);
      shown[1][c] = std::clamp(b.data[i + c], 0.0F, 1.0F);
    }
    all.push_back(ColorDifference(CieLabFromSrgb(shown[0]), CieLabFromSrgb(shown[1])));
  }
  std::sort(all.begin(), all.end());
  return {all[all.size() / 2], all[all.size() * 95 / 100]};
}

// The sample's splat without directions, as sRGB and in "film log".
class OcioSpaceTest : public testing::Test {
 protected:
  OcioSpaceTest() {
    WriteFile(config_, kOcioConfig);
    GaussianModel model = ReadSplat(place_.In("splat.ply"));
    const auto stride = size_t(3 * model.NumShCoeffs());
    FloatArray base;
    for (size_t i = 0; i < model.sh.size(); ++i) {
      if (i % stride < 3) base.push_back(std::clamp(model.sh[i], -0.5F / kShC0, 0.5F / kShC0));
    }
    model.sh = base;
    model.sh_degree = 0;
    WriteSplat(srgb_, model);
    for (float& value : model.sh) value = 0.5F + kShC0 * value;
    Config(config_).Convert("sRGB", "film log", model.sh.data(), model.NumGaussians());
    for (float& value : model.sh) value = (value - 0.5F) / kShC0;
    WriteSplat(log_, model);
  }

  CommandResult Run(const std::string& verb, const std::string& splat, Arguments more) const {
    Arguments arguments = {verb, place_.in.string(), "--splat", splat, "--progress", "none"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    CommandResult result = RunRetint(arguments);
    EXPECT_EQ(result.code, 0) << result.err;
    return result;
  }
  CommandResult Edit(const std::string& splat, const std::string& to, Arguments more) const {
    more.insert(more.end(), {"--view", TinyView(), "--mask", TinyMask().string(), "--to", "#2a6fdb",
                             "--output", to});
    return Run("recolor", splat, more);
  }
  // The painted view as the file's numbers, whatever space they are in.
  Image Numbers(const std::string& splat) const {
    Workspace workspace = Workspace::Open(place_.in);
    workspace.UndistortViews();
    Renderer renderer(CreateBackend("cpu"), ReadSplat(splat));
    const View* const view = workspace.reconstruction.FindView(TinyView());
    return renderer.Render(workspace.reconstruction.Posed(*view)).rgb;
  }
  // Those of a splat in "film log", shown by OpenColorIO.
  Image Shown(const std::string& splat) const {
    Image image = Numbers(splat);
    Config(config_).Convert("film log", "sRGB", image.data.data(), image.data.size() / 3);
    return image;
  }

  Place place_;
  const std::string config_ = place_.In("config.ocio"), srgb_ = place_.In("srgb.ply"),
                    log_ = place_.In("log.ply");
  const Arguments space_ = {"--ocio", config_, "--space", "film log"};
};

TEST_F(OcioSpaceTest, RendersAreWhatOpenColorIOShows) {
  const auto render = [&](Arguments more) {
    more.insert(more.end(), {"--view", TinyView(), "--output", place_.Out("renders")});
    Run("render", log_, more);
    return ReadImage(place_.out / "renders" / (TinyView() + ".png"));
  };
  const Image shown = Shown(log_);
  const Differences with = Compare(render(space_), shown), without = Compare(render({}), shown);
  EXPECT_LT(with.median, 0.5);  // eight bits
  EXPECT_LT(with.most, 1);
  EXPECT_GT(without.median, 5);
}

TEST_F(OcioSpaceTest, AnEditIsThatOfTheSplatInSrgb) {
  Edit(srgb_, place_.Out("srgb.ply"), {});
  Edit(log_, place_.Out("log.ply"), space_);
  const Image expected = Numbers(place_.Out("srgb.ply"));
  const Differences with = Compare(Shown(place_.Out("log.ply")), expected);
  // Mixed in the film's space, colors of neighbors differ a little before the edit, too.
  const Differences mixed = Compare(Shown(log_), Numbers(srgb_));
  EXPECT_LT(with.median, 1);
  EXPECT_LT(with.most, mixed.most + 0.5);
  Edit(log_, place_.Out("without.ply"), {});
  EXPECT_GT(Compare(Shown(place_.Out("without.ply")), expected).most, 5);
  // Gaussians outside the selection keep their bytes.
  const FloatArray before = ReadSplat(log_).sh, after = ReadSplat(place_.Out("log.ply")).sh;
  size_t kept = 0;
  for (size_t i = 0; i < before.size(); i += 3) {
    kept += std::equal(&before[i], &before[i] + 3, &after[i]) ? 1 : 0;
  }
  EXPECT_GT(kept, before.size() / 3 / 2);
  EXPECT_LT(kept, before.size() / 3);
}

TEST_F(OcioSpaceTest, AFileThatCannotSayItIsToldSo) {
  const CommandResult result = Edit(log_, place_.Out("log.usda"), space_);
  EXPECT_THAT(result.err, HasSubstr("the color space film log is lost, which"));
}

// Paths of a job start in its folder, those of its session too.
TEST_F(OcioSpaceTest, AJobAndItsSessionKeepIt) {
  const nlohmann::json job = {
      {"retint_job", 1},
      {"scene",
       {{"workspace", "."}, {"splat", "log.ply"}, {"space", "film log"}, {"ocio", "config.ocio"}}},
      {"regions",
       {{{"name", "thing"},
         {"masks", {{TinyView(), TinyMask().string()}}},
         {"edit", {{"operations", {{{"op", "gray"}}}}}}}}},
      {"outputs", {{"session", "s.retint"}, {"splats", {"job.ply"}}}}};
  WriteFile(place_.In("job.json"), job.dump());
  CommandResult result = RunRetint({"run", place_.In("job.json"), "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  result = RunRetint({"info", place_.In("s.retint"), "--compare", "1"});
  EXPECT_THAT(result.out, HasSubstr("color space  film log (chosen)"));
  fs::rename(place_.in, place_.in.parent_path() / "moved");
  result = RunRetint({"info", (place_.in.parent_path() / "moved" / "s.retint").string()});
  EXPECT_THAT(result.out, HasSubstr("color space  film log (chosen)")) << result.err;
}

const std::string& WithConfig(const Place& place) {
  static std::string file;
  file = place.In("config.ocio");
  WriteFile(file, kOcioConfig);
  return file;
}

const Row kRows[] = {
    {"UnknownSpace", 3, "config.ocio: has no color space 'film-log'. Nearest of its 4: film log",
     [](Place& place) {
       return Recolor(place, {"--ocio", WithConfig(place), "--space", "film-log"});
     }},
    {"NoCurveAndMatrix", 3, "'graded' differs from sRGB by more than a curve and a matrix",
     [](Place& place) {
       return Recolor(place, {"--ocio", WithConfig(place), "--space", "graded"});
     }},
    {"NoConfig", 3, "missing.ocio: is not a file",
     [](Place& place) {
       return Recolor(place, {"--ocio", place.In("missing.ocio"), "--space", "film log"});
     }},
    {"DamagedConfig", 3, "config.ocio: is not a config that OpenColorIO",
     [](Place& place) {
       WriteFile(place.In("config.ocio"), "ocio_profile_version: [2");
       return Recolor(place, {"--ocio", place.In("config.ocio"), "--space", "film log"});
     }},
    {"NoSrgb", 3, "has no sRGB space. Give it the alias sRGB",
     [](Place& place) {
       std::string text = kOcioConfig;
       for (size_t at; (at = text.find("sRGB")) != std::string::npos;) text.replace(at, 4, "TV");
       WriteFile(place.In("tv.ocio"), text);
       return Recolor(place, {"--ocio", place.In("tv.ocio"), "--space", "film log"});
     }},
    {"ConfigAlone", 2, "--ocio needs --space",
     [](Place& place) {
       return Recolor(place, {"--ocio", WithConfig(place)});
     }},
    {"SpaceAlone", 2, "--space needs --ocio, or a config in the environment variable OCIO",
     [](Place& place) {
       unsetenv("OCIO");
       return Recolor(place, {"--space", "film log"});
     }},
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(OcioSpaces, BadInput, testing::ValuesIn(kRows), RowName);

}  // namespace retint
