// SPDX-License-Identifier: BSD-3-Clause
// The photo of a real capture that a color map changed: the map is found again.
#include <algorithm>
#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/color_difference.h"
#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "editing/compare_pictures.h"
#include "opening/open_scene.h"
#include "scene/contact_sheet.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;
using Kind = ColorOperationKind;

// A grade and another hue, as a paint program makes them.
ColorEdit Grade() {
  ColorOperation adjust = ColorOperation::Make(Kind::kAdjust);
  adjust.Get("hue")[0] = 70;
  adjust.Get("chroma")[0] = 0.9f;
  return {{ColorOperation::Make(Kind::kGamma, {1.3f}), adjust}, 1};
}

struct Differences {
  double mean = 0, most = 0;  // DeltaE00; `most` but for one pixel in a hundred
};

// Between two edits of the colors inside `mask`.
Differences Compare(const CompiledEdit& x, const CompiledEdit& y, const Image& image,
                    const Mask& mask) {
  std::vector<double> values;
  const auto shown = [](const Eigen::Vector3f& color) {
    return Eigen::Vector3f(color.cwiseMax(0.0f).cwiseMin(1.0f));
  };
  for (size_t p = 0; p < mask.data.size(); p += 7) {
    if (mask.data[p] < 128) continue;
    const Eigen::Vector3f color = shown(Eigen::Vector3f(&image.data[3 * p]));
    const Eigen::Vector3f a = shown(x.Apply(color)), b = shown(y.Apply(color));
    values.push_back(ColorDifference(CieLabFromSrgb(a.data()), CieLabFromSrgb(b.data())));
  }
  Differences found;
  if (values.empty()) return found;
  std::sort(values.begin(), values.end());
  for (const double value : values) found.mean += value / double(values.size());
  found.most = values[values.size() * 99 / 100];
  return found;
}

std::unique_ptr<OpenScene> OpenFox() {
  SessionOptions options;
  options.backend = "cpu";
  Monitor monitor;
  return OpenScene::Open(DataPath("fox"), DataPath("fox/splat.ply"), options, monitor);
}

TEST(ComparePictures, FindsTheColorMapOfTheFoxAgain) {
  RETINT_REQUIRE_DATA("fox/splat.ply");
  const auto scene = OpenFox();
  const CompiledEdit grade{Grade()};
  RegionSelection selection;
  const Mask& mask = selection.masks["0025.jpg"] = ReadMask(DataPath("fox/masks/0025.jpg.png"));
  const View& view = scene->workspace().RequireView("0025.jpg");
  const Image before = scene->workspace().ReadPhoto(view);
  Image8 painted(before.width, before.height);
  for (size_t p = 0; p < before.NumPixels(); ++p) {
    Eigen::Vector3f color(&before.data[3 * p]);
    if (mask.data[p] >= 128) color = grade.Apply(color);
    for (size_t c = 0; c < 3; ++c) {
      painted.data[3 * p + c] =
          uint8_t(std::lround(255 * std::clamp(color[Eigen::Index(c)], 0.0f, 1.0f)));
    }
  }
  ColorOperation op = ColorOperation::Picture({{"0025.jpg", "", painted}});
  ComparePictures(op, {}, selection, *scene, scene->original().sh);
  ASSERT_TRUE(op.table);
  EXPECT_TRUE(op.picture->layers.empty());  // nothing is left that would have to be carried over
  const CompiledEdit found({{ColorOperation::Lut(op.table)}, 1});
  const Differences here = Compare(found, grade, before, mask);
  // The requested tolerance; the picture's 8 bits alone cause about 0.2.
  EXPECT_GT(here.mean, 0);
  EXPECT_LT(here.mean, 1);
  EXPECT_LT(here.most, 1);
}

