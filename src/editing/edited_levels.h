// SPDX-License-Identifier: BSD-3-Clause
// The edit of a session in every level of detail of its splat (splat_io/streamed_sog.h).
#pragma once

#include <vector>

#include "editing/edit_session.h"

namespace retint {

// The finest level with the session's colors, then the others. Each of these is a scene of its own
// with the masks of the session's regions: which of its Gaussians they select follows from the
// masks, and they are fitted if the session's are. Of a splat with its original colors only the
// finest. InputError if a level cannot be read. Stages: "load", and RefitService::Refit()'s.
std::vector<GaussianModel> EditedLevels(const EditSession& session, Monitor& monitor);

}  // namespace retint
