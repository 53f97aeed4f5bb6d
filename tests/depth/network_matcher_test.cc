// SPDX-License-Identifier: BSD-3-Clause
#include "depth/network_matcher.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "base/median.h"
#include "depth/stereo_pairs.h"
#include "tests/support/data.h"
#include "tests/support/onnx_test.h"
#include "tests/support/onnx_writer.h"

namespace retint {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr int kWidth = 100, kHeight = 70, kTrue = 6;

// Noise without a period, seen from x and y.
uint8_t Noise(int x, int y, int c) {
  uint32_t h = uint32_t(x / 2) * 2654435761u ^ uint32_t(y / 2) * 2246822519u ^ uint32_t(c) * 97u;
  h = (h ^ (h >> 15)) * 2246822519u;
  return uint8_t((h >> 13) & 255);
}

Image8 Seen(int width, int height, int dx, int dy) {
  Image8 image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) image(x, y, c) = Noise(x + dx + 1000, y + dy + 1000, c);
    }
  }
  return image;
}

// How a test network takes its images, and how it answers.
struct Form {
  int inputs = 2, channels = 3;
  int width = -1, height = -1;
  std::vector<std::string> names = {"im0", "im1"};
  float answer = 1;  // answer per pixel of disparity
  float most = 255;  // of the values that it expects
  bool right_first = false;
};

constexpr int kCount = 16;  // disparities of the test networks

// Blurred differences of two images, one channel for each disparity.
std::string Costs(const std::string& left, const std::string& right, OnnxWriter* net) {
  std::vector<std::string> costs;
  for (int d = 0; d < kCount; ++d) {
    std::string moved = right;
    if (d > 0) {
      moved = net->Node("Pad", {moved, net->Integers({0, 0, 0, d, 0, 0, 0, 0})});
      moved =
          net->Node("Slice", {moved, net->Integers({0}), net->Integers({-d}), net->Integers({3})});
    }
    const std::string difference = net->Node("Abs", {net->Node("Sub", {left, moved})});
    const std::string mean =
        net->Node("ReduceMean", {difference}, {{"axes", {1, 1}}, {"keepdims", {1}}});
    costs.push_back(
        net->Node("AveragePool", {mean}, {{"kernel_shape", {5, 5}}, {"pads", {2, 2, 2, 2}}}));
  }
  return net->Node("Concat", costs, {{"axis", {1}}});
}

// The disparity at the soft minimum of costs, times `answer`.
std::string SoftMinimum(const std::string& costs, float factor, float answer, std::string output,
                        OnnxWriter* net) {
  std::vector<float> weights;
  for (int d = 0; d < kCount; ++d) weights.push_back(answer * float(d));
  const std::string scaled = net->Node("Mul", {costs, net->Floats({1}, {-factor})});
  const std::string soft = net->Node("Softmax", {scaled}, {{"axis", {1}}});
  return net->Node("Conv", {soft, net->Floats({1, kCount, 1, 1}, weights)}, {}, std::move(output));
}

// Sees details if its values are 0 to 255. If they are smaller, it answers with the shift that most
// of the pair has, and even more evenly.
std::string NetworkForDetails() {
  OnnxWriter net;
  for (const char* name : {"left", "right"}) net.Input(name, {1, 3, -1, -1});
  const std::string costs = Costs("left", "right", &net);
  const std::string whole = net.Node("ReduceMean", {costs}, {{"axes", {2, 3}}, {"keepdims", {1}}});
  const std::string mean = net.Node("ReduceMean", {whole}, {{"axes", {1, 1}}, {"keepdims", {1}}});
  const std::string prior =
      net.Node("Mul", {net.Node("Div", {whole, mean}), net.Floats({1}, {10})});
  const std::string details = net.Node("Relu", {net.Node("Sub", {costs, net.Floats({1}, {5})})});
  const std::string found = SoftMinimum(net.Node("Add", {details, prior}), 1, 1, "", &net);
  const std::string gray = net.Node("ReduceMean", {"left"}, {{"axes", {1, 1}}, {"keepdims", {1}}});
  net.Node("Add", {found, net.Node("Mul", {gray, net.Floats({1}, {1e-3f})})}, {}, "disp");
  net.Output("disp", {1, 1, -1, -1});
  return net.File();
}