// Red stripes over the fox and nothing else: red is no new color of all that is like the fox.
TEST(ComparePictures, StripesBesideUnchangedSurfaceArePaint) {
  RETINT_REQUIRE_DATA("fox/splat.ply");
  const auto scene = OpenFox();
  const Mask mask = ReadMask(DataPath("fox/masks/0025.jpg.png"));
  const Image8 photo =
      ToImage8(scene->workspace().ReadPhoto(scene->workspace().RequireView("0025.jpg")));
  Image8 striped = photo;
  for (size_t p = 0; p < mask.data.size(); ++p) {
    const bool stripe = p % size_t(mask.width) / 40 % 2 == 0;
    if (mask.data[p] >= 128 && stripe) {
      striped.data[3 * p] = 200, striped.data[3 * p + 1] = 20, striped.data[3 * p + 2] = 30;
    }
  }
  ColorOperation op = ColorOperation::Picture({{"0025.jpg", "", striped}});
  RegionSelection selection;
  selection.masks = ChangedMasks(op, *scene, scene->original().sh);
  ComparePictures(op, {}, selection, *scene, scene->original().sh);
  EXPECT_FALSE(op.table);
  ASSERT_EQ(op.picture->layers.size(), 1u);
  // The same picture as one of another view.
  ColorOperation other = ColorOperation::Picture({{"0026.jpg", "", striped}});
  EXPECT_THROW(ChangedMasks(other, *scene, scene->original().sh), InputError);
}

// Blue and gold stripes all over: the map that fits best makes everything gray, which nobody
// painted.
TEST(ComparePictures, StripesOfTwoColorsAreNoMap) {
  RETINT_REQUIRE_DATA("fox/splat.ply");
  const auto scene = OpenFox();
  RegionSelection selection;
  const Mask& mask = selection.masks["0025.jpg"] = ReadMask(DataPath("fox/masks/0025.jpg.png"));
  Image8 striped =
      ToImage8(scene->workspace().ReadPhoto(scene->workspace().RequireView("0025.jpg")));
  for (size_t p = 0; p < mask.data.size(); ++p) {
    if (mask.data[p] < 128) continue;
    const bool blue = p % size_t(mask.width) / 30 % 2 == 0;
    striped.data[3 * p] = blue ? 20 : 190;
    striped.data[3 * p + 1] = blue ? 40 : 170;
    striped.data[3 * p + 2] = blue ? 160 : 110;
  }
  ColorOperation op = ColorOperation::Picture({{"0025.jpg", "", striped}});
  ComparePictures(op, {}, selection, *scene, scene->original().sh);
  EXPECT_FALSE(op.table);
  EXPECT_EQ(op.picture->layers.size(), 1u);
}

// Everything inside the mask, most of the picture, is painted over.
TEST(ComparePictures, APictureIsKnownBesideItsMask) {
  RETINT_REQUIRE_DATA("fox/splat.ply");
  const auto scene = OpenFox();
  const View& view = scene->workspace().RequireView("0025.jpg");
  const Image8 photo = ToImage8(scene->workspace().ReadPhoto(view));
  RegionSelection selection;
  Mask& mask = selection.masks["0025.jpg"] = Mask(photo.width, photo.height);
  const auto repainted = [&](Image8 picture) {
    for (int y = photo.height / 4; y < photo.height; ++y) {
      for (int x = 0; x < photo.width; ++x) {
        mask(x, y) = 255;
        const uint8_t value = x / 12 % 2 == y / 12 % 2 ? 230 : 20;
        for (int c = 0; c < 3; ++c) picture(x, y, c) = c == 1 ? 120 : value;
      }
    }
    return ColorOperation::Picture({{"0025.jpg", "", std::move(picture)}});
  };
  ColorOperation op = repainted(photo);
  EXPECT_NO_THROW(ComparePictures(op, {}, selection, *scene, scene->original().sh));
  EXPECT_EQ(op.picture->layers.size(), 1u);
  op =
      repainted(ToImage8(scene->workspace().ReadPhoto(scene->workspace().RequireView("0026.jpg"))));
  EXPECT_THROW(ComparePictures(op, {}, selection, *scene, scene->original().sh), InputError);
}

