#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes the pictures of README.md and docs/ anew (needs Pillow with WebP, NumPy and SciPy).

    python3 apps/docs/pictures.py [--build build/release] [--data shared/data] [--only NAME,...]

Names: edits (docs/edits.md), bananas, loop and photos (a real capture), tutorials, editor. The capture is DATA/banana:
photos © 2019 Piero Toffanin, MIT license, docs/images/photos-banana.LICENSE.txt. Charts of docs/benchmarks.md come from
apps/docs/benchmarks.py. `editor` needs Xvfb and builds a program, apps/screenshots.sh."""
import argparse
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image, ImageDraw, ImageFilter, ImageFont
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, RotationSpline

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
IMAGES = ROOT / "docs" / "images"
BLUE = "#3060ff"
CREDIT = "Photos © 2019 Piero Toffanin, MIT license"
INK, PAPER, MARK = (32, 32, 32), (255, 255, 255), (255, 0, 200)  # MARK is no color of the scene

# ---- edits: the sample's box after every operation ----

EDIT_VIEW, EDIT_OBJECT, EDIT_WIDTH = "002.png", "box", 220
EDITS = {
    "before": {},
    "to": {"to": BLUE},
    "to-keep": {"to": BLUE + ",keep-lightness=1"},
    "tint": {"tint": BLUE},
    "adjust": {"adjust": "hue=120,hues=340:40"},
    "exposure": {"exposure": -1.5},
    "contrast": {"contrast": 1.8},
    "gamma": {"gamma": 1.8},
    "white-balance": {"white_balance": 80},
    "saturation": {"saturation": 2},
    "invert": {"invert": True},
    "gray": {"gray": True},
    "matrix": {"matrix": "0,1,0,0,0,0,1,0,1,0,0,0"},
    "gradient": {"gradient": "#101030,#a04020,#fff0d0"},
    "palette": {"palette": "4,1=" + BLUE},
    "lut": {"lut": "look.cube"},
    "edited": {"edited": EDIT_VIEW + "=painted.png"},
    "soft-clip": {"exposure": 1, "soft_clip": True},
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


def paint(photo, mask, bounds, path):
    """Green stripes on the object."""
    left, top, right, bottom = bounds
    painted, width = photo.copy(), right - left
    draw = ImageDraw.Draw(painted)
    for x in range(left, right, max(width // 5, 2)):
        draw.rectangle([x, top, x + width // 10, bottom], fill=(30, 120, 60))
    Image.composite(painted, photo, mask.point(lambda v: 255 * (v >= 250))).save(path)


def make_edits(retint, work):
    scene = work / "scene"
    code = retint.run_command(["synth", "--output", str(scene), "--width", "960", "--height", "720", "--photos", "5",
                               "--quiet"])
    if code != 0:
        sys.exit(code)
    masks = scene / "truth" / "masks" / EDIT_OBJECT
    mask = Image.open(masks / (EDIT_VIEW + ".png")).convert("L")
    left, top, right, bottom = bounds = mask.point(lambda v: 255 * (v >= 128)).getbbox()
    write_look(work / "look.cube")
    paint(Image.open(scene / "images" / EDIT_VIEW).convert("RGB"), mask, bounds, work / "painted.png")
    margin = (right - left) // 5
    for name, operations in EDITS.items():
        # Masks are the true ones: the pictures show the operations and nothing of the selection.
        session = retint.Session(str(scene))
        if operations:
            given = {key: value.replace("look.cube", f"{work}/look.cube").replace("=painted", f"={work}/painted")
                     if isinstance(value, str) else value for key, value in operations.items()}
            session.add_region(name, session.read_masks(masks), retint.Edit(**given))
            session.refit()
        picture = render(session, EDIT_VIEW).crop((left - margin, top - margin, right + margin, bottom + margin))
        height = EDIT_WIDTH * picture.height // picture.width
        save(picture.resize((EDIT_WIDTH, height), Image.Resampling.LANCZOS), f"edit-{name}.jpg", 85)


# ---- The real capture ----

PAINTED = "DSC_0438.JPG"
# Strokes in pixels of the view: on the bananas, and around them.
INSIDE = [[(638, 415), (906, 348), (1062, 192)], [(861, 635), (1084, 571), (1206, 348)]]
OUTSIDE = [[(300, 300), (320, 500), (560, 590), (700, 690), (820, 765), (1000, 790), (1220, 700), (1400, 400),
            (1200, 80)]]
# Those of docs/tutorials/photos.md, on the same photos at half their size.
TUTORIAL_VIEW = "DSC_0428.JPG"
TUTORIAL_INSIDE = [[(500, 220), (560, 420), (700, 540), (880, 570)], [(560, 170), (680, 300), (840, 440)]]
TUTORIAL_OUTSIDE = [[(380, 120), (400, 500), (480, 760), (760, 860), (1060, 760), (1180, 500), (1080, 300),
                     (760, 200), (480, 90), (380, 120)]]


def font(size, bold=False):
    return ImageFont.truetype("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf", size)


def picture_of(pixels):
    return Image.fromarray((np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8))


def render(session, view):
    return picture_of(session.render(view))


def save(picture, name, quality=88):
    picture.save(IMAGES / name, quality=quality, optimize=True)
    print(f"{name}: {(IMAGES / name).stat().st_size} bytes", flush=True)


def open_capture(retint, data, **options):
    return retint.Session(data / "banana", data / "banana" / "splat.ply", **options)


def select(session, view, inside, outside):
    mask = session.mask(view, inside=inside, outside=outside)
    selection = session.select([session.paint(view, mask)])
    return selection, session.project(selection)


def degrees_between(session, first, second):
    directions = [session.workspace[name].camera.cam_from_world[2, :3] for name in (first, second)]
    return round(float(np.degrees(np.arccos(np.clip(directions[0] @ directions[1], -1, 1)))))


def grid(rows, columns, labels, size):
    """Pictures in rows of `rows`, with a title over each column and a label (lines of text) beside each row."""
    gutter, head, gap = 92, 26, 4
    width, height = size
    sheet = Image.new("RGB", (gutter + len(columns) * (width + gap), head + len(rows) * (height + gap)), PAPER)
    draw = ImageDraw.Draw(sheet)
    for at, text in enumerate(columns):
        draw.text((gutter + at * (width + gap) + width // 2, head // 2), text, INK, font(14, True), anchor="mm")
    for down, (row, label) in enumerate(zip(rows, labels)):
        top = head + down * (height + gap)
        draw.multiline_text((gutter // 2, top + height // 2), label, INK, font(13, True), anchor="mm", align="center")
        for at, picture in enumerate(row):
            sheet.paste(picture.resize(size, Image.Resampling.LANCZOS), (gutter + at * (width + gap), top))
    return sheet


def change_outside(before, after, mask, factor):
    """|after - before| times `factor` outside the mask; the object itself is gray."""
    change = np.abs(np.clip(after, 0, 1) - np.clip(before, 0, 1)) * factor
    return picture_of(np.where(mask[..., None] >= 128, 0.3, change))


def make_bananas(retint, data):
    views, factor = [PAINTED, "DSC_0428.JPG", "DSC_0430.JPG", "DSC_0436.JPG"], 10
    session = open_capture(retint, data, holdout=8)
    _, masks = select(session, PAINTED, INSIDE, OUTSIDE)
    before = [session.render(view) for view in views]
    region = session.add_region("bananas", masks, retint.Edit(to=BLUE))
    session.refit()
    after = [session.render(view) for view in views]
    print("bananas:", session.evaluate(region)["train"])
    rows = [[picture_of(one) for one in before], [picture_of(one) for one in after],
            [change_outside(*three, factor) for three in zip(before, after, (masks[view] for view in views))]]
    titles = ["painted"] + [f"not painted, {degrees_between(session, PAINTED, view)}° away" for view in views[1:]]
    save(grid(rows, titles, ["before", "after", f"change\noutside\n× {factor}"], (270, 180)), "bananas.jpg")


def make_photos(retint, data):
    views = [TUTORIAL_VIEW, "DSC_0424.JPG", "DSC_0430.JPG", "DSC_0436.JPG"]
    session = open_capture(retint, data, holdout=8)
    _, masks = select(session, TUTORIAL_VIEW, TUTORIAL_INSIDE, TUTORIAL_OUTSIDE)
    rows = [[render(session, view), Image.fromarray(masks[view]).convert("RGB")] for view in views]
    region = session.add_region("bananas", masks, retint.Edit(to=BLUE))
    session.refit()
    quality = session.evaluate(region)
    print("photos, fitted:", quality["train"], "held out:", quality["heldout"])
    rows = [row + [render(session, view)] for row, view in zip(rows, views)]
    labels = ["painted"] + [f"not\npainted,\n{degrees_between(session, TUTORIAL_VIEW, view)}° away"
                            for view in views[1:]]
    save(grid(rows, ["before", "mask", "after"], labels, (285, 190)), "photos-banana.jpg")


# ---- The loop of README.md: a stroke, masks in all views, colors, and the side that nobody painted ----

FRAMES_A_SECOND = 20
MAIN, SMALL, MARGIN, CAPTION = (640, 426), (150, 100), 8, 36
STRIP = ["DSC_0426.JPG", "DSC_0428.JPG", "DSC_0430.JPG", "DSC_0436.JPG"]
COLORS = ["#d03030", "#2f9e50", BLUE]
PATH = [PAINTED, "DSC_0426.JPG", "DSC_0427.JPG", "DSC_0428.JPG", "DSC_0430.JPG"]  # of the orbit, through real cameras
# How many frames each step takes; together eight seconds.
STILL, STROKES, OUTLINE, MASKS, COLORING, ORBIT, REST = 6, 30, 10, 24, 36, 44, 10
QUALITY = 70
FADE = 4  # frames; WebP drops changes that are small from one frame to the next


class Loop:
    def __init__(self, retint, data):
        self.retint = retint
        self.session = open_capture(retint, data)
        selection, self.masks = select(self.session, PAINTED, INSIDE, OUTSIDE)
        self.focus = selection.positions.astype(np.float64).mean(axis=0)
        self.frames = []
        self.views = [PAINTED, *STRIP]
        self.sizes = [MAIN, *[SMALL] * len(STRIP)]
        self.looks = [self.look()]
        region = self.session.add_region("bananas", self.masks, retint.Edit(to=COLORS[0]))
        for color in COLORS:
            self.session.set_edit(region, retint.Edit(to=color))
            self.session.refit()
            self.looks.append(self.look())

    def look(self):
        """The views as they are now, the painted one from the camera that the orbit begins with."""
        cameras = [self.camera_of(PAINTED), *STRIP]
        return [render(self.session, camera).resize(size, Image.Resampling.LANCZOS)
                for camera, size in zip(cameras, self.sizes)]

    def camera_of(self, view):
        start = self.session.workspace[view].camera
        scale = MAIN[0] / start.width
        return self.retint.Camera(*MAIN, *[value * scale for value in
                                           (start.K[0, 0], start.K[1, 1], start.K[0, 2], start.K[1, 2])],
                                  start.cam_from_world)

    def show(self, pictures, caption):
        sheet = Image.new("RGB", (MAIN[0] + SMALL[0] + 3 * MARGIN, MAIN[1] + 2 * MARGIN + CAPTION), PAPER)
        sheet.paste(pictures[0], (MARGIN, MARGIN))
        step = (MAIN[1] - SMALL[1]) / (len(STRIP) - 1)
        for at, picture in enumerate(pictures[1:]):
            sheet.paste(picture, (MAIN[0] + 2 * MARGIN, MARGIN + round(at * step)))
        draw = ImageDraw.Draw(sheet)
        middle = MAIN[1] + MARGIN + (CAPTION + MARGIN) // 2
        draw.text((MARGIN + 4, middle), caption, INK, font(17, True), anchor="lm")
        draw.text((sheet.width - MARGIN, middle), CREDIT, (120, 120, 120), font(10), anchor="rm")
        self.frames.append(sheet)

    def with_strokes(self, picture, part):
        """The first `part` of the length of all strokes."""
        shown, scale = picture.resize((2 * MAIN[0], 2 * MAIN[1])), 2 * MAIN[0] / 1504
        draw = ImageDraw.Draw(shown)
        strokes = [(line, MARK) for line in INSIDE] + [(line, (255, 255, 255)) for line in OUTSIDE]
        lengths = [sum(np.hypot(*np.subtract(b, a)) for a, b in zip(line, line[1:])) for line, _ in strokes]
        left = part * sum(lengths)
        for line, color in strokes:
            for a, b in zip(line, line[1:]):
                length = float(np.hypot(*np.subtract(b, a)))
                share = min(1.0, max(0.0, left / length))
                left -= length
                if share > 0:
                    end = np.add(a, np.multiply(np.subtract(b, a), share))
                    points = [tuple(np.multiply(point, scale)) for point in (a, end)]
                    draw.line(points, color, 12)
                    for x, y in points:
                        draw.ellipse([x - 6, y - 6, x + 6, y + 6], color)
        return shown.resize(MAIN, Image.Resampling.LANCZOS)

    def with_mask(self, picture, view, strength):
        mask = Image.fromarray(self.masks[view]).resize(picture.size, Image.Resampling.LANCZOS)
        inside = mask.point(lambda v: 255 * (v >= 128))
        wide = inside.filter(ImageFilter.MaxFilter(5 if picture.width > 300 else 3))
        edge = np.asarray(wide) > np.asarray(inside)
        amount = np.where(edge, 1.0, np.asarray(mask) / 255 * 0.45)[..., None] * strength
        return Image.fromarray((np.asarray(picture) * (1 - amount) + np.array(MARK) * amount).astype(np.uint8))

    def path(self):
        """A smooth way through the real cameras of PATH: renders are best there."""
        cameras = [self.camera_of(view) for view in PATH]
        poses = [camera.cam_from_world for camera in cameras]
        seen = np.array([pose[:3, :3] @ self.focus + pose[:3, 3] for pose in poses])  # the object, in their frames
        turns = [np.arccos(np.clip((np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2, -1, 1))
                 for a, b in zip(poses, poses[1:])]
        at = np.concatenate([[0], np.cumsum(turns)]) / sum(turns)
        rotations = RotationSpline(at, Rotation.from_matrix([pose[:3, :3] for pose in poses]))
        places = PchipInterpolator(at, seen)
        k = cameras[0].K
        for t in 0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, ORBIT + 1)[1:]):  # slow at both ends
            pose = np.eye(4)
            pose[:3, :3] = rotations(t).as_matrix()
            pose[:3, 3] = places(t) - pose[:3, :3] @ self.focus
            yield self.retint.Camera(*MAIN, k[0, 0], k[1, 1], k[0, 2], k[1, 2], pose)

    def run(self):
        plain = self.looks[0]
        caption = "1  Draw strokes on one view"
        for _ in range(STILL):
            self.show(plain, caption)
        for frame in range(STROKES):
            self.show([self.with_strokes(plain[0], (frame + 1) / STROKES), *plain[1:]], caption)
        stroked = self.with_strokes(plain[0], 1)
        caption = "2  Retint finds the object in every view"
        masked = [self.with_mask(picture, view, 1) for picture, view in zip(plain, self.views)]
        for frame in range(OUTLINE):
            self.show([Image.blend(stroked, masked[0], min(1.0, (frame + 1) / FADE)), *plain[1:]], caption)
        for frame in range(MASKS):
            shown = (frame + 1) / MASKS * len(plain)  # one view after the other
            self.show([masked[0]] + [masked[at] if shown > at else plain[at] for at in range(1, len(plain))], caption)
        caption = "3  Choose a color: shading and spots stay"
        looks, turn = [masked, *self.looks[1:]], COLORING // len(COLORS)
        for frame in range(COLORING):
            at, step = divmod(frame, turn)
            part = min(1.0, (step + 1) / FADE)
            self.show([Image.blend(a, b, part) for a, b in zip(looks[at], looks[at + 1])], caption)
        caption = "4  Turn to the side that nobody painted"
        for camera in self.path():
            self.show([render(self.session, camera), *self.looks[-1][1:]], caption)
        for _ in range(REST):
            self.frames.append(self.frames[-1])
        return self.frames


def make_loop(retint, data):
    frames = Loop(retint, data).run()
    target = IMAGES / "recolor.webp"
    frames[0].save(target, save_all=True, append_images=frames[1:], duration=1000 // FRAMES_A_SECOND, loop=0,
                   quality=QUALITY, method=4, kmin=9, kmax=10)
    print(f"{target.name}: {len(frames) / FRAMES_A_SECOND} s, {target.stat().st_size} bytes", flush=True)
    if target.stat().st_size >= 3_000_000:
        sys.exit(f"{target.name} is larger than 3 MB")


def main():
    names = ["edits", "bananas", "loop", "photos", "tutorials", "editor"]
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build" / "release")
    parser.add_argument("--data", type=pathlib.Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--only", default=",".join(names), help="separated by commas: " + ", ".join(names))
    options = parser.parse_args()
    wanted = options.only.split(",")
    if set(wanted) - set(names):
        parser.error(f"there are {', '.join(names)}")
    sys.dont_write_bytecode = True
    sys.path.insert(0, str((options.build / "apps" / "python").resolve()))
    import retint

    if "edits" in wanted:
        with tempfile.TemporaryDirectory() as work:
            make_edits(retint, pathlib.Path(work))
    for name, make in (("bananas", make_bananas), ("loop", make_loop), ("photos", make_photos)):
        if name in wanted:
            make(retint, options.data)
    if "tutorials" in wanted:
        subprocess.run([sys.executable, ROOT / "apps/docs/tutorials.py", "--retint", options.build / "apps/retint",
                        "--python", options.build / "apps/python", "--pictures"], check=True)
    if "editor" in wanted:
        subprocess.run(["bash", ROOT / "apps/screenshots.sh"], check=True)


if __name__ == "__main__":
    main()
