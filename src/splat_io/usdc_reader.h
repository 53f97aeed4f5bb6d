// SPDX-License-Identifier: BSD-3-Clause
// OpenUSD layers as crates, "PXR-USDC" (pxr/usd/sdf/crateFile.h of OpenUSD). A table lists sections
// with tokens, fields, paths and specs. Values of fields are inline or at an offset.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "splat_io/usd_stage.h"

namespace retint {

inline constexpr std::string_view kCrateMark = "PXR-USDC";

// Types of values, in bits 48 to 55 of a ValueRep.
enum class CrateType : uint8_t {
  kBool = 1,
  kInt = 3,
  kUInt = 4,
  kHalf = 7,
  kFloat = 8,
  kDouble = 9,
  kString = 10,
  kToken = 11,
  kMatrix4d = 15,
  kQuatd = 16,
  kQuatf = 17,
  kQuath = 18,
  kVec3d = 23,
  kVec3f = 24,
  kVec3h = 25,
  kTokenListOp = 32,
  kTokenVector = 41,
  kSpecifier = 42,
  kVariability = 44,
};
enum class CrateSpec : uint8_t { kAttribute = 1, kPrim = 6, kRoot = 7 };
inline constexpr uint64_t kCrateArray = uint64_t{1} << 63, kCrateInlined = uint64_t{1} << 62,
                          kCrateCompressed = uint64_t{1} << 61;
inline constexpr uint32_t kCrateEnd = ~uint32_t{0};  // end of a set of fields
inline constexpr size_t kCrateHeader = 88;           // mark, version, offset of the table, unused

// Reads versions 0.7 to 0.13. InputError of `path`. `bytes` may be truncated anywhere.
UsdStage ReadUsdc(std::string_view bytes, const std::filesystem::path& path);

}  // namespace retint
