// SPDX-License-Identifier: BSD-3-Clause
#include "session/selection_files.h"

#include <bit>
#include <cstdint>
#include <functional>
#include <string_view>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "session/checksum.h"
#include "session/staged_output.h"

namespace retint {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little-endian");

constexpr std::string_view kMagic = "RTSHARES";

std::filesystem::path SharesPath(const std::filesystem::path& folder) {
  return folder / "shares.bin";
}

uint64_t ChecksumOf(const std::map<std::string, Mask>& masks) {
  Xxh64Stream sum;
  for (const auto& [name, mask] : masks) {
    sum.Add(std::string_view(name.c_str(), name.size() + 1));
    sum.Add({reinterpret_cast<const char*>(mask.data.data()), mask.data.size()});
  }
  return sum.Get();
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
                 const std::vector<float>& shares) {
  AtomicFile file(SharesPath(folder));
  file.Write(kMagic);
  file.WriteValue<uint64_t>(shares.size());
  file.WriteValue<uint64_t>(ChecksumOf(masks));
  file.Write(shares.data(), shares.size() * sizeof(float));
  file.Commit();
}

SharesOfMasks ReadShares(const std::filesystem::path& folder,
                         const std::map<std::string, Mask>& masks, size_t num_gaussians) {
  const std::filesystem::path path = SharesPath(folder);
  if (!IsFile(path)) return {};
  const std::string bytes = ReadFile(path);
  ByteReader reader(bytes, path);
  if (reader.ReadBytes(kMagic.size(), "the signature") != kMagic) {
    throw InputError(path, "is not a file of shares");
  }
  const auto count = reader.Read<uint64_t>("the number of Gaussians");
  const auto checksum = reader.Read<uint64_t>("the checksum of the masks");
  const auto values = reader.ReadBytes(reader.Remaining(), "shares");
  if (values.size() / sizeof(float) != count || values.size() % sizeof(float) != 0) {
    throw InputError(path, "holds " + std::to_string(values.size()) + " bytes of shares, not " +
                               std::to_string(count) + " floats");
  }
  if (count != num_gaussians) {
    return {{},
            path.string() + " has shares of " + std::to_string(count) +
                " Gaussians and the splat has " + std::to_string(num_gaussians) +
                ": they are computed anew from the masks"};
  }
  if (checksum != ChecksumOf(masks)) {
    return {{},
            path.string() +
                " belongs to other masks than those in its folder: the shares are computed anew "
                "from the masks"};
  }
  SharesOfMasks result;
  result.shares.resize(num_gaussians);
  std::memcpy(result.shares.data(), values.data(), values.size());
  for (size_t g = 0; g < num_gaussians; ++g) {
    if (!(result.shares[g] >= 0 && result.shares[g] <= 1)) {
      throw InputError(path, "share of Gaussian " + std::to_string(g) + " is not in [0, 1]");
    }
  }
  return result;
}

}  // namespace retint
