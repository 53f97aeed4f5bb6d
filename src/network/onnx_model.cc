// SPDX-License-Identifier: BSD-3-Clause
#include "network/onnx_model.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <future>
#include <utility>

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <Eigen/Core>

#include "base/checksum.h"
#include "base/error.h"
#include "network/onnx_runtime.h"

namespace retint {
namespace {

// Numbers of a tensor: more than any picture at full size has, and less than would hurt.
constexpr int64_t kMostNumbers = int64_t{1} << 28;
constexpr size_t kMostPorts = 64;  // more, and it is no network for pictures

// Made by a function of ort::Api, and released by another.
template <typename T>
using Owned = std::unique_ptr<T, void (*)(T*)>;

int64_t NumbersOf(const std::vector<int64_t>& shape) {
  int64_t numbers = 1;
  for (const int64_t length : shape) {
    if (length < 0 || (length > 0 && numbers > kMostNumbers / length)) return kMostNumbers + 1;
    numbers *= length;
  }
  return numbers;
}

// Of ONNXTensorElementDataType; 0 for types that we do not pass.
size_t BytesOf(int type) {
  switch (type) {
    case ort::kFloat:
    case ort::kInt32:
      return 4;
    case ort::kInt64:
      return 8;
    case ort::kHalf:
      return 2;
    case ort::kByte:
    case ort::kBool:
      return 1;
    default:
      return 0;
  }
}

template <typename T>
void Put(T value, uint8_t* out) {
  std::memcpy(out, &value, sizeof value);
}

template <typename T>
T Get(const uint8_t* data) {
  T value;
  std::memcpy(&value, data, sizeof value);
  return value;
}

std::vector<uint8_t> Encode(const std::vector<float>& values, int type) {
  const size_t size = BytesOf(type);
  std::vector<uint8_t> bytes(values.size() * size);
  for (size_t i = 0; i < values.size(); ++i) {
    uint8_t* const out = &bytes[size * i];
    const float v = values[i];
    if (type == ort::kFloat) {
      Put(v, out);
    } else if (type == ort::kHalf) {
      Put(Eigen::half(v), out);
    } else if (type == ort::kInt32) {
      Put(int32_t(std::lround(v)), out);
    } else if (type == ort::kInt64) {
      Put(int64_t(std::lround(v)), out);
    } else {
      Put(uint8_t(std::clamp(std::lround(v), 0L, 255L)), out);
    }
  }
  return bytes;
}

std::vector<float> Decode(const void* data, size_t count, int type) {
  std::vector<float> values(count);
  const size_t size = BytesOf(type);
  for (size_t i = 0; i < count; ++i) {
    const uint8_t* const from = static_cast<const uint8_t*>(data) + size * i;
    values[i] = type == ort::kFloat   ? Get<float>(from)
                : type == ort::kHalf  ? float(Get<Eigen::half>(from))
                : type == ort::kInt32 ? float(Get<int32_t>(from))
                : type == ort::kInt64 ? float(Get<int64_t>(from))
                                      : float(*from);
  }
  return values;
}

}  // namespace

std::string ShapeText(const std::vector<int64_t>& shape) {
  std::string text;
  for (const int64_t length : shape) {
    if (!text.empty()) text += 'x';
    text += length < 0 ? "?" : std::to_string(length);
  }
  return text.empty() ? "a single number" : text;
}

struct OnnxModel::State {
  State(const std::filesystem::path& path, bool cpu_only)
      : file(path), runtime(ort::LoadRuntime()), api(runtime.api) {
    if (!cpu_only && runtime.has_cuda && Open(/*cuda=*/true)) return;
    Open(/*cuda=*/false);
  }
  ~State() { api.release_session(session); }

  // InputError, because a failure here is the fault of the file.
  void Check(ort::Status* status, const char* what) const {
    try {
      runtime.Check(status, what);
    } catch (const RunError& error) {
      throw InputError(file, error.what());
    }
  }

