#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What of an edit arrives inside the object and what stains its surroundings: from the true masks
of three views, and from those of all views, which is the limit of any selection.

  python3 tests/benchmarks/borders.py --retint build/release/apps/retint --data DATA --work /tmp/b

Prints a Markdown table. `hit`, `missed` and `stained` are `retint score`'s, means over the views
that were not painted (with all masks: over all views); PSNR is in dB, inside / outside, over all
views, against targets made with the true masks. The three views lie a sixth, a half and five
sixths along the views that show the object, by name."""
import json

import workbench as wb

SETTINGS = {
    "defaults": [],
    "weight outside 0.4": ["--outside-weight", "0.4"],
    "pull 1e-2": ["--set", "ridge_rest=1e-2"],
}


def main():
    parser = wb.arguments(__doc__, ["sample", "misplaced", "flower", "cape"])
    parser.set_defaults(objects="ball,plant")
    parser.add_argument("--settings", default=",".join(SETTINGS),
                        help="of the refit, from: " + ", ".join(SETTINGS))
    parser.add_argument("--masks", default="three,all", help="which views' true masks are given")
    parser.add_argument("--tint", default="#3060ff", help="the edit")
    options = parser.parse_args()
    chosen = [name for name in options.settings.split(",") if name]
    for name in chosen:
        if name not in SETTINGS:
            parser.error(f"setting '{name}' is unknown")
    run = wb.Runner(options)
    # Fewer masks cannot score the views between the painted ones.
    paints = [p for p in wb.make_scenes(options, run) if len(p.truth) > 6]

    def three(paint):
        shown = [name for name, file in paint.truth.items() if any(map(any, wb.read_mask(file)[2]))]
        return [shown[len(shown) * k // 6] for k in (1, 3, 5)]

    def prepare(paint):
        """The masks that three views give, and pictures of the scene as it was."""
        folder = paint.folder(options.work) / "borders"
        folder.mkdir(parents=True, exist_ok=True)
        views = three(paint)
        painted = [x for v in views for x in ("--view", v, "--mask", paint.truth[v])]
        if "three" in options.masks:
            run("select", *paint.scene_flags(), *painted, "--output", folder / "cloud.ply")
            run("project", *paint.scene_flags(), *painted, "--cloud", folder / "cloud.ply",
                "--output", folder / "three")
        run("render", *paint.scene_flags(), "--all", "--output", folder / "before")
        return folder, views

    def measure(job):
        (paint, (folder, views)), kind, setting = job
        truth = next(iter(paint.truth.values())).parent
        masks = truth if kind == "all" else folder / "three"
        name = folder / f"{kind} {setting}".replace(" ", "-")
        edit = ["--tint", options.tint]
        after, splat = name.with_name(name.name + "-after"), name.with_name(name.name + ".ply")
        run("refit", *paint.scene_flags(), "--masks", masks, *edit, *SETTINGS[setting],
            "--output", splat)
        run("render", paint.workspace, "--splat", splat, "--all", "--output", after)
        painted = [x for v in views for x in ("--painted", v)] if kind == "three" else []
        scores, quality = name.with_name(name.name + "-score.json"), name.with_name(
            name.name + "-quality.json")
        run("score", "--truth", truth, "--before", folder / "before", "--after", after, *edit,
            *painted, "--report", scores)
        run("evaluate", paint.workspace, "--splat", paint.splat, "--after", splat,
            "--masks", truth, *edit, "--report", quality)
        group = next(g for g in json.loads(scores.read_text())["groups"] if g["name"] == "all")
        found = {key: group[key]["mean"] for key in ("hit", "missed", "leak", "stained")}
        numbers = json.loads(quality.read_text())["quality"]["train"]
        found.update((key, numbers[key]) for key in ("psnr_inside_after", "psnr_outside"))
        splat.unlink()
        return found

    ready = [(p, r) for p, r in zip(paints, run.each(prepare, paints)) if r]
    jobs = [(one, kind, setting) for one in ready for kind in options.masks.split(",")
            for setting in chosen]
    done = run.each(measure, jobs)
    rows = []
    for ((paint, _), kind, setting), found in zip(jobs, done):
        found = found or {}
        rows.append([f"{paint.scene}, {paint.label}", kind, setting,
                     *(wb.text(found.get(key), 4 if key == "stained" else 3)
                       for key in ("hit", "missed", "stained")),
                     wb.text(found.get("psnr_inside_after"), 1) + " / "
                     + wb.text(found.get("psnr_outside"), 1)])
    wb.print_table("**Borders**", ["", "true masks of", "refit", "hit", "missed", "stained",
                                   "inside / outside"], rows)
    print(f"\n{run.count} runs")
    wb.save(options, [[p.scene, p.label, kind, setting, found]
                      for ((p, _), kind, setting), found in zip(jobs, done)])


if __name__ == "__main__":
    main()
