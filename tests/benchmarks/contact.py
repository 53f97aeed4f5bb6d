# SPDX-License-Identifier: BSD-3-Clause
"""What an edit does beside the line where an object touches its support.

    /usr/bin/python3 tests/benchmarks/contact.py --retint build/release/apps/retint --data DATA \
        --work /tmp/contact

One view of each object is painted, and `--to` makes the object blue. The band is the support within
2 % of the picture's longer side of the contact line, without the border's own 0.2 %. Of the band,
in the painted view and in the others: the part in the mask, and the part that the edit stains (some
channel changes by more than 0.05). And of the object as far inside the line: the part that the mask
misses. Masks are exact, or as a hand paints them (off by up to about 1 %), or found from scribbles.
Truth are the exact ids of `around`, and on `banana` the yellow of the photos. A line is one object
from one mask; the last lines are means and the worst. The painted view stands before the bar, the
others behind it. Needs NumPy, SciPy and Pillow.
"""
import argparse
import pathlib
import shutil
import subprocess

import numpy as np
from PIL import Image
from scipy import ndimage

from selection import OBJECTS, SYNTHETIC, read_mask, stroke_inside, stroke_outside, write_mask
from workbench import read_depth as read_depth_file

ALL = OBJECTS | {"candlestick": ["candlestick"]}
# Tips, stems and what lies between them are not yellow: x, y and radius of circles to leave out.
BANANA = {"DSC_0423.JPG": [(269, 484, 35), (315, 519, 35), (930, 271, 80), (536, 681, 25)],
          "DSC_0427.JPG": [(176, 187, 35), (130, 244, 35), (925, 272, 85), (285, 507, 25)],
          "DSC_0430.JPG": [(910, 105, 35), (1013, 113, 35), (701, 442, 99), (971, 330, 25)],
          "DSC_0432.JPG": [(1016, 210, 35), (1101, 273, 35), (404, 282, 99), (933, 454, 25)],
          "DSC_0435.JPG": [(799, 697, 35), (883, 697, 35), (994, 665, 35), (754, 30, 99)],
          "DSC_0438.JPG": [(414, 478, 35), (503, 508, 35), (1052, 74, 90), (766, 636, 30)]}


def read_depth(path):
    width, height, depth = read_depth_file(path)
    return np.array(depth, np.float32).reshape(height, width)


def oklab_b(rgb):
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    cones = np.cbrt(linear @ np.array([[0.41222, 0.53633, 0.05145], [0.21190, 0.68070, 0.10740],
                                       [0.08830, 0.28172, 0.62998]]).T)
    return cones @ np.array([0.02590, 0.78277, -0.80868])


def yellow(photo):
    parts, _ = ndimage.label(oklab_b(np.asarray(photo) / 255.0) > 0.055)
    largest = parts == 1 + np.argmax(np.bincount(parts.ravel())[1:])
    return ndimage.binary_fill_holes(ndimage.binary_closing(largest, iterations=3))


def bands(thing, support, depth, step):
    """The support beside the contact line, and the object inside it. Beyond `step` pixels from the
    border the depth does not jump there."""
    longer = max(thing.shape)
    away, at = ndimage.distance_transform_edt(~thing, return_indices=True)
    deep, out = ndimage.distance_transform_edt(thing, return_indices=True)
    y, x = np.indices(thing.shape)
    dy, dx = (np.clip(np.sign(y - at[0]) * step, -step, step),
              np.clip(np.sign(x - at[1]) * step, -step, step))
    rim = (away > 0) & (away <= 1.5)
    height, width = thing.shape
    near = depth[np.clip(at[0] - dy, 0, height - 1), np.clip(at[1] - dx, 0, width - 1)]
    far = depth[np.clip(at[0] + dy, 0, height - 1), np.clip(at[1] + dx, 0, width - 1)]
    touch = rim & support & (near > 0) & (far > 0) & (np.abs(near - far) < 0.02 * near)
    line = np.zeros_like(thing)
    line[at[0][touch], at[1][touch]] = True
    beside = support & (away > 0.002 * longer) & (away <= 0.02 * longer) & line[at[0], at[1]]
    inside = (deep > 0.002 * longer) & (deep <= 0.02 * longer) & touch[out[0], out[1]]
    return beside, inside


def by_hand(mask, random):
    """The mask with a border that wanders by 0.4 % of the longer side in the mean, each way."""
    height, width = mask.shape
    amount, field = 0.004 * max(mask.shape), []
    for _ in range(2):
        coarse = Image.fromarray(random.normal(0, 1.4 * amount, (16, 20)).astype(np.float32))
        field.append(np.rint(np.asarray(coarse.resize((width, height), Image.BICUBIC))).astype(int))
    y, x = np.indices(mask.shape)
    return mask[np.clip(y + field[0], 0, height - 1), np.clip(x + field[1], 0, width - 1)]


