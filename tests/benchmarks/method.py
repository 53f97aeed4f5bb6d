#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What each difference from the published method brings: the table of docs/method.md.

  python3 tests/benchmarks/method.py --retint build/release/apps/retint --data DATA --work /tmp/m

Runs Retint's defaults, `--preset paper`, and the defaults with one line of that table as the paper
has it. Prints Markdown: IoU of the masks with the true ones (all views but the painted one), and
PSNR inside and outside on views held out of the fit, every eighth by name. All rows are measured
by the same yardstick: the renders, edited with the true masks; on a capture with fewer than three
of these, with the masks of the defaults."""
import json

import workbench as wb

# (line, options of select, of project, of refit)
LINES = [
    ("Retint's defaults", [], [], []),
    ("`--preset paper`", ["--preset", "paper"], ["--preset", "paper"], ["--preset", "paper"]),
    ("stereo pairs: two", ["--set", "both_sides=false"], [], []),
    ("depth of the pairs: the lesser", ["--set", "aggregate=min"], [], []),
    ("stereo always wins", ["--set", "arbitrate=false"], [], []),
    ("bias of the matcher stays", ["--set", "subpixel=false"], [], []),
    ("registration: none", ["--set", "register_cloud=false"], [], []),
    ("masks: squares of 3 pixels", [], ["--set", "projector=quads"], []),
    ("sides that nobody painted: outside", [], ["--completion", "off"], []),
    ("targets: the photos", [], [], ["--target", "photo"]),
    ("solver: Adam", [], [], ["--set", "solver=adam"]),
    ("solver: Adam, rate 2.5e-3", [], [], ["--set", "solver=adam", "--set", "learning_rate=2.5e-3"]),
    ("Adam's start: the original", [], [],
     ["--set", "solver=adam", "--set", "closed_form_start=false"]),
    ("end: 1000 sweeps or no gain", [], [], ["--set", "iterations=0"]),
    ("may change: all that a mask touches", [], [], ["--set", "active_threshold=0"]),
]


def main():
    parser = wb.arguments(__doc__, ["sample", "fox", "flower"])
    parser.set_defaults(objects="ball,box,plant")
    parser.add_argument("--tint", default="#3060ff", help="the edit")
    parser.add_argument("--lines", default=",".join(str(n) for n in range(len(LINES))),
                        help="their numbers, from 0, which the fox needs as its yardstick")
    parser.add_argument("--holdout", type=int, default=8, help="every n-th view")
    options = parser.parse_args()
    run = wb.Runner(options)
    paints = wb.make_scenes(options, run)
    edit = ["--tint", options.tint, "--holdout", options.holdout]

    def folder_of(paint, number):
        return paint.folder(options.work) / "method" / str(number)

    def recolor(job):
        paint, number = job
        _, select, project, refit = LINES[number]
        folder = folder_of(paint, number)
        folder.mkdir(parents=True, exist_ok=True)
        painted = [*paint.scene_flags(), *paint.paint_flags()]
        run("select", *painted, "--output", folder / "cloud.ply", *select)
        run("project", *painted, "--cloud", folder / "cloud.ply", "--output", folder / "masks",
            *project)
        run("refit", *paint.scene_flags(), "--masks", folder / "masks", *edit, *refit,
            "--output", folder / "after.ply", "--report", folder / "report.json")
        return wb.mean(wb.overlaps(folder / "masks", paint)), json.loads(
            (folder / "report.json").read_text())

    def evaluate(job):
        paint, number = job
        folder = folder_of(paint, number)
        if len(paint.truth) > 2:
            yardstick = next(iter(paint.truth.values())).parent
        else:
            yardstick = folder_of(paint, 0) / "masks"
        run("evaluate", paint.workspace, "--splat", paint.splat,
            "--after", folder / "after.ply", "--masks", folder / "masks",
            "--true-masks", yardstick, *edit, "--report", folder / "evaluated.json")
        (folder / "after.ply").unlink()
        return json.loads((folder / "evaluated.json").read_text())["true_masks"]["quality"]

    lines = [int(n) for n in options.lines.split(",")]
    jobs = [(p, n) for p in paints for n in lines]
    recolored = run.each(recolor, jobs)
    measured = run.each(evaluate, [j for j, r in zip(jobs, recolored) if r])
    by_job = dict(zip([j for j, r in zip(jobs, recolored) if r], measured))

    for scene in dict.fromkeys(p.scene for p in paints):
        rows = []
        for number in lines:
            line = LINES[number][0]
            of_scene = [(r, by_job[j]) for j, r in zip(jobs, recolored)
                        if j[0].scene == scene and j[1] == number and by_job.get(j)]
            heldout = [q["heldout"] or q["train"] for _, q in of_scene]
            rows.append([
                line, wb.text(wb.mean(r[0] for r, _ in of_scene), 3),
                wb.text(wb.mean(q["psnr_inside_after"] for q in heldout), 2),
                wb.text(wb.mean(q["psnr_outside"] for q in heldout), 2),
                wb.text(wb.mean(q["train"]["psnr_inside_after"] for _, q in of_scene), 2),
                wb.text(wb.mean(q["train"]["psnr_outside"] for _, q in of_scene), 2),
                wb.text(wb.mean(r[1]["stages_ms"]["refit"] / 1000 for r, _ in of_scene), 2)])
        wb.print_table(f"**{scene}**", ["", "IoU", "inside, held out, dB", "outside, held out, dB",
                                        "inside, fitted, dB", "outside, fitted, dB", "refit, s"],
                       rows)
    print(f"\n{run.count} runs")
    wb.save(options, [[p.scene, p.label, LINES[n][0], r, by_job.get((p, n))]
                      for (p, n), r in zip(jobs, recolored)])


if __name__ == "__main__":
    main()
