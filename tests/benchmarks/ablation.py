#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What each step of a selection brings: masks and depth with one option changed at a time, on
synthetic scenes whose splat, sparse points or walls are flawed, and on captures.

  python3 tests/benchmarks/ablation.py --retint build/release/apps/retint --data DATA --work /tmp/a

Prints Markdown: the mean IoU of the masks with the true ones over all views but the painted one
(the worst object in brackets), and the depth's errors. Every object is painted once, with its true
mask, in the view that shows most of it."""
import workbench as wb

# Of `retint select` (and `retint depth`, with --method for the method).
CLOUDS = {
    "defaults": [],
    "depth: the Gaussians' own": ["--depth-method", "gaussian"],
    "stereo: two pairs": ["--set", "both_sides=false"],
    "stereo: nearest of the pairs": ["--set", "aggregate=min"],
    "stereo: no arbitration": ["--set", "arbitrate=false"],
    "stereo: no refinement": ["--set", "subpixel=false"],
    "stereo: sgbm": ["--set", "matcher=sgbm"],
    "stereo: the paper's": ["--set", "both_sides=false", "--set", "aggregate=min", "--set", "arbitrate=false",
                            "--set", "subpixel=false"],
    "no registration": ["--set", "register_cloud=false"],
    "own depth, no registration": ["--depth-method", "gaussian", "--set", "register_cloud=false"],
    "outliers kept": ["--set", "outlier_neighbors=0"],
}
STEREO = [name for name in CLOUDS if name.startswith(("defaults", "depth", "stereo"))]
# Of `retint project`. The first is drawn for every cloud, and so are the points.
PROJECTORS = {
    "gaussians": [],
    "gaussians, completion off": ["--completion", "off"],
    "points as quads": ["--set", "projector=quads"],
    "points as surfels": ["--set", "projector=surfels"],
}
FOR_ALL_CLOUDS = ["gaussians", "gaussians, completion off", "points as quads"]


def main():
    parser = wb.arguments(__doc__, [*wb.SYNTHETIC, "fox", "flower"])
    options = parser.parse_args()
    run = wb.Runner(options)
    paints = wb.make_scenes(options, run)

    def select(job):
        paint, cloud = job
        file = paint.folder(options.work) / cloud.replace(" ", "-") / "cloud.ply"
        file.parent.mkdir(parents=True, exist_ok=True)
        printed = run("select", *paint.scene_flags(), *paint.paint_flags(), "--output", file,
                      *CLOUDS[cloud])
        return printed.splitlines()[0]

    def project(job):
        paint, cloud, projector = job
        folder = paint.folder(options.work) / cloud.replace(" ", "-")
        masks = folder / projector.replace(" ", "-")
        run("project", *paint.scene_flags(), *paint.paint_flags(), "--cloud", folder / "cloud.ply",
            "--output", masks, *PROJECTORS[projector])
        return wb.overlaps(masks, paint)

    def depth(job):
        paint, cloud = job
        file = paint.folder(options.work) / cloud.replace(" ", "-") / "depth.bin"
        file.parent.mkdir(parents=True, exist_ok=True)
        printed = run("depth", *paint.scene_flags(), "--view", paint.view, "--output", file,
                      "--against", "sparse", *CLOUDS[cloud])
        exact = paint.exact_depth()
        if exact:
            inside = wb.depth_errors(file, exact, paint.mask)
            return [wb.quantile(inside, 0.5), wb.quantile(inside, 0.9)]
        words = next(line for line in printed.splitlines() if "error" in line).split()
        return [float(words[2]) / 100, float(words[8]) / 100]

    clouds = [(p, c) for p in paints for c in CLOUDS]
    messages = run.each(select, clouds)
    masks = [(p, c, j) for p, c in clouds for j in PROJECTORS
             if j in FOR_ALL_CLOUDS or c == "defaults"]
    ious = run.each(project, masks)
    depths = [(p, c) for p in paints for c in STEREO]
    errors = run.each(depth, depths)

    scenes = list(dict.fromkeys(p.scene for p in paints))
    for projector in PROJECTORS:
        rows = []
        for cloud in CLOUDS:
            if projector not in FOR_ALL_CLOUDS and cloud != "defaults":
                continue
            row = [cloud]
            for scene in scenes:
                of_object = [wb.mean(i) for (p, c, j), i in zip(masks, ious)
                             if i and p.scene == scene and c == cloud and j == projector]
                worst = f" ({min(of_object):.3f})" if len(of_object) > 1 else ""
                row.append(wb.text(wb.mean(of_object), 3) + worst)
            rows.append(row)
        wb.print_table(f"**Masks, {projector}: mean IoU (worst object)**", ["", *scenes], rows)
    rows = []
    for cloud in STEREO:
        row = [cloud]
        for scene in scenes:
            found = [e for (p, c), e in zip(depths, errors) if e and p.scene == scene and c == cloud]
            row.append(" / ".join(wb.text(m and 100 * m, 2)
                                  for m in (wb.mean(e[0] for e in found),
                                            wb.mean(e[1] for e in found))))
        rows.append(row)
    wb.print_table("**Depth: relative error, %, median / 90 % at or below; on objects against the "
                   "exact depth, on captures against the sparse points of the whole view**",
                   ["", *scenes], rows)
    print(f"\n{run.count} runs")
    wb.save(options, {
        "select": [[p.scene, p.label, p.view, c, m] for (p, c), m in zip(clouds, messages)],
        "masks": [[p.scene, p.label, c, j, i] for (p, c, j), i in zip(masks, ious)],
        "depth": [[p.scene, p.label, c, e] for (p, c), e in zip(depths, errors)]})


if __name__ == "__main__":
    main()
