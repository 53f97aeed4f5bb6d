// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/mask_editor.h"

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace retint {
namespace {

using Eigen::Vector2d;

constexpr Combine kAll[] = {Combine::kReplace, Combine::kAdd, Combine::kRemove,
                            Combine::kIntersect};

// The bounds of the differences; the editor's answer must contain them.
GridRect Difference(const Mask& a, const Mask& b) {
  GridRect rect;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      if (a(x, y) != b(x, y)) rect = rect.United({x, y, 1, 1});
    }
  }
  return rect;
}

bool Holds(const GridRect& outer, const GridRect& inner) { return inner.Clipped(outer) == inner; }

Mask Noise(int width, int height, unsigned seed) {
  std::mt19937 engine(seed);
  Mask mask(width, height);
  for (uint8_t& value : mask.data) value = static_cast<uint8_t>(engine());
  return mask;
}

double SegmentDistance(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const double length = (b - a).squaredNorm();
  const double t = length > 0 ? std::clamp((p - a).dot(b - a) / length, 0.0, 1.0) : 0.0;
  return (p - a - t * (b - a)).norm();
}

TEST(MaskEditor, AHardStrokeIsTheBrushSweptAlongItsPath) {
  MaskEditor editor(120, 90);
  const Vector2d path[] = {{20.3, 20.7}, {90, 31}, {60, 80}};
  editor.BeginStroke(path[0], {9, 1}, Combine::kAdd);
  editor.StrokeTo(path[1]);
  editor.StrokeTo(path[2]);
  editor.EndStroke();
  for (int y = 0; y < 90; ++y) {
    for (int x = 0; x < 120; ++x) {
      const Vector2d center(x + 0.5, y + 0.5);
      const double distance = std::min(SegmentDistance(center, path[0], path[1]),
                                       SegmentDistance(center, path[1], path[2]));
      const int value = editor.mask()(x, y);
      if (distance < 8.4) {
        EXPECT_EQ(value, 255) << x << " " << y;
      }
      if (distance > 9.6) {
        EXPECT_EQ(value, 0) << x << " " << y;
      }
      if (distance < 8.99) {
        EXPECT_GE(value, 127) << x << " " << y;
      }
      if (distance > 9.01) {
        EXPECT_LE(value, 128) << x << " " << y;
      }
    }
  }
  EXPECT_TRUE(editor.CanUndo());
  editor.Undo();
  EXPECT_EQ(editor.CountInside(), 0u);
  EXPECT_FALSE(editor.CanUndo()) << "one stroke is one step";
}

TEST(MaskEditor, ASoftBrushFallsOffAndDoesNotAddUpWithinAStroke) {
  MaskEditor editor(100, 100);
  const BrushOptions soft{20, 0.25};
  editor.BeginStroke({50, 50}, soft, Combine::kAdd);
  const Mask once = editor.mask();
  for (int i = 0; i < 5; ++i) editor.StrokeTo({50, 50});
  EXPECT_EQ(once.data, editor.mask().data);
  editor.EndStroke();
  EXPECT_EQ(once(50, 50), 255);
  int last = 255;
  for (int x = 50; x < 75; ++x) {
    EXPECT_LE(once(x, 50), last);
    last = once(x, 50);
  }
  EXPECT_GT(once(60, 50), 128);
  EXPECT_LT(once(66, 50), 128);
  EXPECT_GT(once(66, 50), 0);
  EXPECT_EQ(once(72, 50), 0);
}

TEST(MaskEditor, StrokesCombineWithWhatIsThere) {
  const Mask start = Noise(64, 48, 1);
  for (const Combine combine : kAll) {
    MaskEditor plain(64, 48);
    plain.BeginStroke({20, 20}, {10, 0.5}, Combine::kAdd);
    plain.StrokeTo({40, 25});
    plain.EndStroke();
    const Mask& stroke = plain.mask();

    MaskEditor editor;
    editor.Reset(start);
    GridRect changed = editor.BeginStroke({20, 20}, {10, 0.5}, combine);
    changed = changed.United(editor.StrokeTo({40, 25}));
    EXPECT_TRUE(editor.InStroke());
    EXPECT_TRUE(Holds(changed, Difference(start, editor.mask())));
    editor.EndStroke();
    for (size_t i = 0; i < start.data.size(); ++i) {
      const int m = start.data[i], s = stroke.data[i];
      const int expected = combine == Combine::kReplace  ? s
                           : combine == Combine::kAdd    ? std::max(m, s)
                           : combine == Combine::kRemove ? std::min(m, 255 - s)
                                                         : std::min(m, s);
      ASSERT_EQ(editor.mask().data[i], expected) << "pixel " << i << " mode " << int(combine);
    }
    editor.Undo();
    EXPECT_EQ(editor.mask().data, start.data);
  }
}

