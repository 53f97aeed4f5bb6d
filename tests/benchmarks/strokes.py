# SPDX-License-Identifier: BSD-3-Clause
"""Random strokes anywhere in any view: how much of the paint its own view keeps, and how well other
views show the same stroke.

    PYTHONPATH=build/release/apps/python /usr/bin/python3 tests/benchmarks/strokes.py \
        --retint build/release/apps/retint --data DATA --work /tmp/strokes

A stroke is a line of three random points, 4 to 60 pixels wide. Of its own view: the part of the
painted pixels that the mask holds (kept), and unpainted ones in the mask, as a part of the painted
(added). Synthetic scenes have exact depth, which carries the stroke to every other view: IoU over
all views that show at least 60 pixels of it, of all pixels and of those that the painted view sees,
for strokes of which 95 % lie on a surface.
Needs NumPy and Pillow.
"""
import argparse
import pathlib
import subprocess

import numpy as np
from PIL import Image, ImageDraw

import retint

CAPTURES = ["fox", "flower", "cape", "banana"]
SYNTHETIC = {"sample": [],
             "around": ["--around", "--seed", "3"],
             "flawed": ["--around", "--seed", "5", "--depth-wave", "0.01", "--depth-noise", "0.005",
                        "--floaters", "1500", "--floater-opacity", "0.3"]}
LEAST_PIXELS = 60


def random_stroke(random, width, height, brush):
    if not brush:
        brush = int(round(np.exp(random.uniform(np.log(4), np.log(60)))))
    first = random.uniform(0, 1, 2) * (width, height)
    points = [first]
    for _ in range(2):
        step = random.uniform(0.05, 0.3) * min(width, height)
        angle = random.uniform(0, 2 * np.pi)
        points.append(np.clip(points[-1] + step * np.array([np.cos(angle), np.sin(angle)]), 0,
                              (width - 1, height - 1)))
    picture = Image.new("L", (width, height))
    draw = ImageDraw.Draw(picture)
    draw.line([tuple(p) for p in points], fill=255, width=brush)
    for x, y in points:
        draw.ellipse([x - brush / 2, y - brush / 2, x + brush / 2, y + brush / 2], fill=255)
    return np.array(picture), brush


def read_depth(path):
    data = path.read_bytes()
    at = -1
    for _ in range(3):
        at = data.index(b"&", at + 1)
    width, height, _ = (int(word) for word in data[:at].split(b"&"))
    return np.frombuffer(data[at + 1:], np.float32).reshape(height, width)


def unproject(camera, depth):
    y, x = np.indices(depth.shape)
    k = camera.K
    points = np.stack([(x + 0.5 - k[0, 2]) / k[0, 0], (y + 0.5 - k[1, 2]) / k[1, 1],
                       np.ones_like(depth)], -1) * depth[..., None]
    pose = np.asarray(camera.cam_from_world)
    return (points - pose[:3, 3]) @ pose[:3, :3]


def carried(camera, depth, painted, painted_depth, stroke):
    """Of each pixel: whether the painted view sees its surface, and whether that is painted."""
    pose = np.asarray(painted.cam_from_world)
    points = unproject(camera, depth) @ pose[:3, :3].T + pose[:3, 3]
    z = points[..., 2]
    k = painted.K
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.floor(points[..., 0] / z * k[0, 0] + k[0, 2])
        y = np.floor(points[..., 1] / z * k[1, 1] + k[1, 2])
    height, width = painted_depth.shape
    seen = (depth > 0) & (z > 0) & (x >= 0) & (y >= 0) & (x < width) & (y < height)
    i, j = np.where(seen, y, 0).astype(int), np.where(seen, x, 0).astype(int)
    seen &= np.abs(painted_depth[i, j] - z) < 0.01 * z
    return seen, seen & (stroke[i, j] > 0)