  // False if CUDA is not to be had; `provider` then says why.
  bool Open(bool cuda) {
    ort::SessionOptions* made = nullptr;
    Check(api.create_session_options(&made), "");
    const Owned<ort::SessionOptions> options(made, api.release_session_options);
    constexpr int kFatal = 4;
    Check(api.set_log_level(made, kFatal), "");
    const auto threads =
        tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    Check(api.set_threads(made, int(threads)), "");
    if (!cuda) {
      Check(api.create_session(runtime.env, file.c_str(), made, &session),
            "is not a network that ONNX Runtime can load: ");
      return true;
    }
    try {
      ort::CudaOptions* device = nullptr;
      runtime.Check(api.create_cuda_options(&device), "");
      const Owned<ort::CudaOptions> owned(device, api.release_cuda_options);
      runtime.Check(api.add_cuda(made, device), "");
      runtime.Check(api.create_session(runtime.env, file.c_str(), made, &session), "");
    } catch (const RunError& error) {  // no driver or library; if it is the file, the CPU fails too
      provider += std::string(", because CUDA failed: ") + error.what();
      return false;
    }
    provider = "CUDA";
    return true;
  }

  using Count = ort::Status* (*)(const ort::Session*, size_t*);
  using Name = ort::Status* (*)(const ort::Session*, size_t, ort::Allocator*, char**);
  using Type = ort::Status* (*)(const ort::Session*, size_t, ort::TypeInfo**);

  std::vector<NetworkPort> Ports(Count count_of, Name name_of, Type type_of,
                                 std::vector<int>* types) const {
    size_t count = 0;
    Check(count_of(session, &count), "");
    if (count > kMostPorts) {
      throw InputError(
          file, fmt::format("has {} inputs or outputs: it is no network for pictures", count));
    }
    std::vector<NetworkPort> ports(count);
    for (size_t i = 0; i < count; ++i) {
      ort::Allocator* allocator = nullptr;
      char* name = nullptr;
      Check(api.default_allocator(&allocator), "");
      Check(name_of(session, i, allocator, &name), "");
      ports[i].name = name;
      Check(api.allocator_free(allocator, name), "");
      ort::TypeInfo* made = nullptr;
      Check(type_of(session, i, &made), "");
      const Owned<ort::TypeInfo> type(made, api.release_type_info);
      const ort::TensorInfo* info = nullptr;
      Check(api.tensor_info(made, &info), "");
      types->push_back(0);
      if (!info) continue;
      ports[i].shape = ShapeOf(info, &types->back());
      ports[i].is_tensor = BytesOf(types->back()) > 0;
    }
    return ports;
  }

  std::vector<int64_t> ShapeOf(const ort::TensorInfo* info, int* type) const {
    size_t rank = 0;
    Check(api.element_type(info, type), "");
    Check(api.rank(info, &rank), "");
    std::vector<int64_t> shape(rank);
    Check(api.dimensions(info, shape.data(), rank), "");
    return shape;
  }

  Owned<ort::Value> Tensorize(const Tensor& tensor, std::vector<uint8_t>* bytes, int type) const {
    *bytes = Encode(tensor.values, type);
    ort::MemoryInfo* made = nullptr;
    constexpr int kDeviceAllocator = 0, kDefaultMemory = 0;
    Check(api.cpu_memory(kDeviceAllocator, kDefaultMemory, &made), "");
    const Owned<ort::MemoryInfo> memory(made, api.release_memory_info);
    ort::Value* value = nullptr;
    Check(api.create_tensor(made, bytes->data(), bytes->size(), tensor.shape.data(),
                            tensor.shape.size(), type, &value),
          "");
    return {value, api.release_value};
  }

  Tensor Read(ort::Value* value, const std::string& name) const {
    Tensor tensor;
    int is_tensor = 0, type = 0;
    if (!value) return tensor;
    Check(api.is_tensor(value, &is_tensor), "");
    if (!is_tensor) return tensor;
    ort::TensorInfo* made = nullptr;
    Check(api.value_info(value, &made), "");
    const Owned<ort::TensorInfo> info(made, api.release_tensor_info);
    const std::vector<int64_t> shape = ShapeOf(made, &type);
    if (BytesOf(type) == 0) return tensor;
    const int64_t numbers = NumbersOf(shape);
    if (numbers > kMostNumbers) {
      throw InputError(file, "its output " + name + " is " + ShapeText(shape) + ": too large");
    }
    void* data = nullptr;
    Check(api.tensor_data(value, &data), "");
    tensor.shape = shape;
    tensor.values = Decode(data, size_t(numbers), type);
    const auto is_finite = [](float v) { return std::isfinite(v); };
    if (!std::ranges::all_of(tensor.values, is_finite)) {
      throw InputError(file, "its output " + name + " holds values that are not finite");
    }
    return tensor;
  }

