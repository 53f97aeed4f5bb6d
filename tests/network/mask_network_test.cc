// SPDX-License-Identifier: BSD-3-Clause
#include "network/mask_network.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/onnx_test.h"
#include "tests/support/onnx_writer.h"

namespace retint {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing::Not;

constexpr int kSide = 64;  // of the encoder's picture
constexpr int kWidth = 100, kHeight = 50;

// The encoder's picture in gray, or noise that is another one at every run.
std::string Encoder(bool noise = false) {
  OnnxWriter net;
  net.Input("image", {1, 3, kSide, kSide});
  std::string picture = "image";
  if (noise) picture = net.Node("RandomUniformLike", {"image"});
  net.Node("ReduceMean", {picture}, {{"axes", {1, 1}}, {"keepdims", {1}}}, "image_embeddings");
  net.Output("image_embeddings", {1, 1, kSide, kSide});
  return net.File();
}

void AddInputs(OnnxWriter* net, int label_type = 1) {
  net->Input("image_embeddings", {1, 1, kSide, kSide});
  net->Input("point_coords", {1, -1, 2});
  net->Input("point_labels", {1, -1}, label_type);
  net->Input("mask_input", {1, 1, 256, 256});
  net->Input("has_mask_input", {1});
}

// Discs of radius 7 about points, in pixels of the encoder's picture, with the weight of their
// label; weights of the labels -1 to 3.
std::string Discs(const std::vector<float>& weights, int label_type = 1) {
  OnnxWriter net;
  AddInputs(&net, label_type);
  std::vector<float> steps;
  for (int i = 0; i < kSide; ++i) steps.push_back(float(i));
  const auto coordinate = [&](int which, const std::vector<int64_t>& shape) {
    std::string at = net.Node("Gather", {"point_coords", net.Integers({which})}, {{"axis", {2}}});
    at = net.Node("Unsqueeze", {at, net.Integers({3})});  // [1, N, 1, 1]
    const std::string off = net.Node("Sub", {net.Floats(shape, steps), at});
    return net.Node("Mul", {off, off});
  };
  const std::string square =
      net.Node("Add", {coordinate(0, {1, 1, 1, kSide}), coordinate(1, {1, 1, kSide, 1})});
  const std::string disc = net.Node("Relu", {net.Node("Sub", {net.Floats({1}, {50}), square})});
  const std::string label = net.Node("Cast", {"point_labels"}, {{"to", {7}}});
  const std::string index = net.Node("Add", {label, net.Integers({1})});
  std::string weight = net.Node("Gather", {net.Floats({5}, weights), index}, {{"axis", {0}}});
  weight = net.Node("Unsqueeze", {weight, net.Integers({2, 3})});
  const std::string sum =
      net.Node("ReduceSum", {net.Node("Mul", {weight, disc}), net.Integers({1})});
  net.Node("Sub", {sum, net.Floats({1}, {5})}, {}, "masks");
  net.Output("masks", {1, 1, kSide, kSide});
  return net.File();
}

class MaskNetworkTest : public OnnxTest {
 protected:
  std::string Pair(const std::string& encoder, const std::string& decoder) {
    return "onnx:" + Write("encoder.onnx", encoder) + "," + Write("decoder.onnx", decoder);
  }
  ScalarImage Outline(const MaskNetwork& network, const ObjectPrompt& prompt,
                      const Image8& image = Image8(kWidth, kHeight)) {
    ScalarImage mask = network.Outline(image, prompt, {}, monitor_);
    EXPECT_EQ(mask.width, image.width);
    EXPECT_EQ(mask.height, image.height);
    return mask;
  }
  std::string Fault(const std::string& name, const ObjectPrompt& prompt) {
    try {
      Outline(*MakeMaskNetwork(name), prompt);
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), Not(HasSubstr("\n")));
      return error.what();
    }
    return "nothing";
  }
};

const ObjectPrompt kPoint{.inside = {{30, 20}}};

TEST_F(MaskNetworkTest, APointsPlaceInTheImageIsKept) {
  for (const int label_type : {1, 6, 7}) {  // float, int32, int64
    const auto network = MakeMaskNetwork(Pair(Encoder(), Discs({0, -1, 1, 0, 0}, label_type)));
    const ScalarImage mask = Outline(*network, {.inside = {{30, 20}, {70, 30}}});
    for (const auto& [x, y] : {std::pair{30, 20}, {70, 30}}) {
      // The radius is 6.7 where 5 is taken off, or 10.5 pixels of the image.
      for (const int d : {-9, 9}) {
        EXPECT_GT(mask(x + d, y), 0.5f);
        EXPECT_GT(mask(x, y + d), 0.5f);
      }
      for (const int d : {-12, 12}) {
        EXPECT_LT(mask(x + d, y), 0.5f);
        EXPECT_LT(mask(x, y + d), 0.5f);
      }
    }
  }
}

