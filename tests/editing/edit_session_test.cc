// SPDX-License-Identifier: BSD-3-Clause
#include "editing/edit_session.h"

#include <cstring>
#include <fstream>
#include <span>

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "editing/main_colors.h"
#include "tests/saving/saved_scene.h"
#include "tests/support/closed_form.h"

namespace retint {
namespace {

const ColorEdit kBlue = ColorEdit::Tint({0.2F, 0.4F, 1.0F});
const ColorEdit kRed = ColorEdit::Tint({1.0F, 0.1F, 0.1F});

RefitJob ShortJob(int iterations = 3) {
  RefitJob job;
  job.options.mm.iterations = iterations;
  return job;
}

// Mean |difference| of the renders' pixels inside and outside the masks.
struct Difference {
  double inside = 0, outside = 0;
};
Difference Compare(EditSession& session, const TinyScene& scene, std::span<const float> a,
                   std::span<const float> b) {
  Difference difference;
  double inside = 0, outside = 0;
  for (const View* view : session.scene().reconstruction().ViewsByName()) {
    const Image one = session.scene().Render(*view, a), two = session.scene().Render(*view, b);
    const Mask& mask = scene.masks[view->id - 1];
    for (size_t i = 0; i < one.data.size(); ++i) {
      const double d = std::abs(one.data[i] - two.data[i]);
      const double m = mask.data[i / 3] / 255.0;
      difference.inside += m * d;
      difference.outside += (1 - m) * d;
      inside += m;
      outside += 1 - m;
    }
  }
  difference.inside /= inside;
  difference.outside /= outside;
  return difference;
}

TEST(EditSession, ARegionRecolorsWhatItSelectsAndLeavesTheRest) {
  const TinyScene scene(1);
  const auto session = MakeSession(scene);
  Monitor monitor;
  session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  session->refits().Refit(ShortJob(), monitor);
  const FloatArray after = session->refits().CurrentSh();
  const size_t block = static_cast<size_t>(scene.model.NumShCoeffs()) * 3;
  for (size_t g = 0; g < scene.shares.size(); ++g) {
    if (scene.shares[g] > 0) continue;
    EXPECT_EQ(0, std::memcmp(&after[g * block], &scene.model.sh[g * block], block * sizeof(float)))
        << "Gaussian " << g << " is outside";
  }
  const Difference difference = Compare(*session, scene, after, scene.model.sh);
  EXPECT_GT(difference.inside, 0.05);
  EXPECT_LT(difference.outside, 0.2 * difference.inside);
  EXPECT_EQ(session->refits().Summary().iterations, 3);
}

TEST(EditSession, UndoRestoresTheOriginalBits) {
  const TinyScene scene(2);
  const auto session = MakeSession(scene);
  Monitor monitor;
  session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  session->refits().Refit(ShortJob(), monitor);
  EXPECT_FALSE(SameBits(session->refits().CurrentSh(), scene.model.sh));
  ASSERT_TRUE(session->store().history().Undo());
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(), scene.model.sh));
}

TEST(EditSession, UndoAndRedoRestoreEveryFitExactly) {
  const TinyScene scene(3);
  const auto session = MakeSession(scene);
  Monitor monitor;
  const RegionId region =
      session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  session->refits().Refit(ShortJob(), monitor);
  const FloatArray blue = session->refits().CurrentSh();
  session->store().Do(SetEdit{region, kRed});
  session->refits().Refit(ShortJob(), monitor);
  const FloatArray red = session->refits().CurrentSh();
  EXPECT_FALSE(SameBits(blue, red));
  session->store().history().Undo();
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(), blue));
  session->store().history().Redo();
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(), red));
}

TEST(EditSession, ANewEditStartsFromTheOriginal) {
  const TinyScene scene(4);
  Monitor monitor;
  const auto direct = MakeSession(scene);
  direct->store().Add("left", MasksOf(scene), scene.shares, kRed, monitor);
  direct->refits().Refit(ShortJob(), monitor);
  const auto detour = MakeSession(scene);
  const RegionId region = detour->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  detour->refits().Refit(ShortJob(), monitor);
  detour->store().Do(SetEdit{region, kRed});
  detour->refits().Refit(ShortJob(), monitor);
  EXPECT_TRUE(SameBits(direct->refits().CurrentSh(), detour->refits().CurrentSh()));
}