TEST(MaskEditor, ACancelledStrokeNeverHappened) {
  const Mask start = Noise(64, 48, 2);
  MaskEditor editor;
  editor.Reset(start);
  editor.BeginStroke({10, 10}, {5, 1}, Combine::kIntersect);
  editor.StrokeTo({50, 40});
  editor.CancelStroke();
  EXPECT_EQ(editor.mask().data, start.data);
  EXPECT_FALSE(editor.CanUndo());
  EXPECT_FALSE(editor.InStroke());
  // The coverage of the cancelled stroke is gone as well.
  editor.BeginStroke({10, 10}, {5, 1}, Combine::kRemove);
  editor.EndStroke();
  EXPECT_EQ(editor.mask()(50, 40), start(50, 40));
}

TEST(MaskEditor, StrokesBeyondTheBorderAreClipped) {
  MaskEditor editor(32, 32);
  EXPECT_TRUE(editor.BeginStroke({-100, -100}, {5, 1}, Combine::kAdd).Empty());
  editor.StrokeTo({1e12, 1e12});
  editor.StrokeTo({std::nan(""), 3});
  editor.StrokeTo({16, std::numeric_limits<double>::infinity()});
  editor.EndStroke();
  EXPECT_EQ(editor.mask()(16, 16), 255) << "the diagonal was crossed";
  MaskEditor empty;
  EXPECT_TRUE(empty.BeginStroke({0, 0}, {5, 1}, Combine::kReplace).Empty());
  empty.EndStroke();
  EXPECT_TRUE(empty.Invert().Empty());
  EXPECT_TRUE(empty.Grow(3).Empty());
  EXPECT_TRUE(empty.Undo().Empty());
}

TEST(MaskEditor, ARectangleCoversItsPixelsInAnyOrderOfCorners) {
  for (const auto& [a, b] : {std::pair{Vector2d(10.4, 5.6), Vector2d(20.4, 8.4)},
                             std::pair{Vector2d(20.4, 5.6), Vector2d(10.4, 8.4)}}) {
    MaskEditor editor(40, 30);
    const GridRect changed = editor.FillRectangle(a, b, Combine::kReplace);
    EXPECT_EQ(changed, (GridRect{10, 6, 10, 2}));
    EXPECT_EQ(editor.CountInside(), 20u);
  }
  MaskEditor editor(40, 30);
  editor.FillRectangle({-50, -50}, {500, 500}, Combine::kAdd);
  EXPECT_EQ(editor.CountInside(), 1200u);
  EXPECT_TRUE(editor.FillRectangle({3, 3}, {3.2, 9}, Combine::kAdd).Empty());
  EXPECT_TRUE(editor.FillRectangle({std::nan(""), 3}, {3.2, 9}, Combine::kRemove).Empty());
}

// Even-odd by counting crossings; pixels whose center lies on the outline may go either way.
TEST(MaskEditor, APolygonIsEvenOdd) {
  const std::vector<Vector2d> star = {{50, 3}, {80, 92}, {4, 36}, {96, 36}, {20, 92}};
  MaskEditor editor(100, 100);
  editor.FillPolygon(star, Combine::kReplace);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) {
      const Vector2d p(x + 0.5, y + 0.5);
      bool inside = false, near = false;
      for (size_t i = 0; i < star.size(); ++i) {
        const Vector2d &a = star[i], &b = star[(i + 1) % star.size()];
        near |= SegmentDistance(p, a, b) < 1e-9;
        if ((a.y() > p.y()) == (b.y() > p.y())) continue;
        inside ^= p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      }
      if (!near) {
        EXPECT_EQ(editor.mask()(x, y), inside ? 255 : 0) << x << " " << y;
      }
    }
  }
  EXPECT_EQ(editor.mask()(50, 50), 0) << "the middle is crossed twice";
  const Vector2d two[] = {{1, 1}, {50, 50}};
  EXPECT_TRUE(editor.FillPolygon(two, Combine::kReplace).Empty());
  const Vector2d far[] = {{-1e9, -1e9}, {1e9, -1e9}, {1e9, 1e9}, {-1e9, 1e9}};
  editor.FillPolygon(far, Combine::kAdd);
  EXPECT_EQ(editor.CountInside(), 10000u);
}

TEST(MaskEditor, AShapeOfAnySoftnessIsFilled) {
  MaskEditor editor(4, 1);
  Mask shape(4, 1);
  shape.data = {0, 100, 200, 255};
  editor.Fill(shape, Combine::kReplace);
  EXPECT_EQ(editor.mask().data, (std::vector<uint8_t>{0, 100, 200, 255}));
  shape.data = {255, 0, 100, 155};
  editor.Fill(shape, Combine::kRemove);
  EXPECT_EQ(editor.mask().data, (std::vector<uint8_t>{0, 100, 155, 100}));
  editor.Undo();
  EXPECT_EQ(editor.mask().data, (std::vector<uint8_t>{0, 100, 200, 255}));
}

TEST(MaskEditor, GrowAndShrinkFollowADisc) {
  MaskEditor editor(60, 60);
  editor.FillRectangle({20, 20}, {40, 40}, Combine::kReplace);
  editor.Grow(5);
  EXPECT_EQ(editor.mask()(15, 30), 255);
  EXPECT_EQ(editor.mask()(14, 30), 0);
  EXPECT_EQ(editor.mask()(15, 15), 0) << "corners are round";
  editor.Shrink(5);
  EXPECT_EQ(editor.mask()(20, 30), 255);
  EXPECT_EQ(editor.mask()(19, 30), 0);
  EXPECT_TRUE(editor.Grow(0).Empty());
  editor.SelectAll();
  EXPECT_TRUE(editor.Shrink(4).Empty()) << "the border cuts nothing off";
}

