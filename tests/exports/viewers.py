#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Recolored splats in the viewers of others: viewers.py RETINT FOLDER. A ball is made blue and written in the formats
that viewers made of PlayCanvas, of three.js with Spark and of three.js alone read; each draws it in headless Chromium
from a training view, and the picture must be that of `retint render`, with the blue where it is there. FOLDER keeps
the viewers' packages from npm. Exit code 77: there is no Chromium or no npm, or the packages can't be had."""

import base64
import functools
import http.server
import math
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
from browser import Browser, decode_png, find  # noqa: E402

PACKAGES = ("playcanvas@2.23.3", "three@0.187.0", "@sparkjsdev/spark@2.2.0")
VIEW = "002.png"
BLUE = "#2040ff"
# Each format in the viewer that is its home, glTF in two; they read more of them.
FORMATS = {
    "playcanvas": ("blue.ply", "blue.compressed.ply", "blue.sog", "blue.glb"),
    "three": ("blue.spz", "blue.splat"),
    "gltf": ("blue.glb",),
}
# Formats whose frame is not the scene's: the signs of its axes there.
TURNED = {".spz": (1, -1, -1), ".glb": (-1, -1, 1)}
# Viewers leave out faint Gaussians, round colors to bytes and widen thin Gaussians a little.
LEAST_PSNR = 28
LEAST_OVERLAP = 0.9
MOST_SHIFT = 1.0  # pixels


def skip(reason):
    print(reason)
    sys.exit(77)


def install(folder):
    """The viewers' packages, once a folder."""
    if shutil.which("npm") is None:
        skip("there is no npm")
    listing = folder / "packages.txt"
    if listing.exists() and listing.read_text() == " ".join(PACKAGES):
        return
    folder.mkdir(parents=True, exist_ok=True)
    try:
        done = subprocess.run(["npm", "install", "--prefix", folder, "--no-save", "--no-audit", "--no-fund",
                               "--ignore-scripts", "--fetch-retries", "1", *PACKAGES], capture_output=True,
                              text=True, check=False, timeout=300)
    except subprocess.TimeoutExpired:
        skip("npm did not get the viewers within five minutes")
    if done.returncode != 0:
        skip("npm did not get the viewers: " + done.stderr[-300:])
    listing.write_text(" ".join(PACKAGES))


def make_scene(retint, folder):
    """A scene, its ball made blue in every format, and what Retint itself shows of each file."""
    def run(*arguments):
        subprocess.run([retint, *map(str, arguments), "--quiet"], check=True)

    scene = folder / "scene"
    run("synth", "--output", scene, "--width", 240, "--height", 180, "--photos", 5)
    truth = scene / "truth" / "masks" / "ball" / f"{VIEW}.png"
    run("recolor", scene, "--splat", scene / "splat.ply", "--view", VIEW, "--mask", truth, "--to", BLUE,
        "--output", folder / "blue.ply")
    for name in sorted({name for names in FORMATS.values() for name in names}):
        if name != "blue.ply":
            run("convert", folder / "blue.ply", folder / name)
        run("render", scene, "--splat", folder / name, "--view", VIEW, "--output", folder / (name + ".own"))
    return scene


def read_camera(scene):
    """The view's camera as the pages want it, from COLMAP's binary files (PINHOLE)."""
    model = scene / "sparse" / "0"
    _, _, _, width, height, _, focal, _, _ = struct.unpack_from("<QiiQQdddd", (model / "cameras.bin").read_bytes())
    data, at = (model / "images.bin").read_bytes(), 8
    while True:
        values = struct.unpack_from("<i7di", data, at)
        end = data.index(b"\0", at + 64)
        name = data[at + 64:end].decode()
        points, = struct.unpack_from("<Q", data, end + 1)
        at = end + 9 + 24 * points
        if name == VIEW:
            break
    w, x, y, z = values[1:5]
    rotation = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    center = [-sum(rotation[r][c] * values[5 + r] for r in range(3)) for c in range(3)]
    # COLMAP's camera looks along +z with y down, the pages' along -z with y up.
    right, up, back = rotation[0], [-v for v in rotation[1]], [-v for v in rotation[2]]
    matrix = [*right, 0, *up, 0, *back, 0, *center, 1]
    return {"width": width, "height": height, "fovY": math.degrees(2 * math.atan(height / (2 * focal))), "matrix": matrix}


def serve(folder):
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}"


def draw(browser, address, viewer, name, camera):
    signs = (*TURNED.get(pathlib.Path(name).suffix, (1, 1, 1)), 1)
    camera = dict(camera, matrix=[signs[i % 4] * value for i, value in enumerate(camera["matrix"])])
    browser.navigate(f"{address}/{viewer}.html")
    for _ in range(200):
        if browser.evaluate("window.ready === true"):
            break
        time.sleep(0.05)
    browser.evaluate(f"show('/{name}', {camera})")
    clip = {"x": 0, "y": 0, "width": camera["width"], "height": camera["height"], "scale": 1}
    shot = browser.call("Page.captureScreenshot", format="png", clip=clip)
    return decode_png(base64.b64decode(shot["data"]))[2]


def is_blue(pixel):
    red, green, blue = pixel
    return blue > 1.3 * max(red, green) + 20


def compare(name, drawn, own):
    """One line of figures, and what is wrong with them."""
    squares = [(a - b) ** 2 for r, s in zip(drawn, own) for p, q in zip(r, s) for a, b in zip(p, q)]
    psnr = 10 * math.log10(255 ** 2 / max(sum(squares) / len(squares), 1e-9))
    places = [{(x, y) for y, row in enumerate(rows) for x, pixel in enumerate(row) if is_blue(pixel)}
              for rows in (drawn, own)]
    overlap = len(places[0] & places[1]) / max(len(places[0] | places[1]), 1)
    centers = [[sum(p[i] for p in place) / max(len(place), 1) for i in (0, 1)] for place in places]
    shift = math.dist(*centers)
    print(f"{name}: {psnr:.1f} dB, blue on {len(places[0])} pixels, overlap {overlap:.3f}, shift {shift:.2f} pixels")
    faults = []
    if len(places[1]) < 500:
        faults.append(f"{name}: Retint itself shows blue on {len(places[1])} pixels only")
    if psnr < LEAST_PSNR or overlap < LEAST_OVERLAP or shift > MOST_SHIFT:
        faults.append(f"{name}: below {LEAST_PSNR} dB or {LEAST_OVERLAP}, or {MOST_SHIFT} pixels away")
    return faults


def main():
    retint, packages = sys.argv[1], pathlib.Path(sys.argv[2])
    program = find()
    if program is None:
        skip("there is no Chromium")
    install(packages)
    faults = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        camera = read_camera(make_scene(retint, folder))
        for page in [*HERE.glob("*.html"), *HERE.glob("*.js")]:
            shutil.copy(page, folder)
        (folder / "node_modules").symlink_to(packages.resolve() / "node_modules")
        address = serve(folder)
        browser = Browser(program, ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        try:
            for viewer, names in FORMATS.items():
                for file in names:
                    own = decode_png((folder / (file + ".own") / f"{VIEW}.png").read_bytes())[2]
                    faults += compare(f"{viewer}, {file}", draw(browser, address, viewer, file, camera), own)
        finally:
            browser.close()
    for fault in faults:
        print("FAILED:", fault)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