TEST(EditSession, HidingShowsTheOriginalAndShowingTheFitAgain) {
  const TinyScene scene(5);
  const auto session = MakeSession(scene);
  Monitor monitor;
  const RegionId region =
      session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  session->refits().Refit(ShortJob(), monitor);
  const FloatArray fitted = session->refits().CurrentSh();
  session->store().Do(SetVisible{region, false});
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(), scene.model.sh));
  session->store().Do(SetVisible{region, true});
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(), fitted));
}

TEST(EditSession, RegionsComposeInOrder) {
  const TinyScene scene(6);
  const auto session = MakeSession(scene);
  Monitor monitor;
  const auto other = [&] {
    std::vector<float> shares;
    for (const float share : scene.shares) shares.push_back(1 - share);
    return shares;
  }();
  const RegionId left = session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  session->refits().Refit(ShortJob(), monitor);
  const FloatArray one = session->refits().CurrentSh();
  session->store().Add("right", OtherMasksOf(scene), other, kRed, monitor);
  session->refits().Refit(ShortJob(), monitor);
  const FloatArray both = session->refits().CurrentSh();
  const size_t block = static_cast<size_t>(scene.model.NumShCoeffs()) * 3;
  for (size_t g = 0; g < scene.shares.size(); ++g) {
    const bool is_left = scene.shares[g] > 0;
    const float* expected = is_left ? &one[g * block] : &scene.model.sh[g * block];
    const bool same = std::memcmp(&both[g * block], expected, block * sizeof(float)) == 0;
    EXPECT_EQ(same, is_left) << "Gaussian " << g
                             << ": the second region changes its own Gaussians, and only those";
  }
  // Order is part of the state.
  session->store().Do(MoveRegion{left, 1});
  EXPECT_EQ(session->store().regions().regions[1].id, left);
  session->store().history().Undo();
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(), both));
  session->store().Do(RemoveRegion{left});
  EXPECT_EQ(session->store().regions().regions.size(), 1u);
}

TEST(EditSession, StrengthZeroChangesNothing) {
  const TinyScene scene(7);
  const auto session = MakeSession(scene);
  Monitor monitor;
  const RegionId region =
      session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  session->store().Do(SetEdit{region, kBlue, 0});
  session->refits().Refit(ShortJob(), monitor);
  const Difference difference =
      Compare(*session, scene, session->refits().CurrentSh(), scene.model.sh);
  // Rounding of float renders only.
  EXPECT_LT(difference.inside, 1e-5);
}

TEST(EditSession, BeforeAFitTheStateShowsItsClosedForm) {
  const TinyScene scene(8);
  const auto session = MakeSession(scene);
  Monitor monitor;
  session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(),
                       ClosedFormSh(session->scene().renderer().backend(), scene.model.sh,
                                    scene.model.NumShCoeffs(), scene.shares, kBlue, 1e-3)));
}

// Bands across the first view, as they are once a picture of it was compared.
ColorEdit Bands(const TinyScene& scene) {
  const int width = scene.cameras[0].camera.width, height = scene.cameras[0].camera.height;
  PaintLayer layer{ViewName(0), 0, 0, Image8(width, height), Mask(width, height)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      layer.alpha(x, y) = y / 8 % 2 == 0 ? 255 : 0;
      layer.color(x, y, 0) = 255;
    }
  }
  ColorOperation op = ColorOperation::Picture({});
  op.picture = std::make_shared<PictureEdit>(PictureEdit{{}, {layer}});
  op.Get("explained")[0] = 0;
  op.Get("residual")[0] = 0;
  return {{op}, 1};
}

