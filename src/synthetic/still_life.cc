// SPDX-License-Identifier: BSD-3-Clause
// A round walnut table in a room's corner, with a glazed ball, a gift box,
// a brass candlestick, a potted plant and a pear. Heights are given upwards and turned into the
// world's y-down frame by At().
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "synthetic/noise.h"
#include "synthetic/world.h"

namespace retint::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kTable = 0.72;                 // height of the table's top
constexpr double kWallX = 1.15, kWallZ = 1.25;  // the plain wall and the papered one
constexpr double kRoomHeight = 2.7;
const Vec3 kWallpaperGround(0.052, 0.125, 0.115);

Vec3 At(double x, double height, double z) { return {x, -height, z}; }
Vec3 Blend(const Vec3& a, const Vec3& b, double t) { return a + t * (b - a); }
int64_t Floor(double x) { return int64_t(std::floor(x)); }
int64_t Modulo(int64_t a, int64_t n) { return ((a % n) + n) % n; }

auto Plain(const Vec3& color) {
  return [color](const TexturePoint&) { return color; };
}

// ---- Textures ----

// Signed distance to an ellipse with half axes a, b about the origin, to first order.
double EllipseDistance(double x, double y, double a, double b) {
  const double u = x / a, v = y / b;
  const double k = std::sqrt(u * u + v * v), g = std::sqrt(u * u / (a * a) + v * v / (b * b));
  return g > 0 ? k * (k - 1) / g : -b;
}

// Wallpaper in half drop: sprigs with paired leaves and berries on a deep green ground.
Vec3 Wallpaper(double x, double y, uint64_t seed) {
  constexpr double kCellX = 0.36, kCellY = 0.56, kEdge = 0.0035;
  const int64_t column = Floor(x / kCellX);
  const double shifted = y + (Modulo(column, 2) ? kCellY / 2 : 0);
  double u = x - (double(column) + 0.5) * kCellX;
  const double v = shifted - (std::floor(shifted / kCellY) + 0.5) * kCellY;
  const double linen =
      0.5 * Noise(x * 260, y * 45, seed) + 0.5 * Noise(x * 45, y * 260, seed + 1) - 0.5;
  Vec3 color = kWallpaperGround * (1 + 0.28 * linen) * (0.9 + 0.2 * Fbm(x * 5, y * 5, 3, seed + 2));
  const Vec3 leaf_light(0.46, 0.50, 0.36), leaf_dark(0.24, 0.33, 0.25), berry(0.70, 0.36, 0.12);

  u -= 0.018 * std::sin(v * 11);
  // Stem.
  if (std::abs(v) < 0.235) {
    color = Blend(color, leaf_dark, Smooth(0.0035 + kEdge, 0.0035, std::abs(u)));
  }
  // Leaves along the stem, smaller towards the top; v grows downwards.
  for (int i = 0; i < 5; ++i) {
    const double along = 0.20 - 0.095 * i, size = 1 - 0.11 * i;
    for (const double side : {-1.0, 1.0}) {
      const double a = 0.052 * size, b = 0.0205 * size;
      const double px = u - side * 0.052 * size, py = v - (along - 0.035 - (side > 0 ? 0.018 : 0));
      if (px * px + py * py > (a + 3 * kEdge) * (a + 3 * kEdge)) continue;
      const double angle = side * (0.62 - 0.04 * i) + (side > 0 ? 0 : kPi);
      const double cosine = std::cos(-angle), sine = std::sin(-angle);
      const double lx = cosine * px + sine * py, ly = -sine * px + cosine * py;
      // Pointed at both ends: narrower than an ellipse away from the middle.
      const double d = EllipseDistance(lx, ly * (1 + 0.9 * (lx / a) * (lx / a)), a, b);
      if (d > 2 * kEdge) continue;
      const Vec3 tone = Blend(leaf_light, leaf_dark, Smooth(-0.002, 0.004, side * ly));
      color = Blend(color, tone, Smooth(kEdge, -kEdge, d));
    }
  }
  const double top = EllipseDistance(u, v + 0.245, 0.017, 0.042);
  color = Blend(color, leaf_light, Smooth(kEdge, -kEdge, top));
  // Berries between the sprigs.
  const double bu = std::abs(x - (double(column) + 0.5) * kCellX) - 0.118;
  for (const double bv : {-0.165, -0.120, 0.245}) {
    const double shift = bv == -0.120 ? 0.024 : 0.0;
    const double d = std::hypot(bu - shift, v - bv) - 0.0135;
    color = Blend(color, berry, Smooth(kEdge, -kEdge, d));
    const double glint = std::hypot(bu - shift + 0.004, v - bv + 0.004) - 0.003;
    color = Blend(color, leaf_light, 0.6 * Smooth(kEdge, -kEdge, glint));
  }
  return color;
}

