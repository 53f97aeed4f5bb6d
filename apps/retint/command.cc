// SPDX-License-Identifier: BSD-3-Clause
#include "retint/command.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <tbb/global_control.h>

#include "base/error.h"
#include "base/printable.h"
#include "base/ranks.h"
#include "cluster/mpi_ranks.h"
#include "retint/common.h"
#include "retint/file_checks.h"
#include "retint/help.h"
#include "retint/manual.h"
#include "retint/stage_plans.h"
#include "retint/usage_fault.h"
#include "retint/verbs.h"
#include "retint/version.h"

namespace retint::cli {
namespace {

enum ExitCode { kOk = 0, kUsage = 2, kInput = 3, kRunTime = 4, kInterrupted = 130 };

int Fail(ExitCode code, std::string message, const Globals& globals) {
  message.resize(message.find_last_not_of(" \n") + 1);  // OpenCV ends its lines
  const std::string line =
      globals.json_messages ? JsonMessage("error", message, code) : "retint: " + Printable(message);
  std::fprintf(stderr, "%s\n", line.c_str());
  return code;
}

// Whether --progress json is asked for. A command line that cannot be understood is told so, too.
bool AsksForJson(int argc, char** argv) {
  constexpr std::string_view kFlag = "--progress", kWithValue = "--progress=";
  std::string_view value;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == kFlag && i + 1 < argc) value = argv[i + 1];
    if (word.starts_with(kWithValue)) value = word.substr(kWithValue.size());
  }
  return value == "json";
}

void SetUpLogging(const Globals& globals) {
  auto logger =
      std::make_shared<spdlog::logger>("retint", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_pattern(globals.json_messages ? "%v" : "retint: %l: %v");
  logger->set_level(globals.quiet ? spdlog::level::off
                                  : spdlog::level::from_str(globals.log_level));
  spdlog::set_default_logger(std::move(logger));
}

// `arguments` as a shell reads them.
std::string Typed(int argc, char** argv) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./,:=+@%";
  std::string line = "retint";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    line += ' ';
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) {
      line += word;
      continue;
    }
    line += '\'';
    for (const char c : word) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += '\'';
  }
  return line;
}

// The meaning of an exception that ended the run, for its caller.
struct Failure {
  ExitCode code;
  std::string message;
};

Failure Describe(std::exception_ptr thrown, const Globals& globals) {
  try {
    std::rethrow_exception(thrown);
  } catch (const OptionError& error) {
    return {kUsage, WithFlags(error.what(), globals)};
  } catch (const InputError& error) {
    return {kInput, WithFlags(error.what(), globals)};
  } catch (const Cancelled&) {
    return {kInterrupted, "interrupted; nothing was written"};
  } catch (const std::bad_alloc& error) {
    // A device's says what did not fit.
    const std::string what = error.what();
    return {
        kRunTime,
        what == std::bad_alloc().what()
            ? "out of memory"
            : what + "; a smaller --cache-mb or --set region_cache_mb leaves more for the rest"};
  } catch (const std::exception& error) {
    return {kRunTime, WithFlags(error.what(), globals)};
  }
}

// Ends all ranks. Mostly all of them fail alike, at about the same time: then the first speaks, and
// ends the others before their turn comes.
[[noreturn]] void FailAll(const Failure& failure, const Ranks& ranks, const Globals& globals) {
  constexpr std::chrono::seconds kTurn{2};
  constexpr int kMostTurns = 3;
  std::this_thread::sleep_for(kTurn * std::min(ranks.rank(), kMostTurns));
  const std::string where = ranks.IsRoot() ? "" : "rank " + std::to_string(ranks.rank()) + ": ";
  Fail(failure.code, where + failure.message, globals);
  AbortMpi(failure.code);
}

void RunAction(const Globals& globals, const Action& action) {
  Run run(globals);
  action(run);
  run.Flush();
}

int ExecuteAlone(const Globals& globals, const Action& action) {
  try {
    RunAction(globals, action);
    return kOk;
  } catch (...) {
    const Failure failure = Describe(std::current_exception(), globals);
    return Fail(failure.code, failure.message, globals);
  }
}

