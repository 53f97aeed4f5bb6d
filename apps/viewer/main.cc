// SPDX-License-Identifier: BSD-3-Clause
// retint-viewer: parses the command line and shows the window.
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include <QApplication>
#include <QCommandLineParser>
#include <QIcon>
#include <QSettings>
#include <QTimer>

#include "base/error.h"
#include "base/option_name.h"
#include "base/run_clock.h"
#include "colmap_io/nerfstudio.h"
#include "viewer/window/keep_memory.h"
#include "viewer/window/main_window.h"
#include "viewer/window/open_dialog.h"
#include "viewer/window/preferences_dialog.h"
#include "viewer/window/theme.h"

namespace retint {
namespace {

constexpr int kUsage = 2;
constexpr char kScale[] = "QT_SCALE_FACTOR";

// Qt takes --session, as -session of the desktop's session manager, for itself.
constexpr char kSession[] = "retint-session";

std::vector<std::string> HideSession(int argc, char** argv) {
  std::vector<std::string> arguments(argv, argv + argc);
  for (std::string& argument : arguments) {
    if (argument == "--session" || argument.starts_with("--session=")) {
      argument.replace(2, std::strlen("session"), kSession);
    }
  }
  return arguments;
}

void Describe(QCommandLineParser& parser) {
  parser.setApplicationDescription(
      "Recolors regions of 3D Gaussian Splatting scenes from COLMAP workspaces: the desktop "
      "editor.");
  parser.addOptions({
      {{"h", "help"}, "Show this help."},
      {"version", "Show the version."},
      {"workspace", "COLMAP workspace to open; left out: views are placed around the splat.", "WS"},
      {"splat", "Gaussians of that scene; left out: looked for in the workspace.", "S.ply"},
      {"images", "Folder of the photos; left out: found in the workspace.", "DIR"},
      {"model", "Which sparse model of the workspace; left out: the largest.", "NAME"},
      {"world-from-splat",
       "Where the splat lies in the workspace's world: a JSON file or 12 or 16 numbers.", "T.json"},
      {"render-model", "How the splat was trained, default or mip; left out: as its files say.",
       "NAME"},
      {"space", "Color space of the splat's colors in an OpenColorIO config, such as ACEScct.",
       "NAME"},
      {"ocio", "That config; left out: that of $OCIO.", "CONFIG"},
      {"views", "Without a workspace: how many views are placed.", "N", "40"},
      {"session", "Saved session to go on with.", "S.retint"},
      {"backend", "auto, cpu or cuda.", "NAME", "auto"},
      {"holdout", "Keep every n-th view by name out of the fit; 0 keeps none.", "N", "0"},
      {"theme", "system, light or dark; left out: as chosen last.", "NAME"},
  });
  QCommandLineOption session(kSession, "What --session becomes.", "S.retint");
  session.setFlags(QCommandLineOption::HiddenFromHelp);
  parser.addOption(session);
  parser.addPositionalArgument(
      "paths", "Workspace and splat, or a session, in place of --workspace, --splat and --session.",
      "[paths...]");
}

// Why the command line cannot be used; empty when it can.
QString Fault(const QCommandLineParser& parser) {
  const QString backend = parser.value("backend"), theme = parser.value("theme");
  if (!QStringList({"auto", "cpu", "cuda"}).contains(backend)) {
    return "--backend: '" + backend + "' is not auto, cpu or cuda";
  }
  if (parser.isSet("theme") && !QStringList({"system", "light", "dark"}).contains(theme)) {
    return "--theme: '" + theme + "' is not system, light or dark";
  }
  bool ok = false;
  const int holdout = parser.value("holdout").toInt(&ok);
  if (!ok || holdout < 0 || holdout == 1) {
    return "--holdout: '" + parser.value("holdout") + "' is not 0 or at least 2";
  }
  const int views = parser.value("views").toInt(&ok);
  if (!ok || views < 2 || views > 400) {
    return "--views: '" + parser.value("views") + "' is not in 2 to 400";
  }
  if (parser.isSet("render-model") &&
      !ChosenRenderModel(parser.value("render-model").toStdString())) {
    return "--render-model: '" + parser.value("render-model") + "' is not default or mip";
  }
  if (parser.isSet("world-from-splat")) {
    try {
      WorldFromSplatOf(parser.value("world-from-splat").toStdString());
    } catch (const Error& error) {
      return QString::fromStdString(SpellOptions(
          error.what(), [](std::string_view, std::string_view) { return "--world-from-splat"; }));
    }
  }
  const QStringList paths = parser.positionalArguments();
  const auto twice = [&](const char* option, const char* shown) {
    return !paths.isEmpty() && parser.isSet(option)
               ? QString("'%1' by position and %2: only one of them").arg(paths.front(), shown)
               : QString();
  };
  for (const auto& [option, shown] :
       {std::pair("workspace", "--workspace"), std::pair("splat", "--splat"),
        std::pair(kSession, "--session")}) {
    const QString conflict = twice(option, shown);
    if (!conflict.isEmpty()) return conflict;
  }
  const bool session = parser.isSet(kSession) || !SortPaths(paths).session.isEmpty();
  for (const char* option : {"workspace", "splat", "images", "holdout", "model", "world-from-splat",
                             "render-model", "space", "ocio", "views"}) {
    if (session && parser.isSet(option)) {
      return QString("a session has its own --%1").arg(option);
    }
  }
  return {};
}

StartOptions Resolve(const QCommandLineParser& parser) {
  StartOptions start;
  start.scene.workspace = parser.value("workspace").toStdString();
  start.scene.splat = parser.value("splat").toStdString();
  start.scene.options.image_folder = parser.value("images").toStdString();
  start.scene.options.backend = parser.value("backend").toStdString();
  start.scene.options.holdout = parser.value("holdout").toInt();
  start.scene.options.model = parser.value("model").toStdString();
  start.scene.options.views = parser.value("views").toInt();
  start.scene.options.render_model = ChosenRenderModel(parser.value("render-model").toStdString());
  start.scene.options.space = {parser.value("ocio").toStdString(),
                               parser.value("space").toStdString()};
  if (parser.isSet("world-from-splat")) {
    start.scene.options.world_from_splat =
        WorldFromSplatOf(parser.value("world-from-splat").toStdString());
  }
  start.session = parser.value(kSession).toStdString();
  if (const QStringList paths = parser.positionalArguments(); !paths.isEmpty()) {
    const DroppedPaths given = SortPaths(paths);
    start.scene.workspace = given.workspace.toStdString();
    start.scene.splat = given.splat.toStdString();
    start.session = given.session.toStdString();
    start.problem = given.problem;
  }
  return start;
}

int Main(int argc, char** argv) {
  KeepSmallBlocks();
  // Writing beyond a file size limit is an error like a full disk, not a crash.
  std::signal(SIGXFSZ, SIG_IGN);
  QCoreApplication::setApplicationName("retint-viewer");
  QCoreApplication::setOrganizationName("retint");
  QCoreApplication::setApplicationVersion(
      QString::fromUtf8(Version().data(), qsizetype(Version().size())));
  QCommandLineParser parser;
  Describe(parser);
  {
    // Help needs no display.
    QStringList arguments;
    for (int i = 0; i < argc; ++i) arguments << QString::fromLocal8Bit(argv[i]);
    bool text_only = false;
    for (const QString& argument : arguments) {
      text_only = text_only || argument == "--help" || argument == "-h" || argument == "--version";
    }
    if (text_only) {
      const QCoreApplication app(argc, argv);
      if (!parser.parse(app.arguments())) {
        std::fprintf(stderr, "retint-viewer: %s\n", qPrintable(parser.errorText()));
        return kUsage;
      }
      std::printf("%s", parser.isSet("help")
                            ? qPrintable(parser.helpText())
                            : qPrintable("retint-viewer " + app.applicationVersion() + "\n"));
      return 0;
    }
  }
  std::vector<std::string> own = HideSession(argc, argv);
  std::vector<char*> pointers;
  for (std::string& argument : own) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  if (const int scale = Preferences::Load().scale;
      scale != 100 && !qEnvironmentVariableIsSet(kScale)) {
    qputenv(kScale, QByteArray::number(scale / 100.0));  // Qt reads it once
  }
  QApplication app(argc, pointers.data());
  QApplication::setApplicationDisplayName("Retint");
  QGuiApplication::setDesktopFileName("retint-viewer");
  const bool parsed = parser.parse(app.arguments());
  const QString fault = parsed ? Fault(parser) : parser.errorText();
  if (!fault.isEmpty()) {
    std::fprintf(stderr, "retint-viewer: %s\n", qPrintable(fault));
    return kUsage;
  }
  Theme theme;
  theme.Choose(ParseTheme(parser.isSet("theme") ? parser.value("theme")
                                                : QSettings().value("theme").toString()));
  MainWindow window(&theme);
  window.show();
  // Once the window is on the screen.
  QTimer::singleShot(0, &window, [&] {
    window.files().Start(Resolve(parser));
    window.Welcome();
  });
  return QApplication::exec();
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) { return retint::Main(argc, argv); }