// Lettering is selected with its surroundings, and carried at any size within the selection.
TEST(ComparePictures, APaintedLineIsSelectedWithWhatIsBesideIt) {
  RETINT_REQUIRE_DATA("fox/splat.ply");
  const auto scene = OpenFox();
  const Mask mask = ReadMask(DataPath("fox/masks/0025.jpg.png"));
  const Image8 photo =
      ToImage8(scene->workspace().ReadPhoto(scene->workspace().RequireView("0025.jpg")));
  Image8 lined = photo;
  int painted = 0, x = 0, y = 0;
  for (size_t p = 0; p < mask.data.size(); ++p) {
    const int column = int(p % size_t(mask.width)), row = int(p / size_t(mask.width));
    if (mask.data[p] < 255 || std::abs(row - mask.height / 2) > 2) continue;
    lined.data[3 * p] = 20, lined.data[3 * p + 1] = 30, lined.data[3 * p + 2] = 220;
    if (++painted == 200) x = column, y = row;
  }
  ASSERT_GT(painted, 400);
  ColorOperation op = ColorOperation::Picture({{"0025.jpg", "", lined}});
  RegionSelection selection;
  selection.masks = ChangedMasks(op, *scene, scene->original().sh);
  const Mask& selected = selection.masks.at("0025.jpg");
  EXPECT_EQ(selected(x, y + 9), 255);
  EXPECT_EQ(selected(x, y + 40), 0);
  selection.masks["0025.jpg"] = mask;  // the whole fox, of which the line is little
  ComparePictures(op, {}, selection, *scene, scene->original().sh);
  EXPECT_FALSE(op.table);
  EXPECT_EQ(op.picture->layers.size(), 1u);
}

// A picture of a view as it is shown, with the edits before and the region's soft border.
TEST(ComparePictures, APictureOfTheEditedViewHasNoChange) {
  RETINT_REQUIRE_DATA("fox/splat.ply");
  const auto scene = OpenFox();
  RegionSelection selection;
  Mask& mask = selection.masks["0025.jpg"] = ReadMask(DataPath("fox/masks/0025.jpg.png"));
  for (uint8_t& value : mask.data) value = value ? 140 : 0;
  const ColorEdit before{{ColorOperation::Make(Kind::kInvert)}, 1};
  const CompiledEdit invert(before);
  Image shown = scene->Render(scene->workspace().RequireView("0025.jpg"), scene->original().sh);
  for (size_t p = 0; p < mask.data.size(); ++p) {
    const Eigen::Vector3f color =
        invert.Apply(Eigen::Vector3f(&shown.data[3 * p]), float(mask.data[p]) / 255);
    std::copy_n(color.data(), 3, &shown.data[3 * p]);
  }
  ColorOperation op = ColorOperation::Picture({{"0025.jpg", "", ToImage8(shown)}});
  EXPECT_THAT([&] { ComparePictures(op, before, selection, *scene, scene->original().sh); },
              ThrowsMessage<InputError>(HasSubstr("nothing was changed in this picture")));
}