// The soft minimum of a cost volume.
std::string StereoNetwork(const Form& form) {
  OnnxWriter net;
  const int per_input = form.inputs == 1 ? 2 * form.channels : form.channels;
  std::vector<std::string> images = form.names;
  for (int i = 0; i < form.inputs; ++i) {
    const bool half = form.inputs == 4 && i < 2 && form.width > 0;
    net.Input(form.names[size_t(i)], {1, per_input, half ? form.height / 2 : form.height,
                                      half ? form.width / 2 : form.width});
  }
  if (form.inputs == 1) {
    const auto part = [&](int first) {
      return net.Node("Slice", {form.names[0], net.Integers({first}),
                                net.Integers({first + form.channels}), net.Integers({1})});
    };
    images = {part(0), part(form.channels)};
  } else {
    images.assign(form.names.end() - 2, form.names.end());
  }
  if (form.right_first) std::swap(images[0], images[1]);
  SoftMinimum(Costs(images[0], images[1], &net), 255 / form.most, form.answer, "flow", &net);
  net.Output("flow", {1, 1, form.height, form.width});
  return net.File();
}

class NetworkMatcher : public OnnxTest {
 protected:
  // Of the pair's inner pixels.
  double MedianDisparity(const std::string& network) {
    const auto matcher = MakeNetworkMatcher(network);
    const ScalarImage found =
        matcher
            ->Match(Seen(kWidth, kHeight, 0, 0), Seen(kWidth, kHeight, kTrue, 0), {0, 16}, monitor_)
            .disparity;
    std::vector<float> inner;
    for (int y = 10; y < kHeight - 10; ++y) {
      for (int x = 20; x < kWidth - 10; ++x) inner.push_back(found(x, y));
    }
    return Median(inner);
  }
  double MedianOf(const Form& form, const std::string& settings = "") {
    return MedianDisparity(
        "onnx:" + Write("stereo.onnx" + std::to_string(count_++), StereoNetwork(form)) + settings);
  }
  // The one line that says what is wrong with a network.
  std::string Fault(const std::string& bytes) {
    const std::string path = Write("bad" + std::to_string(count_++) + ".onnx", bytes);
    try {
      MedianDisparity("onnx:" + path);
    } catch (const InputError& error) {
      const std::string text = error.what();
      EXPECT_THAT(text, AllOf(HasSubstr(path), Not(HasSubstr("\n"))));
      return text;
    }
    ADD_FAILURE() << "nothing was found wrong";
    return "";
  }
  int count_ = 0;
};

// A soft minimum over whole disparities of a whole one is off by less than a tenth.
constexpr double kNear = 0.1;

TEST_F(NetworkMatcher, TakesTwoImagesOfAnySize) { EXPECT_NEAR(MedianOf({}), kTrue, kNear); }

TEST_F(NetworkMatcher, TakesOneInputOfBothImages) {
  EXPECT_NEAR(MedianOf({.inputs = 1, .names = {"pair"}}), kTrue, kNear);
  EXPECT_NEAR(MedianOf({.inputs = 1, .channels = 1, .names = {"pair"}}), kTrue, kNear);
}

TEST_F(NetworkMatcher, TakesFourOfWhichTwoAreSmaller) {
  const std::vector<std::string> names = {"init_left", "init_right", "next_left", "next_right"};
  EXPECT_NEAR(MedianOf({.inputs = 4, .width = 128, .height = 96, .names = names}), kTrue, 0.3);
  EXPECT_NEAR(MedianOf({.inputs = 4, .names = names}), kTrue, kNear);
}

