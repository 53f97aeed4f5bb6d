#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What solvers reach inside and outside the masks: adam over learning rates and steps, mm over its
weight outside.

  python3 tests/benchmarks/frontier.py --retint build/release/apps/retint --data DATA --work /tmp/f

Prints a Markdown table for every selection: an object of a scene with its true masks (hard edges)
or with the masks that Retint projects from one painted view (soft edges). PSNR is measured on
views that were held out of the fit, every eighth by name, against targets made with the masks of
the fit; and also against those of the true masks, where the others were fitted."""
import json

import workbench as wb


def numbers(text):
    return [float(value) for value in text.split(",") if value]


def main():
    parser = wb.arguments(__doc__, ["sample", "misplaced", "fox", "flower"])
    parser.set_defaults(objects="ball,plant")
    parser.add_argument("--masks", default="true,projected", help="which kinds")
    parser.add_argument("--rates", type=numbers, default="5e-4,1e-3,2.5e-3,5e-3,1e-2,3e-2",
                        help="learning rates of adam")
    parser.add_argument("--steps", type=numbers, default="1000,3000", help="of adam")
    parser.add_argument("--weights", type=numbers, default="0.4,0.6,0.8,1,1.25,1.5,2,2.5,3,4",
                        help="of mm outside")
    parser.add_argument("--ridges", type=numbers, default="1e-2,3e-2,1e-1",
                        help="pulls of mm's higher bands, each with --ridge-weights")
    parser.add_argument("--ridge-weights", type=numbers, default="0.6,0.8,1,1.5,2",
                        help="of mm outside")
    parser.add_argument("--tint", default="#3060ff", help="the edit")
    parser.add_argument("--holdout", type=int, default=8, help="every n-th view")
    options = parser.parse_args()
    run = wb.Runner(options)
    paints = wb.make_scenes(options, run)

    def project(paint):
        folder = paint.folder(options.work) / "frontier"
        folder.mkdir(parents=True, exist_ok=True)
        run("select", *paint.scene_flags(), *paint.paint_flags(), "--output", folder / "cloud.ply")
        run("project", *paint.scene_flags(), *paint.paint_flags(), "--cloud", folder / "cloud.ply",
            "--output", folder / "masks")
        return folder / "masks"

    selections = []  # (paint, kind, folder of masks)
    if "projected" in options.masks:
        selections += [(p, "projected", m) for p, m in zip(paints, run.each(project, paints)) if m]
    if "true" in options.masks:
        # One true mask is no selection: such views would be all that there is to fit.
        selections += [(p, "true", next(iter(p.truth.values())).parent)
                       for p in paints if len(p.truth) > 2]
    selections.sort(key=lambda s: (s[0].scene, s[0].label, s[1]))

    solvers = [("mm, defaults", ["--set", "solver=mm"])]
    solvers += [(f"mm, weight outside {w:g}", ["--set", "solver=mm", "--outside-weight", w])
                for w in options.weights]
    solvers += [(f"mm, ridge {r:g}, weight outside {w:g}",
                 ["--set", "solver=mm", "--set", f"ridge_rest={r}", "--outside-weight", w])
                for r in options.ridges for w in options.ridge_weights]
    # Where both begin; a step of this rate changes nothing that is measured.
    solvers += [("closed form", ["--set", "solver=adam", "--set", "learning_rate=1e-12",
                                 "--set", "iterations=1"])]
    solvers += [(f"adam, rate {rate:g}, {steps:.0f} steps",
                 ["--set", "solver=adam", "--set", f"learning_rate={rate}", "--set", f"iterations={steps:.0f}"])
                for rate in options.rates for steps in options.steps]

    def refit(job):
        (paint, kind, masks), (name, flags) = job
        folder = paint.folder(options.work) / "frontier" / kind / name.replace(" ", "-")
        folder.mkdir(parents=True, exist_ok=True)
        edit = ["--tint", options.tint, "--holdout", options.holdout]
        run("refit", *paint.scene_flags(), "--masks", masks, *edit, *flags,
            "--output", folder / "after.ply", "--report", folder / "report.json")
        figures = json.loads((folder / "report.json").read_text())
        if kind == "projected" and len(paint.truth) > 2:
            run("evaluate", paint.workspace, "--splat", paint.splat,
                "--after", folder / "after.ply", "--masks", masks, "--true-masks",
                next(iter(paint.truth.values())).parent, *edit,
                "--report", folder / "evaluated.json")
            evaluated = json.loads((folder / "evaluated.json").read_text())
            figures["true_masks"] = evaluated["true_masks"]
        (folder / "after.ply").unlink()
        return figures

    jobs = [(s, solver) for s in selections for solver in solvers]
    # The longest first: steps of adam on large scenes.
    order = sorted(range(len(jobs)), key=lambda i: "adam" not in jobs[i][1][0])
    done = dict(zip(order, run.each(refit, [jobs[i] for i in order])))

    for number, (paint, kind, _) in enumerate(selections):
        rows = []
        for i, (selection, (name, _)) in enumerate(jobs):
            if selection is not selections[number] or not done[i]:
                continue
            row = [name]
            for quality in ("quality", "true_masks"):
                found = done[i].get(quality)
                found = found.get("quality", found) if found else {}
                for part in ("train", "heldout"):
                    for key in ("psnr_inside_after", "psnr_outside"):
                        row.append(wb.text((found.get(part) or {}).get(key), 2))
            row.append(str(done[i]["refit"]["iterations"]))
            row.append(wb.text(done[i]["stages_ms"]["refit"] / 1000, 2))
            rows.append(row)
        head = ["", "in", "out", "in, held out", "out, held out",
                "true masks: in", "out", "in, held out", "out, held out", "steps", "s"]
        if not any(row[5] != "–" for row in rows):
            head, rows = head[:5] + head[9:], [row[:5] + row[9:] for row in rows]
        wb.print_table(f"**{paint.scene}, {paint.label}, {kind} masks**, PSNR in dB", head, rows)
    print(f"\n{run.count} runs")
    wb.save(options, [[s[0].scene, s[0].label, s[1], name, done[i]]
                      for i, (s, (name, _)) in enumerate(jobs)])


if __name__ == "__main__":
    main()
