// SPDX-License-Identifier: BSD-3-Clause
// Fits whose views are shared among ranks: on the CPU the same bits as those of one.
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "recolor/edit_text.h"
#include "recolor/quality_report.h"
#include "recolor/sh_refitter.h"
#include "tests/recolor/tiny_scene.h"
#include "tests/support/thread_ranks.h"

namespace retint {
namespace {

struct FitCase {
  std::string name;
  std::function<void(RefitOptions&)> change;
  const char* operation = nullptr;  // null: a tint
  bool photos = false;
};

struct Fitted {
  std::vector<float> shares;
  FloatArray sh;
  RefitSummary summary;
  QualityReport quality;
};

ColorEdit EditOf(const FitCase& one) {
  if (!one.operation) return ColorEdit::Tint({0.4f, 0.9f, 1.3f});
  ColorEdit edit;
  edit.operations = {ParseOperation(*FindOperationType(one.operation), "1.5")};
  return edit;
}

Fitted Fit(const TinyScene& scene, const FitCase& one) {
  Renderer renderer = scene.MakeRenderer();
  Monitor monitor;
  RefitOptions options;
  options.adam.iterations = 60;  // a mean of the loss in between
  if (one.change) one.change(options);
  const ColorEdit edit = EditOf(one);
  std::vector<RefitTarget> targets = scene.Targets();
  // A process needs the photos of its own targets only.
  const ViewReducer shared = ShareTargets(renderer.backend(), targets);
  for (size_t t = 0; t < targets.size(); ++t) {
    if (!shared.Owns(t)) targets[t].photo = nullptr;
  }
  Fitted fitted;
  fitted.shares = MaskShares(renderer, targets, monitor);
  ShRefitter refitter(renderer, scene.model, targets, edit, fitted.shares, options, monitor);
  fitted.summary = refitter.Run(monitor);
  fitted.sh = refitter.Sh();
  fitted.quality =
      EvaluateEdit(renderer, scene.model.sh, fitted.sh, targets, targets, edit, monitor);
  return fitted;
}

// Bytes, so that a NaN or a -0 counts.
template <typename Values>
bool SameBytes(const Values& a, const Values& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
}

void ExpectSame(const QualityNumbers& a, const QualityNumbers& b) {
  EXPECT_EQ(a.views, b.views);
  const auto values = [](const QualityNumbers& q) {
    return std::vector<double>{q.psnr_inside_before, q.psnr_inside_after, q.psnr_outside, q.bleed,
                               q.out_of_gamut};
  };
  EXPECT_TRUE(SameBytes(values(a), values(b)));
}

void ExpectSame(const Fitted& a, const Fitted& b) {
  EXPECT_TRUE(SameBytes(a.shares, b.shares));
  EXPECT_TRUE(SameBytes(a.sh, b.sh));
  EXPECT_TRUE(SameBytes(a.summary.losses, b.summary.losses));
  EXPECT_EQ(a.summary.BriefReport(), b.summary.BriefReport());
  EXPECT_EQ(a.summary.views, b.summary.views);
  EXPECT_EQ(a.summary.views_kept, b.summary.views_kept);
  EXPECT_EQ(a.summary.region_bytes, b.summary.region_bytes);
  EXPECT_EQ(a.summary.region_fraction, b.summary.region_fraction);
  ExpectSame(a.quality.train, b.quality.train);
  ExpectSame(a.quality.heldout, b.quality.heldout);
  ASSERT_EQ(a.quality.views.size(), b.quality.views.size());
  for (size_t v = 0; v < a.quality.views.size(); ++v) {
    EXPECT_EQ(a.quality.views[v].name, b.quality.views[v].name);
    EXPECT_EQ(a.quality.views[v].psnr_inside, b.quality.views[v].psnr_inside);
  }
}

class RanksTest : public testing::TestWithParam<FitCase> {};

TEST_P(RanksTest, FitTheSameBits) {
  TinyScene scene(17, 700);  // enough Gaussians that sums go from rank to rank in parts
  // One view that sees nothing of the selection: its rank finds no work in it.
  std::fill(scene.masks[2].data.begin(), scene.masks[2].data.end(), uint8_t{0});
  if (GetParam().photos) {
    Renderer renderer = scene.MakeRenderer();
    for (const PosedCamera& camera : scene.cameras) {
      scene.photos.push_back(renderer.Render(camera).rgb);
      for (float& value : scene.photos.back().data) value *= 0.9f;
    }
  }
  const Fitted alone = Fit(scene, GetParam());
  EXPECT_GT(alone.summary.changed_gaussians, 256);
  for (const int count : {2, 3, 8}) {
    SCOPED_TRACE(count);
    for (const Fitted& fitted :
         MakeOnRanks<Fitted>(count, [&] { return Fit(scene, GetParam()); })) {
      ExpectSame(alone, fitted);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Fits, RanksTest,
    testing::Values(FitCase{"Lbfgs", nullptr}, FitCase{"Photos", nullptr, nullptr, true},
                    // Its start is fitted to the views.
                    FitCase{"Gamma", nullptr, "gamma"},
                    // Some views are kept, others prepared at each visit.
                    FitCase{"SmallCache", [](RefitOptions& o) { o.SetRegionCacheBytes(400'000); }},
                    FitCase{"Adam", [](RefitOptions& o) { o.solver = Solver::kAdam; }}),
    [](const auto& one) { return one.param.name; });

// A cache that some of the views fit into, or the case above shows nothing.
TEST(RanksCache, KeepsSomeViews) {
  const TinyScene scene(17, 700);
  const Fitted fitted = Fit(scene, {"", [](RefitOptions& o) { o.SetRegionCacheBytes(400'000); }});
  EXPECT_GT(fitted.summary.views_kept, 0);
  EXPECT_LT(fitted.summary.views_kept, fitted.summary.views);
}

}  // namespace
}  // namespace retint
