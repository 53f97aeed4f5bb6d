// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/sample_scene.h"

#include <chrono>
#include <exception>

#include "synthetic/synthetic_scene.h"
#include "synthetic/synthetic_workspace.h"

namespace retint {
namespace {

constexpr int kWidth = 480, kHeight = 360, kViews = 8;

}  // namespace

SampleScene::~SampleScene() {
  background_.Cancel();
  if (thread_.joinable()) thread_.join();
}

void SampleScene::Prepare() {
  thread_ = std::thread([this] {
    const std::lock_guard lock(making_);
    try {
      MakeAlone(background_);
    } catch (const std::exception&) {
      // Make() tries again, and reports the failure.
    }
  });
}

void SampleScene::Make(Monitor& monitor) {
  std::unique_lock lock(making_, std::defer_lock);
  while (!lock.try_lock_for(std::chrono::milliseconds(50))) monitor.Step("sample", 0, 1);
  MakeAlone(monitor);
}

void SampleScene::MakeAlone(Monitor& monitor) {
  namespace fs = std::filesystem;
  if (fs::exists(folder_ / "splat.ply")) return;
  SyntheticOptions options;
  options.width = kWidth, options.height = kHeight, options.views = kViews;
  const SyntheticScene scene = MakeSyntheticScene(options, monitor);
  // Under another name until it is complete.
  fs::path part = folder_;
  part += ".part";
  fs::remove_all(part);
  WriteSyntheticWorkspace(part, scene, monitor);
  fs::remove_all(folder_);
  fs::rename(part, folder_);
}

}  // namespace retint
