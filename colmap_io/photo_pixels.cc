// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/photo_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "scene/camera_projection.h"

namespace retint {
namespace {

constexpr size_t kMapBytes = size_t{256} << 20;  // of the cached maps, if more than two

// One array's pixels at continuous positions. Beyond the border the nearest pixel holds, or around
// the sphere the other side's.
template <typename Array>
class Sampler {
 public:
  static constexpr int kChannels = Array::kChannels;
  using Values = std::array<float, size_t(kChannels)>;

  Sampler(const Array& array, bool around) : array_(array), around_(around) {}

  Values Linear(float x, float y) const {
    const float left = std::floor(x - 0.5F), top = std::floor(y - 0.5F);
    const float fx = x - 0.5F - left, fy = y - 0.5F - top;
    Values sum{};
    Add(int(left), int(top), (1 - fx) * (1 - fy), &sum);
    Add(int(left) + 1, int(top), fx * (1 - fy), &sum);
    Add(int(left), int(top) + 1, (1 - fx) * fy, &sum);
    Add(int(left) + 1, int(top) + 1, fx * fy, &sum);
    return sum;
  }

  // Keys 1981, a = -1/2: exact for quadratics.
  Values Cubic(float x, float y) const {
    const float left = std::floor(x - 0.5F), top = std::floor(y - 0.5F);
    const auto wx = Weights(x - 0.5F - left), wy = Weights(y - 0.5F - top);
    Values sum{};
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 4; ++i) {
        Add(int(left) + i - 1, int(top) + j - 1, wx[size_t(i)] * wy[size_t(j)], &sum);
      }
    }
    return sum;
  }

  Values Nearest(float x, float y) const {
    Values value{};
    Add(int(std::floor(x)), int(std::floor(y)), 1, &value);
    return value;
  }

 private:
  static std::array<float, 4> Weights(float t) {
    const float u = 1 - t;
    return {-0.5F * t * u * u, 1 - t * t * (2.5F - 1.5F * t), 1 - u * u * (2.5F - 1.5F * u),
            -0.5F * u * t * t};
  }

  void Add(int x, int y, float weight, Values* sum) const {
    x = around_ ? (x + array_.width) % array_.width : std::clamp(x, 0, array_.width - 1);
    y = std::clamp(y, 0, array_.height - 1);
    const auto* pixel = &array_.data[array_.Index(x, y)];
    for (size_t c = 0; c < size_t(kChannels); ++c) (*sum)[c] += weight * float(pixel[c]);
  }

  const Array& array_;
  bool around_;
};

template <typename T>
T ToPixel(float value) {
  if constexpr (std::is_same_v<T, uint8_t>) {
    return uint8_t(std::lround(std::clamp(value, 0.0F, 255.0F)));
  } else {
    return value;
  }
}

bool IsAround(const Camera& camera) { return camera.model == CameraModelId::kEquirectangular; }

// body(i, x, y) for every pixel i of a map that lies somewhere.
template <typename Body>
void ForMapped(const PixelMap& map, const Body& body) {
  ParallelTasks(map.height, [&](int64_t row) {
    const size_t begin = size_t(row) * size_t(map.width);
    for (size_t i = begin; i < begin + size_t(map.width); ++i) {
      if (!std::isnan(map.xy[2 * i])) body(i, map.xy[2 * i], map.xy[2 * i + 1]);
    }
  });
}

}  // namespace

