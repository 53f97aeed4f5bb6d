#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Scores folders of results of RecolorBench, each made by any program (needs NumPy and Pillow).

  python3 tests/recolorbench/score.py --retint build/release/apps/retint --work tasks \\
      --results results/retint results/mine --output scores.json --markdown scores.md

tasks.py describes the folders. All figures are of held-out views. The first table is the mean of
the tasks that every program did; the best of each column is bold.

  hit, missed, leak, stained   `retint score`: the change that arrived inside, and what else changed
  boundary IoU                 `retint score`: of the selection, where one is given
  dE00 inside, outside         mean CIEDE2000 against the right pictures
  PSNR                         of whole pictures against the right ones, dB
  seconds, MiB                 to recolor, without the selection, as the program itself measured it
  Gaussians, bytes             that differ from the original splat"""
import json
import pathlib
import statistics

import numpy as np

import tasks as rb
import edits
import workbench as wb

# Name, heading, digits, and whether more is better.
MEASURES = [("hit", "hit", 3, True), ("missed", "missed", 3, False), ("leak", "leak", 3, False),
            ("stained", "stained", 4, False), ("boundary_iou", "boundary IoU", 3, True),
            ("de_inside", "dE00 inside", 2, False), ("de_outside", "dE00 outside", 3, False),
            ("psnr", "PSNR, dB", 2, True), ("seconds", "seconds", 3, False),
            ("peak_mib", "MiB", 0, False), ("changed_gaussians", "Gaussians", 0, False),
            ("changed_bytes", "bytes", 0, False)]


def render(run, task, root, splat, folder):
    views = [flag for view in task.held_out for flag in ("--view", view)]
    run("render", task.scene_folder(root), "--splat", splat, *views, "--output", folder)


def before_of(task, root):
    return root / "work" / "before" / f"{task.scene}-{task.object}"


def by_score(run, task, root, before, after, masks, report):
    """The figures of `retint score`, means of the held-out views."""
    # A picture is no map of colors to expect; leak and stained do not depend on one.
    edit = ["--invert"] if task.picture else task.edit_flags(root)
    mask_flags = ["--masks", masks] if masks.is_dir() else []
    run("score", "--truth", task.object_folder(root) / "held_out", "--before", before, "--after",
        after, *mask_flags, *edit, "--report", report)
    everything = json.loads(report.read_text())["groups"][0]
    wanted = ["leak", "stained", "boundary_iou"] + ([] if task.picture else ["hit", "missed"])
    return {name: everything[name]["mean"] for name in wanted if name in everything}


def by_truth(task, root, after):
    inside, outside, errors = [], [], []
    for view in task.held_out:
        mask = edits.read_mask(task.object_folder(root) / "held_out" / (view + ".png"))
        true = edits.read(task.edit_folder(root) / "truth" / (view + ".png"))
        found = edits.read(after / (view + ".png"))
        inside.append(edits.differences(found[mask >= 128], true[mask >= 128]))
        outside.append(edits.differences_outside(found[mask == 0], true[mask == 0]))
        errors.append(((found - true) ** 2).ravel())
    error = max(np.concatenate(errors).mean(), 1e-10)
    return {"de_inside": float(np.concatenate(inside).mean()),
            "de_outside": float(np.concatenate(outside).mean()),
            "psnr": float(-10 * np.log10(error))}


def score(run, task, root, results):
    """Figures of one task; None if the program did not do it."""
    folder = results / task.name
    splats = sorted(folder.glob("splat.*"))
    if not splats:
        return None
    work = root / "work" / "scores" / results.name / task.name
    render(run, task, root, splats[0], work / "after")
    figures = by_score(run, task, root, before_of(task, root), work / "after",
                       folder / "masks", work / "score.json")
    figures.update(by_truth(task, root, work / "after"))
    if splats[0].suffix == ".ply":
        differ = rb.changed(rb.Ply(task.splat(root)), rb.Ply(splats[0]))
        if differ:
            figures["changed_gaussians"], figures["changed_bytes"] = differ
    if (folder / "run.json").exists():
        figures.update(json.loads((folder / "run.json").read_text()))
    return figures


def rounded(figures):
    return figures and {name: float(f"{value:.5g}") if isinstance(value, float) else value
                        for name, value in figures.items()}


def means(scores, names):
    rows = {}
    for program, of in scores.items():
        rows[program] = {"tasks": len(names)}
        for measure, *_ in MEASURES:
            values = [of[name][measure] for name in names
                      if of[name] and of[name].get(measure) is not None]
            if values:
                rows[program][measure] = float(f"{statistics.fmean(values):.5g}")
    return rows


def table(title, rows):
    """Markdown of means; a measure that nobody has is left out."""
    shown = [m for m in MEASURES if any(m[0] in row for row in rows.values())]
    lines = [f"**{title}**", "", "| program | " + " | ".join(m[1] for m in shown) + " |",
             "|---|" + "---:|" * len(shown)]
    for program, row in rows.items():
        cells = []
        for name, _, digits, more in shown:
            cell = wb.text(row.get(name), digits)
            every = [wb.text(r[name], digits) for r in rows.values() if name in r]
            best = (max if more else min)(every, key=float) if every else None
            cells.append(f"**{cell}**" if name in row and cell == best else cell)
        lines.append(f"| {program} | " + " | ".join(cells) + " |")
    return lines + [""]


def tables(scores, tasks):
    """Means of the tasks that all did, by edit and by what was given; tasks without all follow."""
    done = {name: [p for p, of in scores.items() if of[name]] for name in scores[next(iter(scores))]}
    common = [t for t in tasks if len(done[t.name]) == len(scores)]
    groups = {f"All {len(common)} tasks that everybody did": (list(scores), common)}
    for key in ("edit", "given"):
        for value in dict.fromkeys(getattr(t, key) for t in common):
            of = [t for t in common if getattr(t, key) == value]
            groups[f"{key}: {value}, {len(of)} tasks"] = (list(scores), of)
    rest = {}
    for task in tasks:
        if 0 < len(done[task.name]) < len(scores):
            rest.setdefault(tuple(done[task.name]), []).append(task)
    for programs, of in rest.items():
        groups["Not done by everybody: " + ", ".join(t.name for t in of)] = (programs, of)
    found = {title: means({p: scores[p] for p in programs}, [t.name for t in of])
             for title, (programs, of) in groups.items() if of}
    return found, [line for title, rows in found.items() for line in table(title, rows)]


def main():
    parser = wb.arguments(__doc__, [])
    parser.add_argument("--results", type=pathlib.Path, nargs="+", required=True,
                        help="one folder for each program, named after it")
    parser.add_argument("--markdown", type=pathlib.Path, help="the tables (.md)")
    options = parser.parse_args()
    run, tasks = wb.Runner(options), rb.read_tasks(options.work)
    scores, objects = {}, {before_of(task, options.work): task for task in tasks}
    run.each(lambda folder: render(run, objects[folder], options.work,
                                   objects[folder].splat(options.work), folder), objects)
    for results in options.results:
        found = run.each(lambda task, of=results: score(run, task, options.work, of), tasks)
        scores[results.name] = {task.name: rounded(figures) for task, figures in zip(tasks, found)}
    summary, lines = tables(scores, tasks)
    wb.save(options, {"means": summary, "tasks": scores})
    print("\n".join(lines))
    if options.markdown:
        options.markdown.write_text("\n".join(lines))


if __name__ == "__main__":
    main()
