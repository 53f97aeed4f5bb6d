// SPDX-License-Identifier: BSD-3-Clause
// The functions of NCCL that Retint calls, without any GPU: each writes what it is asked for into
// the file that FAKE_NCCL_LOG names, and the one that FAKE_NCCL_FAILS names fails.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORTED __attribute__((visibility("default")))

typedef struct {
  char bytes[128];
} Id;

static int Answer(const char* function) {
  const char* const log = getenv("FAKE_NCCL_LOG");
  FILE* const file = log ? fopen(log, "a") : NULL;
  if (file) {
    fprintf(file, "%s\n", function);
    fclose(file);
  }
  const char* const failing = getenv("FAKE_NCCL_FAILS");
  return failing && strcmp(failing, function) == 0 ? 3 : 0;
}

EXPORTED int ncclGetVersion(int* version) {
  *version = 21304;
  return 0;
}
EXPORTED int ncclGetUniqueId(Id* id) {
  memset(id, 7, sizeof(Id));
  return Answer("id");
}
EXPORTED int ncclCommInitRank(void** comm, int ranks, Id id, int rank) {
  char text[64];
  snprintf(text, sizeof text, "join %d of %d by %d", rank, ranks, id.bytes[127]);
  *comm = "comm";
  return Answer(text);
}
EXPORTED int ncclCommDestroy(void* comm) { return Answer(comm ? "leave" : "leave nothing"); }
EXPORTED int ncclCommGetAsyncError(void* comm, int* error) {
  (void)comm;
  *error = Answer("earlier");
  return 0;
}
EXPORTED const char* ncclGetErrorString(int result) {
  return result == 3 ? "internal error" : "no error";
}
EXPORTED const char* ncclGetLastError(void* comm) {
  (void)comm;
  return "a cable was pulled";
}
EXPORTED int ncclMemAlloc(void** data, size_t bytes) {
  *data = calloc(bytes, 1);
  return Answer("take");
}
EXPORTED int ncclMemFree(void* data) {
  free(data);
  return Answer("free");
}
EXPORTED int ncclGroupStart(void) { return Answer("start"); }
EXPORTED int ncclGroupEnd(void) { return Answer("end"); }

#ifndef RETINT_WITHOUT_SEND
static int Transfer(const char* what, size_t count, int type, int other, void* stream) {
  char text[96];
  snprintf(text, sizeof text, "%s %zu of type %d, rank %d, stream %s", what, count, type, other,
           stream ? (const char*)stream : "of CUDA");
  return Answer(text);
}
EXPORTED int ncclSend(const void* data, size_t count, int type, int to, void* comm, void* stream) {
  (void)data, (void)comm;
  return Transfer("send", count, type, to, stream);
}
EXPORTED int ncclRecv(void* data, size_t count, int type, int from, void* comm, void* stream) {
  (void)data, (void)comm;
  return Transfer("receive", count, type, from, stream);
}
#endif
