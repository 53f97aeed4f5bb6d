# SPDX-License-Identifier: BSD-3-Clause
"""What the measuring scripts share: scenes, runs of `retint` side by side, masks, depth, tables.

Python's standard library only, so that the scripts run wherever `retint` does.
"""
import argparse
import array
import concurrent.futures
import functools
import itertools
import json
import pathlib
import shlex
import statistics
import struct
import subprocess
import sys
import threading
import time
import zlib

# Scenes made by `retint synth`: the same still life, and flaws that real splats have.
SYNTHETIC = {
    "sample": [],
    "misplaced": ["--depth-wave", "0.02", "--depth-noise", "0.01",
                  "--floaters", "1500", "--floater-opacity", "0.3"],
    "cloud scaled": ["--cloud-scale", "1.05"],
    "cloud shifted": ["--cloud-shift", "0.03"],
    "bare walls": ["--bare-walls", "--wall-bias", "0.15"],
}
# Captures: the painted view with its mask, and the folder of true masks, in the scene's folder.
CAPTURES = {
    "fox": ("0025.jpg", "masks/0025.jpg.png", "truth"),
    "flower": ("012.jpg", "masks/012.jpg.png", "truth"),
    "cape": ("IMG_5881.jpg", "truth/IMG_5881.jpg.png", "truth"),
}


def arguments(description, scenes):
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--retint", default="retint", help="the program, and options before a verb")
    parser.add_argument("--data", type=pathlib.Path, help="folder of the captures")
    parser.add_argument("--work", type=pathlib.Path, required=True, help="folder for what is made")
    parser.add_argument("--scenes", default=",".join(scenes), help="separated by commas")
    parser.add_argument("--objects", default="ball,box,candlestick,pot,plant,pear",
                        help="of the synthetic scenes")
    parser.add_argument("--size", default="400x300x12", help="of synthetic photos, and how many")
    parser.add_argument("--detail", type=int, default=1,
                        help="how many times finer the synthetic splats are than their photos")
    parser.add_argument("--jobs", type=int, default=2, help="runs side by side")
    parser.add_argument("--threads", type=int, default=1, help="of each run")
    parser.add_argument("--backend", default="cpu", help="cpu, cuda or auto")
    parser.add_argument("--limit", type=float, default=0,
                        help="seconds after which nothing more is started, and the tables are "
                        "printed with holes; 0: none")
    parser.add_argument("--output", type=pathlib.Path, help="all figures (.json)")
    return parser


class Failed(Exception):
    pass


class Runner:
    """Runs `retint`; what a run printed, or Failed with its last line."""

    def __init__(self, options):
        self.command = shlex.split(options.retint)
        self.everywhere = ["--backend", options.backend, "--threads", str(options.threads),
                           "--progress", "none"]
        self.jobs, self.limit = options.jobs, options.limit
        self.lock = threading.Lock()
        self.count = 0
        self.start = time.time()

    def __call__(self, verb, *arguments):
        page = ["--no-report-html"] if verb == "recolor" else []
        command = self.command + [verb] + [str(a) for a in arguments] + page + self.everywhere
        try:
            done = subprocess.run(command, capture_output=True, text=True)
        except OSError as error:
            raise Failed(f"{command[0]}: {error.strerror}") from error
        with self.lock:
            self.count += 1
            if self.count % 50 == 0:
                print(f"{self.count} runs, {time.time() - self.start:.0f} s",
                      file=sys.stderr, flush=True)
        if done.returncode != 0:
            line = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise Failed(f"{' '.join(command)}: {line}")
        return done.stdout

    def each(self, function, items):
        """function(item) of all items, `jobs` at a time; None for one that failed or was left out."""
        def attempt(item):
            if self.limit and time.time() - self.start > self.limit:
                return None
            try:
                return function(item)
            except Failed as failure:
                print(failure, file=sys.stderr, flush=True)
                return None
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(attempt, items))


class Paint:
    """One painted view of an object, and the object's true masks: {image name: file}."""

    def __init__(self, scene, label, workspace, view, mask, truth):
        self.scene, self.label, self.workspace = scene, label, workspace
        self.view, self.mask, self.truth = view, mask, truth
        self.splat = workspace / "splat.ply"

    def scene_flags(self):
        return [self.workspace, "--splat", self.splat]

    def paint_flags(self):
        return ["--view", self.view, "--mask", self.mask]

    def exact_depth(self):
        file = self.workspace / "truth" / "depth" / (self.view + ".bin")
        return file if file.exists() else None

    def folder(self, work):
        return work / self.scene.replace(" ", "-") / self.label


def masks_in(folder):
    return {f.name[:-len(".png")]: f for f in sorted(folder.glob("*.png"))}


def make_scenes(options, run):
    """Paints of all scenes asked for; makes the synthetic ones."""
    names = [name for name in options.scenes.split(",") if name]
    for name in names:
        if name not in SYNTHETIC and name not in CAPTURES:
            sys.exit(f"scene '{name}' is unknown; there are: "
                     + ", ".join([*SYNTHETIC, *CAPTURES]))
        if name in CAPTURES and options.data is None:
            sys.exit(f"scene '{name}' needs --data")
    width, height, views = options.size.split("x")

    def make(name):
        folder = options.work / name.replace(" ", "-") / "workspace"
        if not (folder / "splat.ply").exists():
            run("synth", "--output", folder, "--width", width, "--height", height,
                "--photos", views, "--detail", options.detail, *SYNTHETIC[name])

    run.each(make, [name for name in names if name in SYNTHETIC])
    paints = []
    for name in names:
        if name in CAPTURES:
            view, mask, truth = CAPTURES[name]
            folder = options.data / name
            paints.append(Paint(name, "object", folder, view, folder / mask,
                                masks_in(folder / truth)))
            continue
        folder = options.work / name.replace(" ", "-") / "workspace"
        for label in options.objects.split(","):
            truth = masks_in(folder / "truth" / "masks" / label)
            view = largest_whole(truth)
            if view:
                paints.append(Paint(name, label, folder, view, truth[view], truth))
    return paints


