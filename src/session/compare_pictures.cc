// SPDX-License-Identifier: BSD-3-Clause
#include "session/compare_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/color_difference.h"
#include "base/error.h"
#include "base/files.h"
#include "base/parallel.h"
#include "colmap_io/image_io.h"
#include "recolor/color_map_fit.h"
#include "scene/image_checks.h"
#include "session/contact_sheet.h"
#include "session/photo_paint.h"

namespace retint {
namespace {

constexpr uint8_t kInside = 128;
constexpr size_t kMostPairs = 40000;  // of colors, all pictures together
// DeltaE00. A change below is not seen, or is a JPEG's; a map explains what it gets this close to.
constexpr float kChanged = 2, kExplained = 2.5F;
constexpr double kWhole = 0.98;  // of the pixels: what is left then are stray ones
constexpr int kNeighbors = 4;    // of nine, itself among them, that a changed pixel needs

// One picture, and what its view was before: inside the selection.
struct Pair {
  const EditedPicture* picture = nullptr;
  Image before;  // as operations before the picture leave it
  Mask inside;
};

std::array<float, 3> Color8(const Image8& image, size_t p) {
  return {static_cast<float>(image.data[3 * p]) / 255,
          static_cast<float>(image.data[3 * p + 1]) / 255,
          static_cast<float>(image.data[3 * p + 2]) / 255};
}

// As a file of 8 bits holds it.
void Round8(Image& image) {
  for (float& value : image.data) {
    value = std::round(std::clamp(value, 0.0F, 1.0F) * 255) / 255;
  }
}

double MeanDifference(const Image8& picture, const Image& view) {
  std::vector<float> differences;
  for (size_t i = 0; i < view.data.size(); i += 7) {
    differences.push_back(std::abs(static_cast<float>(picture.data[i]) / 255 - view.data[i]));
  }
  // The median: what was painted does not count.
  const auto middle = differences.begin() + static_cast<ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  double sum = 0;
  for (auto it = differences.begin(); it != middle; ++it) sum += static_cast<double>(*it);
  return sum / static_cast<double>(std::max<size_t>(differences.size() / 2, 1));
}

bool HasSize(const Image8& picture, const Camera& camera) {
  return picture.width == camera.width && picture.height == camera.height;
}

// Whether the picture's file has the pixels of a distorted photo, from which it was resampled.
bool IsOfPhoto(const EditedPicture& picture, const View& view, const Workspace& workspace) {
  if (!workspace.PhotoOf(view) || !IsFile(picture.file)) return false;
  const Image8 file = ReadImage8(picture.file);
  return !HasSize(file, workspace.reconstruction.cameras.at(view.camera_id)) &&
         HasSize(file, workspace.PhotoCamera(view));
}

// The view's render as it comes out of the file of 8 bits that the picture was: one in a photo's
// pixels is resampled twice, and so is this.
Image RenderBefore(const EditedPicture& picture, const View& view, OpenScene& scene,
                   std::span<const float> sh) {
  if (!IsOfPhoto(picture, view, scene.workspace())) {
    Image render = scene.Render(view, sh);
    Round8(render);
    return render;
  }
  const PhotoPixels& pixels = *scene.workspace().photo_pixels;
  const DistortedPhoto& photo = *scene.workspace().PhotoOf(view);
  std::vector<Image> faces;
  for (const ViewId face : photo.faces) {
    faces.push_back(scene.Render(scene.reconstruction().views.at(face), sh));
  }
  Image whole = pixels.ToPhoto(photo, faces);
  Round8(whole);
  Image render = pixels.ToView(view.id, whole);
  Round8(render);
  return render;
}

// The render or the photo, whichever the picture was made from.
Image ViewBefore(const EditedPicture& picture, OpenScene& scene, std::span<const float> sh) {
  const View& view = scene.workspace().RequireView(picture.view);
  Image render = RenderBefore(picture, view, scene, sh);
  if (!scene.workspace().HasPhoto(view)) return render;
  Image photo = scene.workspace().ReadPhoto(view);
  return MeanDifference(picture.image, photo) < MeanDifference(picture.image, render)
             ? std::move(photo)
             : std::move(render);
}

float Difference(const float* x, const float* y) {
  return static_cast<float>(ColorDifference(CieLabFromSrgb(x), CieLabFromSrgb(y)));
}

// How far `edit` of a view is from its picture, DeltaE00, inside; 0 elsewhere.
ScalarImage Residuals(const Pair& pair, const CompiledEdit* edit) {
  ScalarImage residuals(pair.inside.width, pair.inside.height);
  ParallelTasks(residuals.height, [&](int64_t y) {
    const size_t width = static_cast<size_t>(residuals.width);
    for (size_t p = static_cast<size_t>(y) * width; p < static_cast<size_t>(y + 1) * width; ++p) {
      if (pair.inside.data[p] < kInside) continue;
      Eigen::Vector3f color(&pair.before.data[3 * p]);
      if (edit) color = edit->Apply(color).cwiseMax(0.0F).cwiseMin(1.0F);
      residuals.data[p] = Difference(color.data(), Color8(pair.picture->image, p).data());
    }
  });
  return residuals;
}

// 255 where the difference is more than `least` and so are some neighbors', and one pixel around.
Mask Different(const ScalarImage& difference, float least) {
  Mask steady(difference.width, difference.height), mask(difference.width, difference.height);
  const auto count = [&](int x, int y, const auto& holds) {
    int found = 0;
    for (int i = 0; i < 9; ++i) {
      const int px = x + i % 3 - 1, py = y + i / 3 - 1;
      found += difference.Contains(px, py) && holds(px, py) ? 1 : 0;
    }
    return found;
  };
  const auto differs = [&](int x, int y) { return difference(x, y) > least; };
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      steady(x, y) = differs(x, y) && count(x, y, differs) >= kNeighbors ? 1 : 0;
    }
  }
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      mask(x, y) = count(x, y, [&](int px, int py) { return steady(px, py) != 0; }) > 0 ? 255 : 0;
    }
  }
  return mask;
}

