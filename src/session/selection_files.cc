// SPDX-License-Identifier: BSD-3-Clause
#include "session/selection_files.h"

#include <bit>
#include <cstdint>
#include <functional>
#include <string_view>
#include <utility>

#include "base/checksum.h"
#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "session/staged_output.h"

namespace retint {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little-endian");

constexpr std::string_view kShares = "RTSHARES", kConfidence = "RTCONFID";

std::filesystem::path SharesPath(const std::filesystem::path& folder) {
  return folder / "shares.bin";
}

std::filesystem::path ConfidencePath(const std::filesystem::path& folder) {
  return folder / "confidence.bin";
}

uint64_t ChecksumOf(const std::map<std::string, Mask>& masks) {
  Xxh64Stream sum;
  for (const auto& [name, mask] : masks) {
    sum.Add(std::string_view(name.c_str(), name.size() + 1));
    sum.Add({reinterpret_cast<const char*>(mask.data.data()), mask.data.size()});
  }
  return sum.Get();
}

void WriteValues(const std::filesystem::path& path, std::string_view magic, uint64_t checksum,
                 const std::vector<float>& values) {
  AtomicFile file(path);
  file.Write(magic);
  file.WriteValue<uint64_t>(values.size());
  file.WriteValue<uint64_t>(checksum);
  file.Write(values.data(), values.size() * sizeof(float));
  file.Commit();
}

// A number in [0, 1] of every Gaussian; `what` names one in messages.
struct Values {
  std::vector<float> values;  // empty where they do not fit
  std::string why_not;
};

Values ReadValues(const std::filesystem::path& path, std::string_view magic,
                  const std::string& what, uint64_t masks_checksum, size_t num_gaussians) {
  const std::string bytes = ReadFile(path);
  ByteReader reader(bytes, path);
  if (reader.ReadBytes(magic.size(), "the signature") != magic) {
    throw InputError(path, "is not a file of " + what + "s");
  }
  const auto count = reader.Read<uint64_t>("the number of Gaussians");
  const auto checksum = reader.Read<uint64_t>("the checksum of the masks");
  const auto data = reader.ReadBytes(reader.Remaining(), what + "s");
  if (data.size() / sizeof(float) != count || data.size() % sizeof(float) != 0) {
    throw InputError(path, "holds " + std::to_string(data.size()) + " bytes of " + what +
                               "s, not " + std::to_string(count) + " floats");
  }
  if (count != num_gaussians) {
    return {{},
            path.string() + " has " + what + "s of " + std::to_string(count) +
                " Gaussians and the splat has " + std::to_string(num_gaussians)};
  }
  if (checksum != masks_checksum) {
    return {{}, path.string() + " belongs to other masks than those in its folder"};
  }
  Values result;
  result.values.resize(num_gaussians);
  std::memcpy(result.values.data(), data.data(), data.size());
  for (size_t g = 0; g < num_gaussians; ++g) {
    if (!(result.values[g] >= 0 && result.values[g] <= 1)) {
      throw InputError(path, what + " of Gaussian " + std::to_string(g) + " is not in [0, 1]");
    }
  }
  return result;
}

}  // namespace

void WriteMasks(const std::filesystem::path& folder, const std::map<std::string, Mask>& masks,
                Monitor& monitor) {
  auto next = masks.begin();
  const auto make = [&](size_t) -> std::function<void()> {
    const auto& [name, mask] = *next++;
    return [path = ViewFile(folder, name), &mask = mask] { WritePng(path, mask); };
  };
  WriteOnAllCores(masks.size(), make, monitor);
}

void WriteShares(const std::filesystem::path& folder, const std::map<std::string, Mask>& masks,
                 const std::vector<float>& shares, const std::vector<float>& confidence) {
  const uint64_t checksum = ChecksumOf(masks);
  WriteValues(SharesPath(folder), kShares, checksum, shares);
  if (!confidence.empty()) {
    WriteValues(ConfidencePath(folder), kConfidence, checksum, confidence);
  }
}

SharesOfMasks ReadShares(const std::filesystem::path& folder,
                         const std::map<std::string, Mask>& masks, size_t num_gaussians) {
  if (!IsFile(SharesPath(folder))) return {};
  const uint64_t checksum = ChecksumOf(masks);
  Values shares = ReadValues(SharesPath(folder), kShares, "share", checksum, num_gaussians);
  SharesOfMasks result;
  if (!shares.why_not.empty()) {
    result.why_not = shares.why_not + ": the shares are computed anew from the masks";
    return result;
  }
  result.shares = std::move(shares.values);
  if (IsFile(ConfidencePath(folder))) {
    // One that belongs to other masks is left over from them, and says nothing of these.
    result.confidence =
        ReadValues(ConfidencePath(folder), kConfidence, "confidence value", checksum, num_gaussians)
            .values;
  }
  return result;
}

}  // namespace retint
