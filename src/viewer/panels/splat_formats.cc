// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/splat_formats.h"

#include <algorithm>
#include <filesystem>

#include <QCoreApplication>
#include <QFileInfo>
#include <QLocale>
#include <QRegularExpression>

#include "base/temporary_folder.h"
#include "splat_io/splat_io.h"
#include "splat_io/streamed_sog.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr size_t kSampled = 4096;  // Gaussians

QString Tr(const char* text) { return QCoreApplication::translate("ExportFormats", text); }

// Samples the whole list, because its ends may differ.
GaussianModel Sample(const GaussianModel& model) {
  const size_t all = model.NumGaussians(), count = std::min(kSampled, all);
  GaussianModel sample;
  sample.Resize(count, model.sh_degree);
  const auto copy = [&](const FloatArray& from, FloatArray& to) {
    const size_t width = from.size() / all;
    for (size_t i = 0; i < count; ++i) {
      std::copy_n(from.data() + i * all / count * width, width, to.data() + i * width);
    }
  };
  copy(model.means, sample.means);
  copy(model.quats_wxyz, sample.quats_wxyz);
  copy(model.log_scales, sample.log_scales);
  copy(model.opacity_logits, sample.opacity_logits);
  copy(model.sh, sample.sh);
  return sample;
}

// In bytes; 0 if unknown.
double SizeOf(const GaussianModel& sample, const std::string& extension) {
  try {
    const TemporaryFolder folder;
    WriteSplat(folder.path() / ("a" + extension), sample);
    double bytes = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder.path())) {
      if (entry.is_regular_file()) bytes += double(entry.file_size());
    }
    return bytes;
  } catch (const std::exception&) {  // for example no room for the sample
    return 0;
  }
}

}  // namespace

std::vector<ExportFormat> ExportFormats(const GaussianModel& model) {
  const GaussianModel sample = Sample(model);
  const double scale = double(model.NumGaussians()) / double(sample.NumGaussians());
  std::vector<ExportFormat> formats;
  for (const SplatFormat& format : SplatFormats()) {
    if (!format.writable) continue;
    for (const std::string_view extension : format.extensions) {
      const bool is_levels = IsStreamedSog(fs::path(extension)) && IsStreamedSog(model);
      // Other formats are named by one of several files.
      if (!extension.starts_with('.') && !is_levels) continue;
      const double bytes = scale * SizeOf(sample, std::string(extension));
      const QString ending = QString::fromUtf8(extension.data(), qsizetype(extension.size()));
      const QString name = QString::fromUtf8(format.name.data(), qsizetype(format.name.size()));
      const QString size =
          bytes > 0
              ? Tr(", about %1")
                    .arg(QLocale().formattedDataSize(qint64(bytes), 1, QLocale::DataSizeSIFormat))
              : QString();
      if (is_levels) {
        formats.push_back({"/" + ending, QStringLiteral("%1 (%2)").arg(name, ending)});
        continue;
      }
      formats.push_back({ending, QStringLiteral("%1%2 (*%3)").arg(name, size, ending)});
    }
  }
  return formats;
}

QString NamedForExport(const QString& path, const QString& chosen,
                       const std::vector<ExportFormat>& formats, QString* problem) {
  QStringList endings;
  for (const ExportFormat& format : formats) {
    if (path.endsWith(format.extension, Qt::CaseInsensitive)) return path;
    endings << format.extension;
  }
  const QString suffix = QFileInfo(path).suffix();
  static const QRegularExpression kEnding("^[A-Za-z][A-Za-z0-9]*$");
  if (kEnding.match(suffix).hasMatch()) {  // "garden.2" has no extension
    *problem = Tr("Splats cannot be written as .%1. End the name in one of %2, or leave the ending "
                  "out.")
                   .arg(suffix, endings.join(", "));
    return {};
  }
  const auto found = std::ranges::find(formats, chosen, &ExportFormat::filter);
  return path + (found == formats.end() ? formats.front() : *found).extension;
}

}  // namespace retint
