// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/stage_files.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/checksum.h"
#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "saving/session_json.h"
#include "selecting/selection_files.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using json::Json;
using json::Node;

Json ReadJson(const fs::path& path, json::LineIndex* lines) {
  return json::ParseWithLines(ReadFile(path), path, lines);
}

template <typename Values>
std::string_view BytesOf(const Values& values) {
  return {reinterpret_cast<const char*>(values.data()),
          values.size() * sizeof(typename Values::value_type)};
}

uint64_t SumOf(const RegionFit& fit) {
  Xxh64Stream sum;
  sum.Add(BytesOf(fit.indices));
  sum.Add(BytesOf(fit.sh));
  return sum.Get();
}

// Calls `visit` with each array of which the rows of parts are kept, and the values of a row.
template <typename Model, typename Visit>
void VisitParts(Model& model, const Visit& visit) {
  visit(model.means, 3);
  visit(model.log_scales, 3);
  visit(model.opacity_logits, 1);
  visit(model.sh, static_cast<size_t>(model.NumShCoeffs()) * 3);
}

template <typename T>
std::vector<T> ReadValues(ByteReader& reader, size_t count, const char* what) {
  reader.Require(count, sizeof(T), what);
  std::vector<T> values(count);
  const std::string_view bytes = reader.ReadBytes(count * sizeof(T), what);
  if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

}  // namespace

void WriteSelected(const fs::path& folder, const SelectionCloud& cloud,
                   const std::vector<PaintedReport>& reports) {
  WriteCloud(folder / "cloud.ply", cloud);
  Json json = Json::array();
  for (const PaintedReport& report : reports) json.push_back(session_json::ReportJson(report));
  WriteFile(folder / "reports.json", json.dump());
}

void ReadSelected(const fs::path& folder, SelectionCloud* cloud,
                  std::vector<PaintedReport>* reports) {
  SelectionCloud points = ReadCloud(folder / "cloud.ply");
  for (const SelectionPoint& point : points.points) {
    if (!point.position.allFinite()) {
      throw InputError(folder / "cloud.ply", "holds a point that is not finite");
    }
  }
  json::LineIndex lines;
  const fs::path path = folder / "reports.json";
  const Json json = ReadJson(path, &lines);
  std::vector<PaintedReport> read;
  for (const Node& node : Node(json, path, "", &lines).List()) {
    read.push_back(session_json::ReadReport(node));
  }
  *cloud = std::move(points);
  *reports = std::move(read);
}

void WriteProjected(const fs::path& folder, const RegionSelection& selection, Monitor& monitor) {
  WriteMasks(folder / "masks", selection.masks, monitor);
  WriteShares(folder / "masks", selection.masks, selection.shares);
  WriteSelected(folder, selection.source.cloud, selection.source.reports);
}

void ReadProjected(const fs::path& folder, const EditSession& session, RegionSelection* selection) {
  RegionSelection read;
  for (auto& [id, mask] : ReadMasks(folder / "masks", session.scene().reconstruction())) {
    read.masks.emplace(session.scene().reconstruction().views.at(id).name, std::move(mask));
  }
  SharesOfMasks shares =
      ReadShares(folder / "masks", read.masks, session.scene().original().NumGaussians());
  if (shares.shares.empty()) throw InputError(folder, "its shares are missing or of other masks");
  read.shares = std::move(shares.shares);
  ReadSelected(folder, &read.source.cloud, &read.source.reports);
  *selection = std::move(read);
}

void WriteRefined(const fs::path& folder, const Refinement& refined) {
  const FinerGaussians& finer = refined.finer;
  std::string bytes(BytesOf(finer.parents));
  VisitParts(finer.model, [&](const auto& values, size_t row) {
    bytes += BytesOf(values).substr(finer.stayed * row * sizeof(float));
  });
  const RefineSummary& summary = refined.summary;
  const Json json = {{"gaussians", finer.parents.size()},
                     {"stayed", finer.stayed},
                     {"xxh64", HexText(Xxh64(bytes))},
                     {"summary",
                      {{"before", summary.before},
                       {"split", summary.split},
                       {"parts", summary.parts},
                       {"pixels", summary.pixels},
                       {"psnr_split", summary.psnr_split},
                       {"psnr", summary.psnr}}}};
  WriteFile(folder / "refined.json", json.dump());
  WriteFile(folder / "refined.bin", bytes);
}

Refinement ReadRefined(const fs::path& folder, const GaussianModel& model) {
  const fs::path path = folder / "refined.json", data = folder / "refined.bin";
  json::LineIndex lines;
  const Json json = ReadJson(path, &lines);
  const Node root(json, path, "", &lines);
  const std::string bytes = ReadFile(data);
  if (Xxh64(bytes) != root.At("xxh64").Hex()) throw InputError(data, "is damaged");
  ByteReader reader(bytes, data);
  const size_t count = root.At("gaussians").Unsigned();
  const size_t stayed = root.At("stayed").Unsigned(count);
  std::vector<int32_t> parents = ReadValues<int32_t>(reader, count, "parents");
  for (const int32_t parent : parents) {
    if (parent < 0 || static_cast<size_t>(parent) >= model.NumGaussians()) {
      throw InputError(data, "is of another splat");
    }
  }
  Refinement refined;
  refined.finer = CopyParents(model, std::move(parents), stayed);
  VisitParts(refined.finer.model, [&](auto& values, size_t row) {
    const auto parts = ReadValues<float>(reader, (count - stayed) * row, "parts");
    std::copy(parts.begin(), parts.end(),
              values.begin() + static_cast<std::ptrdiff_t>(stayed * row));
  });
  if (reader.Remaining() > 0) throw InputError(data, "is damaged");
  const Node from = root.At("summary");
  RefineSummary& summary = refined.summary;
  summary.before = from.At("before").Unsigned();
  summary.split = from.At("split").Unsigned();
  summary.parts = from.At("parts").Unsigned();
  summary.pixels = from.At("pixels").Number();
  summary.psnr_split = from.At("psnr_split").Number();
  summary.psnr = from.At("psnr").Number();
  return refined;
}

void WriteFit(const fs::path& folder, const RegionFit& fit) {
  Json json = {{"count", fit.indices.size()},
               {"xxh64", HexText(SumOf(fit))},
               {"summary", session_json::SummaryJson(fit.summary)}};
  WriteFile(folder / "fit.json", json.dump());
  AtomicFile file(folder / "fit.bin");
  file.Write(fit.indices.data(), fit.indices.size() * sizeof(int32_t));
  file.Write(fit.sh.data(), fit.sh.size() * sizeof(float));
  file.Commit();
}

RegionFit ReadFit(const fs::path& folder, const GaussianModel& model) {
  const fs::path path = folder / "fit.json";
  json::LineIndex lines;
  const Json json = ReadJson(path, &lines);
  const Node root(json, path, "", &lines);
  const size_t count = root.At("count").Unsigned(model.NumGaussians());
  const std::string bytes = ReadFile(folder / "fit.bin");
  ByteReader reader(bytes, folder / "fit.bin");
  RegionFit fit;
  fit.indices = ReadValues<int32_t>(reader, count, "indices");
  const auto sh = ReadValues<float>(reader, count * static_cast<size_t>(model.NumShCoeffs()) * 3,
                                    "coefficients");
  fit.sh.assign(sh.begin(), sh.end());
  if (reader.Remaining() > 0 || SumOf(fit) != root.At("xxh64").Hex()) {
    throw InputError(folder / "fit.bin", "is damaged");
  }
  fit.summary = session_json::ReadSummary(root.At("summary"));
  return fit;
}

}  // namespace retint