TEST(EditSession, PaintShowsBeforeAFit) {
  const TinyScene scene(8);
  const auto session = MakeSession(scene);
  Monitor monitor;
  const RegionId id =
      session->store().Add("left", MasksOf(scene), scene.shares, ColorEdit(), monitor);
  const FloatArray plain = session->refits().CurrentSh();
  EXPECT_TRUE(SameBits(plain, scene.model.sh));
  session->store().Do(SetEdit{id, Bands(scene)});
  const FloatArray painted = session->refits().CurrentSh();
  const auto paint = session->store().regions().regions[0].paint;
  ASSERT_TRUE(paint);
  ASSERT_FALSE(paint->gaussians.empty());
  const double whole = Compare(*session, scene, painted, plain).inside;
  EXPECT_GT(whole, 0.02);
  // Gaussians outside the selection stay, bit for bit.
  for (size_t g = 0; g < scene.model.NumGaussians(); ++g) {
    if (scene.shares[g] > 0) continue;
    const size_t block = static_cast<size_t>(scene.model.NumShCoeffs()) * 3;
    ASSERT_EQ(0, std::memcmp(&painted[g * block], &plain[g * block], block * sizeof(float))) << g;
  }
  // Half of it, without looking at the layers again, though a copy of them is given.
  session->store().Do(SetEdit{id, Bands(scene), 0.5F});
  EXPECT_EQ(session->store().regions().regions[0].paint, paint);
  const double half = Compare(*session, scene, session->refits().CurrentSh(), plain).inside;
  EXPECT_GT(half, 0.3 * whole);
  EXPECT_LT(half, 0.7 * whole);
  session->store().history().Undo();
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(), painted));
  // A session that is opened again does not hold it.
  RegionSet saved = session->store().regions();
  saved.regions[0].paint = nullptr;
  const auto opened = MakeSession(scene);
  opened->RestoreRegions(std::move(saved), session->store().job());
  EXPECT_TRUE(SameBits(opened->refits().CurrentSh(), painted));
  session->store().history().Undo();
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(), plain));
}

// The first visible result of a background fit has all of the preview.
TEST(EditSession, TheFitOfPaintStartsFromWhatShows) {
  const TinyScene scene(8);
  const auto session = MakeSession(scene);
  Monitor monitor;
  session->store().Add("left", MasksOf(scene), scene.shares, Bands(scene), monitor);
  const FloatArray shown = session->refits().CurrentSh();
  RefitJob job = ShortJob();
  job.options.solver = Solver::kAdam;
  job.options.adam.iterations = 1;
  job.options.adam.learning_rate = 1e-12;  // it stays where it starts
  session->refits().Refit(job, monitor);
  ASSERT_TRUE(session->store().regions().regions[0].fit);
  const FloatArray start = session->refits().CurrentSh();
  EXPECT_LT(Compare(*session, scene, start, shown).inside, 1e-5);
  EXPECT_GT(Compare(*session, scene, start, scene.model.sh).inside, 0.02);
}

TEST(EditSession, TheHistorySaysWhatWasDoneToAnEdit) {
  using Kind = ColorOperationKind;
  const TinyScene scene(9);
  const auto session = MakeSession(scene);
  Monitor monitor;
  const RegionId id = session->store().Add("vase", MasksOf(scene), scene.shares, kBlue, monitor);
  ColorEdit edit = kBlue;
  const auto label = [&](float strength = 1) {
    session->store().Do(SetEdit{id, edit, strength});
    return session->store().history().UndoLabel();
  };
  edit.operations.push_back(ColorOperation::Make(Kind::kWhiteBalance, {20, 0}));
  EXPECT_EQ(label(), "White balance in vase");
  edit.operations.push_back(ColorOperation::Make(Kind::kExposure, {1}));
  EXPECT_EQ(label(), "Exposure in vase");
  edit.operations[1].strength = 0.5F;
  EXPECT_EQ(label(), "White balance in vase");
  std::swap(edit.operations[1], edit.operations[2]);
  EXPECT_EQ(label(), "Reorder the steps of vase");
  edit.operations.pop_back();
  EXPECT_EQ(label(), "Remove a step of vase");
  EXPECT_EQ(label(0.5F), "Change the strength of vase");
  edit.operations[0] = ColorOperation::Make(Kind::kRecolor, {1, 0, 0});
  EXPECT_EQ(label(0.5F), "Recolor vase");
  edit.operations.push_back(ColorOperation::Lut(Tone::Neutral(Tone::Kind::kLevels).Table()));
  EXPECT_EQ(label(0.5F), "Levels in vase");
}

