#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Recolors a scene, plots the quality view by view, and renders a turn around the object.

    retint synth --output sample
    python3 recolor.py --workspace sample --splat sample/splat.ply \
        --view 023.png --mask sample/masks/023.png.png --to '#3060ff' --output result

writes result/recolored.ply, report.json, views.png (if matplotlib is installed) and the frames
turntable/0000.png, 0001.png, ... ffmpeg makes a video of them:

    ffmpeg -framerate 24 -i result/turntable/%04d.png -pix_fmt yuv420p turntable.mp4
"""

import argparse
import json
import pathlib
import sys

import numpy as np

import retint


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--workspace", required=True, help="COLMAP workspace")
    parser.add_argument("--splat", help="splat in its frame; else the one in the workspace")
    parser.add_argument("--view", required=True, help="name of the painted view")
    parser.add_argument("--mask", required=True, help="picture of its size, white inside")
    parser.add_argument("--to", default="#3060ff", help="the object's new color")
    parser.add_argument("--output", required=True, type=pathlib.Path, help="folder to write")
    parser.add_argument("--frames", type=int, default=72, help="of the turn")
    return parser.parse_args()


def show(stage, fraction):
    print(f"\r{stage:<14}{100 * fraction:4.0f} %", end="", file=sys.stderr)


def plot_views(session, region, quality, path):
    """Share of each view that the selection covers, and how close the result is to its target."""
    try:
        import matplotlib
    except ImportError:
        print("matplotlib is not installed: no plot")
        return
    matplotlib.use("Agg")
    from matplotlib import pyplot

    masks = session.region(region).masks
    names = sorted(masks)
    covered = [100 * np.mean(masks[name] >= 128) for name in names]
    psnr = {view["view"]: (view["psnr_inside"], view["psnr_outside"]) for view in quality["views"]}
    inside, outside = np.array([psnr.get(name, (np.nan, np.nan)) for name in names]).T

    figure, (top, bottom) = pyplot.subplots(2, sharex=True, figsize=(10, 6), layout="constrained")
    top.bar(range(len(names)), covered)
    top.set_ylabel("covered, % of the view")
    bottom.plot(inside, "o-", label="inside the mask")
    bottom.plot(outside, "o-", label="outside")
    bottom.set_ylabel("PSNR against the target, dB")
    bottom.legend()
    bottom.set_xticks(range(len(names)), names, rotation=90, fontsize="small")
    figure.savefig(path, dpi=120)
    print(f"wrote {path}")


def turn(session, region, view, frames):
    """Cameras on a circle about the object, level with how the photos were held."""
    splat = session.original
    shares = session.region(region).shares
    focus = np.average(splat.means, axis=0, weights=shares)
    # The photos' own up: a camera's y axis points down.
    up = -np.mean([v.camera.cam_from_world[1, :3] for v in session.workspace], axis=0)
    return retint.orbit(session.workspace[view].camera, focus, up, frames)


def write_turn(session, cameras, folder):
    folder.mkdir(exist_ok=True)
    sh = session.sh
    for i, camera in enumerate(cameras):
        show("turn", i / len(cameras))
        retint.write_png(folder / f"{i:04}.png", session.render(camera, sh=sh))
    print(f"\nwrote {folder}")


def main():
    arguments = parse_arguments()
    output = arguments.output
    with retint.Session(arguments.workspace, arguments.splat, progress=show) as session:
        output.mkdir(parents=True, exist_ok=True)
        painted = session.paint(arguments.view, arguments.mask)
        selection = session.select([painted], progress=show)
        masks = session.project(selection, progress=show)
        region = session.add_region("object", masks, retint.Edit(to=arguments.to))
        session.refit(progress=show)
        print(file=sys.stderr)

        session.write_splat(output / "recolored.ply")
        quality = session.evaluate(region)
        train = quality["train"]
        print(f"{train['views']} views: inside {train['psnr_inside_after']:.1f} dB, "
              f"outside {train['psnr_outside']:.1f} dB")
        (output / "report.json").write_text(json.dumps(session.report(), indent=2),
                                            encoding="utf-8")
        plot_views(session, region, quality, output / "views.png")
        write_turn(session, turn(session, region, arguments.view, arguments.frames),
                   output / "turntable")


if __name__ == "__main__":
    try:
        main()
    except retint.Error as error:
        sys.exit(f"recolor.py: {error}")
