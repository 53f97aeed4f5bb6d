// SPDX-License-Identifier: BSD-3-Clause
#include "opening/pictures.h"

#include <algorithm>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "base/option_name.h"
#include "colmap_io/image_io.h"
#include "colmap_io/mask_names.h"
#include "colmap_io/png_text.h"
#include "opening/photo_paint.h"
#include "opening/picture_likeness.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

// Masks are opaque or not, but for soft borders; few pixels of photos are black or as bright as the
// brightest. Masks that are soft everywhere are told from photos by their edges.
constexpr double kLeastSoft = 0.3;    // of the pixels
constexpr double kLeastEdges = 0.35;  // EdgeCorrelation() of a view's photo and its render
// Strokes: of the brightest, 255; less is noise of a JPEG beside them.
constexpr uint8_t kLeastPaint = 64;

bool LooksLikeAPhoto(const Mask& mask) {
  const auto soft = std::count_if(mask.data.begin(), mask.data.end(),
                                  [](uint8_t value) { return value > 16 && value < 240; });
  return double(soft) > kLeastSoft * double(mask.data.size());
}

// Whether strokes are on a white ground: all along the picture's edge, and on most of it.
bool CoversTheGround(const Mask& strokes) {
  for (int y = 0; y < strokes.height; ++y) {
    const bool is_end = y == 0 || y == strokes.height - 1;
    for (int x = 0; x < strokes.width; x += is_end ? 1 : std::max(1, strokes.width - 1)) {
      if (strokes(x, y) == 0) return false;
    }
  }
  return 2 * CountInside(strokes) > strokes.NumPixels();
}

template <typename Array, typename Draw>
std::vector<Array> DrawFaces(const UserPicture& picture, const Draw& draw) {
  std::vector<Array> faces;
  for (const View* face : picture.faces) faces.push_back(draw(*face));
  return faces;
}

}  // namespace

Pictures::Pictures(const Workspace& workspace, Pixels pixels) : workspace_(workspace) {
  const Reconstruction& model = workspace.reconstruction;
  std::set<const DistortedPhoto*> taken;
  for (const View* view : model.ViewsByName()) {
    const DistortedPhoto* photo = pixels == Pixels::kPhoto ? workspace.PhotoOf(*view) : nullptr;
    if (!photo) {
      const Camera& camera = model.cameras.at(view->camera_id);
      all_.push_back({view->name, camera.width, camera.height, {view}, nullptr});
    } else if (taken.insert(photo).second) {
      UserPicture picture{
          photo->name, photo->lens->photo.width, photo->lens->photo.height, {}, photo};
      for (const ViewId face : photo->faces) picture.faces.push_back(&model.views.at(face));
      all_.push_back(std::move(picture));
    }
  }
  std::sort(all_.begin(), all_.end(),
            [](const UserPicture& a, const UserPicture& b) { return a.name < b.name; });
  for (size_t i = 0; i < all_.size(); ++i) {
    for (const View* face : all_[i].faces) picture_of_[face] = i;
  }
}

bool Pictures::AreViews() const {
  return std::all_of(all_.begin(), all_.end(),
                     [](const UserPicture& picture) { return picture.photo == nullptr; });
}

const UserPicture* Pictures::Find(std::string_view name) const {
  const auto found = std::lower_bound(
      all_.begin(), all_.end(), name,
      [](const UserPicture& picture, std::string_view other) { return picture.name < other; });
  if (found != all_.end() && found->name == name) return &*found;
  const View* view = workspace_.reconstruction.FindView(name);
  return view ? &Of(*view) : nullptr;
}

std::vector<ViewGroup> Pictures::Groups() const {
  std::vector<ViewGroup> groups;
  for (const UserPicture& picture : all_) groups.push_back({picture.name, picture.faces});
  return groups;
}

std::vector<const UserPicture*> Pictures::Require(std::string_view name) const {
  std::vector<const UserPicture*> found;
  for (const UserPicture& picture : all_) {
    const DistortedPhoto* photo = workspace_.PhotoOf(*picture.faces.front());
    if (picture.name == name || (photo && photo->name == name)) found.push_back(&picture);
  }
  if (found.empty()) {
    // A view of a photo that is wanted whole has no picture of its own.
    const DistortedPhoto* photo = workspace_.PhotoOf(workspace_.RequireView(name));
    throw InputError(workspace_.sparse_folder, "\"" + std::string(name) + "\" is a part of " +
                                                   photo->name + "; name that, or give " +
                                                   OptionName("pixels", "pinhole"));
  }
  return found;
}

const UserPicture& Pictures::RequireOne(std::string_view name) const {
  const auto found = Require(name);
  CheckOption(found.size() == 1,
              std::string(name) + " is shown by " + std::to_string(found.size()) +
                  " views: a mask belongs to one of them, such as " + found.front()->name);
  return *found.front();
}

std::vector<const UserPicture*> Pictures::Showing(const std::vector<const View*>& views) const {
  std::vector<const UserPicture*> found;
  for (const View* view : views) {
    const UserPicture* picture = &Of(*view);
    if (std::find(found.begin(), found.end(), picture) == found.end()) found.push_back(picture);
  }
  return found;
}

Image Pictures::Compose(const UserPicture& picture,
                        const std::function<Image(const View&)>& draw) const {
  if (!picture.photo) return draw(*picture.faces.front());
  return workspace_.photo_pixels->ToPhoto(*picture.photo, DrawFaces<Image>(picture, draw));
}

ScalarImage Pictures::ComposeScalar(const UserPicture& picture,
                                    const std::function<ScalarImage(const View&)>& draw) const {
  if (!picture.photo) return draw(*picture.faces.front());
  return workspace_.photo_pixels->ToPhoto(*picture.photo, DrawFaces<ScalarImage>(picture, draw));
}

