// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/large_evaluation.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/option_name.h"
#include "base/parallel.h"
#include "editing/main_colors.h"
#include "recolor/quality_report.h"
#include "reporting/export.h"
#include "scene/mask_pixels.h"
#include "selection/mask_score.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kPieceBytes = uint64_t{8} << 20;  // of each file, read at a time
constexpr size_t kPartRecords = 2048;                // compared by one task

// Of two files, or of a part of both.
struct Difference {
  int64_t changed = 0;  // Gaussians
  bool same_means = true;
  ShRange before, after;
};

// As std::minmax_element finds it: of equal values the first least and the last largest.
ShRange RangeOf(std::span<const float> sh) {
  if (sh.empty()) return {};
  const auto [low, high] = std::minmax_element(sh.begin(), sh.end());
  return {*low, *high};
}

void Widen(ShRange* range, const ShRange& by) {
  if (by.min < range->min) range->min = by.min;
  if (!(by.max < range->max)) range->max = by.max;
}

Difference Compare(const GaussianModel& before, const GaussianModel& after) {
  Difference difference;
  difference.same_means = before.means == after.means;
  const size_t block = static_cast<size_t>(before.NumShCoeffs()) * 3;
  for (size_t g = 0; g < before.NumGaussians(); ++g) {
    difference.changed +=
        std::memcmp(&before.sh[g * block], &after.sh[g * block], block * sizeof(float)) != 0;
  }
  difference.before = RangeOf(before.sh);
  difference.after = RangeOf(after.sh);
  return difference;
}

// One pass over both, a piece of each at a time.
Difference CompareFiles(const PlyFile& before, const PlyFile& after, Monitor& monitor) {
  CheckSameShape({before.path(), static_cast<size_t>(before.count()), before.sh_degree()},
                 {after.path(), static_cast<size_t>(after.count()), after.sh_degree()});
  const uint64_t strides[] = {before.record_bytes(), after.record_bytes()};
  const PlyFile* const files[] = {&before, &after};
  const uint64_t at_once = std::max<uint64_t>(1, kPieceBytes / std::max(strides[0], strides[1]));
  std::vector<char> bytes[2];
  Difference all;
  for (uint64_t first = 0; first < before.count(); first += at_once) {
    monitor.Step("compare", static_cast<double>(first), static_cast<double>(before.count()));
    const auto count = static_cast<size_t>(std::min(at_once, before.count() - first));
    for (size_t i = 0; i < 2; ++i) {
      bytes[i].resize(count * strides[i]);
      files[i]->ReadBytes(files[i]->first_byte() + first * strides[i], bytes[i].data(),
                          bytes[i].size());
    }
    std::vector<Difference> parts((count + kPartRecords - 1) / kPartRecords);
    ParallelTasks(static_cast<int64_t>(parts.size()), [&](int64_t task) {
      const size_t begin = static_cast<size_t>(task) * kPartRecords;
      const size_t some = std::min(kPartRecords, count - begin);
      const auto parse = [&](size_t i) {
        return files[i]->Parse(bytes[i].data() + begin * strides[i], first + begin, some);
      };
      parts[static_cast<size_t>(task)] = Compare(parse(0), parse(1));
    });
    for (size_t i = 0; i < parts.size(); ++i) {
      if (!parts[i].same_means) FailOfOtherMeans(before.path(), after.path());
      all.changed += parts[i].changed;
      if (first == 0 && i == 0) {
        all.before = parts[i].before;
        all.after = parts[i].after;
      }
      Widen(&all.before, parts[i].before);
      Widen(&all.after, parts[i].after);
    }
  }
  before.CheckUnchanged();
  after.CheckUnchanged();
  return all;
}

// The edit by one folder of masks.
struct Side {
  MaskFolder* folder;
  std::map<std::string, Mask> masks;  // of the views of the part
  std::vector<ViewErrors> train, heldout;

  bool Has(const std::string& picture) const {
    return folder->masks.contains(picture) ||
           std::binary_search(folder->empty.begin(), folder->empty.end(), picture);
  }
};

class Evaluator {
 public:
  Evaluator(LargeScene& large, LargeEvaluation job, Monitor& monitor)
      : large_(large),
        job_(std::move(job)),
        monitor_(monitor),
        after_(job_.after),
        pictures_(large.pictures()) {
    sides_.push_back({&job_.masks, {}, {}, {}});
    if (job_.true_masks) sides_.push_back({&*job_.true_masks, {}, {}, {}});
  }

