# SPDX-License-Identifier: BSD-3-Clause
"""Rasterizers of other programs and ours on the same scenes, forward alone, on one NVIDIA GPU.

    python3 tests/benchmarks/rasterizers.py --data DATA --peers FOLDER \
        --ours build/release/tests/benchmarks/retint_bench_device --work WORK

FOLDER holds checkouts, each under its repository's name: PolySplat, FlashGS, gsplat, RoofGS,
faster-gaussian-splatting and diff-gaussian-rasterization. DATA has the captures fox and flower.
A peer that does not build within --build-limit is reported, and the rest goes on. One JSON line
a rasterizer and case goes to WORK/results.jsonl, each picture to WORK/pictures. Needs PyTorch with
CUDA, its compiler, NumPy and Pillow.
"""
import argparse
import importlib
import json
import math
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import time

import numpy as np

from rasterizer_peers import PEERS, build, on_device, renderer

SIZES = {"1080p": (1920, 1080), "4K": (3840, 2160)}
# Capture, view, and copies of it a side: they stand side by side, and the camera steps back.
SCENES = {"fox": ("fox", "0025.jpg", 1), "flower": ("flower", "012.jpg", 1),
          "1M": ("fox", "0025.jpg", 3), "6M": ("fox", "0025.jpg", 7)}