// Oak planks in herringbone; `n` planks' widths make a length.
Vec3 Parquet(double x, double z, uint64_t seed) {
  constexpr double kWidth = 0.085;
  constexpr int64_t kRatio = 5;
  const double s = std::sqrt(0.5);
  const double u = (s * x + s * z) / kWidth, v = (-s * x + s * z) / kWidth;
  const int64_t i = Floor(u), j = Floor(v);
  const int64_t m = Modulo(i - j, 2 * kRatio);
  double along, across;
  uint64_t id;
  if (m < kRatio) {
    along = u - double(i - m), across = v - double(j);
    id = HashOf(seed, uint64_t(i - m), uint64_t(j));
  } else {
    const int64_t begin = j - (Modulo(j - i, 2 * kRatio) - 1);
    along = v - double(begin), across = u - double(i);
    id = HashOf(seed + 1, uint64_t(i), uint64_t(begin));
  }
  const double tone = Unit(id), offset = 50 * Unit(Mix(id));
  const double grain = Fbm(along * 0.9 + offset, across * 7 + offset, 3, seed + 2);
  const double fine = Noise(along * 4 + offset, across * 24 + offset, seed + 3);
  Vec3 color = Blend(Vec3(0.33, 0.185, 0.085), Vec3(0.52, 0.335, 0.175), 0.75 * tone);
  color *= 0.62 + 0.55 * grain + 0.2 * fine;
  const double edge = std::min({across, 1 - across, along, double(kRatio) - along}) * kWidth;
  return color * (0.42 + 0.58 * Smooth(0.0005, 0.005, edge));
}

// Walnut: cathedral grain, growth rings of a leaning trunk cut lengthwise, with fine pores.
Vec3 Walnut(double x, double z, uint64_t seed) {
  const double wander = 0.13 * (Fbm(x * 1.3, z * 2.6, 3, seed) - 0.5);
  const double fiber = 0.010 * (Noise(x * 7, z * 60, seed + 1) - 0.5);
  const double across = z + 0.05 + wander + fiber;
  const double depth = 0.16 + 0.05 * x;
  const double ring = std::sqrt(across * across + depth * depth) * 34;
  const double phase = ring - std::floor(ring);
  // Each year's wood darkens slowly and ends sharply.
  const double late = Smooth(0.15, 0.85, phase) * Smooth(1.0, 0.92, phase);
  const double strength = 0.35 + 0.65 * Unit(HashOf(seed + 2, uint64_t(Floor(ring))));
  const double figure = Fbm(x * 2.5, z * 9, 3, seed + 4);
  const double pores = Noise(x * 26, z * 300, seed + 3);
  const Vec3 color = Blend(Vec3(0.330, 0.170, 0.088), Vec3(0.135, 0.060, 0.030),
                           std::clamp(0.60 * late * strength + 0.75 * (figure - 0.25), 0.0, 1.0));
  return color * (0.84 + 0.30 * pores);
}