class Bench:
    def __init__(self, options):
        self.options, self.rows = options, {}

    def run(self, *arguments):
        subprocess.run([self.options.retint, *map(str, arguments), "--quiet"], check=True)

    def measure(self, name, folder, truth, painted, support, depth, step):
        """`truth`, `support`: {view: mask} each; `depth` of a view."""
        scene = [folder]
        work = self.options.work / "found" / name
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir(parents=True)
        before = self.options.work / "before" / folder.name
        if not before.exists():
            self.run("render", *scene, "--all", "--output", before)
        where = {view: bands(truth[view], support[view], depth(view), step) for view in truth}
        random = np.random.default_rng(0)
        brush = max(3, round(0.01 * min(truth[painted].shape)))
        strokes = [work / "in.png", work / "out.png"]
        write_mask(strokes[0], stroke_inside(truth[painted], random, brush))
        write_mask(strokes[1], stroke_outside(truth[painted], random, brush))
        for kind in self.options.kinds.split(","):
            mask, stages = work / f"{kind}.png", work / kind
            if kind == "exact":
                write_mask(mask, truth[painted])
            if kind == "hand":
                write_mask(mask, by_hand(truth[painted], random))
            if kind.startswith("scribbles"):
                alone = ["--this-view-alone"] if kind.endswith("alone") else []
                self.run("mask", *scene, "--view", painted, "--scribble", strokes[0],
                         "--scribble-outside", strokes[1], "--output", mask, *alone)
            if self.options.masks_only:
                self.run("select", *scene, "--view", painted, "--mask", mask, "--output",
                         work / "cloud.ply")
                self.run("project", *scene, "--view", painted, "--mask", mask, "--cloud",
                         work / "cloud.ply", "--output", stages / "masks", *self.options.more)
            else:
                self.run("recolor", *scene, "--view", painted, "--mask", mask, "--to", "#3060ff",
                         "--output", work / "out.ply", "--save-stages", stages,
                         *self.options.more)
            self.add(name, kind, where, painted, before, stages, truth)

    def add(self, name, kind, where, painted, before, stages, truth):
        figures = []
        for one_is_painted in (True, False):
            sums, overlap = np.zeros(5), []
            for view, (beside, inside) in where.items():
                if (view == painted) != one_is_painted:
                    continue
                found = stained = read_mask(stages / f"masks/{view}.png")
                if not self.options.masks_only:
                    old, new = (np.asarray(Image.open(folder / f"{view}.png").convert("RGB"))
                                / 255.0 for folder in (before, stages / "result"))
                    stained = np.abs(new - old).max(-1) > 0.05
                sums += [beside.sum(), found[beside].sum(), stained[beside].sum(), inside.sum(),
                         (~found[inside]).sum()]
                overlap.append((found & truth[view]).sum() / max(1, (found | truth[view]).sum()))
            figures += [sums[1] / max(1, sums[0]), sums[2] / max(1, sums[0]),
                        sums[4] / max(1, sums[3]), np.mean(overlap) if overlap else 0]
        self.rows.setdefault((name.split("-")[0], kind), []).append(figures)
        print(f"{name:20s} {kind:10s} " + text(figures), flush=True)


def text(figures):
    return " | ".join(f"in mask {100 * f[0]:5.1f} % stained {100 * f[1]:5.1f} % missed "
                      f"{100 * f[2]:5.1f} % IoU {f[3]:.3f}" for f in (figures[:4], figures[4:]))


def around(bench, scene):
    options = bench.options
    folder = options.work / scene
    if not (folder / "splat.ply").exists():
        bench.run("synth", "--output", folder, "--width", 480, "--height", 360, "--photos", 12,
                  *(["--around", *SYNTHETIC[scene]] if scene in SYNTHETIC else []))
    lines = (folder / "truth/objects.txt").read_text().splitlines()
    ids = {entry.split(" ", 1)[1]: int(entry.split(" ", 1)[0]) for entry in lines}
    shown = {file.name[:-4]: np.array(Image.open(file))
             for file in sorted((folder / "truth/objects").glob("*.png"))}
    depth = {view: read_depth(folder / f"truth/depth/{view}.bin") for view in shown}
    support = {view: seen == ids["table"] for view, seen in shown.items()}
    for name in options.objects.split(","):
        truth = {view: np.isin(seen, [ids[part] for part in ALL[name]])
                 for view, seen in shown.items()}
        truth = {view: mask for view, mask in truth.items() if mask.sum() > 60}
        size = {view: bands(mask, support[view], depth[view], 1)[0].sum()
                for view, mask in truth.items()}
        painted = max(size, key=size.get)
        bench.measure(f"{scene}-{name}", folder, truth, painted, support, depth.get, 1)


def banana(bench):
    folder, truth, support = bench.options.data / "banana", {}, {}
    for view, circles in BANANA.items():
        photo = Image.open(folder / "images" / view)
        truth[view] = yellow(photo)
        y, x = np.indices(truth[view].shape)
        support[view] = ~truth[view]
        for i, j, radius in circles:
            support[view] &= np.hypot(x - i, y - j) > radius

    def depth(view):
        file = bench.options.work / f"{view}.bin"
        if not file.exists():
            bench.run("depth", folder, "--view",
                      view, "--depth-method", "gaussian", "--output", file)
        return read_depth(file)

    for painted in list(BANANA)[:bench.options.bananas]:
        bench.measure(f"banana-{painted[4:8]}", folder, truth, painted, support, depth, 5)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--retint", required=True)
    parser.add_argument("--data", required=True, type=pathlib.Path)
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--scenes", default="around,banana")
    parser.add_argument("--objects", default="ball,box,pear,bonsai,candlestick")
    parser.add_argument("--bananas", type=int, default=2, help="views that are painted in turn")
    parser.add_argument("--kinds", default="exact,hand,scribbles")
    parser.add_argument("--masks-only", action="store_true",
                        help="no edit: what the masks hold counts as stained")
    parser.add_argument("--more", type=str.split, default=[], help="more options of `recolor`")
    bench = Bench(parser.parse_args())
    for scene in bench.options.scenes.split(","):
        banana(bench) if scene == "banana" else around(bench, scene)
    for (scene, kind), rows in bench.rows.items():
        worst = np.max(rows, 0)
        worst[3::4] = np.min(rows, 0)[3::4]
        print(f"{scene}, {kind}: mean {text(np.mean(rows, 0))}")
        print(f"{scene}, {kind}: worst {text(worst)}")


if __name__ == "__main__":
    main()
