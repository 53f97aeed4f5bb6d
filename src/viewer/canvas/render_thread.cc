// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/canvas/render_thread.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "base/parallel.h"
#include "base/stopwatch.h"
#include "depth/depth_picture.h"
#include "scene/camera_projection.h"
#include "scene/mask_pixels.h"
#include "selection/mask_projector.h"
#include "viewer/scene/failure_text.h"
#include "viewer/scene/post.h"

namespace retint {
namespace {

constexpr size_t kCacheBytes = size_t{96} << 20;  // for view geometries of a few cameras at rest
constexpr double kUndecided =
    0.2;  // least value to hatch; completion doubts parts that no paint saw by 0.25
constexpr double kSmallestScale = 0.25;
// Fewer pixels than this save almost no time, because the geometry takes longer.
constexpr double kLeastPixelShare = 0.25;  // of the geometry's time
constexpr double kScaleStep = 1.0 / 16;  // steps, so that a resting camera finds its geometry again
constexpr double kMemory = 0.6;          // weight of the past in running means
// For a camera at rest while colors change:
constexpr double kSharpMs =
    60;  // a sharp frame within this time is better than a small one earlier
constexpr double kSharpRiskMs = 25;              // if it may take longer, prepare a smaller frame
constexpr std::chrono::milliseconds kIdle(150);  // after this time without requests

// Predicts the time of a frame from earlier ones: a constant for the geometry, plus a time per
// pixel.
class FrameClock {
 public:
  void AddGeometry(double milliseconds) { Blend(geometry_, milliseconds); }
  void AddPixels(double milliseconds, double pixels) { Blend(per_pixel_, milliseconds / pixels); }

  // With known geometry; 0: not measured yet.
  double Milliseconds(double pixels) const { return per_pixel_ * pixels; }
  // The scale at which this takes `budget`.
  double ScaleWithin(double budget, double pixels) const {
    return Stepped(std::sqrt(budget / Milliseconds(pixels)));
  }

  double ScaleFor(double budget, double pixels) {
    double wanted = 1;
    if (per_pixel_ > 0) {
      const double left = std::max(budget - geometry_, kLeastPixelShare * geometry_);
      wanted = std::sqrt(left / (per_pixel_ * pixels));
    } else {
      wanted = 0.5;  // nothing measured yet
    }
    wanted = std::clamp(wanted, kSmallestScale, 1.0);
    // Keep the scale while it is roughly right: changing scales are worse than a slightly late
    // frame.
    if (scale_ == 0 || wanted < 0.9 * scale_ || wanted > 1.15 * scale_) {
      scale_ = Stepped(wanted);
    }
    return scale_;
  }

 private:
  static double Stepped(double scale) {
    return std::clamp(std::floor(scale / kScaleStep) * kScaleStep, kSmallestScale, 1.0);
  }
  static void Blend(double& mean, double value) {
    mean = mean == 0 ? value : kMemory * mean + (1 - kMemory) * value;
  }
  double geometry_ = 0, per_pixel_ = 0, scale_ = 0;
};

// Marks the pixels that a visible point of the cloud covers.
std::vector<uint8_t> Cover(const OverlayCloud& cloud, const PosedCamera& camera,
                           const DepthMap& depth, double side) {
  std::vector<uint8_t> covered(depth.NumPixels(), 0);
  const double half = std::max(side, 1.0) / 2;
  for (const Eigen::Vector3f& point : cloud.points) {
    const auto seen = camera.Project(point.cast<double>());
    if (!seen) continue;
    const int x0 = std::max(0, int(std::lround(seen->x() - half)));
    const int y0 = std::max(0, int(std::lround(seen->y() - half)));
    const int x1 = std::min(depth.width, int(std::lround(seen->x() + half)));
    const int y1 = std::min(depth.height, int(std::lround(seen->y() + half)));
    if (seen->x() < -half || seen->y() < -half) continue;
    const double nearest = seen->z() / (1 + cloud.depth_tolerance);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const float surface = depth(x, y);
        if (surface <= 0 || surface >= nearest) covered[depth.Index(x, y)] = 1;
      }
    }
  }
  return covered;
}

