// SPDX-License-Identifier: BSD-3-Clause
// gzip and Zstandard with a limit on the output, so that a small file cannot use up all memory.
#pragma once

#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

#include "base/memory.h"

namespace retint {

// The most bytes that a packed file of `bytes` may unpack to. Real scenes shrink to 1/2 or 1/4,
// scenes of equal Gaussians to about 1/100.
inline size_t MostUnpacked(size_t bytes) { return 65536 + 256 * bytes; }

// The first `wanted` bytes, or fewer, of a gzip stream, which may be truncated or damaged.
std::vector<char> GunzipHead(std::string_view packed, size_t wanted);

// Unpacks a whole gzip stream into `bytes`. Passes the first `header_bytes` to `limit`, which
// returns the most bytes to unpack in total. Calls `step` between blocks. If the limit is at most
// kUsualRatio times the packed size, unpacked bytes never move in memory. Throws a
// std::runtime_error with the fault: damaged or truncated data, more data than the limit, or bytes
// after the end.
inline constexpr size_t kUsualRatio = 8;
void Gunzip(std::string_view packed, size_t header_bytes,
            const std::function<size_t(std::string_view header)>& limit,
            const std::function<void(size_t done)>& step, UnsetVector<char>& bytes);
// Calls `step` between blocks with the number of bytes read.
std::vector<char> Gzip(std::string_view bytes, const std::function<void(size_t done)>& step);

// A Zstandard frame that unpacks to exactly `bytes` bytes; std::runtime_error otherwise.
std::vector<char> Unzstd(std::string_view packed, size_t bytes, const std::function<void()>& step);
std::vector<char> Zstd(std::string_view bytes);

}  // namespace retint
