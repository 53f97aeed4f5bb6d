// SPDX-License-Identifier: BSD-3-Clause
#include "retint/version.h"

#include "kernels/backend.h"
#include "session/report.h"

namespace retint::cli {

std::string VersionText() {
  std::string text = "retint " + std::string(Version()) + "\nbackends: ";
  bool first = true;
  for (const std::string& name : AvailableBackends()) {
    text += (first ? "" : "; ") + name + " (" + CreateBackend(name)->Description() + ")";
    first = false;
  }
  return text + "\nlibraries: " + RETINT_LIBRARIES;
}

}  // namespace retint::cli