// The part of the picture where `alpha` is set; empty where it nowhere is.
std::vector<PaintLayer> LayerOf(const EditedPicture& picture, const Mask& alpha) {
  int x0 = alpha.width, y0 = alpha.height, x1 = 0, y1 = 0;
  for (int y = 0; y < alpha.height; ++y) {
    for (int x = 0; x < alpha.width; ++x) {
      if (alpha(x, y) == 0) continue;
      x0 = std::min(x0, x), x1 = std::max(x1, x + 1);
      y0 = std::min(y0, y), y1 = std::max(y1, y + 1);
    }
  }
  if (x0 >= x1) return {};
  PaintLayer layer{picture.view, x0, y0, Image8(x1 - x0, y1 - y0), Mask(x1 - x0, y1 - y0)};
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      layer.alpha(x - x0, y - y0) = alpha(x, y);
      for (int c = 0; c < 3; ++c) layer.color(x - x0, y - y0, c) = picture.image(x, y, c);
    }
  }
  return {std::move(layer)};
}

// Of the view; empty where there is none.
Mask MaskOf(const RegionSelection& selection, const std::string& view, const Workspace& workspace) {
  for (const PaintedView& painted : selection.source.painted) {
    const std::vector<std::string> names = PaintedNames(workspace, painted);
    const auto at = std::find(names.begin(), names.end(), view);
    if (at != names.end()) return OnViews(workspace, painted)[size_t(at - names.begin())].mask;
  }
  const auto found = selection.masks.find(view);
  return found == selection.masks.end() ? Mask() : found->second;
}

// Leaves out what of a view its photo does not show: nobody can have changed it.
void LimitToPhoto(Mask& mask, const EditedPicture& picture, const Workspace& workspace) {
  const View& view = workspace.RequireView(picture.view);
  if (!IsOfPhoto(picture, view, workspace)) return;
  const Mask reach = workspace.photo_pixels->Reach(view.id);
  for (size_t p = 0; p < mask.data.size(); ++p)
    mask.data[p] = std::min(mask.data[p], reach.data[p]);
}