  RunReport Run() {
    job_.edit.Check();
    for (const ColorOperation& op : job_.edit.operations) {
      CheckOption(!op.picture, "an edit by pictures is not evaluated in parts: give " +
                                   OptionName("out_of_core", "off") +
                                   ", or the edit as operations");
    }
    large_.CountWhatIsHeld();
    ListViews();
    const Difference difference = CompareFiles(large_.file(), after_, monitor_);
    MeasureColors();
    for (std::span<const View* const> left = views_; !left.empty();) {
      const size_t count = large_.NumToCompare(left);
      EvaluatePart(left.first(count));
      left = left.subspan(count);
    }
    after_.CheckUnchanged();
    return Report(difference);
  }

 private:
  // Those with a mask, and the Gaussians that may be inside one.
  void ListViews() {
    std::vector<const View*> selected;
    for (const View* view : large_.workspace().reconstruction.ViewsByName()) {
      const std::string& picture = pictures_.Showing({view}).front()->name;
      size_t masks = 0;
      for (const Side& side : sides_) masks += side.Has(picture) ? 1 : 0;
      if (masks > 0) views_.push_back(view);
      progress_.total += masks;
      if (job_.masks.masks.contains(picture)) selected.push_back(view);
    }
    followed_ = large_.RecordsOf(selected, 2 * sizeof(double), views_);
    sums_.resize(2 * followed_.size());
  }

  // Empty if it has no mask, or none with a selected pixel.
  Mask MaskOf(const View& view) const {
    const UserPicture& picture = *pictures_.Showing({&view}).front();
    const auto found = job_.masks.masks.find(picture.name);
    if (found == job_.masks.masks.end()) return {};
    return picture.photo ? pictures_.ToView(picture, view, found->second) : found->second;
  }

  // The edit's measurements of the selection, from the views that a session would look at.
  void MeasureColors() {
    if (job_.edit.NeedsMainColor()) {
      std::vector<const View*> shown;
      for (const View* view : views_) {
        if (IsMeasured(MaskOf(*view))) shown.push_back(view);
      }
      std::vector<float> pixels;
      for (const size_t i : ViewsMeasuredOf(shown.size())) {
        Open(std::span(&shown[i], 1));
        const PosedCamera posed = session_->scene().reconstruction().Posed(*shown[i]);
        const std::vector<float> more =
            PixelsInside(posed, MaskOf(*shown[i]), session_->scene().renderer());
        pixels.insert(pixels.end(), more.begin(), more.end());
      }
      job_.edit = WithMainColors(job_.edit, pixels);
    }
    edit_ = job_.edit.WithStrength(job_.strength);
  }

  void Open(std::span<const View* const> views) {
    session_ = large_.ToCompare(views, std::move(session_), monitor_);
    if (job_.opened) std::exchange(job_.opened, nullptr)(*session_);
  }

  void EvaluatePart(std::span<const View* const> views) {
    Open(views);
    OpenScene& scene = session_->scene();
    for (Side& side : sides_)
      side.masks = std::move(*side.folder).OfViews(pictures_, scene.views());
    AddCoverage();
    const auto targets_of = [&](const Side& side, const std::vector<const View*>& some) {
      return RenderTargets(scene.reconstruction(), side.masks, some);
    };
    AddShares(targets_of(sides_[0], scene.train_views()));
    std::vector<RefitTarget> targets;
    std::vector<std::vector<ViewErrors>*> to;  // [targets]
    for (Side& side : sides_) {
      for (const bool heldout : {false, true}) {
        for (RefitTarget& target :
             targets_of(side, heldout ? scene.heldout_views() : scene.train_views())) {
          const View& view = scene.workspace().RequireView(target.name);
          if (job_.target == TargetKind::kPhoto) {
            target.photo = [&scene, &view] {
              return std::make_shared<const Image>(scene.Picture(view));
            };
          }
          targets.push_back(std::move(target));
          to.push_back(heldout ? &side.heldout : &side.train);
        }
      }
    }
    const FloatArray after = after_.Read(scene.part()->records, monitor_).sh;
    after_.CheckUnchanged();
    const std::vector<ViewErrors> errors = MeasureErrors(
        scene.renderer(), scene.original().sh, after, targets, edit_, &progress_, monitor_);
    for (size_t t = 0; t < errors.size(); ++t) to[t]->push_back(errors[t]);
  }