void DrawCloud(const OverlayCloud& cloud, const PosedCamera& camera, const DepthMap& depth,
               double scale, QImage& image) {
  const auto covered = Cover(cloud, camera, depth, cloud.quad_pixels * scale);
  const int opacity = int(std::lround(256 * std::clamp(cloud.opacity, 0.0, 1.0)));
  const auto mix = [&](int old, int now) { return (old * (256 - opacity) + now * opacity) >> 8; };
  for (int y = 0; y < image.height(); ++y) {
    QRgb* row = reinterpret_cast<QRgb*>(image.scanLine(y));
    const uint8_t* flags = covered.data() + depth.Index(0, y);
    for (int x = 0; x < image.width(); ++x) {
      if (!flags[x]) continue;
      row[x] = qRgb(mix(qRed(row[x]), cloud.color[0]), mix(qGreen(row[x]), cloud.color[1]),
                    mix(qBlue(row[x]), cloud.color[2]));
    }
  }
}

// Slanted lines, dark and light side by side, inside the mask: visible on any picture.
void DrawHatching(const Mask& mask, double period, QImage& image) {
  constexpr double kDark = 0.2, kLight = 0.4;  // of the period, from its beginning
  for (int y = 0; y < image.height(); ++y) {
    QRgb* row = reinterpret_cast<QRgb*>(image.scanLine(y));
    for (int x = 0; x < image.width(); ++x) {
      if (!IsInside(mask(x, y))) continue;
      const double at = std::fmod((x + y) / period, 1);
      if (at < kLight) row[x] = at < kDark ? qRgb(0, 0, 0) : qRgb(255, 255, 255);
    }
  }
}

// The faces of one picture, in common colors. With several faces, depth is the distance.
std::vector<QImage> DepthPictures(const std::vector<PosedCamera>& cameras,
                                  const std::vector<DepthMap>& depths) {
  if (depths.size() == 1) return {ToQImage(DepthPicture(depths.front()))};
  // One below the other: all faces have the same size.
  const int width = depths.front().width, height = depths.front().height;
  DepthMap all(width, height * int(depths.size()));
  for (size_t f = 0; f < depths.size(); ++f) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Eigen::Vector2d ray = cameras[f].camera.CamFromImg({x + 0.5, y + 0.5}).value();
        all(x, y + height * int(f)) = depths[f](x, y) * float(std::sqrt(1 + ray.squaredNorm()));
      }
    }
  }
  const QImage picture = ToQImage(DepthPicture(all));
  std::vector<QImage> faces;
  for (size_t f = 0; f < depths.size(); ++f) {
    faces.push_back(picture.copy(0, height * int(f), width, height));
  }
  return faces;
}

}  // namespace

PosedCamera Scaled(const PosedCamera& camera, double scale) {
  const Camera& from = camera.camera;
  const int width = std::max(1, int(std::lround(from.width * scale)));
  const int height = std::max(1, int(std::lround(from.height * scale)));
  return {Resized(from, width, height), camera.cam_from_world};
}

QImage ToQImage(const Image& image) {
  constexpr int64_t kRows = 32;  // per task
  QImage result(image.width, image.height, QImage::Format_RGB32);
  uchar* const pixels = result.bits();
  const qsizetype line = result.bytesPerLine();
  ParallelRanges(image.height, kRows, [&](int64_t begin, int64_t end) {
    const auto byte = [](float v) { return int(std::clamp(v, 0.0F, 1.0F) * 255 + 0.5F); };
    for (int64_t y = begin; y < end; ++y) {
      QRgb* row = reinterpret_cast<QRgb*>(pixels + y * line);
      const float* from = image.data.data() + image.Index(0, int(y));
      for (int x = 0; x < image.width; ++x, from += 3) {
        row[x] = qRgb(byte(from[0]), byte(from[1]), byte(from[2]));
      }
    }
  });
  return result;
}

QImage ToQImage(const Image8& image) {
  QImage result(image.width, image.height, QImage::Format_RGB32);
  for (int y = 0; y < image.height; ++y) {
    QRgb* row = reinterpret_cast<QRgb*>(result.scanLine(y));
    const uint8_t* from = image.data.data() + image.Index(0, y);
    for (int x = 0; x < image.width; ++x, from += 3) row[x] = qRgb(from[0], from[1], from[2]);
  }
  return result;
}

