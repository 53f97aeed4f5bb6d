// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/selection_files.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <set>
#include <string_view>
#include <utility>

#include "base/checksum.h"
#include "base/error.h"
#include "base/files.h"
#include "base/input_file.h"
#include "base/option_name.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "scene/image_checks.h"

namespace retint {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little-endian");

constexpr std::string_view kShares = "RTSHARES", kConfidence = "RTCONFID";
constexpr size_t kValuesAtOnce = size_t{1} << 18;  // of a file

std::filesystem::path SharesPath(const std::filesystem::path& folder) {
  return folder / "shares.bin";
}

std::filesystem::path ConfidencePath(const std::filesystem::path& folder) {
  return folder / "confidence.bin";
}

// Of masks that come in ascending order of their names.
class MasksChecksum {
 public:
  void Add(const std::string& name, const Mask& mask) {
    sum_.Add(std::string_view(name.c_str(), name.size() + 1));
    sum_.Add({reinterpret_cast<const char*>(mask.data.data()), mask.data.size()});
  }
  uint64_t Get() const { return sum_.Get(); }

 private:
  Xxh64Stream sum_;
};

uint64_t ChecksumOf(const std::map<std::string, Mask>& masks) {
  MasksChecksum sum;
  for (const auto& [name, mask] : masks) sum.Add(name, mask);
  return sum.Get();
}

// `values` of every Gaussian or, if there is a part, of its records; `other` for the rest.
void WriteValues(const std::filesystem::path& path, std::string_view magic, uint64_t checksum,
                 const std::vector<float>& values, const ScenePart* part, float other) {
  const size_t count = part ? static_cast<size_t>(part->file->count()) : values.size();
  AtomicFile file(path);
  file.Write(magic);
  file.WriteValue<uint64_t>(count);
  file.WriteValue<uint64_t>(checksum);
  if (!part) file.Write(values.data(), values.size() * sizeof(float));
  std::vector<float> some;
  for (size_t first = 0, next = 0; part && first < count; first += some.size()) {
    some.assign(std::min(kValuesAtOnce, count - first), other);
    for (; next < values.size() && part->records[next] < first + some.size(); ++next) {
      some[part->records[next] - first] = values[next];
    }
    file.Write(some.data(), some.size() * sizeof(float));
  }
  file.Commit();
}

// Reads a number in [0, 1] of every Gaussian, `what` in messages, and hands some at a time to
// `take`, `first` the first one's Gaussian. Why the file does not fit; then nothing was taken.
std::string ReadValues(
    const std::filesystem::path& path, std::string_view magic, const std::string& what,
    uint64_t masks_checksum, size_t num_gaussians,
    const std::function<void(size_t first, std::span<const float> values)>& take) {
  const InputFile file(path);
  std::string head(magic.size() + 2 * sizeof(uint64_t), '\0');
  head.resize(std::min<uint64_t>(head.size(), file.size()));
  file.ReadAt(0, head.data(), head.size());
  ByteReader reader(head, path);
  if (reader.ReadBytes(magic.size(), "the signature") != magic) {
    throw InputError(path, "is not a file of " + what + "s");
  }
  const auto count = reader.Read<uint64_t>("the number of Gaussians");
  const auto checksum = reader.Read<uint64_t>("the checksum of the masks");
  const uint64_t bytes = file.size() - head.size();
  if (bytes / sizeof(float) != count || bytes % sizeof(float) != 0) {
    throw InputError(path, "holds " + std::to_string(bytes) + " bytes of " + what + "s, not " +
                               std::to_string(count) + " floats");
  }
  if (count != num_gaussians) {
    return path.string() + " has " + what + "s of " + std::to_string(count) +
           " Gaussians and the splat has " + std::to_string(num_gaussians);
  }
  if (checksum != masks_checksum) {
    return path.string() + " belongs to other masks than those in its folder";
  }
  std::vector<float> values;
  for (size_t first = 0; first < num_gaussians; first += values.size()) {
    values.resize(std::min(kValuesAtOnce, num_gaussians - first));
    file.ReadAt(head.size() + first * sizeof(float), values.data(), values.size() * sizeof(float));
    for (size_t i = 0; i < values.size(); ++i) {
      if (values[i] >= 0 && values[i] <= 1) continue;
      throw InputError(path,
                       what + " of Gaussian " + std::to_string(first + i) + " is not in [0, 1]");
    }
    take(first, values);
  }
  return "";
}

// The reason of ReadValues() with its consequence.
std::string WhyNot(const std::string& reason) {
  return reason.empty() ? "" : reason + ": the shares are computed anew from the masks";
}

}  // namespace