// A small painting: a low sun over hills. u to the right, v down, in [0, 1].
Vec3 Landscape(double u, double v, uint64_t seed) {
  Vec3 color = Blend(Vec3(0.30, 0.47, 0.56), Vec3(0.93, 0.70, 0.47), Smooth(0.02, 0.62, v));
  const double sun = std::hypot((u - 0.66) * 1.35, v - 0.40);
  color = Blend(color, Vec3(0.98, 0.80, 0.52), 0.7 * Smooth(0.30, 0.08, sun));
  color = Blend(color, Vec3(0.92, 0.34, 0.15), Smooth(0.108, 0.098, sun));
  const Vec3 hills[4] = {
      {0.46, 0.44, 0.47}, {0.20, 0.33, 0.36}, {0.10, 0.20, 0.19}, {0.62, 0.36, 0.10}};
  for (int i = 0; i < 4; ++i) {
    const double crest = 0.47 + 0.125 * i + 0.09 * std::sin(u * (4.1 - 0.5 * i) + 1.9 * i) +
                         0.05 * (Fbm(u * 5 + 7 * i, 0.5, 3, seed + uint64_t(i)) - 0.5);
    const double stroke = 0.86 + 0.28 * Fbm(u * 14, v * 40, 2, seed + 10 + uint64_t(i));
    color = Blend(color, hills[i] * stroke, Smooth(crest - 0.006, crest + 0.006, v));
  }
  return color * (0.94 + 0.12 * Fbm(u * 60, v * 60, 2, seed + 20));
}

Vec3 GiftPaper(const TexturePoint& at) {
  // Diagonal rows of small diamonds on cream.
  constexpr double kPitch = 0.042;
  const double a = (at.chart_xy.x() + at.chart_xy.y()) / kPitch;
  const double b = (at.chart_xy.x() - at.chart_xy.y()) / kPitch;
  const double da = a - std::floor(a) - 0.5, db = b - std::floor(b) - 0.5;
  const double d = std::max(std::abs(da), std::abs(db));
  const bool odd = Modulo(Floor(a) + Floor(b), 2) != 0;
  const Vec3 ink = odd ? Vec3(0.13, 0.30, 0.34) : Vec3(0.76, 0.45, 0.16);
  return Blend(Vec3(0.80, 0.73, 0.60), ink, Smooth(0.24, 0.17, d));
}

Vec3 PotGlaze(const TexturePoint& at, uint64_t seed) {
  const double height = -at.point.y() - kTable;
  const double angle = 2 * kPi * at.uv.x();
  const double drip = 0.062 + 0.006 * std::sin(3 * angle) + 0.004 * std::sin(7 * angle + 1);
  const double speck = Noise(angle * 22, height * 330, seed);
  Vec3 glaze = Vec3(0.80, 0.78, 0.72) * (speck > 0.86 ? 0.62 : 1.0);
  const Vec3 clay =
      Vec3(0.50, 0.235, 0.13) * (0.85 + 0.3 * Noise(angle * 9, height * 400, seed + 1));
  return Blend(clay, glaze, Smooth(drip - 0.0015, drip + 0.0015, height));
}

Vec3 LeafGreen(const TexturePoint& at, double tone) {
  const double u = at.uv.x(), across = std::abs(2 * at.uv.y() - 1);
  const Vec3 blade = Blend(Vec3(0.045, 0.165, 0.055), Vec3(0.125, 0.295, 0.070), tone);
  const Vec3 vein(0.34, 0.46, 0.17);
  double line = Smooth(0.085 - 0.05 * u, 0.03 - 0.02 * u, across);
  const double side = (u - 0.30 * across) * 9;
  const double rib = std::abs(side - std::floor(side) - 0.5);
  line = std::max(line, 0.38 * Smooth(0.14, 0.04, rib));
  const Vec3 color = Blend(blade * (1 - 0.25 * across), vein, line);
  return at.chart == 0 ? color : Vec3(Blend(color, Vec3(0.28, 0.40, 0.20), 0.5));
}

Vec3 PearSkin(const TexturePoint& at, uint64_t seed) {
  const double angle = 2 * kPi * at.uv.x(), height = -at.point.y() - kTable;
  const double blush = Fbm(1.5 * std::cos(angle) + 4, 1.5 * std::sin(angle) + height * 14, 3, seed);
  Vec3 color = Blend(Vec3(0.62, 0.56, 0.10), Vec3(0.66, 0.23, 0.07),
                     Smooth(0.42, 0.72, blush + 0.25 * std::cos(angle - 3.6) - 0.05));
  const double freckle = Noise(angle * 26, height * 420, seed + 5);
  return color * (freckle > 0.82 ? 0.72 : 1.0);
}

