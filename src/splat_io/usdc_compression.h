// SPDX-License-Identifier: BSD-3-Clause
// How the crates of OpenUSD pack their tables: blocks of LZ4, and integers as differences.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace retint {

// Unpacks chunks of LZ4 (lz4.org, "LZ4 Block Format") behind a count of chunks. At most `most`
// bytes come out; std::runtime_error for damaged data, or more of it.
std::string UnpackCrateBytes(std::string_view packed, uint64_t most);
// Valid chunks, not smaller than `bytes`.
std::string PackCrateBytes(std::string_view bytes);

// `count` integers: the most frequent difference, two bits an integer for the size of its
// difference from the one before, then these. std::runtime_error for damaged data.
std::vector<int32_t> UnpackCrateIntegers(std::string_view packed, uint64_t count);
std::string PackCrateIntegers(std::span<const int32_t> values);

}  // namespace retint