FIELDS = (["x", "y", "z"] + [f"f_dc_{i}" for i in range(3)] + [f"f_rest_{i}" for i in range(45)] +
          ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"])
FRAMES = 60


def read_ply(path):
    content = path.read_bytes()
    end = content.index(b"end_header\n") + 11
    names = re.findall(r"property float (\w+)", content[:end].decode())
    values = np.frombuffer(content, np.float32, offset=end).reshape(-1, len(names))
    return np.ascontiguousarray(values[:, [names.index(field) for field in FIELDS]])


def read_view(model, view):
    """Focal length over width, and the pose of a view of a binary COLMAP model with one camera."""
    content = (model / "cameras.bin").read_bytes()
    width, focal = struct.unpack_from("<Q", content, 16)[0], struct.unpack_from("<d", content, 32)[0]
    content, at = (model / "images.bin").read_bytes(), 8
    while True:
        pose = struct.unpack_from("<7d", content, at + 4)
        end = content.index(b"\0", at + 64)
        if content[at + 64:end].decode() == view:
            return focal / width, np.array(pose[:4]), np.array(pose[4:])
        at = end + 9 + 24 * struct.unpack_from("<Q", content, end + 1)[0]


def read_scene(data, scene):
    """The Gaussians and a camera for each size: the view's width, cut to 16:9."""
    capture, view, copies = SCENES[scene]
    gaussians = read_ply(data / capture / "splat.ply")
    focal, quaternion, translation = read_view(data / capture / "sparse/0", view)
    w, x, y, z = quaternion
    rotation = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                         [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                         [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    if copies > 1:
        depths = gaussians[:, :3] @ rotation[2] + translation[2]
        depth = float(np.median(depths[depths > 0.2]))
        steps = (np.arange(copies) - (copies - 1) / 2) * depth / focal
        offsets = [i * rotation[0] + j * 9 / 16 * rotation[1] for i in steps for j in steps]
        gaussians = np.tile(gaussians, (copies ** 2, 1))
        gaussians[:, :3] += np.repeat(offsets, len(gaussians) // copies ** 2, axis=0)
        translation = translation + [0, 0, (copies - 1) * depth]
    cameras = {size: {"width": width, "height": height, "focal": focal * width, "q": quaternion,
                      "R": rotation, "t": translation, "center": -rotation.T @ translation}
               for size, (width, height) in SIZES.items()}
    return gaussians, cameras


def write_workspaces(options):
    for scene in options.scenes:
        gaussians, cameras = read_scene(options.data, scene)
        first = None
        for size, camera in cameras.items():
            root = options.work / "scenes" / f"{scene}-{size}"
            model = root / "sparse/0"
            model.mkdir(parents=True, exist_ok=True)
            focal, width, height = camera["focal"], camera["width"], camera["height"]
            (model / "cameras.txt").write_text(
                f"1 PINHOLE {width} {height} {focal!r} {focal!r} {width / 2} {height / 2}\n")
            pose = " ".join(repr(float(v)) for v in [*camera["q"], *camera["t"]])
            (model / "images.txt").write_text(f"1 {pose} 1 view.png\n\n")
            (model / "points3D.txt").write_text("")
            if first is None:
                first = root / "splat.ply"
                header = "".join(f"property float {field}\n" for field in FIELDS)
                with open(first, "wb") as file:
                    file.write((f"ply\nformat binary_little_endian 1.0\nelement vertex "
                                f"{len(gaussians)}\n{header}end_header\n").encode())
                    gaussians.tofile(file)
            elif not (root / "splat.ply").exists():
                os.link(first, root / "splat.ply")


def psnr(image, path):
    if not path.exists():
        return None
    error = np.clip(image, 0, 1) - np.clip(np.fromfile(path, np.float32).reshape(image.shape), 0, 1)
    return round(-10 * math.log10(max(float(np.mean(np.square(error, dtype=np.float64))), 1e-12)), 2)


def save_picture(image, path):
    from PIL import Image
    pixels = Image.fromarray((np.clip(image, 0, 1) * 255 + 0.5).astype(np.uint8))
    pixels.resize((480, 270), Image.BOX).save(path)


def measure(name, options):
    import torch
    sys.setdlopenflags(os.RTLD_LAZY)
    sys.path.insert(0, str(options.work / "builds" / name))
    module = importlib.import_module(PEERS[name][0])
    pictures = options.work / "pictures"
    for scene in options.scenes:
        gaussians, cameras = read_scene(options.data, scene)
        g = on_device(torch, gaussians)
        for size, camera in cameras.items():
            case = f"{scene}-{size}"
            with torch.no_grad():
                frame, to_image = renderer(name, torch, module, g, camera, options.peers)
                for _ in range(10):
                    image = frame()
                picture = to_image(image).cpu().numpy().astype(np.float32)
                times, clock = [], []
                for _ in range(FRAMES):
                    start, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
                    torch.cuda.synchronize()
                    began = time.perf_counter()
                    start.record()
                    frame()
                    end.record()
                    end.synchronize()
                    clock.append(1e3 * (time.perf_counter() - began))
                    times.append(start.elapsed_time(end))
            quartiles = [round(float(v), 4) for v in np.percentile(times, [25, 75])]
            print(json.dumps({
                "rasterizer": name, "case": case, "gaussians": len(gaussians),
                "ms": round(float(np.median(times)), 4), "quartiles_ms": quartiles,
                "clock_ms": round(float(np.median(clock)), 4),
                "psnr_original": psnr(picture, pictures / f"original/{case}.f32"),
                "psnr_ours": psnr(picture, pictures / f"ours/{case}.f32")}), flush=True)
            if name == "original":
                picture.tofile(pictures / f"original/{case}.f32")
            save_picture(picture, pictures / f"{name}-{case}.png")
            del frame, image


def measure_ours(options, log):
    pictures = options.work / "pictures"
    scenes = [options.work / "scenes" / f"{s}-{size}" for s in options.scenes for size in SIZES]
    done = subprocess.run([options.ours, "--renders", str(pictures / "ours")] +
                          [f"{scene}:view.png" for scene in scenes], capture_output=True, text=True)
    log(json.dumps({"rasterizer": "ours", "error": done.stderr[-400:]}) if done.returncode else "")
    for line in filter(None, done.stdout.splitlines()):
        of = json.loads(line)
        path = pictures / f"ours/{of['scene']}.f32"
        image = np.fromfile(path, np.float32).reshape(of["height"], of["width"], 3)
        if of["case"] == "forward":
            save_picture(image, pictures / f"ours-{of['scene']}.png")
        log(json.dumps({"rasterizer": "ours, " + {"forward": "kept", "forward_cold": "scratch"}[of["case"]],
                        "case": of["scene"], "gaussians": of["gaussians"], "clock_ms": of["synced_ms"],
                        "quartiles_ms": of["synced_quartiles_ms"], "queued_ms": of["ms"],
                        "psnr_original": psnr(image, pictures / f"original/{of['scene']}.f32")}))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    for option in ("--data", "--peers", "--work"):
        parser.add_argument(option, required=True, type=lambda p: pathlib.Path(p).resolve())
    parser.add_argument("--ours", help="retint_bench_device; without it, the peers alone")
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--only", nargs="+", default=list(PEERS), choices=list(PEERS))
    parser.add_argument("--build-limit", type=float, default=900, help="seconds")
    parser.add_argument("--worker", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        step, name = options.worker
        return build(name, options.peers, options.work) if step == "build" else measure(name, options)
    for folder in (*(f"builds/{name}" for name in options.only), "pictures/ours", "pictures/original"):
        (options.work / folder).mkdir(parents=True, exist_ok=True)
    again = [sys.executable, __file__, *sys.argv[1:], "--worker"]
    started, builds = time.time(), {}
    environment = dict(os.environ, MAX_JOBS="6")
    for name in options.only:
        with open(options.work / f"builds/{name}.log", "w") as output:
            builds[name] = subprocess.Popen(again + ["build", name], stdout=output, stderr=output,
                                            start_new_session=True, env=environment)
    write_workspaces(options)
    with open(options.work / "results.jsonl", "w") as results:
        def log(line):
            if line:
                print(line, flush=True)
                print(line, file=results, flush=True)
        built = {}
        while len(built) < len(builds):
            time.sleep(0.5)
            late = time.time() - started > options.build_limit
            for name, process in builds.items():
                if name in built or (process.poll() is None and not late):
                    continue
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                built[name] = process.wait() == 0
                text = (options.work / f"builds/{name}.log").read_text()
                error = re.findall(r".*(?:error|Error).*", text)[:3] or ["not done in time"]
                log(json.dumps({"rasterizer": name, "built_s": round(time.time() - started)} |
                               ({} if built[name] else {"error": error})))
        if options.ours and "original" not in options.only:
            measure_ours(options, log)
        for name in sorted(options.only, key=lambda n: n != "original"):
            if built[name]:
                done = subprocess.run(again + ["time", name], capture_output=True, text=True, timeout=300)
                for line in done.stdout.splitlines():
                    log(line if line.startswith("{") else "")
                if done.returncode:
                    log(json.dumps({"rasterizer": name, "error": done.stderr[-400:]}))
            if name == "original" and options.ours:
                measure_ours(options, log)


if __name__ == "__main__":
    main()