def largest_whole(masks):
    """The view in which most of the object shows and none of it touches the border."""
    best = (0, None)
    for name, file in masks.items():
        width, height, rows = read_mask(file)
        border = rows[0] + rows[-1] + bytes(r[0] for r in rows) + bytes(r[-1] for r in rows)
        if not any(border):
            best = max(best, (sum(sum(r) for r in rows), name))
    return best[1]


# ---- Pictures and depth ----

def read_mask(path):
    """(width, height, rows) of an 8-bit gray PNG; a row's bytes are 1 inside (>= 128), else 0."""
    data = pathlib.Path(path).read_bytes()
    width, height = int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    if data[:4] != b"\x89PNG" or data[24:26] != b"\x08\x00" or data[28]:
        raise Failed(f"{path}: is no plain 8-bit gray PNG")
    packed, at = [], 8
    while at < len(data):
        length = int.from_bytes(data[at:at + 4], "big")
        if data[at + 4:at + 8] == b"IDAT":
            packed.append(data[at + 8:at + 8 + length])
        at += 12 + length
    raw = zlib.decompress(b"".join(packed))
    rows, above = [], bytes(width)
    for y in range(height):
        kind, line = raw[y * (width + 1)], raw[y * (width + 1) + 1:(y + 1) * (width + 1)]
        above = unfiltered(kind, line, above)
        rows.append(above.translate(INSIDE))
    return width, height, rows


INSIDE = bytes(int(value >= 128) for value in range(256))


def unfiltered(kind, line, above):
    """A row of a PNG with one byte a pixel, from its filtered bytes (PNG specification, 9.2)."""
    if kind == 0:
        return line
    if not any(line) and (kind == 2 or not any(above)):
        return above if kind == 2 else line
    if kind == 1:
        return bytes(v & 255 for v in itertools.accumulate(line))
    if kind == 2:
        return bytes((a + b) & 255 for a, b in zip(line, above))
    row, left, corner = bytearray(len(line)), 0, 0
    for x, value in enumerate(line):
        up = above[x]
        if kind == 3:
            guess = (left + up) // 2
        else:
            p = left + up - corner
            near = abs(p - left), abs(p - up), abs(p - corner)
            guess = (left, up, corner)[near.index(min(near))]
        left = row[x] = (value + guess) & 255
        corner = up
    return bytes(row)


@functools.lru_cache(maxsize=None)
def true_bits(path):
    _, _, rows = read_mask(path)
    return int.from_bytes(b"".join(rows), "big")


def overlap(mask, truth):
    """Intersection over union; None where neither shows anything."""
    _, _, rows = read_mask(mask)
    bits, true = int.from_bytes(b"".join(rows), "big"), true_bits(truth)
    either = (bits | true).bit_count()
    return (bits & true).bit_count() / either if either else None


def overlaps(folder, paint):
    """IoU of the masks in a folder with the true ones, in all views but the painted one."""
    values = [overlap(folder / (name + ".png"), truth)
              for name, truth in paint.truth.items() if name != paint.view]
    return [v for v in values if v is not None]


def read_depth(path):
    data = pathlib.Path(path).read_bytes()
    width, height, _, rest = data.split(b"&", 3)
    depth = array.array("f")
    depth.frombytes(rest)
    return int(width), int(height), depth


def read_cameras(workspace):
    """{image name: (focal lengths and center, rotation w x y z, translation)} of the pinhole views
    that `retint synth` writes (COLMAP's binary files)."""
    folder = pathlib.Path(workspace) / "sparse" / "0"
    data, cameras, at = (folder / "cameras.bin").read_bytes(), {}, 8
    while at < len(data):
        number, model = struct.unpack_from("<ii", data, at)
        if model != 1:
            raise Failed(f"{folder / 'cameras.bin'}: camera {number} is no PINHOLE")
        cameras[number] = struct.unpack_from("<4d", data, at + 24)
        at += 24 + 32
    data, views, at = (folder / "images.bin").read_bytes(), {}, 8
    while at < len(data):
        pose = struct.unpack_from("<7d", data, at + 4)
        camera, = struct.unpack_from("<i", data, at + 60)
        end = data.index(b"\0", at + 64)
        points, = struct.unpack_from("<Q", data, end + 1)
        views[data[at + 64:end].decode()] = cameras[camera], pose[:4], pose[4:]
        at = end + 9 + 24 * points
    return views


def quantile(ordered, share):
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else None


def mean(values):
    values = [v for v in values if v is not None]
    return statistics.fmean(values) if values else None


def text(value, digits):
    return "–" if value is None else f"{value:.{digits}f}"


class Table:
    """A table whose rows are printed as they come."""

    def __init__(self, title, head):
        self.rows, self.lock = [], threading.Lock()
        print(f"\n**{title}**\n\n| " + " | ".join(head) + " |\n|" + "---|" * len(head), flush=True)

    def add(self, row):
        with self.lock:
            self.rows.append(row)
            print("| " + " | ".join(row) + " |", flush=True)


def print_table(title, head, rows):
    print(f"\n{title}\n")
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    sys.stdout.flush()


def save(options, figures):
    if options.output:
        options.output.parent.mkdir(parents=True, exist_ok=True)
        options.output.write_text(json.dumps(figures, indent=1) + "\n")