TEST(EditSession, SharesAreComputedFromTheMasksWhereMissing) {
  const TinyScene scene(9);
  const auto session = MakeSession(scene);
  Monitor monitor;
  session->store().Add("left", MasksOf(scene), {}, kBlue, monitor);
  const auto& shares = session->store().regions().regions[0].selection->shares;
  ASSERT_EQ(shares.size(), scene.shares.size());
  double inside = 0, outside = 0, count = 0;
  for (size_t g = 0; g < shares.size(); ++g) {
    (scene.shares[g] > 0 ? inside : outside) += shares[g];
    count += scene.shares[g];
  }
  EXPECT_GT(inside / count, 0.6);
  EXPECT_LT(outside / (static_cast<double>(shares.size()) - count), 0.4);
}

TEST(EditSession, ACancelledRefitLeavesTheStateAsItWas) {
  const TinyScene scene(10);
  const auto session = MakeSession(scene);
  Monitor monitor;
  session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  const FloatArray before = session->refits().CurrentSh();
  int calls = 0;
  Monitor* cancel = nullptr;
  Monitor cancelling([&](const Progress& progress) {
    if (progress.stage == "refit" && ++calls == 2) cancel->Cancel();
  });
  cancel = &cancelling;
  EXPECT_THROW(session->refits().Refit(ShortJob(1000), cancelling), Cancelled);
  EXPECT_TRUE(SameBits(session->refits().CurrentSh(), before));
  EXPECT_EQ(session->store().regions().regions[0].fit, nullptr);
  session->refits().Refit(ShortJob(), monitor);
  EXPECT_NE(session->store().regions().regions[0].fit, nullptr);
}

TEST(EditSession, TheBackgroundRefitEndsWhereTheForegroundOneDoes) {
  const TinyScene scene(11);
  Monitor monitor;
  const auto foreground = MakeSession(scene);
  foreground->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  foreground->refits().Refit(ShortJob(), monitor);
  const auto background = MakeSession(scene);
  background->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  background->refits().Start(ShortJob(), monitor);
  background->refits().optimizer().Wait();
  ASSERT_EQ(background->refits().optimizer().state(), BackgroundOptimizer::State::kFinished)
      << background->refits().optimizer().error();
  const auto newest = background->refits().NewestSnapshot();
  ASSERT_NE(newest, nullptr);
  EXPECT_TRUE(newest->finished);
  EXPECT_TRUE(background->refits().CollectFits());
  EXPECT_FALSE(background->refits().CollectFits()) << "once is enough";
  EXPECT_TRUE(SameBits(background->refits().CurrentSh(), foreground->refits().CurrentSh()));
  EXPECT_TRUE(SameBits(*newest->sh, background->refits().CurrentSh()));
}

TEST(EditSession, EditsOvertakeTheBackgroundRefitOverAndOver) {
  const TinyScene scene(12);
  const auto session = MakeSession(scene);
  Monitor monitor;
  const RegionId region =
      session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  for (int i = 0; i < 12; ++i) {
    const float tint = 0.05F * static_cast<float>(i + 1);
    session->store().Do(SetEdit{region, ColorEdit::Tint({tint, tint, 1}), 1}, "drag");
    session->refits().Start(ShortJob(1000), monitor);
    if (const auto newest = session->refits().NewestSnapshot())
      session->scene().renderer().SetSh(*newest->sh);
    if (i % 3 == 2)
      session->scene().Render(*session->scene().train_views()[0], session->refits().CurrentSh());
  }
  session->refits().optimizer().Cancel();
  session->refits().optimizer().Wait();
  EXPECT_FALSE(session->refits().CollectFits()) << "no fit was complete";
  ASSERT_TRUE(session->store().history().Undo());
  EXPECT_EQ(session->store().history().RedoLabel(), "Tint in left") << "the drag is one step";
  EXPECT_EQ(session->store().regions().regions[0].edit, kBlue);
}