std::vector<Pair> PairsOf(const ColorOperation& op, const ColorEdit& before,
                          const RegionSelection& selection, OpenScene& scene,
                          std::span<const float> sh) {
  const CompiledEdit compiled(before);
  std::vector<Pair> pairs;
  for (const EditedPicture& picture : op.picture->pictures) {
    Mask mask = MaskOf(selection, picture.view, scene.workspace());
    if (!AnySet(mask)) continue;
    Pair pair{&picture, ViewBefore(picture, scene, sh), std::move(mask)};
    LimitToPhoto(pair.inside, picture, scene.workspace());
    for (size_t i = 0; !before.operations.empty() && i < pair.before.data.size(); i += 3) {
      const Eigen::Vector3f color = compiled.Apply(Eigen::Vector3f(&pair.before.data[i]));
      std::copy_n(color.data(), 3, &pair.before.data[i]);
    }
    pairs.push_back(std::move(pair));
  }
  if (pairs.empty()) {
    throw InputError("picture: the selection does not show in the view '" +
                     op.picture->pictures.front().view + "' whose picture was edited");
  }
  return pairs;
}

ColorTable FitTable(const std::vector<Pair>& pairs) {
  size_t inside = 0;
  for (const Pair& pair : pairs) {
    for (const uint8_t value : pair.inside.data) inside += value >= kInside ? 1 : 0;
  }
  const size_t step = inside / kMostPairs + 1;
  std::vector<float> before, after;
  size_t number = 0;
  for (const Pair& pair : pairs) {
    for (size_t p = 0; p < pair.inside.data.size(); ++p) {
      if (pair.inside.data[p] < kInside || number++ % step != 0) continue;
      const auto color = Color8(pair.picture->image, p);
      before.insert(before.end(), &pair.before.data[3 * p], &pair.before.data[3 * p] + 3);
      after.insert(after.end(), color.begin(), color.end());
    }
  }
  if (before.empty()) throw InputError("picture: the selection has no pixel in the edited views");
  return FitColorTable(before, after);
}

struct Explanation {
  std::vector<ScalarImage> residuals;  // of each pair
  double share = 0;                    // of the pixels inside
  double score = 0;                    // mean residual, what is not explained at its bound
  double median = 0;                   // of the residuals of what is explained
};

Explanation Explain(const std::vector<Pair>& pairs, const CompiledEdit* edit) {
  Explanation found;
  std::vector<float> explained;
  size_t inside = 0;
  double sum = 0;
  for (const Pair& pair : pairs) {
    found.residuals.push_back(Residuals(pair, edit));
    for (size_t p = 0; p < pair.inside.data.size(); ++p) {
      if (pair.inside.data[p] < kInside) continue;
      ++inside;
      const float residual = found.residuals.back().data[p];
      sum += static_cast<double>(std::min(residual, kExplained));
      if (residual <= kExplained) explained.push_back(residual);
    }
  }
  if (inside > 0) found.score = sum / static_cast<double>(inside);
  if (explained.empty()) return found;
  found.share = static_cast<double>(explained.size()) / static_cast<double>(inside);
  const auto middle = explained.begin() + static_cast<ptrdiff_t>(explained.size() / 2);
  std::nth_element(explained.begin(), middle, explained.end());
  found.median = static_cast<double>(*middle);
  return found;
}

Image ToImage(const Image8& picture) {
  Image image(picture.width, picture.height);
  for (size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<float>(picture.data[i]) / 255;
  }
  return image;
}

Image8 ReadEdited(const std::string& file) {
  if (!IsOpaque(file)) {
    throw InputError(file,
                     "has transparent pixels: flatten it over the render or photo that was edited");
  }
  return ReadImage8(file);
}

// The picture, or those of the views that show the photo whose pixels it has.
std::vector<EditedPicture> ReadPicture(EditedPicture picture, const Workspace& workspace) {
  const DistortedPhoto* photo =
      workspace.photo_pixels ? workspace.photo_pixels->FindPhoto(picture.view) : nullptr;
  const bool is_view = workspace.reconstruction.FindView(picture.view) != nullptr;
  if (!photo || is_view) {
    const View& view = workspace.RequireView(picture.view);
    photo = workspace.PhotoOf(view);
    if (picture.image.Empty()) picture.image = ReadEdited(picture.file);
    const Camera& camera = workspace.reconstruction.cameras.at(view.camera_id);
    if (!photo || HasSize(picture.image, camera)) {
      RequireSize(picture.file.empty() ? "picture of view " + picture.view : picture.file,
                  picture.image, camera);
      return {std::move(picture)};
    }
  } else {
    picture.image = ReadEdited(picture.file);
  }
  RequireSize(picture.file.empty() ? "picture of " + photo->name : picture.file, picture.image,
              photo->lens->photo);
  const Image whole = ToImage(picture.image);
  std::vector<EditedPicture> faces;
  for (const ViewId id : photo->faces) {
    const View& face = workspace.reconstruction.views.at(id);
    if (is_view && face.name != picture.view) continue;
    faces.push_back({face.name, picture.file, ToImage8(workspace.photo_pixels->ToView(id, whole))});
  }
  return faces;
}

}  // namespace

