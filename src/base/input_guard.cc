// SPDX-License-Identifier: BSD-3-Clause
#include "base/input_guard.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <system_error>

#include "base/error.h"
#include "base/files.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// Outlives every static object, which may hold a guard.
struct Registry {
  std::mutex mutex;
  std::set<InputGuard*> guards;
  std::atomic<int> recording = 0;
};
Registry& Shared() {
  static auto* const registry = new Registry;
  return *registry;
}

// Empty if there is no such file.
fs::path Whole(const fs::path& file) {
  std::error_code code;
  const fs::path path = fs::canonical(file, code);
  return code ? fs::path() : path;
}

fs::path WholeOutput(const fs::path& output) {
  std::error_code code;
  const fs::path path = fs::weakly_canonical(FollowLinks(output), code);
  return code ? output.lexically_normal() : path;
}

}  // namespace

InputGuard::InputGuard(Guards guards) : guards_reads_(guards == Guards::kReads) {
  const std::lock_guard lock(Shared().mutex);
  Shared().guards.insert(this);
  if (guards_reads_) ++Shared().recording;
}

InputGuard::~InputGuard() {
  const std::lock_guard lock(Shared().mutex);
  Shared().guards.erase(this);
  if (guards_reads_) --Shared().recording;
}

void InputGuard::Add(const fs::path& file) {
  const fs::path path = Whole(file);
  if (path.empty()) return;
  const std::lock_guard lock(Shared().mutex);
  inputs_.insert(path);
  const auto& guards = Shared().guards;
  if (std::ranges::any_of(guards, [&](const auto* one) { return one->allowed_.contains(path); })) {
    return;
  }
  for (const InputGuard* one : guards) {
    const auto planned = one->planned_.find(path);
    if (planned == one->planned_.end()) continue;
    throw OptionError(planned->second + " would replace " + file.string() +
                      ", which is an input: name another file");
  }
}

void InputGuard::AddSplat(const fs::path& splat, const std::vector<fs::path>& files) {
  std::set<fs::path> paths;
  for (const fs::path& file : files) paths.insert(Whole(file));
  paths.erase(fs::path());
  {
    const std::lock_guard lock(Shared().mutex);
    splats_[Whole(splat)] = std::move(paths);
  }
  for (const fs::path& file : files) Add(file);
}

void InputGuard::Plan(const std::string& name, const fs::path& output) {
  Check(output);
  const std::lock_guard lock(Shared().mutex);
  planned_.emplace(WholeOutput(output), name);
}

void InputGuard::ForgetPlanned() {
  const std::lock_guard lock(Shared().mutex);
  planned_.clear();
}

void InputGuard::Allow(const fs::path& output) {
  const std::lock_guard lock(Shared().mutex);
  allowed_.insert(WholeOutput(output));
}

void InputGuard::AllowSplat(const fs::path& output) {
  const fs::path path = WholeOutput(output);
  const std::lock_guard lock(Shared().mutex);
  for (const InputGuard* one : Shared().guards) {
    const auto splat = one->splats_.find(path);
    if (splat != one->splats_.end()) allowed_.insert(splat->second.begin(), splat->second.end());
  }
}

void InputGuard::NoteRead(const fs::path& file) {
  if (Shared().recording == 0) return;
  const fs::path path = Whole(file);
  InputGuard* recorder = nullptr;
  {
    const std::lock_guard lock(Shared().mutex);
    for (InputGuard* one : Shared().guards) {
      if (one->guards_reads_ && !one->inputs_.contains(path)) recorder = one;
    }
  }
  if (recorder) recorder->Add(path);
}

void InputGuard::Check(const fs::path& output) {
  const fs::path path = WholeOutput(output);
  const std::lock_guard lock(Shared().mutex);
  const auto& guards = Shared().guards;
  const auto any = [&](auto member) {
    return std::ranges::any_of(
        guards, [&](const InputGuard* one) { return (one->*member).contains(path); });
  };
  if (!any(&InputGuard::inputs_) || any(&InputGuard::allowed_)) return;
  throw OptionError(output.string() + ": is an input and would be replaced: name another file");
}

}  // namespace retint
