# SPDX-License-Identifier: BSD-3-Clause
"""Selections against true masks: from one view's true mask and from three, from strokes on one view,
and from a second view that `retint suggest` names, against any second view. And what a whole edit
from three views (`edit`) does to the others: its share that arrives, and what it misses and stains.
And from one view's mask painted too small or too large (`small`) by some pixels, or as a polygon.

Scenes are captures and synthetic tables with cameras all around them, or a whole path: a workspace of
`retint synth` whose splat.ply another program has trained from its photos. Every object of a scene
is painted in three views in turn. A row is one object from one view; the last lines have the median and
the worst of each scene.

Strokes are drawn at random from the truth: inside, a line between two far points of its deep part,
by way of its deepest point where the straight one would leave it; outside, an arc of 216 to 324
degrees along the truth's outline, 5 to 12 % of the picture's smaller side away. Needs NumPy, SciPy
and Pillow.
"""
import argparse
import json
import pathlib
import re
import shutil
import statistics
import struct
import subprocess
import time

import numpy as np
from PIL import Image, ImageDraw
from scipy import ndimage

CAPTURES = {"cape": ["IMG_5881.jpg", "IMG_5921.jpg", "IMG_5961.jpg"],
            "flower": ["012.jpg", "002.jpg", "022.jpg"],
            "fox": ["0025.jpg", "0001.jpg"]}
# Options of `retint synth` beside --around. Nothing was chosen by looking at the scene `fresh`.
SYNTHETIC = {"around": ["--seed", "3"],
             "fresh": ["--seed", "12"],
             "flawed": ["--seed", "5", "--depth-wave", "0.01", "--depth-noise", "0.005",
                        "--floaters", "1500", "--floater-opacity", "0.3"]}
OBJECTS = {"ball": ["ball"], "box": ["box"], "table": ["table"], "bonsai": ["pot", "plant"],
           "pear": ["pear"]}
LEAST_PIXELS = 60  # of an object in a view that counts


def read_mask(path):
    picture = Image.open(path)
    if picture.mode in ("RGBA", "LA"):
        rgba = np.array(picture.convert("RGBA"))
        if rgba[..., 3].min() < 255:
            return rgba[..., 3] > 127
    return np.array(picture.convert("RGB")).max(-1) > 127


def write_mask(path, mask):
    Image.fromarray((255 * mask).astype(np.uint8)).save(path)


def moved(mask, pixels):
    """The mask with its border moved outward, or inward by a number below 0."""
    if pixels < 0:
        depth = ndimage.distance_transform_edt(np.pad(mask, 1, mode="edge"))
        return depth[1:-1, 1:-1] > -pixels
    return ndimage.distance_transform_edt(~mask) <= pixels


def polygon(mask, corners):
    """The largest part of the mask with straight lines between points of its outline: where it is
    seen farthest from its middle, in so many directions."""
    parts, _ = ndimage.label(mask)
    part = parts == 1 + np.argmax(np.bincount(parts.ravel())[1:])
    middle = np.array(ndimage.center_of_mass(part))
    points = np.argwhere(part)
    away = points - middle
    turn = ((np.arctan2(*away.T) / (2 * np.pi) + 1) % 1 * corners).astype(int) % corners
    distance = np.hypot(*away.T)
    outline = [points[turn == k][distance[turn == k].argmax()] for k in range(corners)
               if (turn == k).any()]
    picture = Image.new("L", mask.shape[::-1])
    ImageDraw.Draw(picture).polygon([(int(x), int(y)) for y, x in outline], fill=255)
    return np.array(picture) > 127


def line(a, b):
    t = np.linspace(0, 1, int(np.abs(np.subtract(a, b)).max()) + 2)[:, None]
    return np.round(a + t * np.subtract(b, a)).astype(int)