// ---- Profiles ----

// Pairs of radius and height.
std::vector<Vec2> Profile(std::initializer_list<double> values) {
  std::vector<Vec2> points;
  for (const double* v = values.begin(); v != values.end(); v += 2) points.emplace_back(v[0], v[1]);
  return points;
}

// A Catmull-Rom curve through the points, `steps` pieces a span.
std::vector<Vec2> SmoothProfile(std::initializer_list<double> values, int steps) {
  const std::vector<Vec2> points = Profile(values);
  std::vector<Vec2> curve;
  const auto at = [&](int i) { return points[size_t(std::clamp(i, 0, int(points.size()) - 1))]; };
  for (int i = 0; i + 1 < int(points.size()); ++i) {
    for (int k = 0; k < steps; ++k) {
      const double t = double(k) / steps;
      const Vec2 a = 2 * at(i), b = at(i + 1) - at(i - 1);
      const Vec2 c = 2 * at(i - 1) - 5 * at(i) + 4 * at(i + 1) - at(i + 2);
      const Vec2 d = 3 * at(i) - at(i - 1) - 3 * at(i + 1) + at(i + 2);
      Vec2 p = 0.5 * (a + t * b + t * t * c + t * t * t * d);
      p.x() = std::max(0.0, p.x());
      curve.push_back(p);
    }
  }
  curve.push_back(points.back());
  return curve;
}

// ---- Objects ----

void AddFloor(World& world, uint64_t seed, double left, double right, double front, double back) {
  const int floor = world.AddObject("floor", true);
  const int parquet = world.AddMaterial({.albedo = [seed](const TexturePoint& at) {
    return Parquet(at.point.x(), at.point.z(), HashOf(seed, 1));
  }});
  world.Add(floor, parquet,
            Quad(At(left, 0, back), Vec3(right - left, 0, 0), Vec3(0, 0, front - back)));
}

void AddRoom(World& world, uint64_t seed, bool bare_walls) {
  constexpr double kLeft = -3.6, kFront = -2.4;
  AddFloor(world, seed, kLeft, kWallX, kFront, kWallZ);
  const int papered = world.AddObject("wallpaper", true);
  const int plain = world.AddObject("plain wall", true);
  const int paper =
      world.AddMaterial({.albedo =
                             [seed, bare_walls](const TexturePoint& at) {
                               return bare_walls
                                          ? kWallpaperGround
                                          : Wallpaper(at.point.x(), at.point.y(), HashOf(seed, 2));
                             },
                         .textureless = bare_walls});
  const int wall = world.AddMaterial({.albedo = Plain({0.74, 0.655, 0.56}), .textureless = true});
  const int white = world.AddMaterial({.albedo = Plain({0.74, 0.72, 0.67})});

  world.Add(
      papered, paper,
      Quad(At(kLeft, kRoomHeight, kWallZ), Vec3(kWallX - kLeft, 0, 0), Vec3(0, kRoomHeight, 0)));
  world.Add(
      plain, wall,
      Quad(At(kWallX, kRoomHeight, kWallZ), Vec3(0, 0, kFront - kWallZ), Vec3(0, kRoomHeight, 0)));
  // Skirting boards belong to the wall they stand at.
  constexpr double kBoard = 0.055, kDepth = 0.008;
  world.Add(papered, white,
            RoundedBox(At((kLeft + kWallX) / 2, kBoard, kWallZ - kDepth),
                       Vec3((kWallX - kLeft) / 2, kBoard, kDepth), 0.006));
  world.Add(plain, white,
            RoundedBox(At(kWallX - kDepth, kBoard, (kFront + kWallZ) / 2),
                       Vec3(kDepth, kBoard, (kWallZ - kFront) / 2), 0.006));
}

