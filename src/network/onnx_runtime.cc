// SPDX-License-Identifier: BSD-3-Clause
#include "network/onnx_runtime.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "base/option_name.h"
#include "base/printable.h"

namespace retint::ort {
namespace {

namespace fs = std::filesystem;

// Of OrtApi; 1.11 (2022) was the first with all that is called here.
constexpr uint32_t kApiVersion = 11;
constexpr int kFatal = 4;  // ORT_LOGGING_LEVEL_FATAL: errors come back as a status
constexpr const char* kAdvice =
    "a release of ONNX Runtime (1.11 or newer) holds libonnxruntime.so, and so do its pip package "
    "onnxruntime and its npm package onnxruntime-node; name the library with ";

// OrtApiBase and OrtApi are structs of function pointers, and the latter only ever grows.
using Table = void* const*;
struct ApiBase {
  Table (*get_api)(uint32_t version);
  const char* (*get_version)();
};

template <typename Function>
void Take(Table table, size_t position, Function& function) {
  static_assert(sizeof(Function) == sizeof(void*));
  std::memcpy(&function, &table[position], sizeof(void*));
}

// By their positions in OrtApi (onnxruntime_c_api.h).
Api Functions(Table table) {
  Api api{};
  Take(table, 2, api.error_message);
  Take(table, 3, api.create_env);
  Take(table, 7, api.create_session);
  Take(table, 9, api.run);
  Take(table, 10, api.create_session_options);
  Take(table, 22, api.set_log_level);
  Take(table, 24, api.set_threads);
  Take(table, 30, api.input_count);
  Take(table, 31, api.output_count);
  Take(table, 33, api.input_type);
  Take(table, 34, api.output_type);
  Take(table, 36, api.input_name);
  Take(table, 37, api.output_name);
  Take(table, 39, api.create_run_options);
  Take(table, 46, api.terminate);
  Take(table, 49, api.create_tensor);
  Take(table, 50, api.is_tensor);
  Take(table, 51, api.tensor_data);
  Take(table, 55, api.tensor_info);
  Take(table, 60, api.element_type);
  Take(table, 61, api.rank);
  Take(table, 62, api.dimensions);
  Take(table, 65, api.value_info);
  Take(table, 69, api.cpu_memory);
  Take(table, 76, api.allocator_free);
  Take(table, 78, api.default_allocator);
  Take(table, 93, api.release_status);
  Take(table, 94, api.release_memory_info);
  Take(table, 95, api.release_session);
  Take(table, 96, api.release_value);
  Take(table, 97, api.release_run_options);
  Take(table, 98, api.release_type_info);
  Take(table, 99, api.release_tensor_info);
  Take(table, 100, api.release_session_options);
  Take(table, 125, api.providers);
  Take(table, 126, api.release_providers);
  Take(table, 204, api.add_cuda);
  Take(table, 205, api.create_cuda_options);
  Take(table, 208, api.release_cuda_options);
  return api;
}

bool IsLibrary(const fs::path& path) {
  return path.filename().string().starts_with("libonnxruntime.so");
}

// The libraries of a folder, the shortest name first: links to the newest are short.
void AddLibrariesOf(const fs::path& folder, std::vector<fs::path>* places) {
  std::vector<fs::path> found = ListFolder(folder);
  std::erase_if(found, [](const fs::path& path) { return !IsLibrary(path); });
  std::ranges::sort(found);
  places->insert(places->end(), found.begin(), found.end());
}

// pip's folders below a prefix such as /usr/local or ~/.local.
void AddPipOf(const fs::path& prefix, std::vector<fs::path>* places) {
  for (const fs::path& folder : ListFolder(prefix / "lib")) {
    if (!folder.filename().string().starts_with("python3")) continue;
    for (const char* packages : {"dist-packages", "site-packages"}) {
      AddLibrariesOf(folder / packages / "onnxruntime" / "capi", places);
    }
  }
}

std::vector<fs::path> UsualPlaces() {
  std::vector<fs::path> places = {"libonnxruntime.so", "libonnxruntime.so.1"};  // the loader's own
  for (const char* folder : {"/usr/local/lib", "/opt/onnxruntime/lib"}) {
    AddLibrariesOf(folder, &places);
  }
  if (const char* environment = std::getenv("VIRTUAL_ENV")) AddPipOf(environment, &places);
  if (const char* home = std::getenv("HOME")) AddPipOf(fs::path(home) / ".local", &places);
  AddPipOf("/usr/local", &places);
  AddPipOf("/usr", &places);
  return places;
}

// Null, and why, if it cannot be loaded.
std::unique_ptr<Runtime> Load(const fs::path& library, std::string* fault) {
  void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    const char* const text = dlerror();
    *fault = text ? Printable(text) : "cannot be loaded";
    return nullptr;
  }
  using GetBase = const ApiBase* (*)();
  const auto get_base = reinterpret_cast<GetBase>(dlsym(handle, "OrtGetApiBase"));
  const ApiBase* const base = get_base ? get_base() : nullptr;
  const Table table = base ? base->get_api(kApiVersion) : nullptr;
  if (!table) {
    *fault = library.string() + ": is not ONNX Runtime 1.11 or newer";
    dlclose(handle);
    return nullptr;
  }
  auto runtime = std::make_unique<Runtime>();
  runtime->api = Functions(table);
  runtime->version = base->get_version();
  runtime->Check(runtime->api.create_env(kFatal, "retint", &runtime->env), "ONNX Runtime: ");
  char** names = nullptr;
  int count = 0;
  runtime->Check(runtime->api.providers(&names, &count), "ONNX Runtime: ");
  for (int i = 0; i < count; ++i) {
    runtime->has_cuda |= std::strcmp(names[i], "CUDAExecutionProvider") == 0;
  }
  runtime->Check(runtime->api.release_providers(names, count), "ONNX Runtime: ");
  return runtime;
}

// `place` was named by the user.
std::unique_ptr<Runtime> LoadNamed(const fs::path& place) {
  std::vector<fs::path> libraries;
  if (IsFolder(place)) {
    AddLibrariesOf(place, &libraries);
    CheckOption(!libraries.empty(), place.string() + ": holds no libonnxruntime.so");
  } else {
    libraries.push_back(place);
  }
  std::string fault;
  auto runtime = Load(libraries.front(), &fault);
  CheckOption(runtime != nullptr, "ONNX Runtime cannot be loaded: " + fault);
  return runtime;
}

std::unique_ptr<Runtime> LoadUsual() {
  std::string found;  // the fault of the first that is there
  for (const fs::path& library : UsualPlaces()) {
    std::string fault;
    if (auto runtime = Load(library, &fault)) return runtime;
    const bool absent = fault.starts_with(library.string() + ": cannot open shared object file");
    if (found.empty() && !absent) found = fault;
  }
  CheckOption(found.empty(), "ONNX Runtime cannot be loaded: " + found + "; name another with " +
                                 OptionName("onnx_runtime") + " or RETINT_ONNX_RUNTIME");
  throw OptionError(std::string("ONNX Runtime, which runs networks, is not installed: ") + kAdvice +
                    OptionName("onnx_runtime") + " or RETINT_ONNX_RUNTIME");
}

}  // namespace

void Runtime::Check(Status* status, const std::string& what) const {
  if (!status) return;
  constexpr size_t kMost = 300;  // characters
  std::string text = api.error_message(status);
  api.release_status(status);
  text = Printable(text.substr(0, std::min(text.find('\n'), kMost)));
  throw RunError(what + text);
}

const Runtime& LoadRuntime() {
  static std::mutex mutex;
  static auto& loaded = *new std::map<fs::path, std::unique_ptr<Runtime>>;  // its threads run on
  const char* const variable = std::getenv("RETINT_ONNX_RUNTIME");
  const fs::path named = variable ? variable : "";
  const std::lock_guard lock(mutex);
  std::unique_ptr<Runtime>& runtime = loaded[named];
  if (!runtime) runtime = named.empty() ? LoadUsual() : LoadNamed(named);
  return *runtime;
}

}  // namespace retint::ort
