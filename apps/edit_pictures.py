#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes the pictures of docs/edits.md anew: the sample's box after every operation (needs Pillow).

  python3 apps/edit_pictures.py --retint build/release/apps/retint [--output docs/images]

Masks are the true ones, so the pictures show the operations and nothing of the selection."""
import argparse
import pathlib
import subprocess
import tempfile

from PIL import Image, ImageDraw

VIEW, OBJECT, WIDTH = "002.png", "box", 220
EDITS = {
    "before": [],
    "to": ["--to", "#3060ff"],
    "to-keep": ["--to", "#3060ff", "--keep-lightness", "1"],
    "tint": ["--tint", "#3060ff"],
    "adjust": ["--adjust", "hue=120,hues=340:40"],
    "exposure": ["--exposure", "-1.5"],
    "contrast": ["--contrast", "1.8"],
    "gamma": ["--gamma", "1.8"],
    "white-balance": ["--white-balance", "80"],
    "saturation": ["--saturation", "2"],
    "invert": ["--invert"],
    "gray": ["--gray"],
    "matrix": ["--matrix", "0,1,0,0,0,0,1,0,1,0,0,0"],
    "gradient": ["--gradient", "#101030,#a04020,#fff0d0"],
    "palette": ["--palette", "4,1=#3060ff"],
    "lut": ["--lut", "look.cube"],
    "edited": ["--edited", VIEW + "=painted.png"],
    "soft-clip": ["--exposure", "1", "--soft-clip"],
}


def write_look(path):
    """Cool shadows and warm lights, as a table of two colors a channel."""
    rows = []
    for i in range(8):
        light = [i & 1, i >> 1 & 1, i >> 2 & 1]
        gray = sum(light) / 3
        rows.append(f"{0.9 * light[0] + 0.1 * gray:.3f} {0.85 * light[1] + 0.1 * gray:.3f} "
                    f"{0.6 * light[2] + 0.15:.3f}")
    path.write_text("LUT_3D_SIZE 2\n" + "\n".join(rows) + "\n")


def bounds(workspace):
    mask = Image.open(workspace / "truth" / "masks" / OBJECT / (VIEW + ".png")).convert("L")
    return mask, mask.point(lambda v: 255 * (v >= 128)).getbbox()


def paint(workspace, path):
    mask, (left, top, right, bottom) = bounds(workspace)
    photo = Image.open(workspace / "images" / VIEW).convert("RGB")
    painted, width = photo.copy(), right - left
    draw = ImageDraw.Draw(painted)
    for x in range(left, right, max(width // 5, 2)):
        draw.rectangle([x, top, x + width // 10, bottom], fill=(30, 120, 60))
    Image.composite(painted, photo, mask.point(lambda v: 255 * (v >= 250))).save(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--retint", default="retint")
    parser.add_argument("--output", type=pathlib.Path, default=pathlib.Path("docs/images"))
    parser.add_argument("--only", default=",".join(EDITS), help="separated by commas")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        scene = work / "scene"

        def retint(verb, *arguments):
            subprocess.run([options.retint, verb, *map(str, arguments), "--quiet"], check=True)

        retint("synth", "--output", scene, "--width", 480, "--height", 360, "--photos", 5)
        write_look(work / "look.cube")
        paint(scene, work / "painted.png")
        _, (left, top, right, bottom) = bounds(scene)
        margin = (right - left) // 5
        crop = (left - margin, top - margin, right + margin, bottom + margin)
        options.output.mkdir(parents=True, exist_ok=True)
        for name in options.only.split(","):
            edit = [str(work / a) if a == "look.cube" else a.replace("=painted", f"={work}/painted")
                    for a in EDITS[name]]
            splat = scene / "splat.ply"
            if edit:
                splat = work / "edited.ply"
                retint("refit", scene, "--splat", scene / "splat.ply", "--masks",
                       scene / "truth" / "masks" / OBJECT, *edit, "--output", splat)
            retint("render", scene, "--splat", splat, "--view", VIEW, "--output",
                   work / "render")
            picture = Image.open(work / "render" / (VIEW + ".png")).convert("RGB").crop(crop)
            height = WIDTH * picture.height // picture.width
            picture.resize((WIDTH, height), Image.Resampling.LANCZOS).save(
                options.output / f"edit-{name}.jpg", quality=85)


if __name__ == "__main__":
    main()
