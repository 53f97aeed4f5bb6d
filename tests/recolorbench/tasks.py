# SPDX-License-Identifier: BSD-3-Clause
"""The tasks of RecolorBench, and the files that its programs share (needs NumPy and Pillow).

A folder of tasks holds, with all paths relative to it:

  tasks.json                          the tasks: a list of objects with the keys of `Task`
  scenes/SCENE/sparse/0               COLMAP's cameras, poses and points
  scenes/SCENE/splat.ply              the splat to recolor, as the original training code writes it
  scenes/SCENE/OBJECT/masks           true masks of views for the fit, <image name>.png, and
                                      shares.bin, how much of each Gaussian is inside
  scenes/SCENE/OBJECT/held_out        true masks of the views that a result is measured in
  scenes/SCENE/OBJECT/painted         true masks of the views to paint
  scenes/SCENE/OBJECT/EDIT/edit.json  the edit for Retint, with the colors that it measured
  scenes/SCENE/OBJECT/EDIT/edit.cube  the same as a table of display-encoded colors, for any program
  scenes/SCENE/OBJECT/EDIT/truth      the right pictures of the held-out views

A folder of results holds, for each task that a program did:

  TASK/splat.ply    the recolored splat, in any format that Retint reads
  TASK/masks        optional: the selection, <image name>.png, at least of the held-out views
  TASK/run.json     optional: "seconds" to recolor, "selection_seconds", "peak_mib",
                    "device_peak_mib"
"""
import dataclasses
import json
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "benchmarks"))

HOLDOUT = 8  # every so manieth view by name is held out
C0 = 0.28209479177387814  # the constant spherical harmonic


@dataclasses.dataclass
class Task:
    name: str  # SCENE-OBJECT-EDIT-GIVEN
    scene: str
    object: str
    edit: str  # recolor, tint, grade, lut or lettering
    given: str  # one or three painted views, or true masks
    painted: list  # names of the painted views; none where true masks are given
    held_out: list  # names of the views that a result is measured in
    picture: str = ""  # lettering: the painted picture of view painted[0] or `picture_view`
    picture_view: str = ""

    def scene_folder(self, root):
        return root / "scenes" / self.scene

    def splat(self, root):
        return self.scene_folder(root) / "splat.ply"

    def object_folder(self, root):
        return self.scene_folder(root) / self.object

    def edit_folder(self, root):
        return self.object_folder(root) / self.edit

    def edit_flags(self, root):
        """The edit for `retint`."""
        if self.picture:
            return ["--edited", f"{self.picture_view}={root / self.picture}"]
        return ["--edit", self.edit_folder(root) / "edit.json"]


def read_tasks(root):
    return [Task(**entry) for entry in json.loads((root / "tasks.json").read_text())]


def write_tasks(root, tasks):
    (root / "tasks.json").write_text(
        json.dumps([dataclasses.asdict(task) for task in tasks], indent=1) + "\n")


# ---- Splats ----

class Ply:
    """A splat as the original training code writes it: `rows`, an array of named floats."""

    def __init__(self, path):
        data = path.read_bytes()
        self.header = data[:data.index(b"end_header\n") + len(b"end_header\n")]
        words = [line.split() for line in self.header.decode("latin-1").splitlines()]
        if ["format", "binary_little_endian", "1.0"] not in words:
            raise ValueError(f"{path}: is no binary little-endian .ply")
        kinds = {"float": "<f4", "float32": "<f4", "double": "<f8", "uchar": "u1"}
        dtype = np.dtype([(w[2], kinds[w[1]]) for w in words if w[0] == "property"])
        count = next(int(w[2]) for w in words if w[:2] == ["element", "vertex"])
        self.rows = np.frombuffer(data, dtype, count, len(self.header)).copy()
        self.rest = sum(name.startswith("f_rest_") for name in dtype.names) // 3

    def write(self, path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(self.header + self.rows.tobytes())

    def coefficients(self):
        """Spherical harmonics, [N, 1 + rest, 3]."""
        names = [[f"f_dc_{c}"] + [f"f_rest_{c * self.rest + k}" for k in range(self.rest)]
                 for c in range(3)]
        return np.stack([np.stack([self.rows[n] for n in of], 1) for of in names], 2)

    def set_coefficients(self, sh, chosen):
        """Of the chosen Gaussians; all others keep their bytes."""
        for c in range(3):
            self.rows[f"f_dc_{c}"][chosen] = sh[chosen, 0, c]
            for k in range(self.rest):
                self.rows[f"f_rest_{c * self.rest + k}"][chosen] = sh[chosen, 1 + k, c]


def changed(before, after):
    """How many Gaussians, and bytes of them, differ; None if the splats are not of one layout."""
    if before.rows.dtype != after.rows.dtype or len(before.rows) != len(after.rows):
        return None
    differ = (before.rows.view(np.uint8).reshape(len(before.rows), -1)
              != after.rows.view(np.uint8).reshape(len(after.rows), -1))
    return int(differ.any(1).sum()), int(differ.sum())


def read_shares(path):
    data = path.read_bytes()
    if data[:8] != b"RTSHARES":
        raise ValueError(f"{path}: holds no shares")
    return np.frombuffer(data, "<f4", int.from_bytes(data[8:16], "little"), 24)


# ---- Edits as tables ----

def write_table(path, values):
    """values [n, n, n, 3], indexed by red, green, blue."""
    lines = [f"LUT_3D_SIZE {len(values)}"]
    lines += ["%.6f %.6f %.6f" % tuple(v) for v in values.transpose(2, 1, 0, 3).reshape(-1, 3)]
    path.write_text("\n".join(lines) + "\n")


def grid(n):
    axis = np.linspace(0, 1, n, dtype=np.float32)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)


def read_table(path):
    lines = path.read_text().splitlines()
    n = int(lines[0].split()[1])
    return np.array([line.split() for line in lines[1:]], float).reshape(n, n, n, 3).transpose(
        2, 1, 0, 3)


def look_up(table, colors):
    """The edit of colors [N, 3], between the table's nodes linearly; beyond 0 and 1 colors keep what
    they have beyond."""
    inside = np.clip(colors, 0, 1)
    at = inside * (len(table) - 1)
    low = np.minimum(at.astype(int), len(table) - 2)
    part, found = at - low, np.zeros_like(inside)
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, part, 1 - part), 1)
        found += weight[:, None] * table[tuple((low + corner).T)]
    return found + colors - inside