TEST_F(NetworkMatcher, ScalesPairsToAFixedSizeAndDisparitiesBack) {
  // Resampling noise of two pixels leaves a third of a pixel of doubt.
  EXPECT_NEAR(MedianOf({.width = 160, .height = 96}), kTrue, 0.3);
}

TEST_F(NetworkMatcher, FindsSignScaleAndValuesOfTheOutput) {
  EXPECT_NEAR(MedianOf({.answer = -1}), kTrue, kNear);
  EXPECT_NEAR(MedianOf({.answer = -1 / 128.0f, .most = 1}), kTrue, 0.3);
}

TEST_F(NetworkMatcher, FindsTheValuesWithWhichItSeesDetails) {
  Image8 left = Seen(kWidth, kHeight, 0, 0), right = Seen(kWidth, kHeight, kTrue, 0);
  constexpr int kPatch = 12;  // the disparity of a patch
  const Image8 patch = Seen(kWidth, kHeight, 500, 0);
  for (int y = 25; y < 45; ++y) {
    for (int x = 40; x < 60; ++x) {
      std::copy_n(&patch(x, y), 3, &left(x, y));
      std::copy_n(&patch(x, y), 3, &right(x - kPatch, y));
    }
  }
  const auto matcher = MakeNetworkMatcher("onnx:" + Write("details.onnx", NetworkForDetails()));
  const ScalarImage found = matcher->Match(left, right, {0, 16}, monitor_).disparity;
  // It is off by a thousandth of the values.
  EXPECT_NEAR(found(50, 35), kPatch, 0.3);
  EXPECT_NEAR(found(80, 10), kTrue, 0.3);
}

TEST_F(NetworkMatcher, TakesWhatIsGiven) {
  EXPECT_NEAR(MedianOf({.answer = 2}, ",values=255,scale=0.5,pad=1"), kTrue, kNear);
  EXPECT_NEAR(MedianOf({}, ",values=255,scale=2"), 2 * kTrue, 2 * kNear);
}

TEST_F(NetworkMatcher, NamesSayWhichImageIsTheRightOne) {
  EXPECT_NEAR(MedianOf({.names = {"img_right", "img_left"}, .right_first = true}), kTrue, kNear);
}

TEST_F(NetworkMatcher, MatchesVerticalPairs) {
  const auto matcher = MakeNetworkMatcher("onnx:" + Write("vertical.onnx", StereoNetwork({})));
  const RenderedPair pair{Shift::kDown,
                          {0, 0, kWidth, kHeight},
                          Seen(kWidth, kHeight, 0, 0),
                          Seen(kWidth, kHeight, 0, kTrue)};
  const ScalarImage found =
      MatchPair(*matcher, pair, kWidth, kHeight, {0, 16}, /*tolerance=*/1, monitor_);
  EXPECT_NEAR(found(50, 40), kTrue, kNear);
  EXPECT_LT(found(50, 2), 0) << "the other image does not show it";
}

TEST_F(NetworkMatcher, SaysWhatItIs) {
  const auto matcher = MakeNetworkMatcher("onnx:" + Write("named.onnx", StereoNetwork({})) +
                                          ",values=255,provider=cpu,scale=2");
  EXPECT_THAT(matcher->Identity(),
              testing::MatchesRegex("named.onnx \\(xxh64 [0-9a-f]{16}, ONNX Runtime [0-9.]+, "
                                    "CPU\\) with scale=2, values=255"));
}

TEST_F(NetworkMatcher, RefusesFilesThatAreNoNetwork) {
  EXPECT_THAT(Fault(""), HasSubstr("is empty"));
  EXPECT_THAT(Fault("ply\nformat ascii 1.0\n"), HasSubstr("is not a network"));
  const std::string whole = StereoNetwork({});
  EXPECT_THAT(Fault(whole.substr(0, whole.size() / 2)), HasSubstr("is not a network"));
}

