// SPDX-License-Identifier: BSD-3-Clause
// The formats in which a splat can be exported, as the dialog that asks for a file lists them.
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
// A size is found by writing a part of the Gaussians, which takes a moment.
std::vector<ExportFormat> ExportFormats(const GaussianModel& model);

// `path` with an extension: its own, else that of `chosen`, of ExportFormats(). Empty where its
// own is of no format; `problem` says so.
QString NamedForExport(const QString& path, const QString& chosen,
                       const std::vector<ExportFormat>& formats, QString* problem);

}  // namespace retint