TEST(EditSession, AFitForAnOlderEditIsNotCollected) {
  const TinyScene scene(13);
  const auto session = MakeSession(scene);
  Monitor monitor;
  const RegionId region =
      session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  session->refits().Start(ShortJob(), monitor);
  session->refits().optimizer().Wait();
  session->store().Do(SetEdit{region, kRed});
  EXPECT_FALSE(session->refits().CollectFits());
  session->store().history().Undo();
  EXPECT_TRUE(session->refits().CollectFits());
}

TEST(EditSession, HoldoutKeepsEveryNthViewOut) {
  const TinyScene scene(14);
  SessionOptions options;
  options.holdout = 3;
  const auto session = MakeSession(scene, options);
  EXPECT_EQ(session->scene().heldout_views().size(), 2u);
  EXPECT_EQ(session->scene().train_views().size(), 4u);
  EXPECT_EQ(session->scene().heldout_views()[1]->name, "view3");
  Monitor monitor;
  const RegionId region =
      session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  session->refits().Refit(ShortJob(), monitor);
  const QualityReport quality =
      session->refits().Evaluate(region, session->scene().original().sh,
                                 session->refits().CurrentSh(), TargetKind::kRender, monitor);
  EXPECT_EQ(quality.train.views, 4);
  EXPECT_EQ(quality.heldout.views, 2);
  EXPECT_GT(quality.heldout.psnr_inside_after, quality.heldout.psnr_inside_before + 3);
}

TEST(EditSession, TheEditedTargetIsTheRenderWithEveryEditPaintedOver) {
  const TinyScene scene(15);
  const auto session = MakeSession(scene);
  Monitor monitor;
  session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  const View& view = *session->scene().train_views()[0];
  const Image render = session->scene().Render(view, session->scene().original().sh);
  const Image target = session->refits().Edited(view, render);
  const Mask& mask = scene.masks[0];
  for (size_t i = 0; i < mask.data.size(); ++i) {
    const float m = static_cast<float>(mask.data[i]) / 255;
    const float expected = render.data[3 * i] * (1 + m * (0.2F - 1));
    ASSERT_NEAR(target.data[3 * i], expected, 1e-6) << i;
  }
}

TEST(EditSession, PhotosThatCouldNotBeReadTakeNoRoomOfThoseThatAreKept) {
  const TinyScene scene(23, 40);
  const TempFolder folder;
  WriteTinyScene(scene, folder.path());
  const auto photo = [&](size_t v) { return folder / ("ws/images/" + ViewName(v) + ".png"); };
  const Image gray(64, 48, 0.5F);
  for (size_t v = 0; v < scene.cameras.size(); ++v) WritePng(photo(v), gray);
  SessionOptions options;
  options.backend = "cpu";
  options.photo_bytes = scene.cameras.size() * gray.data.size() * sizeof(float);
  Monitor monitor;
  const auto session = EditSession::Open(folder / "ws", folder / "ws/splat.ply", options, monitor);
  const RegionId region =
      session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  RefitJob job = ShortJob(1);
  job.target = TargetKind::kPhoto;
  // As another program does: Retint's own writers spare the photos of a scene that is open.
  const auto put = [&](size_t v, const std::string& bytes) { std::ofstream(photo(v)) << bytes; };
  const std::string good = ReadFile(photo(3));
  put(3, "no picture");
  EXPECT_THROW(session->refits().Refit(job, monitor), InputError);
  put(3, good);
  session->refits().Refit(job, monitor);
  for (size_t v = 0; v < scene.cameras.size(); ++v) put(v, "no picture");
  session->store().Do(SetEdit{region, kRed});
  EXPECT_NO_THROW(session->refits().Refit(job, monitor)) << "all photos are kept";
}

