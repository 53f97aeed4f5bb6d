// SPDX-License-Identifier: BSD-3-Clause
// The program itself, as a process: its command line, and that nothing accepted is lost when it is
// killed in the middle of work.
#include <signal.h>

#include <QFile>
#include <QProcess>
#include <QRegularExpression>

#include "saving/autosave.h"
#include "saving/session_file.h"
#include "tests/viewer/viewer_scene.h"

namespace retint {

namespace fs = std::filesystem;

class ProcessTest : public QObject {
  Q_OBJECT

 private:
  std::unique_ptr<ViewerScene> scene_;

  // Beginning an edit through the plugin; see driver_plugin.cc.
  std::unique_ptr<QProcess> Start(const QStringList& arguments, const char* task,
                                  const fs::path& saw) {
    auto process = std::make_unique<QProcess>();
    QProcessEnvironment environment = QProcessEnvironment::systemEnvironment();
    environment.insert("QT_PLUGIN_PATH", RETINT_PLUGINS);
    environment.insert("QT_QPA_GENERIC_PLUGINS", "retintdriver");
    environment.insert("RETINT_DRIVE", task);
    environment.insert("RETINT_SAW", QString::fromStdString(saw.string()));
    process->setProcessEnvironment(environment);
    process->setProcessChannelMode(QProcess::ForwardedErrorChannel);
    process->start(RETINT_VIEWER_PROGRAM, arguments);
    return process;
  }

  static QByteArray Saw(const fs::path& path) {
    QFile file(QString::fromStdString(path.string()));
    (void)QTest::qWaitFor([&] { return file.exists() && file.size() > 0; }, 3 * kWaitMs);
    return file.open(QIODevice::ReadOnly) ? file.readAll() : QByteArray("nothing");
  }

  struct Answer {
    int code;
    QString out, error;
  };
  static Answer Ask(const QStringList& arguments) {
    QProcess process;
    process.start(RETINT_VIEWER_PROGRAM, arguments);
    if (!process.waitForFinished(kWaitMs)) process.kill();
    return {process.exitCode(), process.readAllStandardOutput(), process.readAllStandardError()};
  }

 private Q_SLOTS:
  void initTestCase() { scene_ = std::make_unique<ViewerScene>(); }
  void cleanupTestCase() { scene_.reset(); }

  void HelpAndVersionNeedNoDisplay() {
    const QByteArray platform = qgetenv("QT_QPA_PLATFORM");
    qputenv("QT_QPA_PLATFORM", "no-such-platform");
    const Answer help = Ask({"--help"}), version = Ask({"--version"});
    qputenv("QT_QPA_PLATFORM", platform);
    QCOMPARE(help.code, 0);
    for (const char* option : {"--workspace", "--splat", "--session", "--backend", "--holdout"}) {
      QVERIFY2(help.out.contains(option), option);
    }
    QCOMPARE(version.code, 0);
    QVERIFY(QRegularExpression("^retint-viewer \\d+\\.\\d+").match(version.out).hasMatch());
  }

  void ABadCommandLineIsRefused() {
    const std::pair<QStringList, const char*> cases[] = {
        {{"--backend", "abacus"}, "abacus"},
        {{"--holdout", "1"}, "--holdout"},
        {{"--holdout", "x"}, "--holdout"},
        {{"--theme", "pink"}, "pink"},
        {{"--session", "a.retint", "--splat", "b.ply"}, "--splat"},
        {{"--session", "a.retint", "--holdout", "2"}, "--holdout"},
        {{"--session", "a.retint", "--images", "photos"}, "--images"},
        {{"ws", "--workspace", "other"}, "--workspace"},
        {{"s.ply", "--splat", "other.ply"}, "--splat"},
        {{"a.retint", "--session", "b.retint"}, "--session"},
        {{"--no-such-option"}, "no-such-option"}};
    for (const auto& [arguments, named] : cases) {
      const Answer answer = Ask(arguments);
      QCOMPARE(answer.code, 2);
      QVERIFY2(answer.error.contains("retint-viewer: ") && answer.error.contains(named),
               qPrintable(answer.error));
      QCOMPARE(answer.error.count("retint-viewer: "), 1);  // a line; Qt may add its own
    }
  }

