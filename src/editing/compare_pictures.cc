// SPDX-License-Identifier: BSD-3-Clause
#include "editing/compare_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "base/color_difference.h"
#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"
#include "colmap_io/image_io.h"
#include "editing/jpeg_noise.h"
#include "editing/picture_before.h"
#include "editing/picture_changes.h"
#include "opening/photo_paint.h"
#include "opening/picture_likeness.h"
#include "recolor/color_map_fit.h"
#include "scene/contact_sheet.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"
#include "selection/view_depth.h"

namespace retint {
namespace {

constexpr size_t kMostPairs = 40000;  // of colors, all pictures together
constexpr float kExplained = 2.5F;    // DeltaE00: colors that a map gets this close to
// A picture that shows its view: the mean change of its half that changed least, and the least
// EdgeCorrelation. Pictures of neighboring views have up to 0.26, of the view itself 0.59 and more.
constexpr double kLike = 0.008, kLeastEdges = 0.35;
constexpr int kColorCells = 16;        // a side of the RGB cube
constexpr double kMostCommon = 0.4;    // of colors that were changed and of those that stayed
constexpr double kWhole = 0.98;        // of the pixels: the rest are stray ones then
constexpr double kUntouched = 0.9995;  // of the pixels, without a map: a small logo is none of them
constexpr double kMostly = 0.8;        // of the pixels: the map is meant for those at the rim too
constexpr double kAsGood = 0.25;       // DeltaE00, mean: an earlier map stays where it is so close
constexpr float kTaken = 0.5F;   // of a pixel's change: less is left of it by a map that helps
constexpr double kHelped = 0.5;  // of the changed pixels: fewer, and the change is no map

// One picture, and its view before: inside the selection.
struct Pair {
  const EditedPicture* picture = nullptr;
  Image before;  // as operations before the picture leave it
  Mask inside;
  Mask around;        // unchanged pixels next to it, if they tell something
  ScalarImage least;  // DeltaE00: of a change
};

std::array<float, 3> Color8(const Image8& image, size_t p) {
  return {static_cast<float>(image.data[3 * p]) / 255,
          static_cast<float>(image.data[3 * p + 1]) / 255,
          static_cast<float>(image.data[3 * p + 2]) / 255};
}

bool HasSize(const Image8& picture, const Camera& camera) {
  return picture.width == camera.width && picture.height == camera.height;
}

// A picture in a photo's pixels was resampled, and with it the noise of its file.
ScalarImage LeastChangesOf(const EditedPicture& picture, const Image& before) {
  return LeastChanges(picture.image, before, picture.of_photo ? std::string() : picture.file);
}

std::string NameOf(const EditedPicture& picture) {
  return picture.file.empty() ? "the picture of view " + picture.view : picture.file;
}

// Refuses a picture of another view. In such a picture even the more similar half of the pixels
// differs, and edges beside `changed`, the mask in which the picture is used (no pixels:
// everywhere), differ.
void RequireLikeness(const EditedPicture& picture, const Image& view, const Mask& changed) {
  if (MeanDifference(picture.image, view) < kLike) return;
  if (EdgeCorrelation(picture.image, view, changed) > kLeastEdges) return;
  throw InputError(NameOf(picture) + ": this does not look like the view '" + picture.view +
                   "': most of it differs, and its edges lie elsewhere. Name the view whose render "
                   "or photo was edited");
}

float Difference(const float* x, const float* y) {
  return static_cast<float>(ColorDifference(CieLabFromSrgb(x), CieLabFromSrgb(y)));
}

// How far `edit` of a view is from its picture, DeltaE00, where `mask` is set; 0 elsewhere.
ScalarImage Residuals(const Pair& pair, const Mask& mask, const CompiledEdit* edit) {
  ScalarImage residuals(mask.width, mask.height);
  ParallelTasks(residuals.height, [&](int64_t y) {
    const size_t width = static_cast<size_t>(residuals.width);
    for (size_t p = static_cast<size_t>(y) * width; p < static_cast<size_t>(y + 1) * width; ++p) {
      if (!IsInside(mask.data[p])) continue;
      Eigen::Vector3f color(&pair.before.data[3 * p]);
      if (edit) color = edit->Apply(color).cwiseMax(0.0F).cwiseMin(1.0F);
      residuals.data[p] = Difference(color.data(), Color8(pair.picture->image, p).data());
    }
  });
  return residuals;
}

// Of the view; empty if it has none.
Mask MaskOf(const RegionSelection& selection, const std::string& view, const Workspace& workspace) {
  for (const PaintedView& painted : selection.source.painted) {
    const std::vector<std::string> names = PaintedNames(workspace, painted);
    const auto at = std::find(names.begin(), names.end(), view);
    if (at != names.end()) return OnViews(workspace, painted)[size_t(at - names.begin())].mask;
  }
  const auto found = selection.masks.find(view);
  return found == selection.masks.end() ? Mask() : found->second;
}

// Leaves out parts of a view that its photo does not show: nobody can have changed them.
void LimitToPhoto(Mask& mask, const EditedPicture& picture, const Workspace& workspace) {
  if (!picture.of_photo) return;
  const Mask reach = workspace.photo_pixels->Reach(workspace.RequireView(picture.view).id);
  for (size_t p = 0; p < mask.data.size(); ++p)
    mask.data[p] = std::min(mask.data[p], reach.data[p]);
}

// Those of the pixels that the picture has as they were.
Mask Unchanged(const Pair& pair, Mask pixels) {
  const ScalarImage residuals = Residuals(pair, pixels, nullptr);
  for (size_t p = 0; p < pixels.data.size(); ++p) {
    if (residuals.data[p] > pair.least.data[p]) pixels.data[p] = 0;
  }
  return pixels;
}

std::vector<Pair> PairsOf(const ColorOperation& op, const ColorEdit& before,
                          const RegionSelection& selection, OpenScene& scene,
                          std::span<const float> sh) {
  std::vector<Pair> pairs;
  for (const EditedPicture& picture : op.picture->pictures) {
    if (picture.compared) continue;
    Mask mask = MaskOf(selection, picture.view, scene.workspace());
    if (!AnySet(mask)) continue;
    // As such a view is shown: the source of a picture.
    const auto shown = selection.masks.find(picture.view);
    const Mask& share = shown == selection.masks.end() ? mask : shown->second;
    Pair pair{&picture, BeforePicture(picture, before, share, scene, sh), mask, {}, {}};
    if (!picture.of_photo) {
      RequireLikeness(picture, pair.before, pair.inside);
    }
    LimitToPhoto(pair.inside, picture, scene.workspace());
    pair.least = LeastChangesOf(picture, pair.before);
    if (op.picture->selects) pair.around = Unchanged(pair, Surroundings(pair.inside));
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
    inside += CountInside(pair.inside);
  }
  const size_t step = inside / kMostPairs + 1;
  std::vector<float> before, after;
  size_t number = 0;
  for (const Pair& pair : pairs) {
    for (size_t p = 0; p < pair.inside.data.size(); ++p) {
      if (!IsInside(pair.inside.data[p]) || number++ % step != 0) continue;
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
  double score = 0;   // mean residual, with pixels that are not explained at the bound
  double median = 0;  // of the residuals of explained pixels
};

Explanation Explain(const std::vector<Pair>& pairs, const CompiledEdit* edit) {
  Explanation found;
  std::vector<float> explained;
  size_t inside = 0;
  double sum = 0;
  for (const Pair& pair : pairs) {
    found.residuals.push_back(Residuals(pair, pair.inside, edit));
    for (size_t p = 0; p < pair.inside.data.size(); ++p) {
      if (!IsInside(pair.inside.data[p])) continue;
      ++inside;
      const float residual = found.residuals.back().data[p];
      // The noise of a file is not to be explained.
      const float bound = std::max(kExplained, pair.least.data[p]);
      sum += static_cast<double>(kExplained * std::min(residual / bound, 1.0F));
      if (residual <= bound) explained.push_back(residual);
    }
  }
  if (inside > 0) found.score = sum / static_cast<double>(inside);
  if (explained.empty()) return found;
  found.share = static_cast<double>(explained.size()) / static_cast<double>(inside);
  found.median = static_cast<double>(Median(std::move(explained)));
  return found;
}

// Whether the colors that were changed are largely those of unchanged pixels around it: that is no
// map of colors, but paint.
bool SomeOfTheirColorsStayed(const std::vector<Pair>& pairs) {
  struct Count {
    size_t changed = 0, stayed = 0;
  };
  std::vector<Count> counts(size_t{kColorCells} * kColorCells * kColorCells);
  for (const Pair& pair : pairs) {
    for (size_t p = 0; p < pair.around.data.size(); ++p) {
      const bool changed = IsInside(pair.inside.data[p]), stayed = pair.around.data[p] > 0;
      if (!changed && !stayed) continue;
      size_t cell = 0;
      for (size_t c = 0; c < 3; ++c) {
        const float value = std::clamp(pair.before.data[3 * p + c], 0.0F, 1.0F);
        cell = cell * kColorCells + std::min(size_t(value * kColorCells), size_t{kColorCells - 1});
      }
      (changed ? counts[cell].changed : counts[cell].stayed) += 1;
    }
  }
  Count all;
  size_t common = 0;
  for (const Count& count : counts) {
    all.changed += count.changed;
    all.stayed += count.stayed;
    common += std::min(count.changed, count.stayed);
  }
  return double(common) > kMostCommon * double(std::min(all.changed, all.stayed));
}

// Whether a map takes most of their change from most of the pixels that were changed. If one color
// became two, the best map makes it a third one between them, which nobody painted.
bool TakesMostOfTheChange(const std::vector<Pair>& pairs, const Explanation& as_it_was,
                          const Explanation& fitted) {
  size_t changed = 0, helped = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    for (size_t p = 0; p < pairs[i].inside.data.size(); ++p) {
      if (!IsInside(pairs[i].inside.data[p])) continue;
      const float bound = std::max(kExplained, pairs[i].least.data[p]);
      const float change = as_it_was.residuals[i].data[p];
      if (change <= bound) continue;
      ++changed;
      helped += fitted.residuals[i].data[p] <= std::max(bound, kTaken * change);
    }
  }
  return static_cast<double>(helped) >= kHelped * static_cast<double>(changed);
}

using Map = std::shared_ptr<const ColorTable>;

Explanation ExplainBy(const std::vector<Pair>& pairs, const Map& map) {
  const CompiledEdit edit({{ColorOperation::Lut(map)}, 1});
  return Explain(pairs, &edit);
}

// The best explanation of the pictures, with its color map, or none if no map explains them. `map`
// is the map of earlier pictures, which stays where it explains these as well.
Explanation FindMap(const std::vector<Pair>& pairs, Map* map) {
  auto table = std::make_shared<ColorTable>(FitTable(pairs));
  table->name = "picture";
  Explanation as_it_was = Explain(pairs, nullptr);
  Explanation fitted = ExplainBy(pairs, table);
  const Map earlier = std::exchange(*map, nullptr);
  if (earlier) {
    Explanation kept = ExplainBy(pairs, earlier);
    if (kept.score <= std::min(fitted.score, as_it_was.score) + kAsGood) {
      *map = earlier;
      return kept;
    }
  }
  if (fitted.score >= as_it_was.score || SomeOfTheirColorsStayed(pairs) ||
      !TakesMostOfTheChange(pairs, as_it_was, fitted)) {
    return as_it_was;
  }
  *map = std::move(table);
  return fitted;
}

// Why nothing of a picture is taken over in which so many pixels differ.
std::string NothingTaken(size_t different) {
  if (different == 0) return "nothing was changed in this picture";
  return (different == 1 ? "1 pixel of this picture differs"
                         : std::to_string(different) + " pixels of this picture differ") +
         ", which is too little to be told from noise";
}

// The same of pictures that were compared inside a selection.
std::string NothingTaken(const std::vector<Pair>& pairs) {
  size_t different = 0;
  bool beside = false;
  for (const Pair& pair : pairs) {
    different += CountDifferent(Residuals(pair, pair.inside, nullptr), pair.least);
    const Mask whole(pair.inside.width, pair.inside.height, 255);
    beside = beside || AnySet(ChangedPixels(Residuals(pair, whole, nullptr), pair.least));
  }
  if (different == 0 && beside) return "what was changed in this picture lies outside the region";
  return NothingTaken(different);
}

// The results of pictures that were compared before, without those that other pictures replace.
PictureEdit Earlier(const PictureEdit& edit) {
  PictureEdit earlier;
  std::set<std::string> replaced;
  for (const EditedPicture& picture : edit.pictures) {
    if (picture.compared) {
      earlier.pictures.push_back(picture);
    } else {
      replaced.insert(picture.view);
    }
  }
  for (const PaintLayer& layer : edit.layers) {
    if (!replaced.contains(layer.view)) earlier.layers.push_back(layer);
  }
  return earlier;
}

const PaintLayer* LayerOf(const PictureEdit& edit, const std::string& view) {
  const auto found = std::ranges::find(edit.layers, view, &PaintLayer::view);
  return found == edit.layers.end() ? nullptr : &*found;
}

// Takes the difference back to 0 where the picture is as it was written and nothing was painted on
// this view. The paint that shows there is of others, and stays theirs.
void LeaveAsWritten(const Pair& pair, const PaintLayer* layer, ScalarImage& difference) {
  const Image8& written = pair.picture->written;
  for (int y = 0; y < written.height; ++y) {
    for (int x = 0; x < written.width; ++x) {
      float& value = difference(x, y);
      if (value == 0) continue;
      if (layer && layer->alpha.Contains(x - layer->x, y - layer->y) &&
          layer->alpha(x - layer->x, y - layer->y)) {
        continue;
      }
      const size_t p = size_t(y) * size_t(written.width) + size_t(x);
      const float painted =
          Difference(Color8(written, p).data(), Color8(pair.picture->image, p).data());
      if (painted <= pair.least.data[p]) value = 0;
    }
  }
}

Image8 ReadEdited(const std::string& file) {
  if (!IsOpaque(file)) {
    throw InputError(file,
                     "has transparent pixels: flatten it over the render or photo that was edited");
  }
  return ReadImage8(file);
}

// A picture that was handed out comes back in the size that it had.
void RequireSameSize(const EditedPicture& picture) {
  const Image8& given = picture.before;
  if (given.Empty() || (given.width == picture.image.width && given.height == picture.image.height))
    return;
  throw InputError(picture.file, "is " + std::to_string(picture.image.width) + " x " +
                                     std::to_string(picture.image.height) + " pixels, not " +
                                     std::to_string(given.width) + " x " +
                                     std::to_string(given.height) + " as it was written");
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
    RequireSameSize(picture);
    const Camera& camera = workspace.reconstruction.cameras.at(view.camera_id);
    if (!photo || HasSize(picture.image, camera)) {
      RequireSize(picture.file.empty() ? "picture of view " + picture.view : picture.file,
                  picture.image, camera);
      return {std::move(picture)};
    }
  } else {
    picture.image = ReadEdited(picture.file);
    RequireSameSize(picture);
  }
  RequireSize(picture.file.empty() ? "picture of " + photo->name : picture.file, picture.image,
              photo->lens->photo);
  const auto on_face = [&](ViewId id, const Image8& image) {
    return image.Empty() ? Image8() : ToImage8(workspace.photo_pixels->ToView(id, ToImage(image)));
  };
  std::vector<EditedPicture> faces;
  for (const ViewId id : photo->faces) {
    const View& face = workspace.reconstruction.views.at(id);
    if (is_view && face.name != picture.view) continue;
    faces.push_back({face.name, picture.file, on_face(id, picture.image), /*of_photo=*/true,
                     on_face(id, picture.before), on_face(id, picture.written)});
  }
  return faces;
}

}  // namespace

void ReadPictures(ColorOperation& op, const Workspace& workspace) {
  if (op.kind != ColorOperationKind::kPicture) return;
  auto read = std::make_shared<PictureEdit>();
  read->layers = op.picture->layers;
  read->selects = op.picture->selects;
  for (const EditedPicture& picture : op.picture->pictures) {
    if (picture.compared) {
      read->pictures.push_back(picture);
      continue;
    }
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

std::vector<std::filesystem::path> FilesCompared(const ColorOperation& op,
                                                 const Workspace& workspace) {
  std::vector<std::filesystem::path> files;
  if (op.kind != ColorOperationKind::kPicture || !op.NeedsMeasuring()) return files;
  const Reconstruction& model = workspace.reconstruction;
  for (const EditedPicture& picture : op.picture->pictures) {
    if (picture.compared) continue;
    files.emplace_back(picture.file);
    const DistortedPhoto* photo =
        workspace.photo_pixels ? workspace.photo_pixels->FindPhoto(picture.view) : nullptr;
    const View* view = photo ? &model.views.at(photo->faces.front()) : model.FindView(picture.view);
    if (view && workspace.HasPhoto(*view)) files.push_back(workspace.PhotoPath(*view));
  }
  return files;
}

void AddPicture(ColorEdit& edit, EditedPicture picture, const std::vector<std::string>& views) {
  const auto found =
      std::ranges::find(edit.operations, ColorOperationKind::kPicture, &ColorOperation::kind);
  if (found == edit.operations.end()) {
    edit.operations.push_back(ColorOperation::Picture({std::move(picture)}));
    return;
  }
  auto pictures = std::make_shared<PictureEdit>(*found->picture);
  std::erase_if(pictures->pictures, [&](const EditedPicture& other) {
    return std::ranges::find(views, other.view) != views.end() || other.view == picture.view;
  });
  pictures->pictures.push_back(std::move(picture));
  found->picture = std::move(pictures);
  std::ranges::fill(found->values, kUnset);  // explained and residual: to be measured
}

std::map<std::string, Mask> ChangedMasks(ColorOperation& op, OpenScene& scene,
                                         std::span<const float> sh) {
  auto edit = std::make_shared<PictureEdit>(*op.picture);
  edit->selects = true;
  op.picture = edit;
  std::vector<Pair> pairs;
  struct Change {
    bool taken = false;
    size_t different = 0;  // pixels
  };
  std::map<std::string, Change> changes;  // by file
  for (const EditedPicture& picture : edit->pictures) {
    Pair pair{&picture, ViewBefore(picture, scene, sh), {}, {}, {}};
    if (!picture.of_photo) {
      RequireLikeness(picture, pair.before, {});
    }
    pair.inside = Mask(pair.before.width, pair.before.height, 255);
    pair.least = LeastChangesOf(picture, pair.before);
    const ScalarImage residuals = Residuals(pair, pair.inside, nullptr);
    pair.inside = ChangedPixels(residuals, pair.least);
    Change& change = changes[picture.file];
    change.different += CountDifferent(residuals, pair.least);
    if (!AnySet(pair.inside)) continue;
    change.taken = true;
    pair.around = Unchanged(pair, Surroundings(pair.inside));
    pairs.push_back(std::move(pair));
  }
  for (const auto& [file, change] : changes) {
    if (!change.taken) throw InputError(file + ": " + NothingTaken(change.different));
  }
  // A map is for changed pixels and for nothing else. Paint is where it is, and the Gaussians that
  // show it reach beyond.
  Map map;
  FindMap(pairs, &map);
  std::map<std::string, Mask> masks;
  for (Pair& pair : pairs) {
    const View& view = scene.workspace().RequireView(pair.picture->view);
    const Reconstruction& model = scene.reconstruction();
    masks.emplace(view.name,
                  map ? WithoutSpill(std::move(pair.inside),
                                     SurfaceDepth(scene.renderer(), model.Posed(view), &view, model,
                                                  /*median=*/true))
                      : Widened(std::move(pair.inside)));
  }
  return masks;
}

void ComparePictures(ColorOperation& op, const ColorEdit& before, const RegionSelection& selection,
                     OpenScene& scene, std::span<const float> sh) {
  ReadPictures(op, scene.workspace());
  const std::vector<Pair> pairs = PairsOf(op, before, selection, scene, sh);
  Map map = op.table;
  Explanation best = FindMap(pairs, &map);
  PictureEdit result = Earlier(*op.picture);
  for (size_t i = 0; i < pairs.size(); ++i) {
    const EditedPicture& picture = *pairs[i].picture;
    // The pixels themselves are not needed any more, nor kept by a session.
    result.pictures.push_back({picture.view, picture.file, {}});
    result.pictures.back().compared = true;
    if (map == op.table)
      LeaveAsWritten(pairs[i], LayerOf(*op.picture, picture.view), best.residuals[i]);
    if (map && best.share >= kMostly) {
      DropRim(best.residuals[i], pairs[i].least, pairs[i].inside);
    }
    if (best.share >= (map ? kWhole : kUntouched)) {
      DropStray(best.residuals[i], pairs[i].least);
    }
    if (auto layer = PaintedLayer(picture.view, picture.image, best.residuals[i], pairs[i].least,
                                  pairs[i].inside)) {
      result.layers.push_back(std::move(*layer));
    }
  }
  const bool had_some = op.table || !op.picture->layers.empty();
  if (!map && result.layers.empty() && !had_some) {
    throw InputError(NameOf(*pairs.front().picture) + ": " + NothingTaken(pairs));
  }
  op.table = std::move(map);
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