PhotoPixels::PhotoPixels(Reconstruction* model) {
  // Cameras of equal intrinsics share a lens, and with it the maps.
  std::vector<std::shared_ptr<const Undistortion>> lenses;
  std::map<CameraId, std::shared_ptr<const Undistortion>> lens_of;
  std::map<CameraId, std::vector<CameraId>> cameras_of;
  std::set<CameraId> used;
  for (const auto& [id, view] : model->views) used.insert(view.camera_id);
  CameraId next_camera = model->cameras.empty() ? 1 : model->cameras.rbegin()->first + 1;
  for (const CameraId id : used) {
    const Camera camera = model->cameras.at(id);
    if (camera.IsPinhole()) continue;
    const auto same = std::find_if(lenses.begin(), lenses.end(), [&](const auto& lens) {
      Camera other = lens->photo;
      other.id = id;
      return other == camera;
    });
    if (same != lenses.end()) {
      lens_of[id] = *same;
    } else {
      try {
        lens_of[id] = lenses.emplace_back(std::make_shared<Undistortion>(Undistort(camera)));
      } catch (const InputError& error) {
        const CameraModelInfo* info = FindCameraModel(static_cast<int>(camera.model));
        throw InputError("camera " + std::to_string(id) + " (" +
                         std::string(info ? info->name : "unknown") + "): " + error.what());
      }
    }
    for (const PinholeFace& face : lens_of[id]->faces) {
      const CameraId face_id = cameras_of[id].empty() ? id : next_camera++;
      model->cameras[face_id] = face.camera;
      model->cameras[face_id].id = face_id;
      cameras_of[id].push_back(face_id);
    }
  }
  std::vector<View> distorted;
  for (const auto& [id, view] : model->views) {
    if (lens_of.count(view.camera_id) > 0) distorted.push_back(view);
  }
  for (const View& view : distorted) {
    Replace(view, lens_of.at(view.camera_id), cameras_of.at(view.camera_id), model);
  }
  std::sort(photos_.begin(), photos_.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  for (size_t i = 0; i < photos_.size(); ++i) {
    for (const ViewId face : photos_[i].faces) photo_of_[face] = i;
  }
}

void PhotoPixels::Replace(const View& view, const std::shared_ptr<const Undistortion>& lens,
                          const std::vector<CameraId>& cameras, Reconstruction* model) {
  DistortedPhoto photo{view.name, lens, {}};
  std::vector<View> faces;
  ViewId next = model->views.rbegin()->first + 1;
  for (size_t i = 0; i < lens->faces.size(); ++i) {
    const PinholeFace& from = lens->faces[i];
    View face;
    face.id = i == 0 ? view.id : next++;
    face.name = view.name;
    if (!from.name.empty()) face.name += "@" + from.name;
    while (face.name != view.name && model->FindView(face.name)) face.name += "@";
    face.camera_id = cameras[i];
    face.cam_from_world.rotation = from.face_from_photo * view.cam_from_world.rotation;
    face.cam_from_world.translation = from.face_from_photo * view.cam_from_world.translation;
    photo.faces.push_back(face.id);
    faces.push_back(std::move(face));
  }
  // An observation goes to the face that sees it best; one without a ray is dropped.
  const CameraProjection projection(lens->photo);
  std::vector<std::pair<int, uint32_t>> moved;  // face and index of each observation
  for (const Observation& observation : view.observations) {
    Eigen::Vector2d pixel;
    const auto ray = projection.CamFromImg(observation.xy);
    const int best = ray ? BestFace(*lens, *ray, &pixel) : -1;
    if (best < 0) {
      moved.emplace_back(-1, 0);
      continue;
    }
    View& face = faces[size_t(best)];
    moved.emplace_back(best, uint32_t(face.observations.size()));
    face.observations.push_back({pixel, observation.point_id});
  }
  std::set<PointId> seen;
  for (const Observation& observation : view.observations) seen.insert(observation.point_id);
  for (const PointId id : seen) {
    const auto point = model->points.find(id);
    if (point == model->points.end()) continue;
    auto& track = point->second.track;
    for (TrackElement& element : track) {
      if (element.view_id != view.id || element.observation_idx >= moved.size()) continue;
      const auto& [face, idx] = moved[element.observation_idx];
      // Marked first: ids of faces are those of views, too.
      element =
          face < 0 ? TrackElement{view.id, UINT32_MAX} : TrackElement{faces[size_t(face)].id, idx};
    }
    std::erase_if(track, [](const auto& element) { return element.observation_idx == UINT32_MAX; });
  }
  for (View& face : faces) model->views[face.id] = std::move(face);
  photos_.push_back(std::move(photo));
}

const DistortedPhoto* PhotoPixels::PhotoOf(ViewId view) const {
  const auto found = photo_of_.find(view);
  return found == photo_of_.end() ? nullptr : &photos_[found->second];
}

const DistortedPhoto* PhotoPixels::FindPhoto(std::string_view name) const {
  for (const DistortedPhoto& photo : photos_) {
    if (photo.name == name) return &photo;
  }
  return nullptr;
}

std::pair<const DistortedPhoto*, size_t> PhotoPixels::FaceOf(ViewId view) const {
  const DistortedPhoto* photo = PhotoOf(view);
  const auto found = std::find(photo->faces.begin(), photo->faces.end(), view);
  return {photo, size_t(found - photo->faces.begin())};
}

PhotoPixels::MapPtr PhotoPixels::Map(const DistortedPhoto& photo, size_t face,
                                     bool of_photo) const {
  const MapKey key{photo.lens.get(), face, of_photo};
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(maps_.begin(), maps_.end(),
                                    [&](const auto& entry) { return entry.first == key; });
    if (found != maps_.end()) {
      std::rotate(found, found + 1, maps_.end());
      return maps_.back().second;
    }
  }
  const auto made = std::make_shared<const PixelMap>(of_photo ? FaceFromPhoto(*photo.lens, face)
                                                              : PhotoFromFace(*photo.lens, face));
  const std::lock_guard lock(mutex_);
  maps_.emplace_back(key, made);
  size_t bytes = 0;
  for (const auto& [other, map] : maps_) bytes += map->xy.size() * sizeof(float);
  while (maps_.size() > 2 && bytes > kMapBytes) {
    bytes -= maps_.front().second->xy.size() * sizeof(float);
    maps_.erase(maps_.begin());
  }
  return made;
}

