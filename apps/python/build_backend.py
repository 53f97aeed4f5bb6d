# SPDX-License-Identifier: BSD-3-Clause
"""Builds the wheel of the Python package with CMake (PEP 517, PEP 660). Standard library alone.

Below the root, build/python holds the build, so that a second wheel compiles only what changed.
CMAKE_ARGS in the environment is handed to CMake, such as -DRETINT_CUDA=OFF.
"""

import base64
import hashlib
import os
import pathlib
import re
import shlex
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "python"
ENTRY_POINTS = "[console_scripts]\nretint = retint.__main__:main\n"


def version():
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    return re.search(r"^project\(retint VERSION ([0-9.]+)", text, re.MULTILINE).group(1)


def metadata():
    return (
        "Metadata-Version: 2.1\n"
        "Name: retint\n"
        f"Version: {version()}\n"
        "Summary: Recolors regions of 3D Gaussian Splatting scenes from COLMAP workspaces\n"
        "License: BSD-3-Clause\n"
        "Requires-Python: >=3.9\n"
        "Requires-Dist: numpy\n"
        "Description-Content-Type: text/markdown\n"
        "\n" + (ROOT / "README.md").read_text(encoding="utf-8"))


def tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = re.sub(r"[-.]", "_", sysconfig.get_platform())
    return f"{python}-{python}-{platform}"


def wheel_file():
    return f"Wheel-Version: 1.0\nGenerator: retint\nRoot-Is-Purelib: false\nTag: {tag()}\n"


def dist_info():
    return f"retint-{version()}.dist-info"


def jobs():
    """As many as memory allows: a source with PCL or Ceres takes more than a gigabyte."""
    try:
        free = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (ValueError, OSError):
        free = 4 << 30
    return max(1, min(os.cpu_count() or 1, free // 1_500_000_000))


def build(stage):
    """Compiles the module and installs the package below `stage`."""
    subprocess.run(
        ["cmake", "-S", ROOT, "-B", BUILD, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
         "-DRETINT_TESTS=OFF", "-DRETINT_BENCHMARKS=OFF", "-DRETINT_VIEWER=OFF",
         "-DRETINT_PYTHON=ON", f"-DPython_EXECUTABLE={sys.executable}",
         "-DRETINT_PYTHON_FOLDER=.", *shlex.split(os.environ.get("CMAKE_ARGS", ""))], check=True)
    subprocess.run(["cmake", "--build", BUILD, "--target", "retint_python", "-j", str(jobs())],
                   check=True)
    subprocess.run(["cmake", "--install", BUILD, "--component", "python", "--strip",
                    "--prefix", stage], check=True)


def write_wheel(folder, contents):
    """`contents`: bytes by name. Names and times are such that equal files give equal wheels."""
    info = dist_info()
    contents = dict(contents)
    contents[f"{info}/METADATA"] = metadata().encode()
    contents[f"{info}/WHEEL"] = wheel_file().encode()
    contents[f"{info}/entry_points.txt"] = ENTRY_POINTS.encode()
    contents[f"{info}/LICENSE"] = (ROOT / "LICENSE").read_bytes()
    record = ""
    name = f"retint-{version()}-{tag()}.whl"
    with zipfile.ZipFile(pathlib.Path(folder) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, data in sorted(contents.items()):
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record += f"{path},sha256={digest},{len(data)}\n"
            add(wheel, path, data)
        add(wheel, f"{info}/RECORD", f"{record}{info}/RECORD,,\n".encode())
    return name


def add(wheel, path, data):
    entry = zipfile.ZipInfo(path, (2020, 1, 1, 0, 0, 0))
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = (0o755 if path.endswith(".so") else 0o644) << 16
    wheel.writestr(entry, data)


# ---- What pip calls ----

def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    with tempfile.TemporaryDirectory() as stage:
        build(stage)
        files = {path.relative_to(stage).as_posix(): path.read_bytes()
                 for path in pathlib.Path(stage, "retint").rglob("*") if path.is_file()}
    if not any(name.endswith(".so") for name in files):
        raise SystemExit("the Python module was not built: install pybind11-dev, python3-dev and "
                         "python3-numpy (apps/setup.sh)")
    return write_wheel(wheel_directory, files)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """The build's own folder on the path: a rebuild is seen at once."""
    with tempfile.TemporaryDirectory() as stage:
        build(stage)
    path = f"{BUILD / 'apps' / 'python'}\n"
    return write_wheel(wheel_directory, {"retint.pth": path.encode()})


def build_sdist(sdist_directory, config_settings=None):
    name = f"retint-{version()}"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True)
    files = [file for file in listed.stdout.decode().split("\0") if file]
    with tarfile.open(pathlib.Path(sdist_directory) / f"{name}.tar.gz", "w:gz",
                      format=tarfile.PAX_FORMAT) as archive:
        for file in files:
            archive.add(ROOT / file, f"{name}/{file}", recursive=False)
        with tempfile.NamedTemporaryFile("w", encoding="utf-8") as info:
            info.write(metadata())
            info.flush()
            archive.add(info.name, f"{name}/PKG-INFO")
    return f"{name}.tar.gz"
