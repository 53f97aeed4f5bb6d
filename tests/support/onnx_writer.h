// SPDX-License-Identifier: BSD-3-Clause
// Small networks in the ONNX format, written by hand: as much of its protocol buffers as tests
// need.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace retint {

class OnnxWriter {
 public:
  // Lengths below 0 are any.
  void Input(const std::string& name, const std::vector<int64_t>& shape, int type = 1) {
    graph_ += Field(11, ValueInfo(name, shape, type));
  }
  void Output(const std::string& name, const std::vector<int64_t>& shape) {
    graph_ += Field(12, ValueInfo(name, shape, 1));
  }
  std::string Floats(const std::vector<int64_t>& shape, const std::vector<float>& values) {
    return Constant(shape, 1, {reinterpret_cast<const char*>(values.data()), 4 * values.size()});
  }
  std::string Integers(const std::vector<int64_t>& values) {
    return Constant({int64_t(values.size())}, 7,
                    {reinterpret_cast<const char*>(values.data()), 8 * values.size()});
  }
  using Attributes = std::vector<std::pair<std::string, std::vector<int64_t>>>;
  // The name of its output. An attribute of one number is that number.
  std::string Node(const std::string& op, const std::vector<std::string>& inputs,
                   const Attributes& attributes = {}, std::string output = "") {
    if (output.empty()) output = "t" + std::to_string(++count_);
    std::string node;
    for (const std::string& input : inputs) node += Field(1, input);
    node += Field(2, output) + Field(4, op);
    for (const auto& [name, values] : attributes) {
      std::string attribute = Field(1, name);
      const bool is_list = values.size() != 1;
      for (const int64_t value : values) attribute += Number(is_list ? 8 : 3, uint64_t(value));
      node += Field(5, attribute + Number(20, is_list ? 7 : 2));
    }
    graph_ += Field(1, node);
    return output;
  }
  std::string File() const {
    return Number(1, 7) + Field(8, Number(2, 13)) + Field(7, graph_ + Field(2, "test"));
  }

 private:
  static std::string Varint(uint64_t value) {
    std::string bytes;
    for (; value >= 128; value >>= 7) bytes += char(value | 128);
    return bytes + char(value);
  }
  static std::string Number(int field, uint64_t value) {
    return Varint(uint64_t(field) << 3) + Varint(value);
  }
  static std::string Field(int field, const std::string& bytes) {
    return Varint(uint64_t(field) << 3 | 2) + Varint(bytes.size()) + bytes;
  }
  static std::string ValueInfo(const std::string& name, const std::vector<int64_t>& shape,
                               int type) {
    std::string dims;
    for (size_t i = 0; i < shape.size(); ++i) {
      const std::string any = Field(2, name + std::to_string(i));
      dims += Field(1, shape[i] < 0 ? any : Number(1, uint64_t(shape[i])));
    }
    const std::string tensor = Number(1, uint64_t(type)) + Field(2, dims);
    return Field(1, name) + Field(2, Field(1, tensor));
  }
  std::string Constant(const std::vector<int64_t>& shape, int type, const std::string& bytes) {
    const std::string name = "c" + std::to_string(++count_);
    std::string tensor;
    for (const int64_t length : shape) tensor += Number(1, uint64_t(length));
    graph_ += Field(5, tensor + Number(2, uint64_t(type)) + Field(8, name) + Field(9, bytes));
    return name;
  }

  std::string graph_;
  int count_ = 0;
};

}  // namespace retint