def stroke_inside(truth, random, brush):
    parts, _ = ndimage.label(truth)
    depth = ndimage.distance_transform_edt(parts == 1 + np.argmax(np.bincount(parts.ravel())[1:]))
    deepest = np.unravel_index(depth.argmax(), depth.shape)
    deep, _ = ndimage.label(depth >= 0.45 * depth.max())
    deep = deep == deep[deepest]
    ends = np.argwhere(deep)
    first = ends[random.integers(len(ends))]
    far = np.argsort(np.hypot(*(ends - first).T))[-max(1, len(ends) // 20):]
    last = ends[random.choice(far)]
    points = line(first, last)
    if deep[tuple(points.T)].mean() < 0.95:
        points = np.concatenate([line(first, deepest), line(deepest, last)])
    stroke = np.zeros_like(truth)
    stroke[tuple(points.T)] = True
    stroke = ndimage.binary_dilation(stroke, iterations=max(1, brush // 2))
    return stroke & (ndimage.distance_transform_edt(truth) > 2)


def stroke_outside(truth, random, brush):
    away = random.uniform(0.05, 0.12) * min(truth.shape)
    ring = np.abs(ndimage.distance_transform_edt(~truth) - away) < brush / 2
    y, x = np.indices(truth.shape)
    middle = ndimage.center_of_mass(truth)
    turn = (np.arctan2(y - middle[0], x - middle[1]) - random.uniform(0, 2 * np.pi)) % (2 * np.pi)
    return ring & (turn < np.pi * random.uniform(1.2, 1.8))


def keep_cameras(folder, kept, views, count):
    """The workspace `folder` with `count` cameras, spread evenly by name from the first of `views`,
    and with the other `views`."""
    data, images, at = (folder / "sparse/0/images.bin").read_bytes(), {}, 8
    for _ in range(struct.unpack_from("<Q", data)[0]):
        name_at = at + 64  # id, quaternion, translation, camera
        name_end = data.index(0, name_at)
        end = name_end + 9 + 24 * struct.unpack_from("<Q", data, name_end + 1)[0]
        images[data[name_at:name_end].decode()] = data[at:end]
        at = end
    names = sorted(images)
    first = names.index(views[0])
    chosen = {names[(first + i * len(names) // count) % len(names)] for i in range(count)}
    chosen = sorted(chosen.union(views))
    model = kept / "sparse/0"
    model.mkdir(parents=True, exist_ok=True)
    (model / "images.bin").write_bytes(
        struct.pack("<Q", len(chosen)) + b"".join(images[name] for name in chosen))
    for link in ("sparse/0/cameras.bin", "sparse/0/points3D.bin", "images"):
        if not (kept / link).exists():
            (kept / link).symlink_to((folder / link).resolve())


def write_shares(splat, shares, path):
    """A splat with the shape of another whose renders are the shares of its Gaussians."""
    data = splat.read_bytes()
    body = data.index(b"end_header\n") + 11
    names = re.findall(r"property float (\S+)", data[:body].decode())
    columns = np.frombuffer(data[body:], "<f4").reshape(-1, len(names))
    gray = (np.frombuffer(shares.read_bytes()[24:], "<f4") - 0.5) / 0.28209479
    kept = [name for name in names if not name.startswith(("f_", "n"))]
    header = [f"element vertex {len(columns)}"] + [
        f"property float {name}" for name in kept + ["f_dc_0", "f_dc_1", "f_dc_2"]]
    table = np.column_stack([columns[:, names.index(name)] for name in kept] + 3 * [gray])
    path.write_bytes("\n".join(["ply", "format binary_little_endian 1.0", *header,
                                "end_header\n"]).encode() + table.astype("<f4").tobytes())


class Object:
    """An object of a scene with its true masks and the views that are painted in turn."""

    def __init__(self, options, scene, name, folder, truth, views):
        self.options, self.scene, self.name = options, scene, name
        self.folder, self.truth, self.views = folder, truth, views[:options.views]
        self.work = options.work / "found" / f"{scene}-{name}"
        self.own = []  # IoU in the painted view itself, of strokes
        self.work.mkdir(parents=True, exist_ok=True)

    def run(self, verb, *arguments):
        command = [self.options.retint, verb, *map(str, arguments), "--progress", "none"]
        command += ["--no-report-html"] if verb == "recolor" else []
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    def files(self, views):
        """Of the scene with all cameras, or with a few when `views` are painted."""
        folder = self.folder
        if self.options.keep:
            folder = self.work / f"keep-{self.options.keep}-{'-'.join(views)}"
            keep_cameras(self.folder, folder, views, self.options.keep)
        return [folder, "--splat", self.folder / "splat.ply"]

    def true_mask(self, view):
        return self.truth / f"{view}.png"

    def painted(self, masks):
        return [part for view, mask in masks for part in ("--view", view, "--mask", mask)]

    def measure(self, what, masks):
        """IoU of all other views from the masks of a few; prints and returns the mean."""
        cloud, found, report = (self.work / f"found{end}" for end in (".ply", "", ".json"))
        files = self.files([view for view, _ in masks])
        shutil.rmtree(found, ignore_errors=True)
        start = time.time()
        self.run("select", *files, *self.painted(masks), "--output", cloud)
        self.run("project", *files, "--cloud", cloud, *self.painted(masks), "--output", found,
                 *self.options.project)
        seconds = time.time() - start
        if self.options.keep:
            self.draw_left_out(found)
        self.run("score", "--truth", self.truth, "--masks", found, "--cameras", self.folder,
                 *[part for view, _ in masks for part in ("--painted", view)], "--report", report)
        groups = {g["name"]: g for g in json.loads(report.read_text())["groups"] if g["views"]}
        print(f"{self.scene} {self.name} {what} {masks[0][0]}: "
              + ", ".join(f"{name} {g['iou']['mean']:.3f} (worst {g['iou']['worst']:.3f})"
                          for name, g in groups.items()) + f"; {seconds:.1f} s", flush=True)
        return groups["all"]["iou"]["mean"]

    def draw_left_out(self, found):
        """Masks of the cameras that were not kept: the shares, rendered."""
        splat = self.work / "shares.ply"
        write_shares(self.folder / "splat.ply", found / "shares.bin", splat)
        views = [mask.name[:-len(".png")] for mask in sorted(self.truth.glob("*.png"))
                 if not (found / mask.name).exists()]
        if views:
            self.run("render", self.folder, "--splat", splat, "--output", found,
                     *[part for view in views for part in ("--view", view)])

    def one(self):
        return [self.measure("one", [(view, self.true_mask(view))]) for view in self.views]

    def small(self):
        """From masks with a moved border, and from polygons; the values are of all of them."""
        values, mask = [], self.work / "moved.png"
        for view in self.views:
            truth = read_mask(self.true_mask(view))
            paint = {f"moved {n:+d}": moved(truth, n) for n in self.options.moved}
            paint |= {f"{n} corners": polygon(truth, n) for n in self.options.corners}
            for what, painted in paint.items():
                if painted.sum() < LEAST_PIXELS:
                    continue
                write_mask(mask, painted)
                values.append(self.measure(f"small {what}", [(view, mask)]))
        return values

    def three(self):
        if len(self.views) < 3:  # no other view has a true mask
            return []
        return [self.measure("three", [(v, self.true_mask(v)) for v in self.views[:3]])]

    def edit(self):
        """How much of a tint from three painted views arrives in the others."""
        if len(self.views) < 3:  # no other view has a true mask
            return []
        masks = [(v, self.true_mask(v)) for v in self.views[:3]]
        edited, before, after, report = (self.work / f"edit{end}"
                                         for end in (".ply", "-before", "-after", ".json"))
        self.run("recolor", *self.files(self.views[:3]), *self.painted(masks), "--tint", "#3060ff", "--output",
                 edited)
        for splat, pictures in ((self.folder / "splat.ply", before), (edited, after)):
            self.run("render", self.folder, "--splat", splat, "--all", "--output",
                     pictures)
        self.run("score", "--truth", self.truth, "--before", before, "--after", after, "--tint",
                 "#3060ff", *[part for view, _ in masks for part in ("--painted", view)],
                 "--report", report)
        group, = (g for g in json.loads(report.read_text())["groups"] if g["name"] == "all")
        hit, missed, stained = (group[key]["mean"] for key in ("hit", "missed", "stained"))
        print(f"{self.scene} {self.name} edit: hit {hit:.4f}, missed {missed:.4f}, "
              f"stained {stained:.4f}", flush=True)
        return [hit]

    def strokes(self):
        """The painted view's own mask, and with --lift the other views from it."""
        values, alone = [], ["--this-view-alone"] if self.options.alone else []
        for view in self.views:
            truth = read_mask(self.true_mask(view))
            brush = max(3, round(0.01 * min(truth.shape)))
            for seed in range(self.options.strokes):
                random = np.random.default_rng(seed)
                inside, outside, mask = (self.work / f"{n}.png" for n in ("in", "out", "mask"))
                write_mask(inside, stroke_inside(truth, random, brush))
                write_mask(outside, stroke_outside(truth, random, brush))
                self.run("mask", *self.files([view]), "--view", view, "--scribble", inside,
                         "--scribble-outside", outside, "--output", mask, *alone)
                found = read_mask(mask)
                own = (found & truth).sum() / (found | truth).sum()
                print(f"{self.scene} {self.name} strokes {view} {seed}: {own:.3f}", flush=True)
                self.own.append(own)
                if self.options.lift and found.any():
                    own = self.measure(f"strokes {seed}", [(view, mask)])
                values.append(own)
        return values

    def suggestion(self):
        view = self.views[0]
        first, report = (view, self.true_mask(view)), self.work / "suggest.json"
        self.run("suggest", *self.files([view]), *self.painted([first]), "--report", report)
        order = [one["view"] for one in json.loads(report.read_text())["views"]]
        known = [name for name in order if self.true_mask(name).exists()]
        if len(known) < 8:
            return []
        for what, name in [("suggested", known[0])] + [
                (f"second {i}", known[i * len(known) // 4]) for i in (1, 2, 3)]:
            self.measure(f"{what} {name}", [first, (name, self.true_mask(name))])
        return []


def capture(options, scene):
    folder, truth = options.data / scene, options.work / "truth" / scene
    truth.mkdir(parents=True, exist_ok=True)
    for file in [*(folder / "truth").glob("*.png"), *(folder / "masks").glob("*.png")]:
        write_mask(truth / file.name, read_mask(file))
    return [Object(options, scene, scene, folder, truth, CAPTURES[scene])]


def synthetic(options, scene):
    folder = options.work / scene  # `scene` itself where that is a whole path
    scene = folder.name
    if not (folder / "splat.ply").exists():
        subprocess.run([options.retint, "synth", "--output", folder, "--around", "--width", "400",
                        "--height", "300", "--photos", "24", *SYNTHETIC[scene], "--quiet"],
                       check=True)
    lines = (folder / "truth" / "objects.txt").read_text().splitlines()
    ids = {name: int(number) for number, name in (entry.split(" ", 1) for entry in lines)}
    objects = []
    for name in options.objects.split(","):
        truth = options.work / "truth" / f"{scene}-{name}"
        truth.mkdir(parents=True, exist_ok=True)
        views = []
        for file in sorted((folder / "truth" / "objects").glob("*.png")):
            mask = np.isin(np.array(Image.open(file)), [ids[part] for part in OBJECTS[name]])
            if mask.sum() < LEAST_PIXELS:
                continue
            write_mask(truth / file.name, mask)
            views.append(file.name[:-len(".png")])
        painted = [views[i * len(views) // 24] for i in (1, 9, 17)]
        objects.append(Object(options, scene, name, folder, truth, painted))
    return objects


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--retint", default="retint")
    parser.add_argument("--data", type=pathlib.Path, help="folder of the captures")
    parser.add_argument("--work", type=pathlib.Path, required=True, help="folder for what is made")
    parser.add_argument("--scenes", default=",".join([*SYNTHETIC, *CAPTURES]),
                        help="names, or whole paths of workspaces of `retint synth`")
    parser.add_argument("--objects", default=",".join(OBJECTS), help="of the synthetic scenes")
    parser.add_argument("--what", default="one,three,strokes,suggestion")
    parser.add_argument("--strokes", type=int, default=2, help="pairs of strokes on each view")
    parser.add_argument("--views", type=int, default=3,
                        help="of an object, painted in turn, at most")
    parser.add_argument("--keep", type=int, default=0,
                        help="of a scene's cameras only so many, evenly by name; the others are scored "
                             "by renders of the shares; 0: all")
    parser.add_argument("--lift", action="store_true",
                        help="strokes: all other views too, not the painted one alone")
    parser.add_argument("--alone", action="store_true",
                        help="strokes: as they are found in the painted view alone")
    parser.add_argument("--moved", type=lambda text: [int(n) for n in text.split(",") if n],
                        default=[-2, -4, -6],
                        help="small: by how many pixels borders are moved outward, as --moved=-2,4")
    parser.add_argument("--corners", type=lambda text: [int(n) for n in text.split(",") if n],
                        default=[16], help="small: of polygons")
    parser.add_argument("--project", type=str.split, default=[],
                        help="more options of `retint project`, as --project='--paint-slack 0'")
    parser.add_argument("--limit", type=float, default=float("inf"),
                        help="seconds after which nothing more is started")
    options = parser.parse_args()
    end, found = time.time() + options.limit, {}
    for scene in options.scenes.split(","):
        if scene in CAPTURES and options.data is None:
            parser.error(f"scene '{scene}' needs --data")
        trained = pathlib.Path(scene).is_absolute() and (pathlib.Path(scene) / "splat.ply").exists()
        if scene not in CAPTURES and scene not in SYNTHETIC and not trained:
            parser.error(f"there is no scene '{scene}', nor a splat.ply in a folder of that path")
        for thing in (capture if scene in CAPTURES else synthetic)(options, scene):
            for what in options.what.split(","):
                if time.time() < end:
                    found.setdefault((scene, what), []).extend(getattr(thing, what)())
            if options.lift and thing.own:
                found.setdefault((scene, "strokes, painted view"), []).extend(thing.own)
    for (scene, what), values in found.items():
        if values:
            print(f"{scene}, {what}, {len(values)}: median {statistics.median(values):.3f}, "
                  f"worst {min(values):.3f}")


if __name__ == "__main__":
    main()