void AddPicture(World& world, uint64_t seed) {
  const int picture = world.AddObject("picture", true);
  const double x = -0.50, height = 1.52, half_w = 0.30, half_h = 0.235, bar = 0.020;
  const int gold = world.AddMaterial({.albedo = Plain({0.46, 0.29, 0.12})});
  const int canvas = world.AddMaterial({.albedo = [seed](const TexturePoint& at) {
    const double margin = 0.055, u = at.chart_xy.x(), v = at.chart_xy.y();
    const double w = 2 * 0.285, h = 2 * 0.22;
    const double inside = std::min({u - margin, w - margin - u, v - margin, h - margin - v});
    const Vec3 mat = Vec3(0.80, 0.77, 0.70);
    const Vec3 paint = Landscape((u - margin) / (w - 2 * margin), (v - margin) / (h - 2 * margin),
                                 HashOf(seed, 3));
    return Blend(mat, paint, Smooth(-0.0015, 0.0015, inside));
  }});
  world.Add(picture, canvas,
            Quad(At(x - 0.285, height + 0.22, kWallZ - 0.012), Vec3(0.57, 0, 0), Vec3(0, 0.44, 0)));
  for (const double side : {-1.0, 1.0}) {
    world.Add(picture, gold,
              RoundedBox(At(x, height + side * half_h, kWallZ - 0.016),
                         Vec3(half_w + bar, bar, 0.016), 0.007));
    world.Add(
        picture, gold,
        RoundedBox(At(x + side * half_w, height, kWallZ - 0.016), Vec3(bar, half_h, 0.016), 0.007));
  }
}

void AddTable(World& world, uint64_t seed) {
  const int table = world.AddObject("table", true);
  const int walnut = world.AddMaterial({.albedo = [seed](const TexturePoint& at) {
    return Walnut(at.point.x() + 0.31 * at.point.z(), at.point.z() - 0.31 * at.point.x(),
                  HashOf(seed, 4));
  }});
  const int lacquer = world.AddMaterial({.albedo = Plain({0.70, 0.68, 0.63})});
  world.Add(
      table, walnut,
      Lathe(At(0, 0, 0), Profile({0, kTable - 0.028, 0.585, kTable - 0.028, 0.606, kTable - 0.022,
                                  0.616, kTable - 0.014, 0.616, kTable - 0.007, 0.611,
                                  kTable - 0.002, 0.603, kTable, 0, kTable})));
  auto profile = SmoothProfile({0.285, 0.012, 0.20, 0.03, 0.085, 0.09, 0.045, 0.22, 0.040, 0.42,
                                0.065, 0.58, 0.16, kTable - 0.03},
                               4);
  profile.insert(profile.begin(), {{0.0, 0.001}, {0.28, 0.001}, {0.288, 0.006}});
  world.Add(table, lacquer, Lathe(At(0, 0, 0), profile));
}

void AddBall(World& world) {
  const int ball = world.AddObject("ball");
  const int glaze = world.AddMaterial(
      {.albedo = Plain({0.74, 0.115, 0.045}), .specular = 0.045, .sharpness = 90});
  world.Add(ball, glaze, Sphere(At(-0.06, kTable + 0.092, -0.32), 0.092));
}

void AddBox(World& world) {
  const int box = world.AddObject("box");
  const int paper = world.AddMaterial({.albedo = GiftPaper});
  const int ribbon = world.AddMaterial({.albedo = Plain({0.60, 0.065, 0.075})});
  const double yaw = 0.52, x = 0.185, z = -0.17, hx = 0.115, hy = 0.075, hz = 0.090;
  const double rise = 0.0022, half_band = 0.016;
  world.Add(box, paper, RoundedBox(At(x, kTable + hy, z), Vec3(hx, hy, hz), 0.006, yaw));
  for (const auto& [wide, deep] : {std::pair{half_band, hz + rise}, {hx + rise, half_band}}) {
    world.Add(
        box, ribbon,
        RoundedBox(At(x, kTable + hy + rise / 2, z), Vec3(wide, hy + rise / 2, deep), 0.002, yaw));
  }
  // The bow: petals around a knot.
  const Vec3 knot = At(x, kTable + 2 * hy + 0.012, z);
  world.Add(box, ribbon, Sphere(knot, 0.013));
  for (int i = 0; i < 6; ++i) {
    const double azimuth = yaw + 0.35 + i * kPi / 3;
    const bool inner = i % 2 == 1;
    const Vec3 along = At(std::cos(azimuth), inner ? 0.95 : 0.42, std::sin(azimuth));
    const Vec3 up = At(-0.4 * std::cos(azimuth), 1, -0.4 * std::sin(azimuth));
    const LeafForm form = {inner ? 0.056 : 0.074, inner ? 0.036 : 0.044, 0.052, 0.006, 0.62};
    world.Add(box, ribbon, Leaf(knot + 0.004 * along, along, up, form));
  }
}