  void AddCoverage() {
    for (const auto& [name, mask] : sides_[0].masks) {
      coverages_.push_back(FractionInside(mask));
      if (sides_.size() < 2) continue;
      const auto truth = sides_[1].masks.find(name);
      if (truth == sides_[1].masks.end()) continue;
      const std::optional<double> iou = Iou(mask, truth->second);
      if (!iou) continue;
      iou_ += *iou;
      ++iou_views_;
    }
  }

  // Goes on with the sums of the Gaussians that are followed: those of others are not asked for.
  void AddShares(const std::vector<RefitTarget>& targets) {
    const std::vector<uint32_t>& records = session_->scene().part()->records;
    std::vector<double> sums(2 * records.size());
    const auto for_followed = [&](const auto& copy) {
      for (size_t i = 0, f = 0; i < records.size() && f < followed_.size();) {
        if (records[i] < followed_[f]) {
          ++i;
        } else if (followed_[f] < records[i]) {
          ++f;
        } else {
          copy(&sums[2 * i++], &sums_[2 * f++]);
        }
      }
    };
    for_followed([](double* here, const double* all) { std::copy_n(all, 2, here); });
    AddMaskSums(session_->scene().renderer(), targets, monitor_, &sums);
    for_followed([](const double* here, double* all) { std::copy_n(here, 2, all); });
  }

  RunReport Report(const Difference& difference) {
    RunReport report = MakeReport(*session_);
    report.edit = edit_;
    report.refit.solver = "external";
    report.refit.changed_gaussians = difference.changed;
    for (size_t f = 0; f < followed_.size(); ++f) {
      report.refit.active_gaussians +=
          ShareOf(&sums_[2 * f]) > RefitOptions{}.active_threshold ? 1 : 0;
    }
    for (const double coverage : coverages_) {
      report.mask_views += coverage > 0 ? 1 : 0;
      report.mean_coverage += coverage / static_cast<double>(coverages_.size());
    }
    const auto quality_of = [&](const Side& side) {
      QualityReport quality = ReportOn(side.train, side.heldout);
      quality.sh_before = difference.before;
      quality.sh_after = difference.after;
      return quality;
    };
    report.quality = quality_of(sides_[0]);
    if (sides_.size() > 1) {
      report.true_masks.emplace();
      report.true_masks->mask_iou = iou_views_ > 0 ? iou_ / iou_views_ : 0;
      report.true_masks->quality = quality_of(sides_[1]);
    }
    report.out_of_core = large_.Report();
    report.out_of_core->views = static_cast<int>(views_.size());
    return report;
  }

  LargeScene& large_;
  LargeEvaluation job_;
  Monitor& monitor_;
  const PlyFile after_;
  const Pictures pictures_;
  std::vector<Side> sides_;         // the masks; the true ones
  std::vector<const View*> views_;  // with a mask, by name
  EvaluationProgress progress_;
  ColorEdit edit_;                  // with its colors, at its strength
  std::vector<uint32_t> followed_;  // records that may lie inside a mask, ascending
  std::vector<double> sums_;        // [followed, 2] of AddMaskSums()
  std::vector<double> coverages_;   // of the masks so far
  double iou_ = 0;
  int iou_views_ = 0;
  std::unique_ptr<EditSession> session_;
};

}  // namespace

void CheckSameShape(const SplatShape& before, const SplatShape& after) {
  if (after.count == before.count && after.sh_degree == before.sh_degree) return;
  throw InputError(after.path, std::to_string(after.count) + " Gaussians of SH degree " +
                                   std::to_string(after.sh_degree) + ", but " +
                                   before.path.string() + " has " + std::to_string(before.count) +
                                   " of degree " + std::to_string(before.sh_degree));
}

void FailOfOtherMeans(const fs::path& before, const fs::path& after) {
  throw InputError(after, "its Gaussians are not those of " + before.string() +
                              ": the means differ or are in another order");
}

RunReport EvaluateInParts(LargeScene& large, LargeEvaluation evaluation, Monitor& monitor) {
  return Evaluator(large, std::move(evaluation), monitor).Run();
}

}  // namespace retint