  void TheCommandLineOpensScenesAndSessions() {
    const fs::path photos = scene_->folder() / "photos", saved = scene_->folder() / "saved.retint";
    fs::copy(scene_->workspace() / "images", photos);
    const QString workspace = QString::fromStdString(scene_->workspace().string());
    const QString splat = workspace + "/splat.ply";
    const QString elsewhere = QString::fromStdString(photos.string());
    {
      Monitor monitor;
      OpenRequest request = scene_->Request();
      request.options.holdout = 2;
      const auto session =
          EditSession::Open(request.workspace, request.splat, request.options, monitor);
      SessionWriter(saved).Write(TakeSnapshot(*session), monitor);
    }
    const QString session = QString::fromStdString(saved.string());
    const QStringList options = {"--images", elsewhere, "--holdout", "3", "--backend", "cpu"};
    struct Case {
      QStringList arguments, says;
    };
    const Case cases[] = {
        {QStringList{"--workspace", workspace, "--splat", splat} + options,
         {"Photos: " + elsewhere, "2 of them held out", "Splat: " + splat, "Backend: CPU"}},
        {QStringList{workspace, splat} + options,
         {"Photos: " + elsewhere, "2 of them held out", "Splat: " + splat, "Backend: CPU"}},
        {{workspace, "--backend", "cpu"},
         {"Photos: " + workspace + "/images", "Splat: " + splat, "Views: 6\n"}},
        {{"--session", session, "--backend", "cpu"},
         {"Title: saved.retint", "3 of them held out", "Workspace: " + workspace}},
        {{session, "--backend", "cpu"},
         {"Title: saved.retint", "3 of them held out", "Workspace: " + workspace}}};
    int number = 0;
    for (const auto& [arguments, says] : cases) {
      const fs::path saw = scene_->folder() / ("look" + std::to_string(number++));
      auto process = Start(arguments, "look", saw);
      const QString text = QString::fromUtf8(Saw(saw));
      process->kill();
      QVERIFY(process->waitForFinished(kWaitMs));
      for (const QString& part : says) {
        QVERIFY2(text.contains(part),
                 qPrintable(arguments.join(" ") + "\n" + text + "lacks " + part));
      }
    }
  }

  void WhatWasAcceptedSurvivesKillMinusNine() {
    const fs::path saw = scene_->folder() / "saw";
    auto process = Start(
        {"--workspace", QString::fromStdString(scene_->workspace().string()), "--backend", "cpu"},
        "paint", saw);
    QCOMPARE(Saw(saw), QByteArray("painted"));
    // The autosave of a program that lives is nobody else's to recover.
    fs::path left;
    QVERIFY(QTest::qWaitFor(
        [&] {
          std::error_code none;
          for (const auto& entry : fs::directory_iterator(AutosaveDataFolder(), none)) {
            if (fs::exists(entry.path() / "session.json")) left = entry.path();
          }
          return !left.empty();
        },
        kWaitMs));
    QVERIFY(FindRecoverable({}).empty());
    ::kill(static_cast<pid_t>(process->processId()), SIGKILL);
    QVERIFY(process->waitForFinished(kWaitMs));
    QCOMPARE(process->exitStatus(), QProcess::CrashExit);
    const auto found = FindRecoverable({});
    QCOMPARE(found.size(), size_t{1});
    QCOMPARE(found.front().info.regions, size_t{1});

    // The next start offers it, and the region is there again; killed once more, it still is.
    const QString workspace = QString::fromStdString(scene_->workspace().string());
    for (const QStringList& arguments : {QStringList(), QStringList(workspace)}) {
      const fs::path then = scene_->folder() / (arguments.isEmpty() ? "second" : "third");
      process = Start(arguments, "recover", then);
      QCOMPARE(Saw(then), QByteArray("recovered"));
      ::kill(static_cast<pid_t>(process->processId()), SIGKILL);
      QVERIFY(process->waitForFinished(kWaitMs));
    }
    QVERIFY(!FindRecoverable({}).empty());
  }
};

}  // namespace retint

QTEST_MAIN(retint::ProcessTest)
#include "process_test.moc"