void AddCandlestick(World& world) {
  const int stick = world.AddObject("candlestick");
  const int brass = world.AddMaterial(
      {.albedo = Plain({0.80, 0.55, 0.22}), .specular = 1, .sharpness = 24, .metal = true});
  const int wax = world.AddMaterial({.albedo = Plain({0.82, 0.76, 0.62})});
  const int wick = world.AddMaterial({.albedo = Plain({0.03, 0.025, 0.02})});
  const double x = 0.455, z = 0.03;
  auto profile = SmoothProfile(
      {0.062, 0.004, 0.060, 0.010, 0.038, 0.018, 0.014, 0.030, 0.0085, 0.055, 0.0085, 0.200,
       0.012, 0.215, 0.019, 0.222, 0.012, 0.230, 0.011, 0.240, 0.026,  0.252, 0.030,  0.258},
      4);
  profile.insert(profile.begin(), {{0, 0.0005}, {0.060, 0.0005}});
  profile.insert(profile.end(), {{0.029, 0.261}, {0.020, 0.256}, {0.0, 0.255}});
  world.Add(stick, brass, Lathe(At(x, kTable, z), profile));
  world.Add(
      stick, wax,
      Lathe(At(x, kTable + 0.2545, z), Profile({0, 0, 0.0145, 0, 0.0135, 0.172, 0.0125, 0.1755,
                                                0.0105, 0.1765, 0.006, 0.174, 0, 0.1735})));
  world.Add(stick, wick,
            Capsule(At(x, kTable + 0.427, z), At(x + 0.002, kTable + 0.440, z), 0.0018));
}

void AddPlant(World& world, uint64_t seed) {
  const int pot = world.AddObject("pot");
  const int plant = world.AddObject("plant");

  const int ceramic = world.AddMaterial(
      {.albedo = [seed](const TexturePoint& at) { return PotGlaze(at, HashOf(seed, 5)); },
       .specular = 0.03,
       .sharpness = 26});
  const int soil = world.AddMaterial({.albedo = [seed](const TexturePoint& at) {
    return Vec3(Vec3(0.055, 0.036, 0.024) *
                (0.5 + 1.2 * Noise(at.point.x() * 210, at.point.z() * 210, seed)));
  }});
  const double x = -0.27, z = 0.13;
  const Vec3 base = At(x, kTable, z);
  world.Add(
      pot, ceramic,
      Lathe(base, Profile({0, 0.0005, 0.066, 0.0005, 0.071, 0.004, 0.090, 0.120, 0.0925, 0.150,
                           0.091, 0.1535, 0.0875, 0.1545, 0.085, 0.152, 0.083, 0.130})));
  world.Add(pot, soil, Lathe(base, Profile({0.0848, 0.147, 0.05, 0.150, 0, 0.151})));

  const int stem = world.AddMaterial({.albedo = Plain({0.17, 0.27, 0.07})});
  Random random(HashOf(seed, 6));
  // A fan of broad leaves in one plane, like a traveler's palm. It faces the middle of the cameras'
  // arc, so that all cameras see the upper side of every leaf and leaves hide little of each other.
  constexpr int kLeaves = 7, kPieces = 7;
  constexpr double kFacing = 0.23;  // of the arc's middle from the front, radians
  const Vec3 across = At(std::cos(kFacing), 0, std::sin(-kFacing));
  const Vec3 front = At(-std::sin(kFacing), 0, -std::cos(kFacing));
  for (int i = 0; i < kLeaves; ++i) {
    const double side = 2.0 * i / (kLeaves - 1) - 1;
    const double angle = 1.12 * side + random.Uniform(-0.05, 0.05);  // from upright
    const double age = 1 - side * side;
    const Vec3 out = std::sin(angle) * across + At(0, std::cos(angle), 0);
    // Behind the pot's middle, so that the stems hide little of the soil.
    const Vec3 root = base + At(0, 0.149, 0) + 0.016 * side * across - 0.036 * front;
    const double reach = 0.095 + 0.075 * age + random.Uniform(-0.008, 0.008);
    const Vec3 end = root + reach * out + (i % 2 ? 0.012 : -0.004) * front;
    const Vec3 bend = root + 0.5 * reach * (0.5 * out + At(0, 0.6, 0));
    const auto curve = [&](double t) {
      return Vec3((1 - t) * (1 - t) * root + 2 * t * (1 - t) * bend + t * t * end);
    };
    for (int k = 0; k < kPieces; ++k) {
      world.Add(plant, stem,
                Capsule(curve(double(k) / kPieces), curve((k + 1.0) / kPieces),
                        0.0075 - 0.0016 * (k + 1) / kPieces));
    }
    const double tone = random.Uniform();
    const int blade =
        world.AddMaterial({.albedo = [tone](const TexturePoint& at) { return LeafGreen(at, tone); },
                           .specular = 0.03,
                           .sharpness = 14,
                           .translucency = 0.35});
    const double length = 0.150 + 0.028 * age + random.Uniform(-0.008, 0.008);
    const LeafForm form = {length, 0.56 * length, 1.1 * length, 0.10 * length, 0.75};
    const Vec3 along = out + (0.10 + random.Uniform(-0.1, 0.1)) * front;
    const Vec3 up = front + At(0, 0.35, 0) + random.Uniform(-0.15, 0.15) * across;
    world.Add(plant, blade, Leaf(end, along, up, form));
  }
}