def iou(mask, truth, where):
    both, any_of = (mask & truth & where).sum(), ((mask | truth) & where).sum()
    return both / any_of if any_of else 1.0


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--retint", required=True)
    parser.add_argument("--data", required=True, type=pathlib.Path)
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--scenes", default=",".join(CAPTURES + list(SYNTHETIC)))
    parser.add_argument("--strokes", type=int, default=10)
    parser.add_argument("--brush", type=int, default=0, help="pixels; 0: 4 to 60")
    parser.add_argument("--surfaces", action="store_true",
                        help="of synthetic scenes: only strokes that lie on surfaces")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--option", action="append", default=[], help="of project(), NAME=VALUE")
    parser.add_argument("--pictures", type=pathlib.Path, help="a folder for those of every stroke")
    options = parser.parse_args()
    project = {}
    for option in options.option:
        name, value = option.split("=")
        project[name] = value if value[0].isalpha() else float(value)
    for scene in options.scenes.split(","):
        folder = options.data / scene
        if scene in SYNTHETIC:
            folder = options.work / scene
            if not (folder / "splat.ply").exists():
                subprocess.run([options.retint, "synth", "--output", folder, "--quiet",
                                *SYNTHETIC[scene]], check=True)
        measure(scene, folder, options, project)


def measure(scene, folder, options, project):
    random = np.random.default_rng(options.seed)
    session = retint.Session(str(folder), str(folder / "splat.ply"))
    views = {view.name: view for view in session.workspace.views}
    depths = {}
    if scene in SYNTHETIC:
        depths = {name: read_depth(folder / f"truth/depth/{name}.bin") for name in views}
    kept, added, all_iou, seen_iou = [], [], [], []
    for number in range(options.strokes):
        name = list(views)[random.integers(len(views))]
        camera = views[name].camera
        stroke, brush = random_stroke(random, camera.width, camera.height, options.brush)
        if options.surfaces and (depths[name][stroke > 127] > 0).mean() < 0.95:
            continue
        try:
            masks = session.project(session.select([session.paint(name, stroke)]), **project)
        except retint.Error as error:
            print(f"{scene} {number} {name} brush {brush}: {error}", flush=True)
            kept.append(0.0)
            added.append(0.0)
            continue
        paint, mask = stroke > 127, masks[name] > 127
        kept.append((paint & mask).sum() / paint.sum())
        added.append((mask & ~paint).sum() / paint.sum())
        line = f"{scene} {number} {name} brush {brush}: kept {kept[-1]:.3f} added {added[-1]:.3f}"
        reached = sum((masks[other] > 127).sum() >= LEAST_PIXELS for other in views)
        line += f" views {reached}/{len(views)}"
        one_all, one_seen = [], []
        for other in depths:
            if other == name:
                continue
            seen, truth = carried(views[other].camera, depths[other], camera, depths[name], stroke)
            if truth.sum() < LEAST_PIXELS:
                continue
            found = masks[other] > 127
            one_all.append(iou(found, truth, np.ones_like(seen)))
            one_seen.append(iou(found, truth, seen))
        on_surface = name in depths and (depths[name][paint] > 0).mean() >= 0.95
        if one_all and on_surface:
            all_iou.append(np.mean(one_all))
            seen_iou.append(np.mean(one_seen))
            line += f" IoU {all_iou[-1]:.3f} seen {seen_iou[-1]:.3f} worst {min(one_all):.3f}"
        print(line, flush=True)
        if options.pictures:
            picture(session, views, masks, name, stroke, options.pictures / f"{scene}-{number}.jpg")
    line = (f"{scene}: kept mean {np.mean(kept):.4f} worst {min(kept):.4f}, "
            f"added mean {np.mean(added):.4f} worst {max(added):.4f}")
    if all_iou:
        line += (f", IoU median {np.median(all_iou):.3f} worst {min(all_iou):.3f}, "
                 f"seen median {np.median(seen_iou):.3f} worst {min(seen_iou):.3f}")
    print(line, flush=True)


def picture(session, views, masks, name, stroke, path):
    """The painted view, with its paint and with its mask, and three others with theirs."""
    def tinted(view, mask):
        photo = np.array(session.render(view))
        photo[mask > 127] = 0.4 * photo[mask > 127] + 0.6 * np.array([0.1, 0.3, 1])
        return photo
    names = list(views)
    some = [names[i * len(names) // 3] for i in range(3)]
    row = [tinted(name, stroke), tinted(name, masks[name])]
    row += [tinted(other, masks[other]) for other in some]
    path.parent.mkdir(parents=True, exist_ok=True)
    row = np.clip(np.concatenate(row, 1), 0, 1)
    Image.fromarray((255 * row).astype(np.uint8)).reduce(2).save(path)


if __name__ == "__main__":
    main()