// A network with these inputs whose output "disp" is `make` of the first.
std::string Other(const std::vector<std::vector<int64_t>>& shapes,
                  const std::function<void(OnnxWriter& net)>& make, int type = 1) {
  OnnxWriter net;
  for (size_t i = 0; i < shapes.size(); ++i) net.Input("i" + std::to_string(i), shapes[i], type);
  make(net);
  net.Output("disp", {-1, -1, -1, -1});
  return net.File();
}

TEST_F(NetworkMatcher, RefusesNetworksForSomethingElse) {
  const auto copy = [](OnnxWriter& net) { net.Node("Identity", {"i0"}, {}, "disp"); };
  const std::vector<int64_t> image = {1, 3, -1, -1};
  EXPECT_THAT(Fault(Other({image, image, image}, copy)), HasSubstr("has 3 inputs"));
  EXPECT_THAT(Fault(Other({{1, 5, -1, -1}}, copy)), HasSubstr("its input i0 is 1x5x?x?"));
  EXPECT_THAT(Fault(Other({{1, 1000}, {1, 1000}}, copy)), HasSubstr("its input i0 is 1x1000"));
  EXPECT_THAT(Fault(Other({image, {1, 3, 64, 64}}, copy)), HasSubstr("different sizes"));
  EXPECT_THAT(Fault(Other({{1, 3, 1 << 20, 1 << 20}, image}, copy)),
              HasSubstr("no size for images"));
  EXPECT_THAT(Fault(Other({image, image}, copy)), HasSubstr("no output of the size"));
}

TEST_F(NetworkMatcher, RefusesAnswersThatAreNone) {
  const std::vector<int64_t> gray = {1, 1, -1, -1};
  EXPECT_THAT(Fault(Other({gray, gray},
                          [](OnnxWriter& net) {
                            const auto zero = net.Node("Sub", {"i0", "i0"});
                            net.Node("Div", {zero, zero}, {}, "disp");
                          })),
              HasSubstr("not finite"));
  EXPECT_THAT(
      Fault(Other({gray, gray}, [](OnnxWriter& net) { net.Node("Identity", {"i1"}, {}, "disp"); })),
      HasSubstr("does not see that a test pair is shifted by 8 pixels"));
  // More memory than there is: ONNX Runtime is refused it, and says so.
  EXPECT_THAT(Fault(Other({gray, gray},
                          [](OnnxWriter& net) {
                            const auto size = net.Integers({1, 1, 1 << 25, 1 << 25});
                            const auto huge = net.Node("ConstantOfShape", {size});
                            net.Node("Add", {huge, net.Node("ReduceMean", {"i0"})}, {}, "disp");
                          })),
              testing::AnyOf(HasSubstr("cannot run it"), HasSubstr("is not a network")));
}

TEST_F(NetworkMatcher, ACancelledRunEnds) {
  const auto matcher = MakeNetworkMatcher("onnx:" + Write("cancel.onnx", StereoNetwork({})));
  monitor_.Cancel();
  EXPECT_THROW(
      matcher->Match(Seen(kWidth, kHeight, 0, 0), Seen(kWidth, kHeight, 0, 0), {0, 16}, monitor_),
      Cancelled);
}

TEST(NetworkName, IsCheckedAtOnce) {
  for (const char* name : {"foo", "onnx:", "exec:", "onnx:a.onnx,colour=1", "onnx:a.onnx,pad=x",
                           "onnx:a.onnx,pad=0", "onnx:a.onnx,scale=0", "onnx:a.onnx,scale=nan",
                           "onnx:a.onnx,values=3", "onnx:a.onnx,provider=gpu"}) {
    EXPECT_THROW(MakeNetworkMatcher(name), OptionError) << name;
  }
  EXPECT_EQ(MakeNetworkMatcher("onnx:a, b.onnx,pad=64"),
            MakeNetworkMatcher("onnx:a, b.onnx,pad=64"));
}

