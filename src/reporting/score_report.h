// SPDX-License-Identifier: BSD-3-Clause
// Views' scores, summed up.
#pragma once

#include <vector>

#include "reporting/score.h"

namespace retint {

std::vector<ScoreGroup> GroupScores(const ScoreRequest& request,
                                    const std::vector<ViewScore>& views);

}  // namespace retint
