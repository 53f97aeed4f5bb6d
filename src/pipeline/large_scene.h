// SPDX-License-Identifier: BSD-3-Clause
// A splat in a file that is larger than memory: sessions of the parts of it that a step needs. A
// part's views see it, bit for bit, as they see the whole (out_of_core/frustum.h).
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "base/input_guard.h"
#include "base/monitor.h"
#include "editing/edit_session.h"
#include "out_of_core/splat_index.h"
#include "pipeline/edit_memory.h"
#include "reporting/report.h"
#include "selecting/selection_files.h"

namespace retint {

struct LargeSceneOptions {
  MemoryLimits limits;
  std::filesystem::path index;  // empty: SplatIndex::PathFor()
  int most_views = 0;  // of those that see a selection, the ones that see it largest; 0: all
  std::optional<RefitOptions> refit;  // the fit that follows, if one does
};

// Whether the splat is of the format that can be opened in parts, and an edit of all of it would
// not fit beside caches of so many bytes. A file of another format, or one that cannot be read, is
// not.
bool IsTooLarge(const std::filesystem::path& splat, const MemoryLimits& limits, size_t cache_bytes);

// Opens the index at `path`, or builds it if there is none that fits, or with `force`. Building
// uses only memory that the limit leaves; `built` gets the reason for it. OptionError, one line
// with the --memory-mb that is enough, before memory is allocated.
SplatIndex OpenIndex(const PlyFile& splat, const std::filesystem::path& path,
                     const MemoryLimits& limits, SplatIndexOptions options, bool force,
                     Monitor& monitor, std::string* built);

class LargeScene {
 public:
  // Opens the workspace, and the index, which is built where it must be; then `index_built` says
  // why. InputError as OpenScene::Open(), and for a splat that is not a binary .ply. Stages
  // "index", "load".
  LargeScene(const std::filesystem::path& workspace, const std::filesystem::path& splat,
             const SessionOptions& options, const LargeSceneOptions& large, Monitor& monitor);
  const std::string& index_built() const { return index_built_; }
  const Workspace& workspace() const { return *workspace_; }
  Pictures pictures() const { return Pictures(*workspace_, options_.pixels); }
  const PlyFile& file() const { return *file_; }
  size_t NumGaussians() const { return static_cast<size_t>(file_->count()); }  // of the splat

  // Sessions of a part each. `before` is freed first, and its clock is passed on. OptionError, one
  // line with the limit that is enough, if a part does not fit into the limits.

  // The pictures of these names, to be looked at or painted on. InputError if they show nothing.
  std::unique_ptr<EditSession> Show(const std::vector<std::string>& pictures,
                                    std::unique_ptr<EditSession> before, Monitor& monitor);
  // These views. If they see nothing, some other Gaussians stand for it.
  std::unique_ptr<EditSession> Show(const std::vector<const View*>& views,
                                    std::unique_ptr<EditSession> before, Monitor& monitor);
  // The Gaussians from which the depth of these views is estimated.
  std::unique_ptr<EditSession> ForDepth(const std::vector<PosedCamera>& views,
                                        const SelectOptions& select,
                                        std::unique_ptr<EditSession> before, Monitor& monitor);
  // The views that see one of the selections, those that are painted, and `pictures`. The Gaussians
  // that the completion of their clouds needs are there too. InputError for a cloud without points.
  std::unique_ptr<EditSession> ForSelections(const std::vector<const SelectionSource*>& selections,
                                             const std::vector<std::string>& pictures,
                                             std::unique_ptr<EditSession> before, Monitor& monitor);
  // The selection of `masks`: the views whose masks have a selected pixel, and some of those with
  // an empty mask. These may see a Gaussian of `shares` above the threshold or, if no shares are
  // known, one that the former views may see. In a fit of all views the others would change no bit.
  std::unique_ptr<EditSession> ForMasks(const MaskFolder& masks, const SparseShares& shares,
                                        double active_threshold, Monitor& monitor);

