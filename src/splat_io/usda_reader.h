// SPDX-License-Identifier: BSD-3-Clause
// OpenUSD layers as text, "#usda 1.0".
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

#include "splat_io/usd_stage.h"

namespace retint {

// InputError of `path` with the line of the fault. `text` may be cut off anywhere.
UsdStage ReadUsda(std::string_view text, const std::filesystem::path& path);

// The elements of an array, `elements` being what stands between its brackets in the text of
// `path`: each one's numbers and where in `elements` they begin and end.
using UsdaElement = std::function<void(const double* numbers, size_t begin, size_t end)>;
void ForEachUsdaElement(std::string_view elements, size_t components,
                        const std::filesystem::path& path, const UsdaElement& each);

}  // namespace retint
