// SPDX-License-Identifier: BSD-3-Clause
// A library with the face of ONNX Runtime, for tests of machines that have no GPU, or none that
// works. Its networks have no input and no output. STAND_IN_CUDA in the environment is how CUDA
// fails; empty: it works.
#include <cstdint>
#include <cstdlib>
#include <initializer_list>

namespace {

// Positions in OrtApi, as src/network/onnx_runtime.cc has them.
const void* g_functions[300] = {};
char g_cuda[] = "CUDAExecutionProvider", g_cpu[] = "CPUExecutionProvider";
char* g_names[] = {g_cuda, g_cpu};
int g_object = 0;  // every handle points here
bool g_has_cuda_options = false;

const char* MessageOf(const void* status) { return static_cast<const char*>(status); }
void* Make(void** out) {
  *out = &g_object;
  return nullptr;
}
void* CreateEnv(int, const char*, void** out) { return Make(out); }
void* CreateSession(const void*, const char*, const void*, void** out) { return Make(out); }
void* SetNumber(void*, int) { return nullptr; }
void* CountNone(const void*, size_t* out) {
  *out = 0;
  return nullptr;
}
void* Providers(char*** names, int* count) {
  *names = g_names;
  *count = 2;
  return nullptr;
}
void* ReleaseProviders(char**, int) { return nullptr; }
void* CreateCudaOptions(void** out) {
  g_has_cuda_options = true;
  return Make(out);
}
void* AddCuda(void*, const void*) {
  static char no_options[] = "no options were made";
  char* const fault = std::getenv("STAND_IN_CUDA");
  if (!g_has_cuda_options) return no_options;
  return fault && *fault ? fault : nullptr;
}
void ReleaseCudaOptions(void*) { g_has_cuda_options = false; }
void Release(void*) {}

const void* const* GetApi(uint32_t) {
  const auto put = [](int position, auto* function) {
    g_functions[position] = reinterpret_cast<const void*>(function);
  };
  put(2, MessageOf);
  put(3, CreateEnv);
  put(7, CreateSession);
  put(10, Make);
  for (const int position : {22, 24}) put(position, SetNumber);
  for (const int position : {30, 31}) put(position, CountNone);
  for (const int position : {93, 95, 100}) put(position, Release);
  put(125, Providers);
  put(126, ReleaseProviders);
  put(204, AddCuda);
  put(205, CreateCudaOptions);
  put(208, ReleaseCudaOptions);
  return g_functions;
}
const char* GetVersion() { return "0.0.1"; }

struct ApiBase {
  const void* const* (*get_api)(uint32_t);
  const char* (*get_version)();
};

}  // namespace

extern "C" __attribute__((visibility("default"))) const ApiBase* OrtGetApiBase();
const ApiBase* OrtGetApiBase() {
  static const ApiBase base = {GetApi, GetVersion};
  return &base;
}