QImage ToQImage(const Mask& mask) {
  QImage result(mask.width, mask.height, QImage::Format_Grayscale8);
  for (int y = 0; y < mask.height; ++y) {
    std::copy_n(mask.data.data() + mask.Index(0, y), mask.width, result.scanLine(y));
  }
  return result;
}

class RenderThread::Impl {
 public:
  explicit Impl(RenderThread& owner) : owner_(owner), thread_([this] { Loop(); }) {}

  ~Impl() {
    {
      std::lock_guard lock(mutex_);
      quit_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

  void SetScene(std::shared_ptr<const SceneFacts> facts) {
    {
      std::lock_guard lock(mutex_);
      next_scene_ = std::move(facts);
      scene_changed_ = true;
      request_.reset();
      probes_.clear();
    }
    changed_.notify_all();
  }

  void Request(const FrameRequest& request) {
    {
      std::lock_guard lock(mutex_);
      request_ = request;
    }
    changed_.notify_all();
  }

  void Probe(const PosedCamera& camera, const Eigen::Vector2d& pixel, ProbeFor what) {
    {
      std::lock_guard lock(mutex_);
      probes_.push_back({camera, pixel, what});
    }
    changed_.notify_all();
  }

  void SetFrameBudget(double milliseconds) {
    std::lock_guard lock(mutex_);
    budget_ = milliseconds;
  }

 private:
  struct Question {
    PosedCamera camera;
    Eigen::Vector2d pixel;
    ProbeFor what;
  };
  // A picture has one camera, or one for each face of its lens.
  using Cameras = std::vector<PosedCamera>;
  struct Resting {
    Cameras cameras;
    double pixels;  // drawn for these cameras
  };

  void Loop() {
    std::unique_lock lock(mutex_);
    while (true) {
      const auto wanted = [this] {
        return quit_ || scene_changed_ || (scene_ && (request_ || !probes_.empty()));
      };
      const auto resting = std::exchange(resting_, std::nullopt);
      if (resting && !changed_.wait_for(lock, kIdle, wanted)) {
        const double budget = budget_;
        lock.unlock();
        MakeReady(*resting, budget);
        lock.lock();
      }
      changed_.wait(lock, wanted);
      if (quit_) return;
      if (std::exchange(scene_changed_, false)) {
        scene_ = std::exchange(next_scene_, nullptr);
        lock.unlock();
        Guarded([this] { Load(); });
        lock.lock();
      } else if (!probes_.empty()) {
        const Question question = probes_.front();
        probes_.pop_front();
        lock.unlock();
        Guarded([&] { AnswerProbe(question); });
        lock.lock();
      } else {
        const FrameRequest request = *std::exchange(request_, std::nullopt);
        const double budget = budget_;
        lock.unlock();
        Guarded([&] { Draw(request, budget); });
        lock.lock();
      }
    }
  }

  template <typename F>
  void Guarded(F work) {
    QString message;
    try {
      work();
      return;
    } catch (const std::exception& error) {
      message = FailureText(error);
    }
    RenderThread* owner = &owner_;
    Post(owner, [owner, message] { Q_EMIT owner->failed(message); });
  }

  void Load() {
    renderer_.reset();
    shown_.reset();
    shown_active_.reset();
    clock_ = {};
    resting_.reset();
    ready_scale_ = 1;
    if (!scene_) return;
    RendererOptions options;
    options.cache_bytes = kCacheBytes;
    options.background = scene_->request.options.background;
    renderer_ = std::make_unique<Renderer>(scene_->backend, *scene_->original, options);
    shown_ = Original();
    shown_active_ = std::make_shared<const std::vector<int32_t>>();
  }

  ShPointer Original() const { return {scene_->original, &scene_->original->sh}; }

  // Uploads coefficients. If the changes from the original are known for the coefficients before
  // and now, uploads only these: to host memory, because copying a few floats is cheap.
  void Show(const ShPointer& sh, ActivePointer active) {
    if (!sh || sh == shown_ || sh->size() != scene_->original->sh.size()) return;
    if (sh == Original()) active = std::make_shared<const std::vector<int32_t>>();
    if (active && shown_active_ && scene_->backend->IsHost()) {
      const size_t block = static_cast<size_t>(scene_->original->NumShCoeffs()) * 3;
      for (const auto* indices : {shown_active_.get(), active.get()}) {
        for (const int32_t index : *indices) {
          const size_t at = static_cast<size_t>(index) * block;
          std::copy_n(sh->data() + at, block, renderer_->model().sh() + at);
        }
      }
    } else {
      renderer_->SetSh(*sh);
    }
    shown_ = sh;
    shown_active_ = std::move(active);
  }

  static Cameras ScaledAll(const Cameras& cameras, double scale) {
    Cameras scaled;
    for (const PosedCamera& camera : cameras) scaled.push_back(Scaled(camera, scale));
    return scaled;
  }

  bool HasGeometries(const Cameras& cameras) const {
    return std::ranges::all_of(cameras,
                               [&](const auto& camera) { return renderer_->HasGeometry(camera); });
  }

  double ScaleFor(const Cameras& cameras, double budget, double pixels) {
    const double whole = clock_.Milliseconds(pixels);
    if (whole > 0 && HasGeometries(cameras)) {
      if (whole < kSharpMs) return 1;
      if (IsReady(cameras)) return ready_scale_;
    }
    return clock_.ScaleFor(budget, pixels);
  }

  bool IsReady(const Cameras& cameras) const {
    return ready_scale_ < 1 && HasGeometries(ScaledAll(cameras, ready_scale_));
  }

  // Prepares the geometry of a smaller frame, for future color changes.
  void MakeReady(const Resting& at, double budget) {
    if (!renderer_ || clock_.Milliseconds(at.pixels) < kSharpRiskMs || IsReady(at.cameras)) return;
    // Both must fit: the sharp frame comes after the small ones.
    if (!HasGeometries(at.cameras)) return;
    try {
      size_t bytes = 0;
      for (const PosedCamera& camera : at.cameras) bytes += renderer_->Geometry(camera)->bytes();
      if (bytes > kCacheBytes / 2) return;
      ready_scale_ = clock_.ScaleWithin(budget / 2, at.pixels);
      for (const PosedCamera& camera : ScaledAll(at.cameras, ready_scale_)) {
        renderer_->Geometry(camera);
      }
    } catch (const std::exception&) {
      // This frame was not requested. A requested one will report the fault.
    }
  }

  void Draw(const FrameRequest& request, double budget) {
    if (!renderer_) return;
    const Stopwatch whole;
    const Cameras sharp =
        request.lens ? request.lens->Faces(request.camera.cam_from_world) : Cameras{request.camera};
    double pixels = 0;
    for (const PosedCamera& one : sharp) pixels += double(one.camera.width) * one.camera.height;
    const double doubled = (request.before ? 2 : 1) * (request.cloud ? 1.5 : 1);
    auto frame = std::make_shared<Frame>();
    frame->serial = request.serial;
    frame->camera = request.camera;
    frame->what = request.what;
    frame->moving = request.moving;
    frame->scale = request.moving ? ScaleFor(sharp, budget, pixels * doubled) : 1;
    const Cameras cameras = ScaledAll(sharp, frame->scale);
    {
      const Stopwatch watch;
      for (const PosedCamera& camera : cameras) renderer_->Geometry(camera);
      // A geometry from the cache says nothing about the time of the next one.
      if (watch.Milliseconds() > 1) clock_.AddGeometry(watch.Milliseconds());
    }
    const Stopwatch watch;
    std::vector<QImage> before;
    if (request.before && request.what == RenderWhat::kRgb) {
      Show(request.before, nullptr);
      for (const PosedCamera& camera : cameras) {
        renderer_->Render(camera, {}, &output_);
        before.push_back(ToQImage(output_.rgb));
      }
    }
    Show(request.sh, request.sh_active);
    frame->sh = shown_;
    std::vector<QImage> faces = DrawFaces(request, cameras, frame->scale);
    clock_.AddPixels(watch.Milliseconds(), pixels * doubled * frame->scale * frame->scale);
    frame->image = request.lens ? request.lens->Bent(faces) : std::move(faces.front());
    if (!before.empty()) {
      frame->before = request.lens ? request.lens->Bent(before) : std::move(before.front());
    }
    if (frame->scale == 1 && request.what == RenderWhat::kRgb) {
      resting_ = Resting{sharp, pixels * doubled};
    }
    frame->milliseconds = whole.Milliseconds();
    RenderThread* owner = &owner_;
    Post(owner, [owner, frame] { Q_EMIT owner->frameReady(frame); });
  }

  // With the current coefficients, including drawings on surfaces.
  std::vector<QImage> DrawFaces(const FrameRequest& request, const Cameras& cameras, double scale) {
    const bool colored = request.what == RenderWhat::kRgb;
    const bool cloud = request.cloud && !request.cloud->points.empty();
    RenderRequest render;
    render.rgb = colored;
    render.depth_median = !colored || cloud;
    std::vector<QImage> faces;
    std::vector<DepthMap> depths;
    for (const PosedCamera& camera : cameras) {
      renderer_->Render(camera, render, &output_);
      if (colored) faces.push_back(ToQImage(output_.rgb));
      depths.push_back(std::move(output_.depth_median));
    }
    if (!colored) faces = DepthPictures(cameras, depths);
    for (size_t f = 0; f < faces.size(); ++f) {
      if (cloud) DrawCloud(*request.cloud, cameras[f], depths[f], scale, faces[f]);
      if (request.hatching && colored &&
          request.hatching->shares->size() == scene_->original->NumGaussians()) {
        ProjectorOptions shown;
        shown.share_threshold = kUndecided;
        DrawHatching(RenderShares(*renderer_, cameras[f], *request.hatching->shares, shown),
                     request.hatching->pixels * scale, faces[f]);
      }
    }
    return faces;
  }

  // Renders the depth in a window of a few pixels around the requested one.
  void AnswerProbe(const Question& question) {
    if (!renderer_) return;
    const auto& [camera, pixel, what] = question;
    constexpr int kSide = 9;
    const double x0 = std::floor(pixel.x()) - kSide / 2, y0 = std::floor(pixel.y()) - kSide / 2;
    const Camera& full = camera.camera;
    const PosedCamera window{Camera::Pinhole(full.id, kSide, kSide, full.fx(), full.fy(),
                                             full.cx() - x0, full.cy() - y0),
                             camera.cam_from_world};
    RenderRequest render;
    render.rgb = false;
    render.cache = false;
    render.depth_median = render.depth_expected = true;
    const RenderOutput output = renderer_->Render(window, render);
    const int middle = kSide / 2;
    double depth = output.depth_median(middle, middle);
    if (depth <= 0) depth = output.depth_expected(middle, middle);
    RenderThread* owner = &owner_;
    Post(owner, [owner, question, depth] {
      Q_EMIT owner->probed(question.camera, question.pixel, question.what, depth);
    });
  }

  RenderThread& owner_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_.
  std::optional<FrameRequest> request_;
  std::deque<Question> probes_;
  std::shared_ptr<const SceneFacts> next_scene_;
  bool scene_changed_ = false, quit_ = false;
  double budget_ = 60;
  // Used only on the thread.
  std::shared_ptr<const SceneFacts> scene_;
  std::unique_ptr<Renderer> renderer_;
  RenderOutput output_;  // of the last frame
  ShPointer shown_;
  ActivePointer shown_active_;
  FrameClock clock_;
  std::optional<Resting> resting_;  // the last frame, if it is sharp
  double ready_scale_ = 1;          // of MakeReady(); 1: nothing prepared
  std::thread thread_;              // last: it starts when all members above exist
};

RenderThread::RenderThread(QObject* parent)
    : QObject(parent), impl_(std::make_unique<Impl>(*this)) {}

RenderThread::~RenderThread() = default;

void RenderThread::SetScene(std::shared_ptr<const SceneFacts> facts) {
  impl_->SetScene(std::move(facts));
}
void RenderThread::Request(const FrameRequest& request) { impl_->Request(request); }
void RenderThread::Probe(const PosedCamera& camera, const Eigen::Vector2d& pixel, ProbeFor what) {
  impl_->Probe(camera, pixel, what);
}
void RenderThread::SetFrameBudget(double milliseconds) { impl_->SetFrameBudget(milliseconds); }

}  // namespace retint