void AddPear(World& world, uint64_t seed) {
  const int pear = world.AddObject("pear");
  const int skin = world.AddMaterial(
      {.albedo = [seed](const TexturePoint& at) { return PearSkin(at, HashOf(seed, 7)); },
       .specular = 0.025,
       .sharpness = 16});
  const double x = -0.46, z = -0.09;
  world.Add(pear, skin,
            Lathe(At(x, kTable, z),
                  SmoothProfile({0.0, 0.004, 0.018, 0.002, 0.039, 0.020, 0.045, 0.042, 0.036, 0.068,
                                 0.022, 0.090, 0.018, 0.104, 0.010, 0.112, 0.0, 0.110},
                                5)));
  const int stalk = world.AddMaterial({.albedo = Plain({0.12, 0.07, 0.035})});
  world.Add(pear, stalk,
            Capsule(At(x, kTable + 0.108, z), At(x + 0.010, kTable + 0.134, z + 0.004), 0.0022));
}

}  // namespace

World MakeStillLife(uint64_t seed, Room room) {
  World world;
  if (room == Room::kOpen) {
    constexpr double kReach = 4;
    AddFloor(world, seed, -kReach, kReach, -kReach, kReach);
  } else {
    AddRoom(world, seed, room == Room::kBare);
    AddPicture(world, seed);
  }
  AddTable(world, seed);
  AddBall(world);
  AddBox(world);
  AddCandlestick(world);
  AddPlant(world, seed);
  AddPear(world, seed);
  // A large soft window at the front left, above eye level.
  const Vec3 center = At(-2.75, 2.15, -0.75), target = At(0.1, kTable, 0.1);
  const Vec3 normal = (target - center).normalized();
  const Vec3 u = normal.cross(At(0, 1, 0)).normalized(), v = normal.cross(u);
  world.light.center = center;
  world.light.half_u = 0.55 * u;
  world.light.half_v = 0.70 * v;
  if (world.light.Normal().dot(normal) < 0) world.light.half_v *= -1;
  world.light.radiance = Vec3(1.0, 0.92, 0.80) * 24.0;
  world.exposure = 0.9;
  world.Finish();
  return world;
}

}  // namespace retint::synthetic
