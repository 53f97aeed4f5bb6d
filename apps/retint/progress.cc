// SPDX-License-Identifier: BSD-3-Clause
#include "retint/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "base/error.h"

namespace retint::cli {
namespace {

constexpr int kBarWidth = 28;
constexpr std::chrono::milliseconds kRedraw{100};

std::string Duration(double seconds) {
  char text[32];
  if (seconds < 60) {
    std::snprintf(text, sizeof text, "%.1f s", seconds);
  } else {
    const long whole = std::lround(seconds);
    std::snprintf(text, sizeof text, "%ld:%02ld min", whole / 60, whole % 60);
  }
  return text;
}

bool IsTerminal() {
  const char* term = std::getenv("TERM");
  return isatty(STDERR_FILENO) != 0 && !(term && std::string(term) == "dumb");
}

}  // namespace

ProgressStyle ParseProgressStyle(const std::string& name) {
  if (name == "auto") return IsTerminal() ? ProgressStyle::kBar : ProgressStyle::kPlain;
  if (name == "bar") return ProgressStyle::kBar;
  if (name == "plain") return ProgressStyle::kPlain;
  if (name == "json") return ProgressStyle::kJson;
  if (name == "none") return ProgressStyle::kNone;
  throw OptionError("--progress: '" + name + "' is not auto, bar, plain, json or none");
}

double ProgressPrinter::Seconds() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void ProgressPrinter::Report(const Progress& progress) {
  if (style_ == ProgressStyle::kNone) return;
  std::lock_guard lock(mutex_);
  // A stage may be visited again (several painted views, several regions): back at its beginning,
  // it is a new line.
  if (progress.stage != stage_ || progress.fraction + 0.5 < fraction_) {
    EndStage(/*done=*/true);
    stage_ = progress.stage;
    start_ = Clock::now();
    last_drawn_ = {};
  }
  fraction_ = progress.fraction;
  const auto now = Clock::now();
  if (now - last_drawn_ < kRedraw) return;
  last_drawn_ = now;
  Draw(fraction_);
}

void ProgressPrinter::Draw(double fraction) {
  if (style_ == ProgressStyle::kJson) {
    std::fprintf(stderr, "{\"stage\":\"%s\",\"fraction\":%.4f,\"seconds\":%.3f}\n", stage_.c_str(),
                 fraction, Seconds());
  } else if (style_ == ProgressStyle::kBar) {
    const int full = static_cast<int>(fraction * kBarWidth);
    std::string bar(static_cast<size_t>(full), '=');
    if (full < kBarWidth) bar += '>';
    bar.resize(kBarWidth, ' ');
    const double elapsed = Seconds();
    const std::string left = fraction > 0.02 && elapsed > 0.5
                                 ? Duration(elapsed * (1 - fraction) / fraction) + " left"
                                 : "";
    std::fprintf(stderr, "\r\033[K%-13s[%s] %3.0f %%  %s", stage_.c_str(), bar.c_str(),
                 100 * fraction, left.c_str());
    drawn_ = true;
  }
}

void ProgressPrinter::EndStage(bool done) {
  if (stage_.empty()) return;
  if (style_ == ProgressStyle::kBar) {
    std::fprintf(stderr, "\r\033[K");
    if (done) {
      std::fprintf(stderr, "%-13s[%s] %s\n", stage_.c_str(), std::string(kBarWidth, '=').c_str(),
                   Duration(Seconds()).c_str());
    }
  } else if (done && style_ == ProgressStyle::kPlain) {
    std::fprintf(stderr, "%-13s%s\n", stage_.c_str(), Duration(Seconds()).c_str());
  } else if (done && style_ == ProgressStyle::kJson) {
    Draw(1.0);
  }
  stage_.clear();
  fraction_ = 0;
  drawn_ = false;
}

void ProgressPrinter::Finish() {
  std::lock_guard lock(mutex_);
  EndStage(/*done=*/true);
}

void ProgressPrinter::Clear() {
  std::lock_guard lock(mutex_);
  if (drawn_) std::fprintf(stderr, "\r\033[K");
  drawn_ = false;
}

}  // namespace retint::cli
