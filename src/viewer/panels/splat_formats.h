// SPDX-License-Identifier: BSD-3-Clause
// The formats for exporting a splat, as a file dialog lists them.
#pragma once

#include <string>
#include <vector>

#include <QString>

#include "scene/gaussian_model.h"

namespace retint {

struct ExportFormat {
  QString extension;  // ".ply"
  QString filter;     // of a file dialog: "3DGS .ply, about 12 MB (*.ply)"
};
// Estimates sizes by writing a part of the Gaussians, which takes a moment.
std::vector<ExportFormat> ExportFormats(const GaussianModel& model);

// `path` with an extension: its own, otherwise that of `chosen`, one of ExportFormats(). Empty if
// its own is not a format; then `problem` says so.
QString NamedForExport(const QString& path, const QString& chosen,
                       const std::vector<ExportFormat>& formats, QString* problem);

}  // namespace retint
