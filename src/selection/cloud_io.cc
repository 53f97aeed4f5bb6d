// SPDX-License-Identifier: BSD-3-Clause
// Clouds as .ply. The reader accepts any element and property, and uses those that it
// knows.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "base/error.h"
#include "base/files.h"
#include "base/ply_body.h"
#include "base/ply_header.h"
#include "selection/neighbors.h"
#include "selection/selection_cloud.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// A view's name may hold any byte, but a comment is one line: control characters and '%' become
// %XX.
std::string EscapeName(const std::string& name) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string out;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f && c != '%') {
      out += c;
    } else {
      out += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  return out;
}

std::string UnescapeName(std::string_view text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(text.data() + i + 1, text.data() + i + 3, byte, 16).ptr ==
            text.data() + i + 3) {
      out += static_cast<char>(byte);
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

// The names of painted views in the header's comments.
std::vector<std::string> SourcesOf(const PlyHeader& header) {
  constexpr std::string_view kSource = "comment source ";
  std::vector<std::string> sources;
  for (const std::string& comment : header.comments) {
    if (!comment.starts_with(kSource)) continue;
    sources.push_back(UnescapeName(std::string_view(comment).substr(kSource.size())));
  }
  return sources;
}

// The values of a point, by property.
struct Record {
  double x = 0, y = 0, z = 0, nx = 0, ny = 0, nz = 0, red = 0, green = 0, blue = 0;
  double footprint = 0, confidence = 1, coverage = 1, source = 0, px = 0, py = 0;
};

struct Field {
  std::string_view name;
  double Record::*member;
  PlyType type;  // type in the file
};

constexpr Field kFields[] = {
    {"x", &Record::x, PlyType::kFloat},
    {"y", &Record::y, PlyType::kFloat},
    {"z", &Record::z, PlyType::kFloat},
    {"nx", &Record::nx, PlyType::kFloat},
    {"ny", &Record::ny, PlyType::kFloat},
    {"nz", &Record::nz, PlyType::kFloat},
    {"red", &Record::red, PlyType::kUint8},
    {"green", &Record::green, PlyType::kUint8},
    {"blue", &Record::blue, PlyType::kUint8},
    {"footprint", &Record::footprint, PlyType::kFloat},
    {"confidence", &Record::confidence, PlyType::kFloat},
    {"coverage", &Record::coverage, PlyType::kFloat},
    {"source", &Record::source, PlyType::kUint16},
    {"px", &Record::px, PlyType::kUint16},
    {"py", &Record::py, PlyType::kUint16},
};

SelectionPoint ToPoint(const Record& record, uint64_t idx, bool own, size_t num_sources,
                       const fs::path& path) {
  const auto fail = [&](const char* fault) {
    throw InputError(path, "point " + std::to_string(idx) + ": " + fault);
  };
  SelectionPoint point;
  point.position = Eigen::Vector3d(record.x, record.y, record.z).cast<float>();
  point.normal = Eigen::Vector3d(record.nx, record.ny, record.nz).cast<float>();
  if (!point.position.allFinite()) fail("position is NaN or infinite");
  if (!point.normal.allFinite()) fail("normal is NaN or infinite");
  // A normal that is unit up to rounding keeps its bits, so that a written cloud is read back
  // unchanged.
  const float length = point.normal.norm();
  if (length > 0 && std::abs(length - 1) > 1e-6F) point.normal /= length;
  const auto byte = [&](double v) {
    if (std::isnan(v)) fail("color is NaN");
    return static_cast<uint8_t>(std::clamp(v, 0.0, 255.0));
  };
  point.color = {byte(record.red), byte(record.green), byte(record.blue)};
  point.footprint = static_cast<float>(record.footprint);
  if (!(point.footprint >= 0 && std::isfinite(point.footprint))) fail("bad footprint");
  point.confidence = static_cast<float>(record.confidence);
  point.coverage = static_cast<float>(record.coverage);
  if (!(record.confidence >= 0 && record.confidence <= 1)) fail("confidence is not in [0, 1]");
  if (!(record.coverage >= 0 && record.coverage <= 1)) fail("coverage is not in [0, 1]");
  if (!own) return point;
  const auto is_u16 = [](double v) { return v >= 0 && v <= 65535; };
  if (!is_u16(record.source) || record.source >= double(num_sources)) fail("names no source view");
  if (!is_u16(record.px) || !is_u16(record.py)) fail("bad source pixel");
  point.source = static_cast<uint16_t>(record.source);
  point.x = static_cast<uint16_t>(record.px);
  point.y = static_cast<uint16_t>(record.py);
  return point;
}

// Clouds of other tools have no footprint. The spacing of the points replaces it.
void EstimateFootprints(SelectionCloud& cloud) {
  std::vector<Eigen::Vector3f> positions;
  for (const auto& point : cloud.points) positions.push_back(point.position);
  const PointTree tree(positions);
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    cloud.points[i].footprint = tree.Spacing(static_cast<int>(i), 4);
  }
}

