# SPDX-License-Identifier: BSD-3-Clause
"""A tiny sample workspace, made once, and the real executable to compare with."""

import fcntl
import os
import pathlib
import shutil
import subprocess
import tempfile

import pytest

EXECUTABLE = os.environ["RETINT_EXECUTABLE"]
FOLDER = pathlib.Path(os.environ["RETINT_TEST_FOLDER"])
TINT = "0.2,0.4,1.0"


def run_retint(*arguments):
    """Runs the executable; what it printed when it succeeds. A page is written only where it is named."""
    words = [EXECUTABLE, *map(str, arguments)]
    if arguments[0] == "recolor" and "--report-html" not in words:
        words.append("--no-report-html")
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


class Scene:
    """Files of the sample scene, and its splat on the command line."""

    def __init__(self, folder):
        self.folder = folder
        self.splat = folder / "splat.ply"
        self.mask = next((folder / "masks").iterdir())
        self.view = self.mask.stem

    def arguments(self):
        return [self.folder, "--splat", self.splat, "--quiet"]

    def paint(self):
        return ["--view", self.view, "--mask", self.mask]


def make_scene(name, *arguments):
    """Tests run side by side: the first to come makes it, the others wait."""
    folder = FOLDER / name
    FOLDER.mkdir(parents=True, exist_ok=True)
    with open(FOLDER / f"{name}.lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        splat = folder / "splat.ply"
        made = splat.exists() and splat.stat().st_mtime >= os.stat(EXECUTABLE).st_mtime
        if not made:
            shutil.rmtree(folder, ignore_errors=True)
            run_retint("synth", "--output", folder, "--quiet", *arguments)
    return Scene(folder)


@pytest.fixture(scope="session")
def scene():
    return make_scene("scene", "--width", 160, "--height", 120, "--photos", 8)


@pytest.fixture
def folder():
    with tempfile.TemporaryDirectory() as name:
        yield pathlib.Path(name)