  // To measure an edited splat, some views after the others (large_evaluation.h): How many of
  // `views`, from the first on, fit into memory together; at least one.
  size_t NumToCompare(std::span<const View* const> views) const;
  // These views, with room for a second set of coefficients.
  std::unique_ptr<EditSession> ToCompare(std::span<const View* const> views,
                                         std::unique_ptr<EditSession> before, Monitor& monitor);
  // The records that `selected` may see, ascending. OptionError, before memory is allocated, if
  // `bytes` each do not fit beside any of `views`. Else they count as in use from now on.
  std::vector<uint32_t> RecordsOf(const std::vector<const View*>& selected, size_t bytes,
                                  const std::vector<const View*>& views);
  // Memory in use now counts as in use beside the scenes opened later. Call it while none is open.
  void CountWhatIsHeld();

  // Writes the index of `copy`, a copy of the splat with other colors, beside it. The index will
  // belong beside `target`. False, and nothing is written, if another file than an index has that
  // name. RunError as SplatIndex::WriteFor().
  bool WriteIndexOf(const std::filesystem::path& copy, const std::filesystem::path& target) const;

  // Of the session that was opened last.
  const EditSize& size() const { return size_; }
  OutOfCoreReport Report() const { return report_; }

 private:
  struct Need {
    std::vector<const View*> views;
    std::vector<PosedCamera> cameras;  // besides
    std::optional<Eigen::AlignedBox3f> within;
    bool everything = false;
    bool or_any = false;     // of the blocks, where none of them is seen
    bool completes = false;  // a selection, over everything or within the box
    uint64_t active = 0;     // Gaussians to be fitted, about
  };
  // The memory of one selection beside the views that see it.
  void AddNeed(const SelectionSource& selection, Need* need) const;
  static Need ComparisonOf(std::span<const View* const> views);
  std::vector<uint32_t> BlocksOf(const Need& need) const;
  uint64_t VisibleTo(const PosedCamera& camera) const;  // Gaussians, at most
  EditSize SizeOf(const Need& need) const;
  // Including the memory in use; without caches.
  MemoryBytes BytesFor(const EditSize& size) const {
    return {base_bytes_ + HostBytesOf(size), DeviceBytesOf(size)};
  }
  // The limits that would be enough for it, and for so many more bytes on the host; it does not
  // fit.
  std::string EnoughFor(EditSize size, size_t more = 0) const;
  // How many of the views, largest first, fit with the rest of `need`.
  size_t ViewsThatFit(Need need, const std::vector<const View*>& largest_first) const;
  // An upper bound for the edit of an object in these views that is not known yet.
  Need EditOf(const Need& shown) const;
  // OptionError, which says what would do, where it does not fit; `or_else` is added to it.
  void CheckFits(const Need& need, const std::function<std::string()>& or_else = {}) const;
  // `need` and the views that see a selection, of which --most-views takes the first.
  std::unique_ptr<EditSession> OpenLargest(Need need, std::vector<const View*> largest_first,
                                           std::unique_ptr<EditSession> before, Monitor& monitor);
  std::unique_ptr<EditSession> Open(const Need& need, std::unique_ptr<EditSession> before,
                                    Monitor& monitor);
  std::vector<const View*> FacesOf(const std::vector<std::string>& pictures) const;
  // That may see a point of the cloud, those that see it largest first.
  std::vector<const View*> ViewsThatSee(const Eigen::AlignedBox3f& box) const;

  InputGuard inputs_;
  std::shared_ptr<const Workspace> workspace_;
  std::shared_ptr<const PlyFile> file_;
  std::unique_ptr<SplatIndex> index_;
  SessionOptions options_;
  LargeSceneOptions large_;
  std::shared_ptr<Backend> backend_;
  std::string index_built_;
  StageClock clock_;
  OutOfCoreReport report_;
  EditSize size_;
  size_t base_bytes_ = 0;                            // in memory before anything of the splat is
  mutable std::map<std::string, uint64_t> visible_;  // VisibleTo(), by the camera's bytes
};

}  // namespace retint
