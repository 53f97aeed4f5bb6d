#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""OpenUSD files in a reader that isn't ours: usd.py RETINT FOLDER. tinyusdz opens a small splat in every form that
Retint writes, and prints the numbers that Retint was given. FOLDER keeps its package from npm. Exit code 77: there is
no Node or no npm, or the package can't be had."""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

PACKAGE = "tinyusdz@0.9.0-rc10"
HERE = pathlib.Path(__file__).resolve().parent
COLUMNS = ("x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", *(f"f_rest_{i}" for i in range(9)), "opacity", "scale_0",
           "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")
ROWS = ((1, 2, 3, .5, -.5, .25, *(i / 16 for i in range(9)), 0, 0, 0, 0, 1, 0, 0, 0),
        (-4, 5, -6, 1, 0, -1, *(-i / 32 for i in range(9)), 0, 0, 0, 0, 0, 1, 0, 0))


def skip(reason):
    print(reason)
    sys.exit(77)


def install(folder):
    if shutil.which("npm") is None or shutil.which("node") is None:
        skip("there is no Node or no npm")
    package = folder / "node_modules" / "tinyusdz"
    if not (package / "tinyusdz.wasm").exists():
        folder.mkdir(parents=True, exist_ok=True)
        try:
            done = subprocess.run(["npm", "install", "--prefix", folder, "--no-save", "--no-audit", "--no-fund",
                                   "--ignore-scripts", "--fetch-retries", "1", PACKAGE], capture_output=True,
                                  text=True, check=False, timeout=300)
        except subprocess.TimeoutExpired:
            skip("npm did not get tinyusdz within five minutes")
        if done.returncode != 0:
            skip("npm did not get tinyusdz: " + done.stderr[-300:])
    return package


def numbers(text, name):
    found = re.search(r"\s" + re.escape(name) + r" = \[(.*?)\]", text, re.S)
    assert found, f"{name} is missing:\n{text[:2000]}"
    return [float(number) for number in re.findall(r"[-+.\deE]+", found.group(1))]


def check(text):
    for part in ('def ParticleField3DGaussianSplat "Gaussians"', 'upAxis = "Y"', "metersPerUnit = 1",
                 "radiance:sphericalHarmonicsDegree = 1", 'colorSpace:name = "srgb_rec709_display"'):
        assert part in text, f"{part} is missing:\n{text[:2000]}"
    # Right-up-back: y and z change sign, and of degree 1 (-y, z, -x) the first two.
    expected = {"positions": [x for row in ROWS for x in (row[0], -row[1], -row[2])],
                "scales": [1] * 6, "opacities": [.5] * 2, "orientations": [1, 0, 0, 0, 0, 1, 0, 0],
                "radiance:sphericalHarmonicsCoefficients":
                    [x for row in ROWS for x in (*row[3:6], *(sign * row[6 + 3 * c + k] for k, sign in
                                                              ((0, -1), (1, -1), (2, 1)) for c in range(3)))]}
    for name, values in expected.items():
        got = numbers(text, name)
        assert len(got) == len(values), f"{name}: {len(got)} numbers"
        assert all(abs(a - b) < 1e-6 for a, b in zip(got, values)), f"{name}: {got}, expected {values}"


def main():
    retint, package = sys.argv[1], install(pathlib.Path(sys.argv[2]))
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        header = "ply\nformat ascii 1.0\nelement vertex 2\n" + "".join(f"property float {c}\n" for c in COLUMNS)
        (folder / "a.ply").write_text(header + "end_header\n" + "".join(
            " ".join(map(str, row)) + "\n" for row in ROWS))
        for name in ("a.usda", "a.usdc", "a.usdz", "a.usd"):
            subprocess.run([retint, "convert", folder / "a.ply", folder / name, "--quiet"], check=True)
            done = subprocess.run(["node", HERE / "tinyusdz.mjs", package, folder / name], capture_output=True,
                                  text=True, check=False, timeout=120)
            assert done.returncode == 0, f"{name}: {done.stderr[-500:]}"
            check(done.stdout)
            print(name, "is read as it was meant")


if __name__ == "__main__":
    main()