Mask Pictures::ComposeMask(const UserPicture& picture,
                           const std::function<Mask(const View&)>& draw) const {
  if (!picture.photo) return draw(*picture.faces.front());
  return workspace_.photo_pixels->ToPhoto(*picture.photo, DrawFaces<Mask>(picture, draw));
}

DepthMap Pictures::ComposeDepth(const UserPicture& picture,
                                const std::function<DepthMap(const View&)>& draw) const {
  if (!picture.photo) return draw(*picture.faces.front());
  return workspace_.photo_pixels->DepthToPhoto(*picture.photo, DrawFaces<DepthMap>(picture, draw));
}

Pictures::MasksByName Pictures::FromViews(const MasksByName& masks) const {
  MasksByName result;
  for (const UserPicture& picture : all_) {
    const bool any = std::any_of(picture.faces.begin(), picture.faces.end(),
                                 [&](const View* face) { return masks.count(face->name) > 0; });
    if (!any) continue;
    if (!picture.photo) {
      result.emplace(picture.name, masks.at(picture.name));
      continue;
    }
    result.emplace(picture.name, ComposeMask(picture, [&](const View& face) {
                     const auto found = masks.find(face.name);
                     if (found != masks.end()) return found->second;
                     const Camera& camera = CameraOf(face);
                     return Mask(camera.width, camera.height);
                   }));
  }
  return result;
}

Pictures::MasksByName Pictures::ToViews(const MasksByName& masks) const {
  MasksByName result;
  for (const UserPicture& picture : all_) {
    const auto found = masks.find(picture.name);
    if (found == masks.end()) continue;
    for (const View* face : picture.faces) {
      result.emplace(face->name, ToView(picture, *face, found->second));
    }
  }
  return result;
}

Mask Pictures::ToView(const UserPicture& picture, const View& face, const Mask& mask) const {
  return picture.photo ? workspace_.photo_pixels->ToView(face.id, mask) : mask;
}

Mask Pictures::Reach(const UserPicture& picture, const View& face) const {
  return picture.photo ? workspace_.photo_pixels->Reach(face.id) : Mask();
}

void Pictures::ReadMasks(const std::filesystem::path& folder, bool invert,
                         const std::function<void(const UserPicture&, Mask)>& take) const {
  std::vector<std::string> names;
  for (const UserPicture& picture : all_) names.push_back(picture.name);
  const auto files = FindMasks(folder, names);
  for (const UserPicture& picture : all_) {
    const auto file = files.find(picture.name);
    if (file == files.end()) continue;
    Mask mask = ReadMask(file->second, picture.width, picture.height);
    if (invert) {
      for (uint8_t& value : mask.data) value = static_cast<uint8_t>(255 - value);
    }
    take(picture, std::move(mask));
  }
}

Pictures::MasksByName Pictures::ReadMasks(const std::filesystem::path& folder, bool invert) const {
  MasksByName masks;
  ReadMasks(folder, invert, [&](const UserPicture& picture, Mask mask) {
    masks.emplace(picture.name, std::move(mask));
  });
  return masks;
}

std::vector<PaintedView> Pictures::ReadBrush(std::string_view name,
                                             const std::filesystem::path& mask) const {
  const UserPicture& one = RequireOne(name);
  std::vector<PaintedView> painted = Brush(one, ReadBrushOf(one, mask), mask);
  const std::string outlined_by = ReadPngText(mask, kOutlinedBy);
  for (PaintedView& view : painted) view.outlined_by = outlined_by;
  return painted;
}

Mask Pictures::ReadBrushOf(const UserPicture& picture, const std::filesystem::path& path) const {
  Mask mask = ReadBrushMask(path, picture.width, picture.height);
  if (!LooksLikeAPhoto(mask) || !IsOpaque(path)) return mask;
  const View& view = *picture.faces.front();
  if (!workspace_.HasPhoto(view)) return mask;
  const Image photo =
      picture.photo ? ReadImage(workspace_.PhotoPath(view)) : workspace_.ReadPhoto(view);
  if (photo.width != mask.width || photo.height != mask.height) return mask;
  if (EdgeCorrelation(ReadImage8(path), photo) < kLeastEdges) return mask;
  throw InputError(path, "this shows the view '" + picture.name +
                             "' itself: a mask is black or transparent outside what is selected");
}

Mask Pictures::ReadStrokesOf(const UserPicture& picture, const std::filesystem::path& path,
                             bool inside) const {
  Mask strokes = ReadBrushOf(picture, path);
  const bool photo = LooksLikeAPhoto(strokes) && IsOpaque(path);
  for (uint8_t& value : strokes.data) value = value >= kLeastPaint ? 255 : 0;
  const bool covers =
      inside ? CoversTheGround(strokes) : CountInside(strokes) == strokes.NumPixels();
  if (photo || covers) {
    throw InputError(path,
                     "most of the picture counts as a stroke: a picture of strokes is black "
                     "or transparent elsewhere");
  }
  return strokes;
}

std::vector<PaintedView> Pictures::Brush(const UserPicture& picture, const Mask& mask,
                                         const std::filesystem::path& origin) const {
  std::vector<PaintedView> painted =
      OnViews(workspace_, PaintedView{picture.name, PosedPicture(workspace_, picture), mask});
  std::erase_if(painted, [](const PaintedView& view) { return !AnySet(view.mask); });
  if (painted.empty()) throw InputError(origin, "only pixels are painted that no ray leads to");
  return painted;
}

}  // namespace retint
