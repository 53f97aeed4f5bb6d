// SPDX-License-Identifier: BSD-3-Clause
// OpenUSD layers as text, "#usda 1.0".
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

#include "splat_io/usd_stage.h"

namespace retint {

// InputError of `path` with the line of the fault. `text` may be truncated anywhere.
UsdStage ReadUsda(std::string_view text, const std::filesystem::path& path);

// Visits the elements of an array. `elements` is the text of `path` between the array's brackets.
// Each element has numbers, and begins and ends at places in `elements`.
using UsdaElement = std::function<void(const double* numbers, size_t begin, size_t end)>;
void ForEachUsdaElement(std::string_view elements, size_t components,
                        const std::filesystem::path& path, const UsdaElement& each);

}  // namespace retint
