// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/edit_outputs.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "depth/depth_picture.h"
#include "reporting/report.h"
#include "scene/contact_sheet.h"
#include "scene/mask_pixels.h"
#include "selecting/paint_picture.h"
#include "selecting/selection_files.h"

namespace retint {
namespace {

constexpr size_t kComparisonRows = 4;
constexpr double kComparisonArea = 400 * 300;  // pixels a picture, so that tall ones stay small

// Of all regions, each pixel's largest.
Mask MaskOf(const RegionSet& regions, const View& view, const Camera& camera) {
  Mask all(camera.width, camera.height);
  for (const Region& region : regions.regions) {
    const auto found = region.selection->masks.find(view.name);
    if (found == region.selection->masks.end()) continue;
    std::ranges::transform(all.data, found->second.data, all.data.begin(),
                           [](uint8_t a, uint8_t b) { return std::max(a, b); });
  }
  return all;
}

// Painted views first, then views spread evenly over the others that the regions reach.
std::vector<const View*> ComparisonViews(const EditSession& session) {
  const RegionSet& regions = session.store().regions();
  const Reconstruction& model = session.scene().reconstruction();
  std::vector<const View*> chosen, others;
  const auto is_chosen = [&](const View* view) {
    return std::find(chosen.begin(), chosen.end(), view) != chosen.end();
  };
  for (const Region& region : regions.regions) {
    for (const PaintedView& painted : region.selection->source.painted) {
      if (chosen.size() + 1 >= kComparisonRows) break;
      const View* view = model.FindView(painted.name);
      if (view && !is_chosen(view)) chosen.push_back(view);
    }
  }
  constexpr double kReached = 0.002;  // of a view's pixels
  for (const View* view : model.ViewsByName()) {
    const Mask mask = MaskOf(regions, *view, model.Posed(*view).camera);
    if (FractionInside(mask) > kReached && !is_chosen(view)) others.push_back(view);
  }
  if (chosen.empty() && others.empty()) return {model.ViewsByName().front()};
  const size_t wanted = std::min(kComparisonRows - chosen.size(), others.size());
  for (size_t i = 0; i < wanted; ++i) {
    chosen.push_back(others[(2 * i + 1) * others.size() / (2 * wanted)]);
  }
  return chosen;
}

// The first painted picture's depth has the fixed name; others go by theirs.
void WriteDepths(const std::filesystem::path& folder, EditSession& session,
                 const SelectionResult& selected) {
  const Pictures pictures = session.scene().pictures();
  std::map<const View*, DepthEstimate> depths;
  std::vector<const UserPicture*> painted;
  for (size_t i = 0; i < selected.depths.size(); ++i) {
    const View* view = session.scene().reconstruction().FindView(selected.painted[i].view);
    depths[view] = selected.depths[i];
    const UserPicture* picture = pictures.Showing({view}).front();
    if (std::find(painted.begin(), painted.end(), picture) == painted.end()) {
      painted.push_back(picture);
    }
  }
  for (const UserPicture* picture : painted) {
    const auto base = picture == painted.front() ? folder / "depth"
                                                 : ViewFile(folder / "depth", picture->name, "");
    WriteDepth(base.string() + ".bin", base.string() + ".png",
               ComposeDepths(pictures, *picture, depths));
  }
}

}  // namespace

void WriteDepth(const std::filesystem::path& map, const std::filesystem::path& picture,
                const DepthEstimate& depth) {
  if (!map.empty()) WriteDepthMap(map, depth.depth);
  if (!picture.empty()) WritePng(picture, DepthPicture(depth.depth, depth.valid));
}

DepthEstimate ComposeDepths(const Pictures& pictures, const UserPicture& picture,
                            const std::map<const View*, DepthEstimate>& depths) {
  if (!picture.photo) return depths.at(picture.faces.front());
  DepthEstimate result;
  std::map<const View*, DepthEstimate> all = depths;
  for (size_t i = 0; i < picture.faces.size(); ++i) {
    const auto found = depths.find(picture.faces[i]);
    if (found != depths.end()) continue;
    const Camera& camera = picture.photo->lens->faces[i].camera;
    DepthEstimate& none = all[picture.faces[i]];
    none.depth = DepthMap(camera.width, camera.height);
    none.valid = Mask(camera.width, camera.height);
  }
  result.depth =
      pictures.ComposeDepth(picture, [&](const View& face) { return all.at(&face).depth; });
  result.valid =
      pictures.ComposeMask(picture, [&](const View& face) { return all.at(&face).valid; });
  for (uint8_t& value : result.valid.data) value = IsInside(value) ? 255 : 0;
  return result;
}

void WriteStages(const std::filesystem::path& folder, EditSession& session, RegionId id,
                 const SelectionResult& selected, Monitor& monitor) {
  WriteDepths(folder, session, selected);
  WriteCloud(folder / "cloud_raw.ply", selected.cloud_raw);
  WriteCloud(folder / "cloud.ply", selected.cloud);
  WriteFile(folder / "registration.json", RegistrationsToJson(selected.painted));
  const RegionSelection& selection = *session.store().Require(id).selection;
  for (const PaintedPicture& one :
       PicturesOfPaint(session.scene(), selection.source.painted, selection.masks)) {
    WritePng(ViewFile(folder / "paint", one.view), one.picture);
  }
  session.WriteMasks(folder / "masks", id, monitor);
}

void WriteTargets(const std::filesystem::path& folder, EditSession& session, TargetKind target,
                  Monitor& monitor) {
  const Pictures pictures = session.scene().pictures();
  const auto& all = pictures.all();
  const FloatArray after = session.refits().CurrentSh();
  // The refit's target in every view, then its result.
  const auto make = [&](size_t i) -> std::function<void()> {
    const bool aim = i < all.size();
    const UserPicture& shown = all[i % all.size()];
    if (i == 0) session.scene().renderer().SetSh(session.scene().original().sh);
    if (i == all.size()) session.scene().renderer().SetSh(after);
    const bool photo = aim && target == TargetKind::kPhoto;
    Image picture = pictures.Compose(shown, [&](const View& view) {
      Image drawn =
          photo
              ? session.scene().Picture(view)
              : session.scene().renderer().Render(session.scene().reconstruction().Posed(view)).rgb;
      return aim ? session.refits().Edited(view, std::move(drawn)) : drawn;
    });
    return [path = ViewFile(folder / (aim ? "targets" : "result"), shown.name),
            image = std::move(picture)] { WritePng(path, image); };
  };
  WriteOnAllCores(2 * all.size(), make, monitor);
}

Image8 ComparisonPicture(EditSession& session, Monitor& monitor) {
  const Pictures pictures = session.scene().pictures();
  const RegionSet& regions = session.store().regions();
  const FloatArray edited = session.refits().CurrentSh();
  std::vector<std::vector<Image8>> rows;
  for (const UserPicture* picture : pictures.Showing(ComparisonViews(session))) {
    monitor.ThrowIfCancelled();
    const auto draw = [&](std::span<const float> sh) {
      return pictures.Compose(*picture,
                              [&](const View& view) { return session.scene().Render(view, sh); });
    };
    const Image before = draw(session.scene().original().sh), after = draw(edited);
    const Mask mask = pictures.ComposeMask(*picture, [&](const View& view) {
      return MaskOf(regions, view, session.scene().reconstruction().Posed(view).camera);
    });
    rows.push_back({ToImage8(before), MaskOverlay(before, mask), ToImage8(after)});
  }
  const double shape = static_cast<double>(rows[0][0].width) / rows[0][0].height;
  return ContactSheet(rows, std::max(32, static_cast<int>(std::sqrt(kComparisonArea * shape))));
}

}  // namespace retint