// A change that is not taken over is not reported as unchanged.
TEST(ComparePictures, AChangeThatIsNotTakenOverIsSaidToBeOne) {
  RETINT_REQUIRE_DATA("fox/splat.ply");
  const auto scene = OpenFox();
  const Image8 photo =
      ToImage8(scene->workspace().ReadPhoto(scene->workspace().RequireView("0025.jpg")));
  RegionSelection selection;
  Mask& mask = selection.masks["0025.jpg"] = Mask(photo.width, photo.height);
  const int x = photo.width / 2, y = photo.height / 2;
  for (int dy = -100; dy <= 100; ++dy) {
    for (int dx = -100; dx <= 100; ++dx) mask(x + dx, y + dy) = 255;
  }
  const auto painted = [&](int left, int size) {
    Image8 picture = photo;
    for (int i = 0; i < size * size; ++i) {
      for (int c = 0; c < 3; ++c) picture(left + i % size, y + i / size, c) = c == 2 ? 255 : 0;
    }
    return ColorOperation::Picture({{"0025.jpg", "p.png", std::move(picture)}});
  };
  const auto compare = [&](const ColorOperation& picture) {
    return [&, picture] {
      ColorOperation op = picture;
      ComparePictures(op, {}, selection, *scene, scene->original().sh);
    };
  };
  const auto select = [&](const ColorOperation& picture) {
    return [&, picture] {
      ColorOperation op = picture;
      ChangedMasks(op, *scene, scene->original().sh);
    };
  };
  const auto says = [](const std::string& text) {
    return ThrowsMessage<InputError>(testing::StrEq("p.png: " + text));
  };
  const std::string one =
                        "1 pixel of this picture differs, which is too little to be told from "
                        "noise",
                    beside = "what was changed in this picture lies outside the region";
  EXPECT_THAT(compare(painted(x, 1)), says(one));
  EXPECT_THAT(select(painted(x, 1)), says(one));
  EXPECT_THAT(compare(painted(x + 150, 20)), says(beside));
}

// Graded, and with lettering that is less than a hundredth of it; noise is no lettering.
TEST(ComparePictures, SmallLetteringOnAGradedObjectIsPaint) {
  RETINT_REQUIRE_DATA("fox/splat.ply");
  const auto scene = OpenFox();
  const CompiledEdit grade{Grade()};
  RegionSelection selection;
  const Mask& mask = selection.masks["0025.jpg"] = ReadMask(DataPath("fox/masks/0025.jpg.png"));
  const Image before = scene->workspace().ReadPhoto(scene->workspace().RequireView("0025.jpg"));
  const TempFolder folder;
  const auto layers = [&](bool lettering, const char* name) {
    Image8 painted = ToImage8(before);
    int inside = 0, letters = 0, left = -1, top = 0;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        if (mask(x, y) < 128) continue;
        ++inside;
        Eigen::Vector3f color = grade.Apply(Eigen::Vector3f(&before.data[before.Index(x, y)]));
        if (left < 0 && y > mask.height / 2 && mask(x + 100, y) == 255) left = x + 20, top = y;
        // Strokes of two pixels, 14 high.
        const bool ink = left >= 0 && x >= left && x < left + 70 && y >= top && y < top + 14 &&
                         ((x - left) % 7 < 2 || ((y - top) % 6 < 2 && (x - left) % 14 < 7));
        if (ink && lettering) color = {0.95f, 0.95f, 0.1f}, ++letters;
        for (int c = 0; c < 3; ++c) {
          painted(x, y, c) = uint8_t(std::lround(255 * std::clamp(color[c], 0.0f, 1.0f)));
        }
      }
    }
    EXPECT_EQ(letters > 0, lettering);
    EXPECT_LT(letters, 0.01 * inside);
    const std::filesystem::path file = folder / name;
    if (file.extension() == ".jpg") {
      WriteFile(file, EncodeJpeg(painted, 90));
    } else {
      WritePng(file, painted);
    }
    ColorOperation op = ColorOperation::Picture({{"0025.jpg", file.string(), {}}});
    ComparePictures(op, {}, selection, *scene, scene->original().sh);
    EXPECT_TRUE(op.table) << name;
    EXPECT_GT(op.Get("explained")[0], 0.98f) << name;
    return op.picture->layers;
  };
  for (const char* name : {"painted.png", "painted.jpg"}) {
    EXPECT_TRUE(layers(false, name).empty()) << name;
    const std::vector<PaintLayer> paint = layers(true, name);
    ASSERT_EQ(paint.size(), 1u) << name;
    EXPECT_LT(paint[0].color.width, 100) << name;
    EXPECT_LT(paint[0].color.height, 40) << name;
  }
}

}  // namespace
}  // namespace retint