void WriteMasks(const std::filesystem::path& folder, const std::map<std::string, Mask>& masks,
                Monitor& monitor, MaskNames names) {
  std::set<std::filesystem::path> files;
  for (const auto& [name, mask] : masks) {
    CheckOption(files.insert(MaskFile(folder, name, names)).second,
                "two masks would be called " + MaskFile("", name, names).string() + ": write " +
                    OptionName("mask_names", kMaskNames[0]));
  }
  auto next = masks.begin();
  const auto make = [&](size_t) -> std::function<void()> {
    const auto& [name, mask] = *next++;
    return [path = MaskFile(folder, name, names), &mask = mask] { WritePng(path, mask); };
  };
  WriteOnAllCores(masks.size(), make, monitor);
}

MaskFolder ReadMaskFolder(const std::filesystem::path& folder, bool invert,
                          const Pictures& pictures) {
  MaskFolder result;
  MasksChecksum sum;
  pictures.ReadMasks(folder, invert, [&](const UserPicture& picture, Mask mask) {
    sum.Add(picture.name, mask);
    if (AnySet(mask)) {
      result.masks.emplace(picture.name, std::move(mask));
    } else {
      result.empty.push_back(picture.name);
    }
  });
  result.checksum = sum.Get();
  return result;
}

std::map<std::string, Mask> MaskFolder::OfViews(const Pictures& pictures,
                                                const std::vector<const View*>& views) && {
  std::map<std::string, Mask> result;
  for (const View* view : views) {
    const UserPicture& picture = *pictures.Showing({view}).front();
    const auto found = masks.find(picture.name);
    if (found != masks.end()) {
      result.emplace(view->name, picture.photo ? pictures.ToView(picture, *view, found->second)
                                               : std::move(found->second));
    } else if (std::binary_search(empty.begin(), empty.end(), picture.name)) {
      const Camera& camera = pictures.CameraOf(*view);
      result.emplace(view->name, Mask(camera.width, camera.height));
    }
  }
  return result;
}

void WriteShares(const std::filesystem::path& folder, const std::map<std::string, Mask>& masks,
                 const std::vector<float>& shares, const std::vector<float>& confidence,
                 const ScenePart* part) {
  const uint64_t checksum = ChecksumOf(masks);
  WriteValues(SharesPath(folder), kShares, checksum, shares, part, 0);
  if (!confidence.empty()) {
    WriteValues(ConfidencePath(folder), kConfidence, checksum, confidence, part, 1);
  }
}

SharesOfMasks ReadShares(const std::filesystem::path& folder,
                         const std::map<std::string, Mask>& masks, size_t num_gaussians) {
  if (!IsFile(SharesPath(folder))) return {};
  return ReadShares(folder, ChecksumOf(masks), num_gaussians);
}

SharesOfMasks ReadShares(const std::filesystem::path& folder, uint64_t checksum,
                         size_t num_gaussians) {
  SharesOfMasks result;
  if (!IsFile(SharesPath(folder))) return result;
  const auto append_to = [](std::vector<float>* all) {
    return [all](size_t, std::span<const float> values) {
      all->insert(all->end(), values.begin(), values.end());
    };
  };
  result.why_not = WhyNot(ReadValues(SharesPath(folder), kShares, "share", checksum, num_gaussians,
                                     append_to(&result.shares)));
  if (result.why_not.empty() && IsFile(ConfidencePath(folder))) {
    // One that belongs to other masks is left over from them, and says nothing of these.
    ReadValues(ConfidencePath(folder), kConfidence, "confidence value", checksum, num_gaussians,
               append_to(&result.confidence));
  }
  return result;
}

SparseShares ReadSparseShares(const std::filesystem::path& folder, uint64_t checksum,
                              size_t num_gaussians) {
  SparseShares result;
  if (!IsFile(SharesPath(folder))) return result;
  const auto take = [&](size_t first, std::span<const float> values) {
    for (size_t i = 0; i < values.size(); ++i) {
      if (values[i] == 0) continue;
      result.gaussians.push_back(static_cast<uint32_t>(first + i));
      result.shares.push_back(values[i]);
    }
  };
  result.why_not =
      WhyNot(ReadValues(SharesPath(folder), kShares, "share", checksum, num_gaussians, take));
  result.known = result.why_not.empty();
  return result;
}

std::vector<float> SparseShares::Of(std::span<const uint32_t> records) const {
  std::vector<float> result(records.size(), 0.0F);
  size_t at = 0;
  for (size_t i = 0; i < records.size(); ++i) {
    while (at < gaussians.size() && gaussians[at] < records[i]) ++at;
    if (at < gaussians.size() && gaussians[at] == records[i]) result[i] = shares[at];
  }
  return result;
}

std::vector<uint32_t> SparseShares::Above(double threshold) const {
  std::vector<uint32_t> result;
  for (size_t i = 0; i < gaussians.size(); ++i) {
    if (static_cast<double>(shares[i]) > threshold) result.push_back(gaussians[i]);
  }
  return result;
}

}  // namespace retint
