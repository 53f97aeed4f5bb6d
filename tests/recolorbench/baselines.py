#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Does the tasks of RecolorBench with Retint and with simple methods (needs NumPy and Pillow).

  python3 tests/recolorbench/baselines.py --retint build/release/apps/retint --work tasks \\
      --results results

  retint    the defaults
  adam-R    Adam from the original coefficients at rate R, no other option changed
  paper     ReCoGS as published, with its own selection
  affine    one affine map of the spherical harmonics of the selected Gaussians, the linear part on
            the higher bands, as SuperSplat 3 and LichtFeld's nodes do: the map that comes closest to
            the edit for their constant terms, by least squares
  degree0   the edit of the constant term of each selected Gaussian, and nothing of the higher bands,
            as KIRI's add-on and Splatshop do

All but `paper` start from the same masks: Retint's selection from the painted views, or the true
masks. A Gaussian is selected if more than half of it is inside. Results are in RESULTS/METHOD/TASK,
as tasks.py describes it."""
import json
import pathlib
import shutil
import threading
import time
import tracemalloc

import numpy as np

import tasks as rb
import workbench as wb

METHODS = ["retint", "affine", "degree0", "paper", "adam-1e-3", "adam-2.5e-3", "adam-5e-3"]


class Bench:
    def __init__(self, options):
        self.options, self.root, self.run = options, options.work, wb.Runner(options)
        self.locks, self.lock = {}, threading.Lock()

    def scene_flags(self, task):
        return [task.scene_folder(self.root), "--splat", task.splat(self.root)]

    def paint_flags(self, task):
        folder = task.object_folder(self.root) / "painted"
        return [flag for view in task.painted
                for flag in ("--view", view, "--mask", folder / (view + ".png"))]

    def selection(self, task):
        """The folder of the masks that a task starts from, and the seconds that they took."""
        if not task.painted:
            return task.object_folder(self.root) / "masks", 0.0
        folder = self.options.results / "selections" / f"{task.scene}-{task.object}-{task.given}"
        with self.lock:
            lock = self.locks.setdefault(folder, threading.Lock())
        with lock:
            if not (folder / "seconds").exists():
                folder.mkdir(parents=True, exist_ok=True)
                start = time.perf_counter()
                self.run("select", *self.scene_flags(task), *self.paint_flags(task), "--output",
                         folder / "cloud.ply")
                self.run("project", *self.scene_flags(task), *self.paint_flags(task), "--cloud",
                         folder / "cloud.ply", "--output", folder / "masks")
                (folder / "seconds").write_text(f"{time.perf_counter() - start:.3f}")
        return folder / "masks", float((folder / "seconds").read_text())

    def refit(self, task, folder, *more):
        masks, seconds = self.selection(task)
        self.run("refit", *self.scene_flags(task), "--masks", masks, *task.edit_flags(self.root),
                 "--holdout", rb.HOLDOUT, *more, "--output", folder / "splat.ply",
                 "--report", folder / "report.json")
        return masks, self.figures(folder, seconds)

    def paper(self, task, folder):
        if not task.painted:
            return self.refit(task, folder, "--preset", "paper")
        self.run("recolor", *self.scene_flags(task), *self.paint_flags(task),
                 *task.edit_flags(self.root), "--holdout", rb.HOLDOUT, "--preset", "paper",
                 "--output", folder / "splat.ply", "--report", folder / "report.json",
                 "--save-stages", folder / "stages")
        stages = json.loads((folder / "report.json").read_text())["stages_ms"]
        seconds = sum(stages[s] for s in ("depth", "cloud", "registration", "projection")) / 1e3
        return folder / "stages" / "masks", self.figures(folder, seconds)

    @staticmethod
    def figures(folder, selection_seconds):
        report = json.loads((folder / "report.json").read_text())
        return {"seconds": report["stages_ms"]["refit"] / 1e3,
                "selection_seconds": selection_seconds, "peak_mib": report["peak_rss_mb"],
                "device_peak_mib": report["peak_device_mb"] or None}

    def per_gaussian(self, task, folder, recolor):
        if task.picture:
            raise wb.Failed(f"{task.name}: a picture is no map of colors")
        masks, selection_seconds = self.selection(task)
        splat = rb.Ply(task.splat(self.root))
        table = rb.read_table(task.edit_folder(self.root) / "edit.cube")
        shares = rb.read_shares(masks / "shares.bin")
        tracemalloc.start()
        start = time.perf_counter()
        chosen = np.flatnonzero(shares > 0.5)
        sh = splat.coefficients()
        base = 0.5 + rb.C0 * sh[chosen, 0].astype(float)
        sh[chosen] = recolor(sh[chosen], base, rb.look_up(table, base))
        splat.set_coefficients(sh, chosen)
        seconds, peak = time.perf_counter() - start, tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        splat.write(folder / "splat.ply")
        return masks, {"seconds": seconds, "selection_seconds": selection_seconds,
                       "peak_mib": peak / 2 ** 20}

    def do(self, method, task):
        folder = self.options.results / method / task.name
        if (folder / "run.json").exists():
            return
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        if method == "retint":
            masks, figures = self.refit(task, folder)
        elif method == "paper":
            masks, figures = self.paper(task, folder)
        elif method.startswith("adam-"):
            masks, figures = self.refit(task, folder, "--set", "solver=adam", "--set",
                                        "adam.closed_form_start=false", "--set",
                                        f"adam.learning_rate={method[len('adam-'):]}")
        else:
            masks, figures = self.per_gaussian(task, folder, {"affine": affine,
                                                              "degree0": degree0}[method])
        if task.painted:
            (folder / "masks").mkdir()
            for view in task.held_out:
                shutil.copy(masks / (view + ".png"), folder / "masks")
        shutil.rmtree(folder / "stages", ignore_errors=True)
        (folder / "run.json").write_text(json.dumps(figures) + "\n")


def affine(sh, base, wanted):
    ones = np.ones((len(base), 1))
    found = np.linalg.lstsq(np.hstack([base, ones]), wanted, rcond=None)[0]
    recolored = sh @ found[:3]
    recolored[:, 0] = (base @ found[:3] + found[3] - 0.5) / rb.C0
    return recolored


def degree0(sh, _, wanted):
    recolored = sh.copy()
    recolored[:, 0] = (wanted - 0.5) / rb.C0
    return recolored


def main():
    parser = wb.arguments(__doc__, [])
    parser.add_argument("--results", type=pathlib.Path, required=True, help="folder to write")
    parser.add_argument("--methods", default=",".join(METHODS), help="separated by commas")
    parser.add_argument("--tasks", default="", help="only tasks whose name holds this")
    options = parser.parse_args()
    bench = Bench(options)
    jobs = [(method, task) for method in options.methods.split(",")
            for task in rb.read_tasks(options.work) if options.tasks in task.name]
    # One at a time: their seconds are reported.
    bench.run.jobs = 1
    bench.run.each(lambda job: bench.do(*job), jobs)


if __name__ == "__main__":
    main()