TEST_F(MaskNetworkTest, PointsOutsideAndRectanglesHaveTheirLabels) {
  const auto network = MakeMaskNetwork(Pair(Encoder(), Discs({0, -1, 1, 0, 0})));
  EXPECT_GT(Outline(*network, kPoint)(30, 24), 0.5f);
  EXPECT_LT(Outline(*network, {.inside = {{30, 20}}, .outside = {{30, 28}}})(30, 26), 0.5f);
  const auto corners = MakeMaskNetwork(Pair(Encoder(), Discs({0, 0, 0, 1, 0})));
  const ScalarImage least = Outline(*corners, {.rectangle = {{{{20, 15}, {80, 35}}}}});
  EXPECT_GT(least(20, 15), 0.5f);
  EXPECT_LT(least(80, 35), 0.5f);
  const auto others = MakeMaskNetwork(Pair(Encoder(), Discs({0, 0, 0, 0, 1})));
  EXPECT_GT(Outline(*others, {.rectangle = {{{{20, 15}, {80, 35}}}}})(80, 35), 0.5f);
}

TEST_F(MaskNetworkTest, TheEncoderRunsOnceForAnImage) {
  OnnxWriter net;
  AddInputs(&net);
  net.Node("Identity", {"image_embeddings"}, {}, "masks");
  net.Output("masks", {1, 1, kSide, kSide});
  const auto network = MakeMaskNetwork(Pair(Encoder(/*noise=*/true), net.File()));
  const auto first = Outline(*network, kPoint).data;
  EXPECT_EQ(first, Outline(*network, {.inside = {{50, 5}}}).data);
  EXPECT_NE(first, Outline(*network, kPoint, Image8(kWidth, kHeight, 9)).data);
}

TEST_F(MaskNetworkTest, MasksOfTheImagesSizeAreTakenAsTheyAre) {
  OnnxWriter net;
  AddInputs(&net);
  net.Input("orig_im_size", {2});
  const std::string size = net.Node("Cast", {"orig_im_size"}, {{"to", {7}}});
  const std::string shape =
      net.Node("Concat", {net.Integers({1, 1}), size}, {{"axis", {0}}});  // 1, 1, height, width
  const std::string zeros = net.Node("ConstantOfShape", {shape});
  const std::string ones = net.Node("Add", {zeros, net.Floats({1}, {1})});
  const std::string columns = net.Node("CumSum", {ones, net.Integers({3})});  // 1, 2, 3, ...
  net.Node("Sub", {columns, net.Floats({1}, {40.5})}, {}, "masks");
  net.Output("masks", {-1, -1, -1, -1});
  const ScalarImage mask = Outline(*MakeMaskNetwork(Pair(Encoder(), net.File())), kPoint);
  EXPECT_LT(mask(39, 49), 0.5f);
  EXPECT_GT(mask(40, 0), 0.5f);
}

TEST_F(MaskNetworkTest, TheBestOfSeveralMasksCounts) {
  OnnxWriter net;
  AddInputs(&net);
  std::vector<float> bands;  // mask m has the m-th quarter of the columns
  for (int m = 0; m < 4; ++m) {
    for (int i = 0; i < kSide * kSide; ++i) bands.push_back(i % kSide / 16 == m ? 9.0f : -9.0f);
  }
  const std::string nothing = net.Node("Mul", {"has_mask_input", net.Floats({1}, {0})});
  net.Node("Add", {net.Floats({1, 4, kSide, kSide}, bands), nothing}, {}, "masks");
  net.Node("Add", {net.Floats({1, 4}, {0.9f, 0.2f, 0.6f, 0.3f}), nothing}, {}, "iou_predictions");
  net.Output("masks", {1, 4, kSide, kSide});
  net.Output("iou_predictions", {1, 4});
  const auto network = MakeMaskNetwork(Pair(Encoder(), net.File()));
  const auto band = [](const ScalarImage& mask) {
    return std::max_element(mask.data.begin(), mask.data.begin() + kWidth) - mask.data.begin();
  };
  // Of an ambiguous point, the first mask of four, an average, does not count.
  EXPECT_NEAR(double(band(Outline(*network, kPoint))), 50, 2);
  EXPECT_NEAR(double(band(Outline(*network, {.inside = {{30, 20}, {40, 20}}}))), 0, 2);
}

TEST_F(MaskNetworkTest, EncodersMayTakeBytesWithTheChannelsLast) {
  OnnxWriter net;
  net.Input("input_image", {-1, -1, 3});
  // Of the picture's bright half; the longer side is 1024 pixels.
  const std::string gray = net.Node("ReduceMean", {"input_image"}, {{"axes", {2, 2}}});
  const std::string padded =
      net.Node("Pad", {gray, net.Integers({0, 0, 0, 512, 0, 0})});  // to the square
  net.Node("Sub", {net.Node("Unsqueeze", {padded, net.Integers({0})}), net.Floats({1}, {128})}, {},
           "embedding");
  net.Output("embedding", {1, -1, -1, -1});
  OnnxWriter decoder;
  decoder.Input("image_embeddings", {1, -1, -1, -1});
  decoder.Input("point_coords", {1, -1, 2});
  decoder.Input("point_labels", {1, -1});
  const std::string rows = decoder.Node(
      "Transpose", {decoder.Node("Identity", {"image_embeddings"})}, {{"perm", {0, 3, 1, 2}}});
  decoder.Node("Identity", {rows}, {}, "masks");
  decoder.Output("masks", {1, 1, -1, -1});
  Image8 image(kWidth, kHeight);
  for (int y = 30; y < kHeight; ++y) {
    for (int x = 0; x < 3 * kWidth; ++x) image.data[size_t(3 * kWidth * y + x)] = 200;
  }
  const ScalarImage mask =
      Outline(*MakeMaskNetwork(Pair(net.File(), decoder.File())), kPoint, image);
  EXPECT_LT(mask(50, 27), 0.5f);
  EXPECT_GT(mask(50, 32), 0.5f);
}

