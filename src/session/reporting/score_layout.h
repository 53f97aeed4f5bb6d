// SPDX-License-Identifier: BSD-3-Clause
// Internal to session: which file is measured against which.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "session/reporting/score.h"

namespace retint {

struct ScoredFile {
  std::string scene, view;
  std::filesystem::path truth, mask;  // no mask where pictures are measured
  bool painted = false;
};

// In the order of the report. Scenes without a folder of masks are left out with a warning.
std::vector<ScoredFile> FindScoredFiles(const ScoreRequest& request,
                                        std::vector<std::string>* warnings);

}  // namespace retint
