// SPDX-License-Identifier: BSD-3-Clause
// A scene with two regions, and its session in a file, for tests of such files.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files.h"
#include "tests/saving/saved_scene.h"

namespace retint {

class SavedSession : public ::testing::Test {
 protected:
  SavedSession() {
    WriteTinyScene(scene_, folder_.path());
    session_ = OpenTinyScene(folder_.path());
    EditTinyScene(scene_, *session_);
  }

  std::filesystem::path File() const { return folder_ / "edit.retint"; }
  std::filesystem::path Manifest() const { return File() / "session.json"; }
  SessionSnapshot Snapshot() {
    SessionSnapshot snapshot = TakeSnapshot(*session_);
    snapshot.draft = std::make_shared<const SelectionSource>(TinySource(scene_));
    snapshot.view = R"({"camera":{"zoom":0.1,"name":"é"},"panels":[1,null]})";
    return snapshot;
  }
  void Save() {
    Monitor monitor;
    SessionWriter(File()).Write(Snapshot(), monitor);
  }
  OpenedSession Load() { return Load(File()); }
  OpenedSession Load(const std::filesystem::path& path) {
    SessionOptions options;
    options.backend = "cpu";
    Monitor monitor;
    return OpenSession(path, options, monitor);
  }
  // Of the InputError that opening throws; anything else fails the test.
  std::string Refusal() {
    try {
      Load();
    } catch (const InputError& error) {
      return error.what();
    }
    ADD_FAILURE() << "was not refused";
    return {};
  }
  // The only one of the session, which opens.
  std::string Warning() {
    const std::vector<std::string> warnings = Load().session->warnings();
    EXPECT_EQ(warnings.size(), 1u);
    return warnings.empty() ? "" : warnings[0];
  }
  nlohmann::ordered_json ReadManifest() const {
    return nlohmann::ordered_json::parse(ReadFile(Manifest()));
  }
  void ChangeManifest(const std::function<void(nlohmann::ordered_json&)>& change) {
    nlohmann::ordered_json json = ReadManifest();
    change(json);
    WriteFile(Manifest(), json.dump());
  }
  std::filesystem::path FirstPart(const std::string& key, const std::string& of) const {
    return File() / ReadManifest()[key][0][of].get<std::string>();
  }

  const TinyScene scene_{21};
  const TempFolder folder_;
  std::unique_ptr<EditSession> session_;
};

}  // namespace retint
