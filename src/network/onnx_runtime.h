// SPDX-License-Identifier: BSD-3-Clause
// Internal to network: the C API of ONNX Runtime, found when a program runs. We declare the few
// functions that we call, so that nothing of ONNX Runtime is needed to build Retint.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace retint::ort {

// ONNX Runtime's own types, of which only pointers are passed.
struct Env;
struct Status;
struct MemoryInfo;
struct Session;
struct Value;
struct RunOptions;
struct TypeInfo;
struct TensorInfo;
struct SessionOptions;
struct Allocator;
struct CudaOptions;

// ONNXTensorElementDataType
inline constexpr int kFloat = 1, kByte = 2, kInt32 = 6, kInt64 = 7, kBool = 9, kHalf = 10;

// Functions of OrtApi. Each fails by returning a status, null if all is well; Check() reads it.
struct Api {
  const char* (*error_message)(const Status*);
  Status* (*create_env)(int log_level, const char* name, Env** out);
  Status* (*create_session)(const Env*, const char* path, const SessionOptions*, Session** out);
  Status* (*run)(Session*, const RunOptions*, const char* const* input_names,
                 const Value* const* inputs, size_t num_inputs, const char* const* output_names,
                 size_t num_outputs, Value** outputs);
  Status* (*create_session_options)(SessionOptions** out);
  Status* (*set_log_level)(SessionOptions*, int level);
  Status* (*set_threads)(SessionOptions*, int threads);
  Status* (*input_count)(const Session*, size_t* out);
  Status* (*output_count)(const Session*, size_t* out);
  Status* (*input_type)(const Session*, size_t index, TypeInfo** out);
  Status* (*output_type)(const Session*, size_t index, TypeInfo** out);
  Status* (*input_name)(const Session*, size_t index, Allocator*, char** out);
  Status* (*output_name)(const Session*, size_t index, Allocator*, char** out);
  Status* (*create_run_options)(RunOptions** out);
  Status* (*terminate)(RunOptions*);
  Status* (*create_tensor)(const MemoryInfo*, void* data, size_t bytes, const int64_t* shape,
                           size_t rank, int type, Value** out);
  Status* (*is_tensor)(const Value*, int* out);
  Status* (*tensor_data)(Value*, void** out);
  Status* (*tensor_info)(const TypeInfo*, const TensorInfo** out);  // null: it is no tensor
  Status* (*element_type)(const TensorInfo*, int* out);
  Status* (*rank)(const TensorInfo*, size_t* out);
  Status* (*dimensions)(const TensorInfo*, int64_t* out, size_t rank);
  Status* (*value_info)(const Value*, TensorInfo** out);
  Status* (*cpu_memory)(int allocator_type, int memory_type, MemoryInfo** out);
  Status* (*allocator_free)(Allocator*, void* data);
  Status* (*default_allocator)(Allocator** out);  // not released
  Status* (*providers)(char*** names, int* count);
  Status* (*release_providers)(char** names, int count);
  Status* (*add_cuda)(SessionOptions*, const CudaOptions*);
  Status* (*create_cuda_options)(CudaOptions** out);
  void (*release_cuda_options)(CudaOptions*);
  void (*release_status)(Status*);
  void (*release_memory_info)(MemoryInfo*);
  void (*release_session)(Session*);
  void (*release_value)(Value*);
  void (*release_run_options)(RunOptions*);
  void (*release_type_info)(TypeInfo*);
  void (*release_tensor_info)(TensorInfo*);
  void (*release_session_options)(SessionOptions*);
};

struct Runtime {
  Api api;
  std::string version;  // "1.29.0"
  Env* env = nullptr;
  bool has_cuda = false;  // whether it was built with CUDA; its provider may still fail to load

  // RunError(what + why) unless `status` is null; releases it.
  void Check(Status* status, const std::string& what) const;
};

// Loads the library once and keeps it until the program ends. The environment variable
// RETINT_ONNX_RUNTIME names a library or a folder that holds one; if it is empty, the usual places
// are searched. OptionError if there is none, and it says where to get one. Thread-safe.
const Runtime& LoadRuntime();

}  // namespace retint::ort
