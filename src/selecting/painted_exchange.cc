// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/painted_exchange.h"

#include <cstring>
#include <type_traits>

namespace retint {
namespace {

// All processes are the same program: values travel as they lie in memory.
class Packer {
 public:
  template <typename T>
  void Value(const T& value) {
    Bytes(&value, sizeof(T));
  }
  void Text(const std::string& text) { Array(std::vector<char>(text.begin(), text.end())); }
  template <typename T>
  void Array(const std::vector<T>& values) {
    Value(values.size());
    Bytes(values.data(), values.size() * sizeof(T));
  }
  const std::string& text() const { return text_; }

 private:
  void Bytes(const void* bytes, size_t count) {
    if (count > 0) text_.append(static_cast<const char*>(bytes), count);
  }
  std::string text_;
};

class Unpacker {
 public:
  explicit Unpacker(const std::string& text) : text_(text) {}
  template <typename T>
  void Value(T& value) {
    Bytes(&value, sizeof(T));
  }
  void Text(std::string& text) {
    std::vector<char> letters;
    Array(letters);
    text.assign(letters.begin(), letters.end());
  }
  template <typename T>
  void Array(std::vector<T>& values) {
    size_t count = 0;
    Value(count);
    values.resize(count);
    Bytes(values.data(), count * sizeof(T));
  }

 private:
  void Bytes(void* bytes, size_t count) {
    if (count > 0) std::memcpy(bytes, text_.data() + at_, count);
    at_ += count;
  }
  const std::string& text_;
  size_t at_ = 0;
};

// Whatever packs or unpacks visits the same members in the same order.
template <typename Archive, typename Array>
void VisitImage(Archive& archive, Array& image) {
  archive.Value(image.width);
  archive.Value(image.height);
  archive.Array(image.data);
}

template <typename Archive, typename Cloud>
void VisitCloud(Archive& archive, Cloud& cloud) {
  archive.Array(cloud.points);
  size_t count = cloud.sources.size();
  archive.Value(count);
  if constexpr (!std::is_const_v<Cloud>) cloud.sources.resize(count);
  for (auto& source : cloud.sources) archive.Text(source);
}

template <typename Archive, typename Summary>
void VisitRegistration(Archive& archive, Summary& summary) {
  archive.Value(summary.points_used);
  archive.Value(summary.points_heldout);
  archive.Value(summary.rms_before);
  archive.Value(summary.rms_after);
  archive.Value(summary.heldout_before);
  archive.Value(summary.heldout_after);
  archive.Value(summary.a);
  archive.Value(summary.b);
  archive.Value(summary.world_from_cloud);
  archive.Value(summary.accepted);
  archive.Text(summary.reason);
}

template <typename Archive, typename Part>
void Visit(Archive& archive, Part& part) {
  VisitImage(archive, part.depth.depth);
  VisitImage(archive, part.depth.valid);
  archive.Value(part.depth.valid_fraction);
  archive.Text(part.depth.method);
  archive.Text(part.depth.reason);
  archive.Text(part.depth.warning);
  VisitCloud(archive, part.cloud);
  VisitCloud(archive, part.raw);
  archive.Text(part.report.view);
  archive.Text(part.report.outlined_by);
  archive.Text(part.report.depth_method);
  archive.Text(part.report.depth_reason);
  archive.Value(part.report.valid_fraction);
  archive.Value(part.report.cloud);
  VisitRegistration(archive, part.report.registration);
}

}  // namespace

void SharePainted(ViewReducer& views, std::vector<PaintedPart>* parts) {
  for (size_t i = 0; views.IsShared() && i < parts->size(); ++i) {
    Packer packer;
    const PaintedPart& own = (*parts)[i];
    if (views.Owns(i)) Visit(packer, own);
    const std::string text = views.BroadcastText(i, packer.text());
    if (views.Owns(i)) continue;
    Unpacker unpacker(text);
    Visit(unpacker, (*parts)[i]);
  }
}

}  // namespace retint
