// SPDX-License-Identifier: BSD-3-Clause
// A network in a file of the ONNX format, run by the user's own ONNX Runtime. Nothing else in
// Retint knows that library.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/monitor.h"

namespace retint {

// An input or output: floats, half floats, bytes, truth values, or whole numbers of 32 or 64 bits.
struct NetworkPort {
  std::string name;
  std::vector<int64_t> shape;  // below 0: any length
  bool is_tensor = false;      // of a type that Retint can pass
};

// Values in the order of the shape, the last dimension fastest.
struct Tensor {
  std::vector<int64_t> shape;
  std::vector<float> values;
};

std::string ShapeText(const std::vector<int64_t>& shape);  // "1x3x?x?"

class OnnxModel {
 public:
  // InputError for a file that is no network, OptionError without a runtime. `cpu_only`: does not
  // try CUDA.
  OnnxModel(std::filesystem::path file, bool cpu_only);
  ~OnnxModel();
  OnnxModel(const OnnxModel&) = delete;
  OnnxModel& operator=(const OnnxModel&) = delete;

  const std::filesystem::path& file() const { return file_; }
  const std::vector<NetworkPort>& inputs() const { return inputs_; }
  const std::vector<NetworkPort>& outputs() const { return outputs_; }
  // "hitnet.onnx (xxh64 0123456789abcdef, ONNX Runtime 1.29.0, CPU)": results depend on all of it.
  // If the runtime has CUDA and it fails, the reason follows.
  const std::string& Identity() const { return identity_; }

  // All outputs of the network, empty those that are no tensors of numbers. `inputs`: a tensor for
  // each. InputError if the network refuses them, or answers with a value that is not finite.
  // Cancelling `monitor` ends the run. One run at a time.
  std::vector<Tensor> Run(std::vector<Tensor> inputs, const Monitor& monitor) const;

 private:
  struct State;
  std::filesystem::path file_;
  std::unique_ptr<State> state_;
  std::vector<NetworkPort> inputs_, outputs_;
  std::string identity_;
};

}  // namespace retint
