// SPDX-License-Identifier: BSD-3-Clause
// The pictures that a user sees and names: photos in their own pixels, or the pinhole views that
// show them. Masks come in and masks, renders and depth maps go out as these; in between everything
// works on views. If no camera is distorted, the two are the same, bit for bit.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "colmap_io/workspace.h"
#include "scene/image.h"
#include "selection/mask_projector.h"
#include "selection/suggestion.h"

namespace retint {

// The pixels of masks, renders, depth maps and targets in files if a camera is distorted: those of
// its photo, or of the pinhole views that show it.
enum class Pixels { kPhoto, kPinhole };

struct UserPicture {
  std::string name;  // of the photo, or of the view
  int width = 0, height = 0;
  std::vector<const View*> faces;         // the views that make it, at least one
  const DistortedPhoto* photo = nullptr;  // null: the pixels of its only face
};

class Pictures {
 public:
  using MasksByName = std::map<std::string, Mask>;

  // `workspace` outlives this.
  Pictures(const Workspace& workspace, Pixels pixels);

  const std::vector<UserPicture>& all() const { return all_; }  // by name
  // Whether every picture is a view's own.
  bool AreViews() const;
  // The one that shows a view of the workspace.
  const UserPicture& Of(const View& view) const { return all_[picture_of_.at(&view)]; }
  // The one of that name or, failing that, the one that shows the view of that name; null for none.
  const UserPicture* Find(std::string_view name) const;
  // The pictures that are painted at once.
  std::vector<ViewGroup> Groups() const;
  // The picture of that name; of a photo whose views are wanted, each of these. InputError with the
  // nearest names when there is none.
  std::vector<const UserPicture*> Require(std::string_view name) const;
  // The only one of that name. OptionError when the name stands for several.
  const UserPicture& RequireOne(std::string_view name) const;
  // Those that show any of the views, each once, in the order of the views.
  std::vector<const UserPicture*> Showing(const std::vector<const View*>& views) const;

  // The picture made of the results of `draw` for each of its faces.
  Image Compose(const UserPicture& picture, const std::function<Image(const View&)>& draw) const;
  ScalarImage ComposeScalar(const UserPicture& picture,
                            const std::function<ScalarImage(const View&)>& draw) const;
  Mask ComposeMask(const UserPicture& picture, const std::function<Mask(const View&)>& draw) const;
  DepthMap ComposeDepth(const UserPicture& picture,
                        const std::function<DepthMap(const View&)>& draw) const;
  // Masks of views as masks of pictures; a face that has none counts as empty.
  MasksByName FromViews(const MasksByName& masks) const;
  // And back. Every mask has its picture's size.
  MasksByName ToViews(const MasksByName& masks) const;
  // A picture's mask as one of its faces has it.
  Mask ToView(const UserPicture& picture, const View& face, const Mask& mask) const;
  const Camera& CameraOf(const View& face) const {
    return workspace_.reconstruction.cameras.at(face.camera_id);
  }
  // The pixels of a face that lie in the picture; empty: all do.
  Mask Reach(const UserPicture& picture, const View& face) const;

  // The masks in a folder (colmap_io/mask_names.h), by picture name, one after the other; `invert`:
  // their black is inside. InputError as FindMasks(), or when one is not of its picture's size.
  void ReadMasks(const std::filesystem::path& folder, bool invert,
                 const std::function<void(const UserPicture&, Mask)>& take) const;
  // The same, all of them.
  MasksByName ReadMasks(const std::filesystem::path& folder, bool invert) const;
  // The brush mask at `mask` of a picture (ReadBrushMask()). InputError as it, and for the
  // picture's photo or render itself, painted over or not: a mask is black or transparent outside.
  Mask ReadBrushOf(const UserPicture& picture, const std::filesystem::path& mask) const;
  // Strokes, 0 or 255, from a picture of any colors on black. InputError as ReadBrushOf(), for any
  // other photo, and for strokes on a white ground. The ground is white if every pixel has a
  // stroke, or strokes `inside` fill the whole edge of the picture and most of it.
  Mask ReadStrokesOf(const UserPicture& picture, const std::filesystem::path& path,
                     bool inside) const;
  // A brush mask, painted on the picture of that name, as the views of it that it paints.
  // OptionError if several pictures have that name.
  std::vector<PaintedView> ReadBrush(std::string_view name,
                                     const std::filesystem::path& mask) const;
  // The same of a mask of the picture's size that came from `origin`.
  std::vector<PaintedView> Brush(const UserPicture& picture, const Mask& mask,
                                 const std::filesystem::path& origin) const;

 private:
  const Workspace& workspace_;
  std::vector<UserPicture> all_;
  std::map<const View*, size_t> picture_of_;
};

}  // namespace retint
