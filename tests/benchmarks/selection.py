# SPDX-License-Identifier: BSD-3-Clause
"""Selections of the captures against their true masks: from one view's true mask, from two strokes
on it, and from a second view that `retint suggest` names, against any second view.

Strokes follow from the truth by a rule: inside, the medial axis of its largest part, where that is
at least a third as deep as at its deepest, 5 pixels wide; outside, a line 5 pixels wide all around
the truth, a tenth of the picture's smaller side away. Needs NumPy, SciPy and Pillow.
"""
import argparse
import json
import pathlib
import subprocess
import time

import numpy as np
from PIL import Image
from scipy import ndimage

# Scene: painted view, its mask, and the folder of true masks.
CAPTURES = {
    "cape": ("IMG_5881.jpg", "truth/IMG_5881.jpg.png", "truth"),
    "flower": ("012.jpg", "masks/012.jpg.png", "truth"),
    "fox": ("0025.jpg", "masks/0025.jpg.png", "truth"),
}


def read_mask(path):
    picture = Image.open(path)
    if picture.mode in ("RGBA", "LA"):
        rgba = np.array(picture.convert("RGBA"))
        if rgba[..., 3].min() < 255:
            return rgba[..., 3] > 127
    return np.array(picture.convert("RGB")).max(-1) > 127


def strokes(truth):
    parts, _ = ndimage.label(truth)
    largest = parts == 1 + np.argmax(np.bincount(parts.ravel())[1:])
    depth = ndimage.distance_transform_edt(largest)
    slope = np.hypot(*np.gradient(ndimage.gaussian_filter(depth, 2)))
    axis = largest & (slope < 0.75) & (depth >= depth.max() / 3)
    inside = ndimage.binary_dilation(axis, iterations=2) & (depth > 3)
    away = ndimage.distance_transform_edt(~truth) - 0.1 * min(truth.shape)
    return inside, np.abs(away) < 2.5


class Capture:
    def __init__(self, options, name):
        self.view, mask, truth = CAPTURES[name]
        self.folder = options.data / name
        self.mask, self.truth = self.folder / mask, self.folder / truth
        self.work = options.work / name
        self.work.mkdir(parents=True, exist_ok=True)
        self.retint = options.retint
        self.scene = ["--workspace", self.folder, "--splat", self.folder / "splat.ply"]

    def run(self, verb, *arguments):
        command = [self.retint, verb, *map(str, arguments), "--progress", "none"]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    def painted(self, masks):
        return [part for view, mask in masks for part in ("--view", view, "--mask", mask)]

    def measure(self, what, masks, *more):
        """Masks of all views from those of a few, and their IoU with the truth."""
        cloud, found, report = (self.work / f"{what}{end}" for end in (".ply", "", ".json"))
        start = time.time()
        self.run("select", *self.scene, *self.painted(masks), "--output", cloud)
        self.run("project", *self.scene, "--cloud", cloud, *self.painted(masks), "--output", found,
                 *more)
        seconds = time.time() - start
        self.run("score", "--truth", self.truth, "--masks", found, "--workspace", self.folder,
                 *[part for view, _ in masks for part in ("--painted", view)], "--report", report)
        for group in json.loads(report.read_text())["groups"]:
            if group["views"]:
                iou = group["iou"]
                print(f"{self.folder.name} {what}, {group['name']}, {group['views']} views: "
                      f"mean {iou['mean']:.3f}, median {iou['median']:.3f}, "
                      f"worst {iou['worst']:.3f} {iou['worst_view']}; {seconds:.1f} s", flush=True)

    def scribbles(self):
        pictures = []
        for name, stroke in zip(("inside", "outside"), strokes(read_mask(self.mask))):
            pictures.append(self.work / f"{name}.png")
            Image.fromarray((255 * stroke).astype(np.uint8)).save(pictures[-1])
        mask = self.work / "scribbled.png"
        self.run("mask", *self.scene, "--view", self.view, "--scribble", pictures[0],
                 "--scribble-outside", pictures[1], "--output", mask)
        found, truth = read_mask(mask), read_mask(self.mask)
        print(f"{self.folder.name} scribbles, the view itself: "
              f"{(found & truth).sum() / (found | truth).sum():.3f}", flush=True)
        self.measure("scribbles", [(self.view, mask)])

    def suggestion(self):
        report = self.work / "suggest.json"
        self.run("suggest", *self.scene, "--view", self.view, "--mask", self.mask, "--report", report)
        order = [one["view"] for one in json.loads(report.read_text())["views"]]
        known = [view for view in order if (self.truth / f"{view}.png").exists()]
        if len(known) < 8:
            return
        one = (self.view, self.mask)
        for what, view in [("suggested", known[0])] + [
                (f"second {i}", known[i * len(known) // 4]) for i in (1, 2, 3)]:
            self.measure(what, [one, (view, self.truth / f"{view}.png")])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--retint", default="retint")
    parser.add_argument("--data", type=pathlib.Path, required=True, help="folder of the captures")
    parser.add_argument("--work", type=pathlib.Path, required=True, help="folder for what is made")
    parser.add_argument("--scenes", default=",".join(CAPTURES))
    parser.add_argument("--what", default="mask,scribbles,suggestion")
    options = parser.parse_args()
    for name in options.scenes.split(","):
        capture = Capture(options, name)
        for what in options.what.split(","):
            if what == "mask":
                capture.measure("mask", [(capture.view, capture.mask)])
            else:
                getattr(capture, what)()


if __name__ == "__main__":
    main()
