// SPDX-License-Identifier: BSD-3-Clause
// How OpenUSD crates pack their tables: blocks of LZ4, and integers as differences.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace retint {

// Unpacks chunks of LZ4 (lz4.org, "LZ4 Block Format") after a count of chunks. std::runtime_error
// for damaged data, or if more than `most` bytes come out.
std::string UnpackCrateBytes(std::string_view packed, uint64_t most);
// Stores `bytes` in valid chunks, without making them smaller.
std::string PackCrateBytes(std::string_view bytes);

// `count` integers. Stored are the most frequent difference, two bits per integer for the size of
// its difference from its predecessor, then the differences. std::runtime_error for damaged data.
std::vector<int32_t> UnpackCrateIntegers(std::string_view packed, uint64_t count);
std::string PackCrateIntegers(std::span<const int32_t> values);

}  // namespace retint