TEST(EditSession, RefusesBadInputAndKeepsItsState) {
  const TinyScene scene(16);
  const auto session = MakeSession(scene);
  Monitor monitor;
  EXPECT_THROW(session->selection().Paint("view9", scene.masks[0]), InputError);
  EXPECT_THROW(session->selection().Paint("view0", Mask(64, 48)), InputError) << "empty";
  EXPECT_THROW(session->selection().Paint("view0", Mask(63, 48, 255)), InputError) << "size";
  EXPECT_NO_THROW(session->selection().Paint("view0", scene.masks[0]));

  std::map<std::string, Mask> empty = {{"view0", Mask(64, 48)}};
  EXPECT_THROW(session->store().Add("x", empty, scene.shares, kBlue, monitor), InputError);
  std::map<std::string, Mask> wrong = {{"view0", Mask(1, 1, 255)}};
  EXPECT_THROW(session->store().Add("x", wrong, scene.shares, kBlue, monitor), InputError);
  std::map<std::string, Mask> unknown = {{"nowhere", Mask(64, 48, 255)}};
  EXPECT_THROW(session->store().Add("x", unknown, scene.shares, kBlue, monitor), InputError);
  EXPECT_THROW(session->store().Add("x", MasksOf(scene), {1.0F}, kBlue, monitor), InputError);
  const ColorEdit negative = ColorEdit::Tint({-1, 0, 0});
  EXPECT_THROW(session->store().Add("x", MasksOf(scene), scene.shares, negative, monitor),
               OptionError);
  EXPECT_TRUE(session->store().regions().regions.empty());
  EXPECT_FALSE(session->store().history().CanUndo());

  EXPECT_THROW(session->store().Do(SetEdit{7, kBlue}), OptionError);
  const RegionId region =
      session->store().Add("left", MasksOf(scene), scene.shares, kBlue, monitor);
  EXPECT_THROW(session->store().Do(SetEdit{region, kBlue, 1.5F}), OptionError);
  EXPECT_EQ(session->store().history().UndoLabel(), "Add left");
  SessionOptions options;
  options.holdout = 1;
  EXPECT_THROW(options.Check(), OptionError);
}

// How many pixels of a small picture are looked at does not depend on how large its mask is.
TEST(EditSession, MeasuresColorsInSmallPicturesOfLargeMasks) {
  const TinyScene scene(19);
  Renderer renderer = scene.MakeRenderer();
  const Camera& camera = scene.cameras[0].camera;
  const Mask mask(16 * camera.width, 16 * camera.height, 255);
  ASSERT_GT(mask.NumPixels(), 400'000);
  EXPECT_EQ(PixelsInside(scene.cameras[0], mask, renderer).size(),
            size_t(3 * camera.width * camera.height));
}

TEST(EditSession, MeasuresTheMainColorOfARegion) {
  const TinyScene scene(31);
  const auto session = MakeSession(scene);
  Monitor monitor;
  ColorEdit edit;
  edit.operations = {ColorOperation::Make(ColorOperationKind::kRecolor, {0.2F, 0.4F, 1})};
  const RegionId region = session->store().Add("x", MasksOf(scene), scene.shares, edit, monitor);
  const ColorEdit measured = session->store().regions().Find(region)->edit;
  EXPECT_FALSE(measured.NeedsMainColor());
  ASSERT_EQ(measured.operations.size(), 1U);
  EXPECT_EQ(measured.operations[0].Get("to")[2], 1);
  EXPECT_GE(measured.operations[0].Get("brightest")[0], 1);
  EXPECT_EQ(session->store().MeasureEdit(region, edit), measured);
  // Measured after the earlier operations of the list: gray here.
  edit.operations.insert(edit.operations.begin(), ColorOperation::Make(ColorOperationKind::kGray));
  session->store().Do(SetEdit{region, edit});
  const auto from = session->store().regions().Find(region)->edit.operations[1].Get("from");
  // Gray to the rounding of OKLab's matrices.
  EXPECT_NEAR(from[0], from[1], 2e-3F);
  EXPECT_NEAR(from[1], from[2], 2e-3F);
  EXPECT_GT(from[0], 0.05F);
  // A named color is not measured again.
  session->store().Do(SetEdit{region, measured});
  EXPECT_EQ(session->store().regions().Find(region)->edit, measured);
}

}  // namespace
}  // namespace retint