  // The run itself, on a thread of its own, so that a cancelled one can be ended.
  void RunCancellable(const std::vector<const char*>& input_names,
                      const std::vector<ort::Value*>& inputs,
                      const std::vector<const char*>& output_names,
                      std::vector<ort::Value*>* outputs, const Monitor& monitor) const {
    ort::RunOptions* made = nullptr;
    Check(api.create_run_options(&made), "");
    const Owned<ort::RunOptions> options(made, api.release_run_options);
    auto running = std::async(std::launch::async, [&] {
      return api.run(session, made, input_names.data(), inputs.data(), inputs.size(),
                     output_names.data(), output_names.size(), outputs->data());
    });
    using namespace std::chrono_literals;
    bool ended = false;
    while (running.wait_for(20ms) != std::future_status::ready) {
      if (ended || !monitor.IsCancelled()) continue;
      ended = true;
      if (ort::Status* status = api.terminate(made)) api.release_status(status);
    }
    ort::Status* const status = running.get();
    if (monitor.IsCancelled() && status) api.release_status(status);
    monitor.ThrowIfCancelled();
    Check(status, provider == "CUDA" ? "ONNX Runtime cannot run it on the GPU (provider=cpu would "
                                       "leave it out): "
                                     : "ONNX Runtime cannot run it: ");
  }

  std::filesystem::path file;
  const ort::Runtime& runtime;
  const ort::Api& api;
  ort::Session* session = nullptr;
  std::string provider = "CPU";
  std::vector<int> input_types, output_types;
};

OnnxModel::OnnxModel(std::filesystem::path file, bool cpu_only) : file_(std::move(file)) {
  const FileChecksum sum = ChecksumFile(file_);
  if (sum.bytes == 0) throw InputError(file_, "is empty");
  state_ = std::make_unique<State>(file_, cpu_only);
  const ort::Api& api = state_->api;
  inputs_ = state_->Ports(api.input_count, api.input_name, api.input_type, &state_->input_types);
  outputs_ =
      state_->Ports(api.output_count, api.output_name, api.output_type, &state_->output_types);
  identity_ = fmt::format("{} (xxh64 {}, ONNX Runtime {}, {})", file_.filename().string(),
                          HexText(sum.xxh64), state_->runtime.version, state_->provider);
}

OnnxModel::~OnnxModel() = default;

std::vector<Tensor> OnnxModel::Run(std::vector<Tensor> inputs, const Monitor& monitor) const {
  std::vector<std::vector<uint8_t>> bytes(inputs.size());
  std::vector<Owned<ort::Value>> owned;
  std::vector<ort::Value*> given, taken(outputs_.size(), nullptr);
  std::vector<const char*> input_names, output_names;
  for (size_t i = 0; i < inputs.size(); ++i) {
    if (NumbersOf(inputs[i].shape) != int64_t(inputs[i].values.size())) {
      throw InputError(file_, "its input " + inputs_.at(i).name + " of " +
                                  ShapeText(inputs[i].shape) + " is too large");
    }
    owned.push_back(state_->Tensorize(inputs[i], &bytes[i], state_->input_types.at(i)));
    inputs[i].values = {};
    given.push_back(owned.back().get());
    input_names.push_back(inputs_[i].name.c_str());
  }
  for (const NetworkPort& port : outputs_) output_names.push_back(port.name.c_str());
  state_->RunCancellable(input_names, given, output_names, &taken, monitor);
  for (ort::Value* value : taken) owned.emplace_back(value, state_->api.release_value);
  std::vector<Tensor> results;
  for (size_t i = 0; i < taken.size(); ++i) {
    results.push_back(state_->Read(taken[i], outputs_[i].name));
  }
  return results;
}

}  // namespace retint