void ReadPictures(ColorOperation& op, const Workspace& workspace) {
  if (op.kind != ColorOperationKind::kPicture) return;
  auto read = std::make_shared<PictureEdit>();
  read->layers = op.picture->layers;
  for (const EditedPicture& picture : op.picture->pictures) {
    for (EditedPicture& one : ReadPicture(picture, workspace)) {
      const auto& all = read->pictures;
      const bool twice = std::any_of(all.begin(), all.end(), [&](const EditedPicture& other) {
        return other.view == one.view;
      });
      if (twice) throw InputError("there are two pictures of view " + one.view);
      read->pictures.push_back(std::move(one));
    }
  }
  op.picture = std::move(read);
}

std::map<std::string, Mask> ChangedMasks(const PictureEdit& edit, OpenScene& scene,
                                         std::span<const float> sh) {
  std::map<std::string, Mask> masks;
  std::map<std::string, bool> changed;  // by file
  for (const EditedPicture& picture : edit.pictures) {
    Pair pair{&picture, ViewBefore(picture, scene, sh), {}};
    pair.inside = Mask(pair.before.width, pair.before.height, 255);
    Mask mask = Different(Residuals(pair, nullptr), kChanged);
    bool& any = changed[picture.file];
    if (!AnySet(mask)) continue;
    any = true;
    masks.emplace(picture.view, std::move(mask));
  }
  for (const auto& [file, any] : changed) {
    if (!any) throw InputError(file + ": nothing was changed in this picture");
  }
  return masks;
}

void ComparePictures(ColorOperation& op, const ColorEdit& before, const RegionSelection& selection,
                     OpenScene& scene, std::span<const float> sh) {
  ReadPictures(op, scene.workspace());
  const std::vector<Pair> pairs = PairsOf(op, before, selection, scene, sh);
  auto table = std::make_shared<ColorTable>(FitTable(pairs));
  table->name = "picture";
  const CompiledEdit map({{ColorOperation::Lut(table)}, 1});
  Explanation best = Explain(pairs, nullptr);
  Explanation fitted = Explain(pairs, &map);
  if (fitted.score < best.score) {
    best = std::move(fitted);
    op.table = table;
  }
  PictureEdit result;
  for (size_t i = 0; i < pairs.size(); ++i) {
    // The pixels themselves are not needed any more, nor kept by a session.
    result.pictures.push_back({pairs[i].picture->view, pairs[i].picture->file, {}});
    if (best.share >= kWhole) continue;
    Mask paint = Different(best.residuals[i], kChanged);
    for (size_t p = 0; p < paint.data.size(); ++p) {
      if (pairs[i].inside.data[p] == 0) paint.data[p] = 0;
    }
    for (PaintLayer& layer : LayerOf(*pairs[i].picture, paint)) {
      result.layers.push_back(std::move(layer));
    }
  }
  op.Get("explained")[0] = static_cast<float>(best.share);
  op.Get("residual")[0] = static_cast<float>(best.median);
  op.picture = std::make_shared<PictureEdit>(std::move(result));
}

std::vector<PosedCamera> LayerCameras(const ColorEdit& edit, const Workspace& workspace) {
  std::vector<PosedCamera> cameras;
  for (const ColorOperation& op : edit.operations) {
    if (!op.picture) continue;
    for (const PaintLayer& layer : op.picture->layers) {
      cameras.push_back(workspace.reconstruction.Posed(workspace.RequireView(layer.view)));
    }
  }
  return cameras;
}

}  // namespace retint
