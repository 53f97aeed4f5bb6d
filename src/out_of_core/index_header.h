// SPDX-License-Identifier: BSD-3-Clause
// Internal to out_of_core: the first bytes of an index file.
#pragma once

#include <cstdint>

#include "out_of_core/splat_index.h"

namespace retint {

inline constexpr char kIndexMagic[8] = {'R', 'T', 'S', 'P', 'L', 'I', 'D', 'X'};

// Then the blocks' record numbers, then the table of blocks up to the end. Little-endian.
struct IndexHeader {
  char magic[8];
  uint32_t version;
  uint32_t header_bytes;
  // Of the splat file.
  uint64_t splat_bytes;
  int64_t splat_modified_ns;
  uint64_t splat_xxh64;  // 0: not known, of a copy that was not read
  uint64_t count;        // Gaussians
  uint64_t first_byte;   // of its records
  uint64_t record_bytes;
  // Of the index.
  uint64_t num_blocks;
  uint64_t table_offset;
  uint64_t table_xxh64;
  uint64_t header_xxh64;  // of the bytes before
};
static_assert(sizeof(IndexHeader) == 96);

}  // namespace retint
