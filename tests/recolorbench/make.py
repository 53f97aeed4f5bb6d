#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes the tasks of RecolorBench (needs NumPy, SciPy, Pillow and the module `retint`).

  PYTHONPATH=build/release/apps/python python3 tests/recolorbench/make.py \\
      --retint build/release/apps/retint --data DATA --work tasks

tasks.py describes the folder. What is there already is kept, so a second call completes it. Truth
of a recolor and of lettering on a synthetic scene is the render of that scene with the changed
albedo, by Gaussians at the same places. Truth of all else is the edit, applied to the render of the
original splat inside the true mask. Captures have half the size of their photos, and splats that
went through .spz, so that tasks are small to hand on. Only edits and shares need the module."""
import json
import pathlib
import shutil
import struct
import sys

import numpy as np
from PIL import Image

import tasks as rb
import contact
import edits
import workbench as wb

SHRINK = 2  # captures
NODES = {"recolor": 65}  # of an edit's table, a side; 33 where an edit is smooth
EDITS = {"tint": {"tint": "#80b0ff"},
         "grade": {"exposure": 0.4, "contrast": 1.25, "white_balance": "40,5", "saturation": 1.3}}
# Of synthetic objects, the new albedo; of captures, the new main color.
COLORS = {"ball": "#3060ff", "pear": "#d02020", "plant": "#e0e0e0", "box": "#20a040",
          "fox": "#3060ff", "flower": "#3060ff", "cape": "#20a040", "banana": "#d02020"}
# (scene, object): {edit: what is given}
SYNTHETIC = {
    ("sample", "ball"): {"recolor": ["one", "three", "true"], "grade": ["one", "true"]},
    ("sample", "pear"): {"recolor": ["one", "true"], "tint": ["one"]},
    ("sample", "plant"): {"recolor": ["one", "true"], "lut": ["one"]},
    ("box", "box"): {"lettering": ["one", "true"]},
}
CAPTURED = {
    "fox": {"recolor": ["one"], "tint": ["one"], "grade": ["one"], "lut": ["one"]},
    "flower": {"recolor": ["one", "three", "true"], "grade": ["one"], "lut": ["true"]},
    "cape": {"recolor": ["one", "three", "true"], "tint": ["one"], "lut": ["one"]},
    "banana": {"recolor": ["one", "three", "true"], "grade": ["true"], "lut": ["one"]},
}
PAINTED = {"fox": ["0025.jpg"], "flower": ["012.jpg", "003.jpg", "021.jpg"],
           "cape": ["IMG_5881.jpg"], "banana": ["DSC_0427.JPG", "DSC_0430.JPG", "DSC_0438.JPG"]}


def look():
    """The lookup table of the edit `lut`: teal shadows and warm lights."""
    colors = rb.grid(17)
    luma = (colors @ np.array([0.2126, 0.7152, 0.0722]))[..., None]
    toned = luma * np.array([0.12, 0.03, -0.10]) + (1 - luma) * np.array([-0.06, 0.02, 0.06])
    return np.clip(0.5 + 1.1 * (colors + toned - 0.5), 0, 1)


def shrink_model(source, target, to_size):
    """Copies a model with PINHOLE cameras (COLMAP's binary files) for pictures of other sizes."""
    target.mkdir(parents=True, exist_ok=True)
    data, scales, at = bytearray((source / "cameras.bin").read_bytes()), {}, 8
    while at < len(data):
        number, model, width, height = struct.unpack_from("<iiQQ", data, at)
        if model != 1:
            raise wb.Failed(f"{source}: camera {number} is no PINHOLE")
        small = to_size(width, height)
        x, y = small[0] / width, small[1] / height
        fx, fy, cx, cy = struct.unpack_from("<4d", data, at + 24)
        struct.pack_into("<QQ4d", data, at + 8, *small, fx * x, fy * y, cx * x, cy * y)
        scales[number], at = (x, y), at + 56
    (target / "cameras.bin").write_bytes(data)
    data, at = bytearray((source / "images.bin").read_bytes()), 8
    while at < len(data):
        camera, = struct.unpack_from("<i", data, at + 60)
        end = data.index(b"\0", at + 64)
        points, = struct.unpack_from("<Q", data, end + 1)
        xy = np.frombuffer(data, np.dtype([("xy", "<f8", 2), ("id", "<u8")]), points, end + 9)
        xy["xy"] *= scales[camera]
        at = end + 9 + 24 * points
    (target / "images.bin").write_bytes(data)
    shutil.copy(source / "points3D.bin", target)


def half(width, height):
    return width // SHRINK, height // SHRINK


def masks_of_capture(data, scene):
    """True masks of a capture, {view: picture}, in the photos' size."""
    folder = data / scene
    if scene == "banana":
        return {file.name: Image.fromarray(255 * contact.yellow(Image.open(file)).astype(np.uint8))
                for file in sorted((folder / "images").glob("*.JPG"))}
    view, painted, truth = wb.CAPTURES[scene]
    files = {view: folder / painted, **wb.masks_in(folder / truth)}
    return {name: Image.open(file).convert("L") for name, file in files.items()}


class Maker:
    def __init__(self, options):
        self.options, self.root = options, options.work
        self.run = wb.Runner(options)
        self.tasks = []

    def capture(self, scene):
        folder, source = self.root / "scenes" / scene, self.options.data / scene
        if not (folder / "sparse").exists():
            shrink_model(source / "sparse" / "0", folder / "sparse" / "0", half)
        if not (folder / "splat.spz").exists():  # what a task is handed on as: 5 MB, not 28
            self.run("convert", source / "splat.ply", folder / "splat.spz")
        if not (folder / "splat.ply").exists():
            self.run("convert", folder / "splat.spz", folder / "splat.ply")
        if not (folder / "object").exists():
            masks = {name: mask.resize(half(*mask.size), Image.Resampling.BOX)
                     for name, mask in masks_of_capture(self.options.data, scene).items()}
            painted = PAINTED[scene]
            if scene == "cape":  # all around
                painted = painted + sorted(masks)[5::20][:2]
            self.sort_masks(scene, "object", masks, painted)

    def synthetic(self, scene, label):
        albedo = ["box=#c8b478"] if scene == "box" else []
        plain = edits.true_scene(self.options, self.run, scene, albedo)
        folder = self.root / "scenes" / scene
        if not (folder / "sparse").exists():
            shutil.copytree(plain / "sparse", folder / "sparse")
            shutil.copy(plain / "splat.ply", folder)
        if not (folder / label).exists():
            files = wb.masks_in(plain / "truth" / "masks" / label)
            masks = {name: Image.open(file).convert("L") for name, file in files.items()}
            whole = wb.largest_whole(files)
            others = [name for name in masks if name != whole and np.asarray(masks[name]).any()]
            self.sort_masks(scene, label, masks, [whole, others[1], others[-1]])

    def views(self, scene):
        return sorted(wb.read_cameras(self.root / "scenes" / scene))

    def sort_masks(self, scene, label, masks, painted):
        """True masks into the folders of a task: of views to fit, held out and painted."""
        folder = self.root / "scenes" / scene / label
        held_out = set(self.views(scene)[::rb.HOLDOUT]) - set(painted)
        for name, mask in masks.items():
            places = ["held_out" if name in held_out else "masks"]
            for place in places + ["painted"] * (name in painted):
                (folder / place).mkdir(parents=True, exist_ok=True)
                mask.save(folder / place / (name + ".png"))
        (folder / "painted.json").write_text(json.dumps(painted))
        self.write_shares(scene, folder / "masks")

    def write_shares(self, scene, folder):
        import retint
        session = retint.Session(self.root / "scenes" / scene, backend=self.options.backend)
        region = session.add_region("object", session.read_masks(folder), retint.Edit(invert=True))
        masks = {name: retint.read_mask(folder / (name + ".png")) for name in wb.masks_in(folder)}
        retint.Masks(masks, session.region(region).shares).write(folder)

    def true_scene(self, scene, label, edit):
        """The synthetic scene whose object has the new albedo; None where no albedo is the edit."""
        if scene not in ("sample", "box") or edit not in ("recolor", "lettering"):
            return None
        albedo = COLORS[label] if edit == "recolor" else edits.painted_box(
            self.root / "work" / "letters.png", "letters")
        return edits.true_scene(self.options, self.run, f"{label}-{edit}", [f"{label}={albedo}"])

    def new_color(self, scene, label, true):
        """The object's new main color: of a synthetic one what its albedo looks like."""
        if not true:
            return COLORS[scene]
        plain = self.root / "truth" / scene
        paint = wb.Paint(scene, label, plain, None, None,
                         wb.masks_in(plain / "truth" / "masks" / label))
        main = edits.main_color(self.run, paint, self.root / "work" / scene / label)
        return edits.new_color(main, plain, true, label)

    def write_edit(self, scene, label, edit, true):
        """The edit, a recolor with the color that it replaces, and its table."""
        import retint
        folder, work = self.root / "scenes" / scene, self.root / "work" / scene / label
        if edit == "lut":
            rb.write_table(self.root / "look.cube", look())
            made = retint.Edit(lut=str(self.root / "look.cube"))
        elif edit == "recolor":
            work.mkdir(parents=True, exist_ok=True)
            self.run("refit", folder, "--masks", folder / label / "masks", "--to",
                     self.new_color(scene, label, true), "--set", "mm.iterations=1", "--output",
                     work / "main.ply", "--report", work / "main.json")
            made = retint.Edit.read(work / "main.json")
        else:
            made = retint.Edit(**EDITS[edit])
        rb.write_table(folder / label / edit / "edit.cube",
                       np.asarray(made.apply(rb.grid(NODES.get(edit, 33)))))
        (folder / label / edit / "edit.json").write_text(made.to_json())

    def render(self, workspace, splat, views, folder):
        named = [flag for view in views for flag in ("--view", view)]
        self.run("render", workspace, "--splat", splat, *named, "--output", folder)

    def make_edit(self, scene, label, edit, folder):
        workspace = self.root / "scenes" / scene
        true = self.true_scene(scene, label, edit)
        if edit != "lettering" and not (folder / "edit.json").exists():
            self.write_edit(scene, label, edit, true)
        if (folder / "truth").exists():
            return
        held_out = wb.masks_in(workspace / label / "held_out")
        if edit == "lettering":
            view = json.loads((workspace / label / "painted.json").read_text())[0]
            self.render(workspace, true / "splat.ply", [view], folder / "picture")
        if true:
            self.render(workspace, true / "splat.ply", held_out, folder / "truth")
            return
        before = self.root / "work" / scene / label / "before"
        self.render(workspace, workspace / "splat.ply", held_out, before)
        table = rb.read_table(folder / "edit.cube")
        (folder / "truth").mkdir()
        for view, mask in held_out.items():
            colors = edits.read(before / (view + ".png"))
            inside = edits.read_mask(mask)[..., None] / 255.0
            edited = rb.look_up(table, colors.reshape(-1, 3)).reshape(colors.shape)
            wanted = np.clip(colors + inside * (edited - colors), 0, 1)
            Image.fromarray((255 * wanted + 0.5).astype(np.uint8)).save(
                folder / "truth" / (view + ".png"))

    def add(self, scene, label, wanted):
        folder = self.root / "scenes" / scene / label
        painted = json.loads((folder / "painted.json").read_text())
        for edit, givens in wanted.items():
            (folder / edit).mkdir(exist_ok=True)
            self.make_edit(scene, label, edit, folder / edit)
            for given in givens:
                views = painted[:{"one": 1, "three": 3, "true": 0}[given]]
                task = rb.Task("-".join([scene, label, edit, given]), scene, label, edit, given,
                               views, sorted(wb.masks_in(folder / "held_out")))
                if edit == "lettering":
                    task.picture_view = painted[0]
                    picture = folder / edit / "picture" / (painted[0] + ".png")
                    task.picture = str(picture.relative_to(self.root))
                self.tasks.append(task)


def main():
    parser = wb.arguments(__doc__, ["sample", "box", *CAPTURED])
    parser.set_defaults(objects="ball,pear,plant,box", size="320x240x16")
    options = parser.parse_args()
    scenes = options.scenes.split(",")
    if options.data is None and set(scenes) & set(CAPTURED):
        sys.exit("captures need --data")
    maker = Maker(options)
    try:
        for (scene, label), wanted in SYNTHETIC.items():
            if scene in scenes and label in options.objects.split(","):
                maker.synthetic(scene, label)
                maker.add(scene, label, wanted)
        for scene, wanted in CAPTURED.items():
            if scene in scenes:
                maker.capture(scene)
                maker.add(scene, "object", wanted)
    except wb.Failed as failure:
        sys.exit(str(failure))
    rb.write_tasks(options.work, maker.tasks)
    print(f"{len(maker.tasks)} tasks")


if __name__ == "__main__":
    main()
