// SPDX-License-Identifier: BSD-3-Clause
#include "base/stage_cache.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "base/hidden.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

struct Stored {
  fs::path path;
  fs::file_time_type used;
  uint64_t bytes = 0;
};

uint64_t BytesBelow(const fs::path& folder) {
  uint64_t bytes = 0;
  std::error_code code;
  for (const fs::path& file : ListBelow(folder)) {
    const uint64_t size = IsFile(file) ? fs::file_size(file, code) : 0;
    if (!code) bytes += size;
  }
  return bytes;
}

bool IsEntry(const fs::path& path) {
  const std::string name = path.filename().string();
  const auto dash = name.rfind('-');
  return dash != std::string::npos && name.size() - dash - 1 == 32 &&
         name.find_first_not_of("0123456789abcdef", dash + 1) == std::string::npos;
}

}  // namespace

StageKey& StageKey::Add(std::string_view bytes) {
  // The second sum begins with other bytes, which makes the two independent.
  if (!started_) second_.Add("second");
  started_ = true;
  const uint64_t size = bytes.size();
  for (Xxh64Stream* sum : {&first_, &second_}) {
    sum->Add({reinterpret_cast<const char*>(&size), sizeof(size)});
    sum->Add(bytes);
  }
  return *this;
}

std::string StageKey::Hex() const { return HexText(first_.Get()) + HexText(second_.Get()); }

StageCache::StageCache(fs::path folder)
    : folder_(std::move(folder)), start_(fs::file_time_type::clock::now()) {}

fs::path StageCache::Entry(const std::string& stage, const std::string& key) const {
  return folder_ / (stage + "-" + key);
}

bool StageCache::Has(const std::string& stage, const std::string& key) const {
  return !folder_.empty() && !key.empty() && IsFolder(Entry(stage, key));
}

bool StageCache::Read(const std::string& stage, const std::string& key,
                      const std::function<void(const fs::path&)>& read) {
  if (!Has(stage, key)) return false;
  const fs::path entry = Entry(stage, key);
  std::error_code code;
  try {
    read(entry);
  } catch (const InputError&) {
    fs::remove_all(entry, code);
    return false;
  }
  fs::last_write_time(entry, fs::file_time_type::clock::now(), code);
  return true;
}

void StageCache::Write(const std::string& stage, const std::string& key,
                       const std::function<void(const fs::path&)>& write) {
  if (folder_.empty() || key.empty()) return;
  const fs::path entry = Entry(stage, key);
  std::error_code code;
  fs::create_directories(folder_, code);
  if (code) throw RunError(folder_.string() + ": cannot create the folder: " + code.message());
  HiddenFolder unfinished(folder_);
  if (unfinished.path().empty()) {
    throw RunError(folder_.string() + ": cannot write: " + std::strerror(errno));
  }
  write(unfinished.path());
  // Another process may have put the same entry there: then this one is not needed.
  fs::rename(unfinished.path(), entry, code);
  if (!code) unfinished.Keep();
}

void StageCache::Trim(uint64_t most_bytes) {
  if (folder_.empty()) return;
  std::vector<Stored> entries;
  uint64_t total = 0;
  std::error_code code;
  for (const fs::path& path : ListFolder(folder_)) {
    const auto used = fs::last_write_time(path, code);
    if (!IsEntry(path)) continue;
    entries.push_back({path, used, BytesBelow(path)});
    total += entries.back().bytes;
  }
  std::sort(entries.begin(), entries.end(),
            [](const auto& a, const auto& b) { return a.used < b.used; });
  for (const auto& entry : entries) {
    if (total <= most_bytes || entry.used >= start_) break;
    fs::remove_all(entry.path, code);
    total -= entry.bytes;
  }
}

}  // namespace retint