TEST(MaskEditor, InvertAllAndNone) {
  const Mask start = Noise(30, 20, 3);
  MaskEditor editor;
  editor.Reset(start);
  editor.Invert();
  for (size_t i = 0; i < start.data.size(); ++i) {
    ASSERT_EQ(editor.mask().data[i], 255 - start.data[i]);
  }
  editor.SelectAll();
  EXPECT_EQ(editor.CountInside(), 600u);
  EXPECT_TRUE(editor.SelectAll().Empty()) << "nothing changed, no step";
  editor.SelectNone();
  EXPECT_FALSE(editor.AnyInside());
  editor.Undo(), editor.Undo(), editor.Undo();
  EXPECT_EQ(editor.mask().data, start.data);
  EXPECT_FALSE(editor.CanUndo());
  EXPECT_TRUE(editor.Fill(Mask(3, 3), Combine::kReplace).Empty());
}

// Any sequence of edits, undone and done again, gives the same masks.
TEST(MaskEditor, UndoAndRedoRepeatEveryStateExactly) {
  std::mt19937 engine(4);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(engine()) / 4294967296.0);
  };
  const auto point = [&] { return Vector2d(uniform(-10, 90), uniform(-10, 70)); };
  MaskEditor editor(80, 60);
  std::vector<Mask> states = {editor.mask()};
  for (int i = 0; i < 60; ++i) {
    const Combine combine = kAll[engine() % 4];
    const Mask before = editor.mask();
    GridRect changed;
    switch (engine() % 6) {
      case 0:
        changed = editor.BeginStroke(point(), {uniform(1, 15), uniform(0, 1)}, combine);
        for (int k = 0; k < 3; ++k) changed = changed.United(editor.StrokeTo(point()));
        editor.EndStroke();
        break;
      case 1:
        changed = editor.FillRectangle(point(), point(), combine);
        break;
      case 2: {
        const Vector2d outline[] = {point(), point(), point(), point()};
        changed = editor.FillPolygon(outline, combine);
        break;
      }
      case 3:
        changed = editor.Grow(int(engine() % 4));
        break;
      case 4:
        changed = editor.Shrink(int(engine() % 4));
        break;
      default:
        changed = editor.Invert();
    }
    EXPECT_TRUE(Holds(changed, Difference(before, editor.mask())));
    if (editor.mask().data != before.data) states.push_back(editor.mask());
  }
  ASSERT_GT(states.size(), 30u);
  for (size_t i = states.size() - 1; i > 0; --i) {
    ASSERT_EQ(editor.mask().data, states[i].data);
    const GridRect changed = editor.Undo();
    EXPECT_TRUE(Holds(changed, Difference(states[i], states[i - 1])));
  }
  EXPECT_FALSE(editor.CanUndo());
  for (const Mask& state : states) {
    ASSERT_EQ(editor.mask().data, state.data);
    editor.Redo();
  }
  EXPECT_FALSE(editor.CanRedo());
}

TEST(MaskEditor, ANewChangeForgetsWhatWasUndone) {
  MaskEditor editor(10, 10);
  editor.SelectAll();
  editor.Undo();
  ASSERT_TRUE(editor.CanRedo());
  editor.FillRectangle({0, 0}, {2, 2}, Combine::kAdd);
  EXPECT_FALSE(editor.CanRedo());
  EXPECT_EQ(editor.history_bytes(), 4u);
}

TEST(MaskEditor, TheHistoryKeepsToItsBudget) {
  MaskEditor editor(100, 100, 25000);
  for (int i = 0; i < 9; ++i) editor.Invert();
  EXPECT_LE(editor.history_bytes(), 25000u);
  EXPECT_TRUE(editor.CanUndo());
  int undone = 0;
  while (editor.CanUndo()) editor.Undo(), ++undone;
  EXPECT_EQ(undone, 2);
  EXPECT_EQ(editor.CountInside(), 10000u) << "seven of nine inversions remain";
  MaskEditor tiny(100, 100, 10);
  tiny.Invert();
  EXPECT_TRUE(tiny.CanUndo()) << "the newest step always stays";
}

// The cost of a move depends on the brush, not on the image: its box is as large as the brush, and
// it is far cheaper than the image.
TEST(MaskEditor, AMoveTouchesTheBrushAlone) {
  MaskEditor editor(4000, 3000);
  editor.BeginStroke({2000, 1500}, {20, 1}, Combine::kAdd);
  const GridRect changed = editor.StrokeTo({2005, 1502});
  EXPECT_LE(changed.width, 5 + 2 * 21 + 2);
  EXPECT_LE(changed.height, 2 + 2 * 21 + 2);
  editor.EndStroke();
  EXPECT_LT(editor.history_bytes(), 5000u);
}

}  // namespace
}  // namespace retint