void ReadVertices(const PlyElement& element, const std::vector<std::string>& sources, PlyBody& body,
                  const fs::path& path, SelectionCloud* cloud) {
  std::vector<double Record::*> members;  // null: skip the property
  std::vector<PlyColumn> columns;
  bool has[3] = {false, false, false};
  bool has_footprint = false, has_source = false, has_pixel = false;
  for (const auto& property : element.properties) {
    double Record::*member = nullptr;
    columns.push_back(ColumnOf(property));
    for (const auto& field : kFields) {
      if (field.name == property.name && !columns.back().list_count) member = field.member;
    }
    members.push_back(member);
    has[0] |= member == &Record::x;
    has[1] |= member == &Record::y;
    has[2] |= member == &Record::z;
    has_footprint |= member == &Record::footprint;
    has_source |= member == &Record::source;
    has_pixel |= member == &Record::px;
  }
  if (!has[0] || !has[1] || !has[2]) throw InputError(path, "vertices lack x, y or z");
  const bool own = has_source && has_pixel && !sources.empty();
  if (own) cloud->sources = sources;
  body.Require(element);
  cloud->points.reserve(element.count);
  for (uint64_t i = 0; i < element.count; ++i) {
    Record record;
    for (size_t p = 0; p < members.size(); ++p) {
      if (members[p]) {
        record.*members[p] = body.Value(columns[p].type);
      } else {
        body.Skip(columns[p]);
      }
    }
    cloud->points.push_back(ToPoint(record, i, own, cloud->sources.size(), path));
  }
  if (!has_footprint) EstimateFootprints(*cloud);
}

template <typename T>
void PutValue(AtomicFile& file, double value) {
  file.WriteValue(static_cast<T>(value));
}

}  // namespace

void WriteCloud(const std::filesystem::path& path, const SelectionCloud& cloud) {
  static_assert(std::endian::native == std::endian::little);
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment Retint selection cloud\n";
  for (const auto& name : cloud.sources) header += "comment source " + EscapeName(name) + "\n";
  header += "element vertex " + std::to_string(cloud.points.size()) + "\n";
  for (const auto& field : kFields) {
    const char* type = field.type == PlyType::kFloat   ? "float "
                       : field.type == PlyType::kUint8 ? "uchar "
                                                       : "ushort ";
    header += "property " + std::string(type) + std::string(field.name) + "\n";
  }
  AtomicFile file(path);
  file.Write(header + "end_header\n");
  for (const auto& point : cloud.points) {
    const Record record{point.position.x(),     point.position.y(),     point.position.z(),
                        point.normal.x(),       point.normal.y(),       point.normal.z(),
                        double(point.color[0]), double(point.color[1]), double(point.color[2]),
                        point.footprint,        point.confidence,       point.coverage,
                        double(point.source),   double(point.x),        double(point.y)};
    for (const auto& field : kFields) {
      const double value = record.*field.member;
      if (field.type == PlyType::kFloat) {
        PutValue<float>(file, value);
      } else if (field.type == PlyType::kUint8) {
        PutValue<uint8_t>(file, value);
      } else {
        PutValue<uint16_t>(file, value);
      }
    }
  }
  file.Commit();
}

SelectionCloud ReadCloud(const std::filesystem::path& path) {
  const std::string bytes = ReadFile(path);
  const PlyHeader header =
      ParsePlyHeader(std::string_view(bytes).substr(0, kMaxPlyHeaderBytes), path);
  PlyBody body(bytes, header, path);
  SelectionCloud cloud;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex") {
      ReadVertices(element, SourcesOf(header), body, path, &cloud);
      return cloud;
    }
    body.Skip(element);
  }
  throw InputError(path, "holds no vertices");
}

}  // namespace retint
