// SPDX-License-Identifier: BSD-3-Clause
#include "retint/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "base/error.h"

namespace retint::cli {
namespace {

constexpr int kBarWidth = 28;
constexpr std::chrono::milliseconds kRedraw{100};

std::string Duration(double seconds, int digits) {
  char text[32];
  if (seconds < 60) {
    std::snprintf(text, sizeof text, "%.*f s", digits, seconds);
  } else {
    const long whole = std::lround(seconds);
    std::snprintf(text, sizeof text, "%ld:%02ld min", whole / 60, whole % 60);
  }
  return text;
}

double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
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

void ProgressPrinter::SetPlan(std::vector<PlannedStage> plan) {
  std::lock_guard lock(mutex_);
  const std::string first = plan.front().name;
  whole_ = OverallProgress(std::move(plan));
  whole_.Update({first, 1});
}

double ProgressPrinter::SecondsLeft() const {
  constexpr double kLeastFraction = 0.02, kLeastSeconds = 0.5;  // before, it would be a guess
  const double fraction = whole_.fraction(), seconds = SecondsSince(begin_);
  if (fraction < kLeastFraction || seconds < kLeastSeconds) return -1;
  return seconds * (1 - fraction) / fraction;
}

void ProgressPrinter::Report(const Progress& progress) {
  if (style_ == ProgressStyle::kNone) return;
  std::lock_guard lock(mutex_);
  // A stage may be visited again (several painted views, several regions).
  if (IsNewVisit(newest_, progress)) {
    EndStage(/*done=*/true);
    start_ = Clock::now();
    last_drawn_ = {};
  }
  newest_ = progress;
  whole_.Update(progress);
  const auto now = Clock::now();
  if (now - last_drawn_ < kRedraw) return;
  last_drawn_ = now;
  Draw(progress.fraction);
}

void ProgressPrinter::Draw(double fraction) {
  const double whole = finished_ ? 1 : whole_.fraction();
  const double left = finished_ ? 0 : SecondsLeft();
  const std::string& stage = newest_.stage;
  if (style_ == ProgressStyle::kJson) {
    std::fprintf(stderr, "{\"stage\":\"%s\",\"fraction\":%.4f,\"seconds\":%.3f,\"total\":%.4f",
                 stage.c_str(), fraction, SecondsSince(start_), whole);
    if (left >= 0) std::fprintf(stderr, ",\"left\":%.1f", left);
    std::fprintf(stderr, "}\n");
  } else if (style_ == ProgressStyle::kBar) {
    const int full = static_cast<int>(whole * kBarWidth);
    std::string bar(static_cast<size_t>(full), '=');
    if (full < kBarWidth) bar += '>';
    bar.resize(kBarWidth, ' ');
    const std::string text = left >= 0 ? "about " + Duration(left, 0) + " left" : "";
    std::fprintf(stderr, "\r\033[K%-13s[%s] %3.0f %%  %s", stage.c_str(), bar.c_str(), 100 * whole,
                 text.c_str());
    drawn_ = true;
  }
}

void ProgressPrinter::EndStage(bool done) {
  if (newest_.stage.empty()) return;
  if (style_ == ProgressStyle::kBar && !done && drawn_) {
    std::fprintf(stderr, "\r\033[K");
  } else if (done && style_ == ProgressStyle::kPlain) {
    const double left = finished_ ? -1 : SecondsLeft();
    std::fprintf(stderr, "%-13s%s%s\n", newest_.stage.c_str(),
                 Duration(SecondsSince(start_), 1).c_str(),
                 left >= 0 ? (", about " + Duration(left, 0) + " left").c_str() : "");
  } else if (done && style_ == ProgressStyle::kJson) {
    whole_.Update({newest_.stage, 1});
    Draw(1.0);
  }
  newest_ = {};
}

void ProgressPrinter::Finish() {
  std::lock_guard lock(mutex_);
  finished_ = true;
  EndStage(/*done=*/true);
  if (drawn_) std::fprintf(stderr, "\r\033[K");
  drawn_ = false;
}

void ProgressPrinter::Clear() {
  std::lock_guard lock(mutex_);
  if (drawn_) std::fprintf(stderr, "\r\033[K");
  drawn_ = false;
}

}  // namespace retint::cli