// Programs in the shell, which have "answer.pfm" to copy: a disparity of 3, none in the last
// column.
class ProgramMatcher : public testing::Test {
 protected:
  static constexpr int kSide = 4;
  void SetUp() override {
    std::vector<float> pixels(kSide * kSide, 3);
    for (int y = 0; y < kSide; ++y) pixels[size_t(y * kSide + kSide - 1)] = INFINITY;
    WriteFile(folder_ / "answer.pfm",
              "Pf\n4 4\n-1.0\n" +
                  std::string(reinterpret_cast<const char*>(pixels.data()), 4 * pixels.size()));
  }
  // `body` is run for each line; $1, $2 and $3 are its parts.
  std::string Program(const std::string& body) {
    const std::string path = folder_ / ("program" + std::to_string(count_++) + ".sh");
    WriteFile(path, "cd " + folder_.path().string() +
                        "\necho started >>starts\necho loading >&2\nwhile read line; do set -- "
                        "$line\n" +
                        body + "\ndone\n");
    return "exec:exec sh " + path;
  }
  ScalarImage Match(const std::string& name) {
    const Image8 image(kSide, kSide, 7);
    return MakeNetworkMatcher(name)->Match(image, image, {0, 16}, monitor_).disparity;
  }
  std::string Fault(const std::string& body) {
    try {
      Match(Program(body));
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), Not(HasSubstr("\n")));
      return error.what();
    }
    return "nothing";
  }
  TempFolder folder_;
  Monitor monitor_;
  int count_ = 0;
};

TEST_F(ProgramMatcher, AnswersManyPairsInOneLife) {
  const std::string name = Program("test -s $1 && test -s $2 && cp answer.pfm $3.pfm; echo ok");
  for (int i = 0; i < 3; ++i) {
    const ScalarImage found = Match(name);
    EXPECT_EQ(found(1, 1), 3);
    EXPECT_LT(found(3, 1), 0) << "an infinite disparity is none";
  }
  EXPECT_EQ(ReadFile(folder_ / "starts"), "started\n");
}

TEST_F(ProgramMatcher, ItsFaultsAreSentences) {
  EXPECT_THAT(Fault("echo no weights >&2; exit 3"),
              AllOf(HasSubstr("ended with exit code 3"), HasSubstr(": no weights")));
  EXPECT_THAT(Fault("kill -KILL $$"), HasSubstr("ended with exit code 137"));
  EXPECT_THAT(Fault("echo bananas"), HasSubstr("answered 'bananas' instead of ok"));
  EXPECT_THAT(Fault("echo ok"), HasSubstr("wrote no output.npy, .pfm or .png"));
  EXPECT_THAT(Fault("echo Pf >$3.pfm; echo ok"), HasSubstr("not a .pfm file"));
  EXPECT_THAT(Fault("printf 'Pf\\n1 1\\n-1\\n1234' >$3.pfm; echo ok"),
              HasSubstr("wrote 1x1 pixels for an image of 4x4"));
  EXPECT_THAT(Fault("exec >&-; sleep 600"), HasSubstr("closed its input or output"));
  EXPECT_THAT(Fault("tr -d '\\n' </dev/zero | tr '\\0' x"), HasSubstr("line without an end"));
}

TEST_F(ProgramMatcher, AHangEndsWithTheUsersPatience) {
  const std::string name = Program("touch ready; sleep 600");
  std::thread user([&] {
    while (!std::filesystem::exists(folder_ / "ready")) std::this_thread::yield();
    monitor_.Cancel();
  });
  EXPECT_THROW(Match(name), Cancelled);
  user.join();
}

TEST_F(ProgramMatcher, StartsAgainAfterItDied) {
  const std::string name =
      Program("test -e once || { touch once; exit 1; }; cp answer.pfm $3.pfm; echo ok");
  EXPECT_THROW(Match(name), RunError);
  EXPECT_EQ(Match(name)(0, 0), 3);
}

}  // namespace
}  // namespace retint