TEST_F(MaskNetworkTest, BothFilesAreNamed) {
  const auto network =
      MakeMaskNetwork(Pair(Encoder(), Discs({0, -1, 1, 0, 0})) + ",provider=cpu,values=1");
  constexpr const char* kOne = " \\(xxh64 [0-9a-f]{16}, ONNX Runtime [0-9.]+, CPU\\)";
  EXPECT_THAT(network->Identity(), MatchesRegex(std::string("encoder.onnx") + kOne +
                                                " and decoder.onnx" + kOne + " with values=1"));
}

TEST_F(MaskNetworkTest, FaultsOfPromptedNetworksAreSentences) {
  const std::string decoder = Discs({0, -1, 1, 0, 0});
  EXPECT_THAT(Fault(Pair(Encoder(), decoder), {}),
              AllOf(HasSubstr("`point`"), HasSubstr("`rectangle`")));
  EXPECT_THAT(Fault(Pair(decoder, Encoder()), kPoint), HasSubstr("has 5 inputs"));
  EXPECT_THAT(Fault("onnx:" + Write("alone.onnx", decoder), kPoint), HasSubstr("has 5 inputs"));
  EXPECT_THAT(Fault(Pair(Encoder(), Encoder()), kPoint), HasSubstr("its input image is neither"));
  EXPECT_THAT(Fault(Pair(Encoder(), "no network"), kPoint), HasSubstr("is not a network"));
  EXPECT_THAT(
      Fault("onnx:" + Write("a.onnx", Encoder()) + "," + (folder_ / "none").string(), kPoint),
      HasSubstr("none"));
  EXPECT_THROW(MakeMaskNetwork("onnx:a.onnx,"), OptionError);
  OnnxWriter net;
  net.Input("image_embeddings", {1, 1, kSide, kSide});
  net.Node("Identity", {"image_embeddings"}, {}, "masks");
  net.Output("masks", {1, 1, kSide, kSide});
  EXPECT_THAT(Fault(Pair(Encoder(), net.File()), kPoint), HasSubstr("is no decoder of SAM"));
  OnnxWriter bad;
  AddInputs(&bad);
  const std::string zeros = bad.Node("Sub", {"image_embeddings", "image_embeddings"});
  bad.Node("Div", {zeros, zeros}, {}, "masks");
  bad.Output("masks", {1, 1, kSide, kSide});
  EXPECT_THAT(Fault(Pair(Encoder(), bad.File()), kPoint), HasSubstr("not finite"));
}

// White squares at (10, 10) and (70, 20), of 20 pixels.
Image8 Squares() {
  Image8 image(kWidth, kHeight);
  for (const auto& [left, top] : {std::pair{10, 10}, {70, 20}}) {
    for (int y = top; y < top + 20; ++y) {
      for (int x = left; x < left + 20; ++x) {
        for (int c = 0; c < 3; ++c) image(x, y, c) = 255;
      }
    }
  }
  return image;
}

TEST_F(MaskNetworkTest, ASalientObjectIsThePartThatIsNamed) {
  // White is salient.
  const auto network = MakeMaskNetwork("onnx:" + Write("white.onnx", Encoder()) + ",values=1");
  const ScalarImage both = Outline(*network, {}, Squares());
  EXPECT_GT(both(20, 20), 0.5f);
  EXPECT_GT(both(80, 30), 0.5f);
  EXPECT_LT(both(50, 25), 0.5f);
  const ScalarImage one = Outline(*network, {.inside = {{80, 30}}}, Squares());
  EXPECT_LT(one(20, 20), 0.5f);
  EXPECT_GT(one(80, 30), 0.5f);
  EXPECT_EQ(Outline(*network, {.inside = {{50, 5}}}, Squares()).data, both.data)
      << "a point beside everything names nothing";
  const ScalarImage within = Outline(*network, {.rectangle = {{{{5, 5}, {35, 35}}}}}, Squares());
  EXPECT_GT(within(20, 20), 0.5f);
  EXPECT_GT(within(11, 11), 0.5f);
  EXPECT_LT(within(7, 7), 0.5f);
  EXPECT_LT(within(80, 30), 0.5f);
}

}  // namespace
}  // namespace retint
