// SPDX-License-Identifier: BSD-3-Clause
// gzip and Zstandard with a bound on the output, so that a small file cannot take all memory.
#pragma once

#include <cstddef>
#include <functional>
#include <string_view>
#include <vector>

#include "base/memory.h"

namespace retint {

// What a file of `bytes` may hold unpacked: real scenes shrink to a half or a fourth; scenes of
// equal Gaussians to some hundredth.
inline size_t MostUnpacked(size_t bytes) { return 65536 + 256 * bytes; }

// The first `wanted` bytes or fewer of a gzip stream that may be cut off or damaged.
std::vector<char> GunzipHead(std::string_view packed, size_t wanted);

// Unpacks a whole gzip stream into `bytes`. Once `header_bytes` are there, `limit` is told them and
// gives the most bytes that may come out in all; `step` is called between blocks. Where the limit
// is within kUsualRatio times what is packed, bytes that have come out stay in their place in
// memory. std::runtime_error that says what is wrong: damaged or truncated data, more than the
// limit, or bytes that follow.
inline constexpr size_t kUsualRatio = 8;
void Gunzip(std::string_view packed, size_t header_bytes,
            const std::function<size_t(std::string_view header)>& limit,
            const std::function<void(size_t done)>& step, UnsetVector<char>& bytes);
// `step` is called between blocks with the bytes that were taken in.
std::vector<char> Gzip(std::string_view bytes, const std::function<void(size_t done)>& step);

// A Zstandard frame that unpacks to exactly `bytes` bytes; std::runtime_error otherwise.
std::vector<char> Unzstd(std::string_view packed, size_t bytes, const std::function<void()>& step);
std::vector<char> Zstd(std::string_view bytes);

}  // namespace retint
