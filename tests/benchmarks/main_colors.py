#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The main color of thirty crops of the captures against the color that a person names (numpy, Pillow).

  python3 tests/benchmarks/main_colors.py --retint build/release/apps/retint --data DATA --work /tmp/m

main_colors.json holds the crops: a photo, a polygon or a mask, and the named color. It was written
down by looking at the crops, before any code measured them. A name is the color of a spot that is
lit, has no gloss, and stands for the crop. This script masks each crop in its view, has
`retint evaluate` measure the main color there on the splat's render, and prints the CIEDE2000
difference of each crop, then the median and the worst."""
import json
import pathlib
import sys

import numpy as np
from PIL import Image, ImageDraw

import workbench as wb
from edits import differences

CROPS = pathlib.Path(__file__).with_suffix(".json")


def color_of(text):
    return np.array([int(text[i:i + 2], 16) for i in (1, 3, 5)]) / 255


def hex_of(color):
    return "#" + "".join(f"{round(255 * min(max(v, 0), 1)):02x}" for v in color)


def write_mask(crop, data, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    if "mask" in crop:
        mask = Image.open(data / crop["mask"]).convert("L").point(lambda v: 255 if v > 127 else 0)
    else:
        mask = Image.new("L", Image.open(data / crop["photo"]).size)
        ImageDraw.Draw(mask).polygon([tuple(point) for point in crop["polygon"]], fill=255)
    mask.save(path)


def main_color(run, crop, options):
    scene, name = options.data / crop["photo"].split("/")[0], pathlib.Path(crop["photo"]).name
    folder = options.work / crop["name"].replace(" ", "-")
    write_mask(crop, options.data, folder / "masks" / (name + ".png"))
    splat = scene / "splat.ply"
    run("evaluate", scene, "--splat", splat, "--after", splat, "--masks",
        folder / "masks", "--to", "#808080", "--report", folder / "report.json")
    report = json.loads((folder / "report.json").read_text())
    return np.array(report["edit"]["operations"][0]["from"])


def main():
    parser = wb.arguments(__doc__, wb.CAPTURES)
    options = parser.parse_args()
    if options.data is None:
        parser.error("--data is missing")
    crops = json.loads(CROPS.read_text())
    run = wb.Runner(options)
    found = run.each(lambda crop: main_color(run, crop, options), crops)
    if any(color is None for color in found):
        sys.exit(1)
    named = np.array([color_of(crop["color"]) for crop in crops])
    errors = differences(np.array(found), named)
    rows = wb.Table("Main colors against named ones: CIEDE2000",
                    ["crop", "photo", "what", "named", "measured", "difference"])
    for crop, color, error in zip(crops, found, errors):
        rows.add([crop["name"], crop["photo"], crop["note"], crop["color"], hex_of(color),
                  f"{error:.1f}"])
    print(f"\nmedian {np.median(errors):.1f}, worst {errors.max():.1f}")


if __name__ == "__main__":
    main()