Image PhotoPixels::ToView(ViewId view, const Image& photo) const {
  const auto [of, face] = FaceOf(view);
  const MapPtr map = Map(*of, face, /*of_photo=*/false);
  const Camera& camera = of->lens->photo;
  const float sx = float(photo.width) / float(camera.width);
  const float sy = float(photo.height) / float(camera.height);
  const Sampler<Image> sampler(photo, IsAround(camera));
  Image result(map->width, map->height);
  ForMapped(*map, [&](size_t i, float x, float y) {
    const auto values = sampler.Cubic(x * sx, y * sy);
    for (size_t c = 0; c < 3; ++c) result.data[3 * i + c] = std::clamp(values[c], 0.0F, 1.0F);
  });
  return result;
}

Mask PhotoPixels::ToView(ViewId view, const Mask& photo) const {
  const auto [of, face] = FaceOf(view);
  const MapPtr map = Map(*of, face, /*of_photo=*/false);
  const Camera& camera = of->lens->photo;
  const float sx = float(photo.width) / float(camera.width);
  const float sy = float(photo.height) / float(camera.height);
  const Sampler<Mask> sampler(photo, IsAround(camera));
  Mask result(map->width, map->height);
  ForMapped(*map, [&](size_t i, float x, float y) {
    result.data[i] = ToPixel<uint8_t>(sampler.Linear(x * sx, y * sy)[0]);
  });
  return result;
}

Mask PhotoPixels::Reach(ViewId view) const {
  const auto [of, face] = FaceOf(view);
  const MapPtr map = Map(*of, face, /*of_photo=*/false);
  Mask result(map->width, map->height);
  ForMapped(*map, [&](size_t i, float, float) { result.data[i] = 255; });
  return result;
}

template <typename Array>
Array PhotoPixels::Compose(const DistortedPhoto& photo, const std::vector<Array>& faces) const {
  constexpr auto kChannels = size_t(Array::kChannels);
  const Camera& camera = photo.lens->photo;
  Array result(camera.width, camera.height);
  const size_t pixels = result.NumPixels();
  std::vector<float> sums(pixels * kChannels), weights(pixels);
  for (size_t f = 0; f < faces.size(); ++f) {
    const MapPtr map = Map(photo, f, /*of_photo=*/true);
    const Sampler<Array> sampler(faces[f], false);
    ForMapped(*map, [&](size_t i, float x, float y) {
      const float weight = FaceWeight(*photo.lens, f, x, y);
      const auto values = sampler.Linear(x, y);
      for (size_t c = 0; c < kChannels; ++c) sums[i * kChannels + c] += weight * values[c];
      weights[i] += weight;
    });
  }
  ParallelRanges(int64_t(pixels), 1 << 16, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      if (!(weights[i] > 0)) continue;
      for (size_t c = 0; c < kChannels; ++c) {
        const float value = sums[i * kChannels + c] / weights[i];
        result.data[i * kChannels + c] = ToPixel<typename decltype(result.data)::value_type>(value);
      }
    }
  });
  return result;
}

Image PhotoPixels::ToPhoto(const DistortedPhoto& photo, const std::vector<Image>& faces) const {
  return Compose(photo, faces);
}

Mask PhotoPixels::ToPhoto(const DistortedPhoto& photo, const std::vector<Mask>& faces) const {
  return Compose(photo, faces);
}

ScalarImage PhotoPixels::ToPhoto(const DistortedPhoto& photo,
                                 const std::vector<ScalarImage>& faces) const {
  return Compose(photo, faces);
}

DepthMap PhotoPixels::DepthToPhoto(const DistortedPhoto& photo,
                                   const std::vector<DepthMap>& faces) const {
  const Undistortion& lens = *photo.lens;
  DepthMap result(lens.photo.width, lens.photo.height);
  std::vector<float> nearest(result.NumPixels(), -1);  // distance from the border of the best face
  for (size_t f = 0; f < faces.size(); ++f) {
    const MapPtr map = Map(photo, f, /*of_photo=*/true);
    const Camera& camera = lens.faces[f].camera;
    const Sampler<DepthMap> sampler(faces[f], false);
    ForMapped(*map, [&](size_t i, float x, float y) {
      const float border = std::min({x, y, float(camera.width) - x, float(camera.height) - y});
      if (border <= nearest[i]) return;
      nearest[i] = border;
      float depth = sampler.Nearest(x, y)[0];
      if (lens.DepthIsDistance()) {
        const Eigen::Vector2d ray = camera.CamFromImg({x, y}).value();
        depth *= float(std::sqrt(1 + ray.squaredNorm()));
      }
      result.data[i] = depth;
    });
  }
  return result;
}

}  // namespace retint
