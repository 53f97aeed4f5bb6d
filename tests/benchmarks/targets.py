# SPDX-License-Identifier: BSD-3-Clause
"""One sheet of six objects of the sample in twelve target colors, to be looked at, and the share of
the new colors that no screen shows.

    PYTHONPATH=build/release/apps/python /usr/bin/python3 tests/benchmarks/targets.py \
        --work /tmp/targets --sheet sheet.png

Masks are the true ones, so that the sheet shows the colors and nothing of the selection.
Needs NumPy and Pillow.
"""
import argparse
import pathlib

import numpy as np
from PIL import Image, ImageDraw

import retint

OBJECTS = ["ball", "box", "candlestick", "pear", "plant", "pot"]
TARGETS = ["#ffffff", "#000000", "#808080", "#d02020", "#20a040", "#3060ff", "#f0c010", "#e060c0",
           "#10b0c0", "#703010", "#f5deb3", "#2b0a60"]
VIEW, CELL, MARGIN, HEAD = "003.png", 112, 14, 20


def cell(pixels, box):
    left, top, right, bottom = box
    part = np.clip(pixels[top:bottom, left:right], 0, 1)
    picture = Image.fromarray((255 * part + 0.5).astype(np.uint8))
    picture.thumbnail((CELL - 2, CELL - 2))
    framed = Image.new("RGB", (CELL, CELL), (40, 40, 40))
    framed.paste(picture, ((CELL - picture.width) // 2, (CELL - picture.height) // 2))
    return framed


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--sheet", required=True, type=pathlib.Path)
    options = parser.parse_args()
    scene = options.work / "sample"
    if not scene.exists():
        retint.run_command(["synth", "--output", str(scene), "--width", "320", "--height", "240",
                            "--photos", "6", "--quiet"])
    session = retint.Session(scene)
    sheet = Image.new("RGB", (CELL * (len(TARGETS) + 1), CELL * len(OBJECTS) + HEAD))
    draw = ImageDraw.Draw(sheet)
    for column, target in enumerate(TARGETS, 1):
        draw.rectangle([CELL * column + 2, 2, CELL * (column + 1) - 3, HEAD - 2], fill=target)
    before = session.render(VIEW)
    for row, name in enumerate(OBJECTS):
        masks = session.read_masks(scene / "truth/masks" / name)
        y, x = np.nonzero(masks[VIEW] >= 128)
        box = (max(x.min() - MARGIN, 0), max(y.min() - MARGIN, 0), x.max() + MARGIN, y.max() + MARGIN)
        sheet.paste(cell(before, box), (0, CELL * row + HEAD))
        worst = (0, "")
        for column, target in enumerate(TARGETS, 1):
            region = session.add_region(name, masks, retint.Edit(to=target))
            session.refit()
            sheet.paste(cell(session.render(VIEW), box), (CELL * column, CELL * row + HEAD))
            worst = max(worst, (session.evaluate(region)["train"]["out_of_gamut"], target))
            session.remove(region)
        print(f"{name:<12} out of gamut at most {100 * worst[0]:.2f} % ({worst[1]})", flush=True)
    sheet.save(options.sheet)


if __name__ == "__main__":
    main()