// One rank of several. Leaving waits for the others.
int ExecuteShared(const Globals& globals, const Action& action) {
  std::unique_ptr<Ranks> ranks;
  try {
    ranks = JoinMpi();
  } catch (...) {
    const Failure failure = Describe(std::current_exception(), globals);
    return ReadLaunch().rank == 0 ? Fail(failure.code, failure.message, globals) : failure.code;
  }
  const ShareAmong share(*ranks);
  try {
    RunAction(globals, action);
    return kOk;
  } catch (...) {
    FailAll(Describe(std::current_exception(), globals), *ranks, globals);
  }
}

int Execute(Globals globals, const Action& action, bool shared) {
  const Launch launch = ReadLaunch();
  if (shared) {
    globals.quiet = globals.quiet || launch.rank > 0;
    ChooseDevice(launch);
    if (globals.threads == 0 && launch.local_size > 1) globals.threads = ThreadsOfRank(launch);
  }
  SetUpLogging(globals);
  std::unique_ptr<tbb::global_control> limit;
  if (globals.threads > 0) {
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<size_t>(globals.threads));
  }
  return shared ? ExecuteShared(globals, action) : ExecuteAlone(globals, action);
}

void AddVerbs(CLI::App& app, Globals& globals, Action& action) {
  for (const VerbGroup& group : VerbGroups()) {
    const size_t before = app.get_subcommands([](CLI::App*) { return true; }).size();
    for (const auto add : group.verbs) add(app, globals, action);
    const auto all = app.get_subcommands([](CLI::App*) { return true; });
    for (size_t i = before; i < all.size(); ++i) all[i]->group(group.title);
  }
}

}  // namespace

int RunCommand(int argc, char** argv) {
  // Writing beyond a file size limit is an error like a full disk, not a crash.
  std::signal(SIGXFSZ, SIG_IGN);
  Globals globals;
  globals.command = Typed(argc, argv);
  globals.json_messages = AsksForJson(argc, argv);
  Action action;
  CLI::App app("Recolors regions of 3D Gaussian Splatting scenes", "retint");
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_help_flag("-h", "The options that people use");
  app.set_help_all_flag("--help", "All options that are flags");
  app.set_version_flag(
      "--version", [] { return VersionText(); }, "Version, backends and libraries");
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::simple);
  app.footer(
      "`retint COMMAND -h` shows the common options of a command and examples, --help all flags.\n"
      "Exit codes: 0 done, 2 usage, 3 input, 4 run time, 130 interrupted.");
  AddExamples(&app, {"retint synth -o sample",
                     "retint recolor sample --view 023.png --mask sample/masks/023.png.png "
                     "--to '#3060ff' -o out.ply"});
  AddVerbs(app, globals, action);
  AddManual(app);
  const Launch launch = ReadLaunch();
  const std::string first = argc > 1 ? argv[1] : "";
  const auto known = app.get_subcommands([](const CLI::App*) { return true; });
  const auto is_first = [&](const CLI::App* verb) { return verb->get_name() == first; };
  if (!first.empty() && first[0] != '-' && std::none_of(known.begin(), known.end(), is_first)) {
    return launch.rank > 0 ? kOk : Fail(kUsage, UnknownVerb(app, first), globals);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // The first rank says it; mpirun would end it before that if another had failed already.
    if (launch.rank > 0) return kOk;
    if (error.get_exit_code() == 0) {  // --help, --version, manual
      const int code = app.exit(error);
      return FlushOutput() ? code : Fail(kRunTime, kNoStandardOutput, globals);
    }
    return Fail(kUsage, UsageFault(app, error), globals);
  }
  const auto verbs = app.get_subcommands();
  InputGuard guard(InputGuard::Guards::kReads);
  try {
    for (const CLI::App* verb : verbs) {
      const auto found = globals.scenes.find(verb);
      SceneArguments* const scene = found == globals.scenes.end() ? nullptr : found->second;
      if (scene) FindScene(*scene);
      CheckFiles(*verb, scene, &guard);
    }
  } catch (...) {
    const Failure failure = Describe(std::current_exception(), globals);
    return launch.rank > 0 ? kOk : Fail(failure.code, failure.message, globals);
  }
  const bool shared = launch.by_mpi && !verbs.empty() && SharesWork(verbs.front()->get_name());
  if (launch.rank > 0 && !shared) return kOk;
  if (!verbs.empty()) globals.plan = PlanOf(*verbs.front());
  return Execute(globals, action, shared);
}

}  // namespace retint::cli
