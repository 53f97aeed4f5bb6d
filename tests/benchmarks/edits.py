#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How exact edits are, in CIEDE2000 differences (needs numpy and Pillow).

  python3 tests/benchmarks/edits.py --retint build/release/apps/retint --data DATA --work /tmp/e

Prints Markdown, any of four tables (--tables):
  operations  every operation on every scene: held-out views of the result against the operation
              applied to the original render, inside and outside the mask. Twice: of pictures, whose
              values are rounded to 8 bits, and of the values themselves, by the Python module that
              is built beside the program
  recolor     `--to` of the synthetic objects, and a tint, against renders of the same scene whose
              object has that color: each object with several colors, inside its true masks. The
              target is what the pixels of the object's main color have there
  highlight   the highlight of the sample's ball after `--to`, inside its true masks, against the
              splat of the scene whose ball has the color: its contrast to the ring around it, in
              linear light, and how much of the true one that is; how much more of the new hue it has
              than the true one, and how else hue and chroma differ: CIEDE2000 at equal lightness
  picture     stripes and letters on the box, taken over from the picture of one view, against the
              photos of the scene whose box has them: the side that the picture shows, in the views
              that see it
A row is printed when it is measured. `--limit`, few `--colors`, `--operations` and `--objects` and a
small `--size` make it quick."""
import json
import pathlib
import shlex
import sys

import numpy as np
from PIL import Image, ImageDraw

import workbench as wb

OPERATIONS = {
    "tint": ["--tint", "#3060ff"],
    "matrix": ["--matrix", "0,1,0,0,0,0,1,0,1,0,0,0"],
    "exposure": ["--exposure", "0.7"],
    "contrast": ["--contrast", "1.3"],
    "gamma": ["--gamma", "1.4"],
    "white-balance": ["--white-balance", "50,10"],
    "saturation": ["--saturation", "1.5"],
    "invert": ["--invert"],
    "gray": ["--gray"],
    "adjust": ["--adjust", "hue=90,chroma=0.9"],
    "to": ["--to", "#3060ff"],
    "gradient": ["--gradient", "#101030,#a04020,#fff0d0"],
    "palette": ["--palette", "4,1=#3060ff"],
    "to, soft-clip": ["--to", "#3060ff", "--soft-clip"],
}
COLORS = ["#3060ff", "#20a040", "#d02020", "#e0e0e0", "#303030"]  # dark, pale, strong and gray


def cie_lab(rgb):
    linear = linear_of(rgb)
    to_xyz = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                       [0.0193339, 0.1191920, 0.9503041]])
    xyz = linear @ to_xyz.T / np.array([0.95047, 1, 1.08883])
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]),
                     200 * (f[..., 1] - f[..., 2])], -1)


def differences(x, y):
    """CIEDE2000 (Sharma, Wu and Dalal 2005) of two arrays of display-encoded colors, [N, 3]."""
    l1, a1, b1 = cie_lab(x).T
    l2, a2, b2 = cie_lab(y).T
    mean = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    stretch = 1.5 - 0.5 * np.sqrt(mean ** 7 / (mean ** 7 + 25.0 ** 7))
    a1, a2 = a1 * stretch, a2 * stretch
    c1, c2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = np.degrees(np.arctan2(b1, a1)) % 360, np.degrees(np.arctan2(b2, a2)) % 360
    turn = (h2 - h1 + 180) % 360 - 180
    turn = np.where(c1 * c2 == 0, 0, turn)
    dl, dc, dh = l2 - l1, c2 - c1, 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2))
    lm, cm = (l1 + l2) / 2, (c1 + c2) / 2
    hm = np.where(c1 * c2 == 0, h1 + h2, (h1 + turn / 2) % 360)
    t = (1 - 0.17 * np.cos(np.radians(hm - 30)) + 0.24 * np.cos(np.radians(2 * hm))
         + 0.32 * np.cos(np.radians(3 * hm + 6)) - 0.2 * np.cos(np.radians(4 * hm - 63)))
    sl = 1 + 0.015 * (lm - 50) ** 2 / np.sqrt(20 + (lm - 50) ** 2)
    sc, sh = 1 + 0.045 * cm, 1 + 0.015 * cm * t
    twist = (-2 * np.sqrt(cm ** 7 / (cm ** 7 + 25.0 ** 7))
             * np.sin(np.radians(60 * np.exp(-((hm - 275) / 25) ** 2))))
    return np.sqrt((dl / sl) ** 2 + (dc / sc) ** 2 + (dh / sh) ** 2 + twist * dc / sc * dh / sh)


def differences_outside(x, y):
    """The same, where most pixels are equal."""
    found, differ = np.zeros(len(x)), (x != y).any(1)
    found[differ] = differences(x[differ], y[differ])
    return found


def read(path):
    return np.asarray(Image.open(path).convert("RGB")) / 255.0


def read_mask(path):
    return np.asarray(Image.open(path).convert("L"))


def recolor(run, paint, folder, edit, *more):
    """Runs `retint recolor` of one painted view and keeps its stages."""
    folder.mkdir(parents=True, exist_ok=True)
    run("recolor", *paint.scene_flags(), *paint.paint_flags(), *edit, "--output",
        folder / "out.ply", "--report", folder / "report.json", "--save-stages", folder / "stages",
        *more)
    return folder / "stages"


def refit(run, paint, folder, edit):
    """Renders of the scene after `retint refit` inside the object's true masks."""
    folder.mkdir(parents=True, exist_ok=True)
    workspace = [paint.workspace, "--splat"]
    masks = next(iter(paint.truth.values())).parent
    run("refit", *workspace, paint.splat, "--masks", masks, *edit, "--output", folder / "out.ply")
    run("render", *workspace, folder / "out.ply", "--all", "--output", folder / "renders")
    return folder / "renders"


def held_out(stages, every):
    return sorted(f.name for f in (stages / "result").glob("**/*.png"))[::every]


class Unrounded:
    """The same differences of renders whose values are not rounded; None without the module."""

    def __init__(self, options):
        program = pathlib.Path(shlex.split(options.retint)[0]).resolve()
        sys.path.insert(0, str(program.parent / "python"))
        try:
            import retint
        except ImportError:
            retint = None
        self.retint = retint

    def differences(self, paint, stages, names):
        if self.retint is None:
            return None
        folder, inside, outside = stages.parent, [], []
        report = json.loads((folder / "report.json").read_text())
        edit = self.retint.Edit.from_json(json.dumps(report["edit"]))
        workspace = self.retint.Workspace(str(paint.workspace))
        before, after = (self.retint.Splat.read(str(f)) for f in (paint.splat, folder / "out.ply"))
        for picture in names:
            camera = workspace[picture.removesuffix(".png")].camera
            old, found = (np.asarray(self.retint.render(s, camera, backend="cpu"))
                          for s in (before, after))
            mask = read_mask(stages / "masks" / picture)
            wanted = old + mask[..., None] / 255.0 * (np.asarray(edit.apply(old)) - old)
            found, wanted = found.clip(0, 1), wanted.clip(0, 1)
            inside.append(differences(found[mask >= 128], wanted[mask >= 128]))
            outside.append(differences_outside(found[mask == 0], wanted[mask == 0]))
        return np.concatenate(inside), np.concatenate(outside)


def operations(options, run, paints):
    rows = wb.Table("Operations: held-out views, CIEDE2000",
                    ["scene", "operation", "inside: median", "95 %", "outside: median", "mean",
                     "not rounded, inside: median", "95 %", "outside: mean"])
    unrounded = Unrounded(options)
    for paint in paints:
        if paint.scene in wb.SYNTHETIC and paint.label not in options.objects.split(",")[:1]:
            continue

        def measure(name, paint=paint):
            stages = recolor(run, paint, paint.folder(options.work) / name.replace(", ", "-"),
                             OPERATIONS[name], "--holdout", options.holdout,
                             *shlex.split(options.more))
            inside, outside = [], []
            for view in held_out(stages, options.holdout):
                mask = read_mask(stages / "masks" / view)
                found, wanted = read(stages / "result" / view), read(stages / "targets" / view)
                inside.append(differences(found[mask >= 128], wanted[mask >= 128]))
                outside.append(differences_outside(found[mask == 0], wanted[mask == 0]))
            inside, outside = np.concatenate(inside), np.concatenate(outside)
            exact = unrounded.differences(paint, stages, held_out(stages, options.holdout))
            rows.add([paint.scene, name, f"{np.median(inside):.2f}",
                      f"{np.quantile(inside, 0.95):.2f}", f"{np.median(outside):.2f}",
                      f"{outside.mean():.3f}"] +
                     ([f"{np.median(exact[0]):.2f}", f"{np.quantile(exact[0], 0.95):.2f}",
                       f"{exact[1].mean():.3f}"] if exact else ["–"] * 3))

        run.each(measure, options.operations.split(";"))
    return rows.rows


def true_scene(options, run, name, albedo):
    width, height, views = options.size.split("x")
    folder = options.work / "truth" / name
    if not (folder / "splat.ply").exists():
        run("synth", "--output", folder, "--width", width, "--height", height, "--photos", views,
            "--detail", options.detail, *[flag for entry in albedo for flag in ("--albedo", entry)])
    return folder


def linear_of(rgb):
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


# OKLab (B. Ottosson 2020): from linear sRGB to cones, and from their cube roots.
CONES = np.array([[0.4122214708, 0.2119034982, 0.0883024619],
                  [0.5363325363, 0.6806995451, 0.2817188376],
                  [0.0514459929, 0.1073969566, 0.6299787005]])
OPPONENTS = np.array([[0.2104542553, 1.9779984951, 0.0259040371],
                      [0.7936177850, -2.4285922050, 0.7827717662],
                      [-0.0040720468, 0.4505937099, -0.8086757660]])


def ok_lab(rgb):
    """OKLab of display-encoded colors, [N, 3]."""
    return np.cbrt(linear_of(rgb) @ CONES) @ OPPONENTS


def rgb_of(lab):
    linear = np.clip((lab @ np.linalg.inv(OPPONENTS)) ** 3 @ np.linalg.inv(CONES), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear,
                    1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)


def main_color(run, paint, folder):
    """The object's color that `retint refit` finds and replaces, as its report has it."""
    refit(run, paint, folder, ["--to", "#808080", "--report", folder / "report.json"])
    report = json.loads((folder / "report.json").read_text())
    return np.array(report["edit"]["operations"][0]["from"])


def new_color(main, plain, truth, label):
    """What the object's pixels of color `main`, or near to it, become."""
    before, after = [], []
    for name, mask in wb.masks_in(plain / "truth" / "masks" / label).items():
        inside = read_mask(mask) >= 250
        before.append(read(plain / "images" / name)[inside])
        after.append(read(truth / "images" / name)[inside])
    distance = np.linalg.norm(ok_lab(np.concatenate(before)) - ok_lab(main[None]), axis=1)
    near = distance <= np.quantile(distance, 0.05)
    return "#" + "".join(f"{round(255 * v):02x}"
                         for v in np.median(np.concatenate(after)[near], axis=0))


def recolored(options, run, paints):
    paints = [p for p in paints if p.scene == "sample"]
    rows = wb.Table("Recolored objects against the same scene with that color: mean CIEDE2000",
                    ["object", "albedo", "its main color", "`--to`", "`--tint`"])
    mains = run.each(lambda p: main_color(run, p, p.folder(options.work) / "main"), paints)
    mains = {p.label: main for p, main in zip(paints, mains) if main is not None}
    for color in options.colors.split(","):
        truth = true_scene(options, run, color[1:], [f"{p.label}={color}" for p in paints])

        def measure(paint, color=color, truth=truth):
            target = new_color(mains[paint.label], paint.workspace, truth, paint.label)
            row = [paint.label, color, target]
            for edit in (["--to", target], ["--tint", target]):
                renders = refit(run, paint, paint.folder(options.work) / (color[1:] + edit[0]), edit)
                found = []
                for view, mask in paint.truth.items():
                    inside = read_mask(mask) >= 250
                    found.append(differences(read(renders / (view + ".png"))[inside],
                                             read(truth / "images" / view)[inside]))
                row.append(f"{np.concatenate(found).mean():.2f}")
            rows.add(row)

        run.each(measure, [p for p in paints if p.label in mains])
    return rows.rows


def grown(mask, times):
    for _ in range(times):
        wider = mask.copy()
        wider[1:] |= mask[:-1]
        wider[:-1] |= mask[1:]
        wider[:, 1:] |= mask[:, :-1]
        wider[:, :-1] |= mask[:, 1:]
        mask = wider
    return mask


def highlight_of(render, inside):
    """Pixels of a render where gloss hides the object's color, and the ring around them: brighter
    than most of the object, and with less than half of its chroma."""
    lab = ok_lab(render.reshape(-1, 3)).reshape(render.shape)
    chroma, lightness = np.hypot(lab[..., 1], lab[..., 2]), lab[..., 0]
    found = (inside & (chroma < np.median(chroma[inside]) / 2)
             & (lightness > np.quantile(lightness[inside], 0.9)))
    return found, inside & grown(found, 8) & ~grown(found, 3)


def luminance(rgb):
    return (linear_of(rgb) @ np.array([0.2126, 0.7152, 0.0722])).mean()


def hue_gained(true, found, target):
    """CIEDE2000 of what `found` has more of the target's hue than `true`, at the true lightness;
    and of all that the two differ by in hue and chroma."""
    lab, other = ok_lab(true), ok_lab(found)
    new = ok_lab(np.array([[int(target[i:i + 2], 16) / 255 for i in (1, 3, 5)]]))[0, 1:]
    excess = np.maximum((other - lab)[:, 1:] @ new / max(np.hypot(*new), 1e-6), 0)
    more = lab.copy()
    more[:, 1:] += excess[:, None] * new / max(np.hypot(*new), 1e-6)
    other[:, 0] = lab[:, 0]
    return differences(rgb_of(lab), rgb_of(more)), differences(rgb_of(lab), rgb_of(other))


def highlights(options, run, paints):
    """The yardstick is the splat of the scene whose ball has the color: the same Gaussians, so that
    their blur does not count."""
    rows = wb.Table("The ball's highlight after `--to`",
                    ["albedo", "its main color", "pixels", "contrast before", "true", "found",
                     "kept", "new hue gained: mean", "95 %", "all hue and chroma: mean"])
    paint = next((p for p in paints if (p.scene, p.label) == ("sample", "ball")), None)
    if paint is None:
        return []
    folder = paint.folder(options.work)
    main = main_color(run, paint, folder / "main")
    plain = refit(run, paint, folder / "plain", ["--matrix", "1,0,0,0,0,1,0,0,0,0,1,0"])

    def measure(color):
        truth = true_scene(options, run, color[1:], [f"{p.label}={color}" for p in paints])
        target = new_color(main, paint.workspace, truth, paint.label)
        made = refit(run, paint, folder / ("light" + color[1:]), ["--to", target])
        true = folder / ("true" + color[1:])
        run("render", truth, "--splat", truth / "splat.ply", "--all", "--output",
            true)
        contrasts, hues = [], []
        for view, mask in paint.truth.items():
            before, wanted, found = (read(f / (view + ".png")) for f in (plain, true, made))
            light, ring = highlight_of(before, read_mask(mask) >= 250)
            if light.sum() < 5 or ring.sum() < 5:
                continue
            contrasts.append([light.sum()] + [light.sum() * (luminance(x[light])
                                                             - luminance(x[ring]))
                                              for x in (before, wanted, found)])
            hues.append(hue_gained(wanted[light], found[light], target))
        if not hues:
            return
        pixels, *sums = np.sum(contrasts, axis=0)
        gained, all_hue = np.concatenate(hues, axis=1)
        rows.add([color, target, str(int(pixels)), *(f"{x / pixels:.3f}" for x in sums),
                  f"{sums[2] / sums[1]:.2f}", f"{gained.mean():.2f}",
                  f"{np.quantile(gained, 0.95):.2f}", f"{all_hue.mean():.2f}"])

    run.each(measure, options.colors.split(","))
    return rows.rows


def painted_box(path, what):
    picture = Image.new("RGB", (256, 256), (200, 180, 120))
    draw = ImageDraw.Draw(picture)
    if what == "stripes":
        for x in range(0, 256, 64):
            draw.rectangle([x, 0, x + 31, 255], fill=(40, 60, 160))
    else:
        for text, y in (("RETINT", 40), ("BOX", 150)):
            small = Image.new("L", (60, 12), 0)
            ImageDraw.Draw(small).text((2, 0), text, fill=255)
            large = small.resize((300, 72), Image.Resampling.BICUBIC)
            picture.paste((20, 20, 20), (10, y), large)
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path)
    return path


# ---- A painted side ----

def rotation_of(quaternion):
    w, x, y, z = quaternion
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def world_points(depth, view):
    """[H, W, 3]: what the pixels of a view of `workbench.read_cameras` show; depth [H, W]."""
    (fx, fy, cx, cy), quaternion, translation = view
    rotation = rotation_of(quaternion)
    height, width = depth.shape
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    in_camera = np.stack([(u - cx) / fx * depth, (v - cy) / fy * depth, depth], -1)
    return (in_camera - np.array(translation)) @ rotation


def largest_side(points, inside):
    """The plane, unit normal and offset, that most of the pixels show."""
    across = np.gradient(points, axis=1)
    down = np.gradient(points, axis=0)
    normals = np.cross(across, down)[inside & ~grown(~inside, 1)]
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    tries = normals[np.linspace(0, len(normals) - 1, 64).astype(int)]
    votes = normals @ tries.T > 0.98
    normal = np.median(normals[votes[:, votes.sum(0).argmax()]], axis=0)
    normal /= np.linalg.norm(normal)
    offsets = points[inside] @ normal
    heights, bins = np.histogram(offsets, bins=int(np.ptp(offsets) / 1e-3) + 1)
    best = heights.argmax()
    near = offsets[(offsets >= bins[best] - 1e-3) & (offsets <= bins[best + 1] + 1e-3)]
    return normal, np.median(near)


def sides(workspace, masks, view):
    """Of each view that sees the side that `view` shows most of, its pixels, within 2 mm, and the
    angle at which it looks at the side, in degrees from straight on."""
    cameras = wb.read_cameras(workspace)

    def points(name):
        width, height, depth = wb.read_depth(workspace / "truth" / "depth" / (name + ".bin"))
        return world_points(np.array(depth, dtype=float).reshape(height, width), cameras[name])

    normal, offset = largest_side(points(view), read_mask(masks[view]) >= 250)
    found = {name: (read_mask(mask) >= 250) & (np.abs(points(name) @ normal - offset) < 2e-3)
             for name, mask in masks.items()}
    found = {name: side for name, side in found.items() if side.sum() >= 100}
    angles = {}
    for name, side in found.items():
        _, quaternion, translation = cameras[name]
        toward = -np.array(translation) @ rotation_of(quaternion) - points(name)[side].mean(0)
        angles[name] = np.degrees(np.arccos(abs(normal @ toward) / np.linalg.norm(toward)))
    return found, angles


def sample(gray, x, y):
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - x0, y - y0
    x0, y0 = np.clip(x0, 0, gray.shape[1] - 2), np.clip(y0, 0, gray.shape[0] - 2)
    return ((gray[y0, x0] * (1 - u) + gray[y0, x0 + 1] * u) * (1 - v)
            + (gray[y0 + 1, x0] * (1 - u) + gray[y0 + 1, x0 + 1] * u) * v)


def edge_shifts(truth, found, side):
    """Pixels by which edges inside a side have moved: along the true gradient, where profiles 4
    pixels long correlate best."""
    weights = np.array([0.2126, 0.7152, 0.0722])
    truth, found = truth @ weights, found @ weights
    down, right = np.gradient(truth)
    strength = np.hypot(right, down)
    y, x = np.nonzero((strength > 0.05) & ~grown(~side, 4))
    right, down = right[y, x] / strength[y, x], down[y, x] / strength[y, x]
    steps = np.arange(-2, 2.01, 0.5)

    def profiles(gray, shift):
        along = (steps + shift)[None]
        values = sample(gray, x[:, None] + along * right[:, None], y[:, None] + along * down[:, None])
        values = values - values.mean(1, keepdims=True)
        return values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-9)

    shifts = np.arange(-2, 2.01, 0.125)
    true = profiles(truth, 0)
    scores = np.stack([(true * profiles(found, shift)).sum(1) for shift in shifts], 1)
    return np.abs(shifts[scores.argmax(1)])


def pictures(options, run, paints):
    """The plain box is the scene; the picture of one view is the photo of the painted one: of the
    view that shows most of the box, or of `--painted`. Pixels are those of the side that the first
    of these shows most of, in all views that see it. The bound is what
    these Gaussians can show at best: fitted to the painted box's photos of all views."""
    rows = wb.Table("A painted side of the box, from the picture of one view",
                    ["paint", "views", "PSNR before, dB", "after", "bound", "the painted view: after",
                     "bound", "edges moved: median, pixels", "95 %", "within a pixel", "bound",
                     "explained by a color map"])
    plain = true_scene(options, run, "plain-box", ["box=#c8b478"])
    masks = wb.masks_in(plain / "truth" / "masks" / "box")
    view = wb.largest_whole(masks)
    seen, angles = sides(plain, masks, view)
    print("The side: " + ", ".join(f"{name} {int(seen[name].sum())} pixels at {angles[name]:.0f} degrees"
                                  for name in sorted(seen)))
    view = options.painted or view
    paint = wb.Paint("pictures", "box", plain, view, masks[view], masks)

    def psnr(folder, suffix, truth, names):
        squares = [((read(folder / (name + suffix))[seen[name]]
                     - read(truth / "images" / name)[seen[name]]) ** 2).ravel() for name in names]
        return f"{-10 * np.log10(np.concatenate(squares).mean()):.1f}"

    def shifts(folder, truth):
        return np.concatenate([edge_shifts(read(truth / "images" / name),
                                           read(folder / (name + ".png")), side)
                               for name, side in seen.items()])

    def measure(what):
        paint_file = painted_box(options.work / "truth" / (what + ".png"), what)
        truth = true_scene(options, run, what + "-box", [f"box={paint_file}"])
        folder = options.work / "pictures" / what
        after = refit(run, paint, folder / "after",
                      ["--edited", f"{view}={truth / 'images' / view}", "--target", "photo",
                       "--report", folder / "report.json"])
        there = wb.Paint("pictures", what, truth, view, masks[view], masks)
        there.splat = paint.splat
        identity = ["--matrix", "1,0,0,0,0,1,0,0,0,0,1,0", "--target", "photo"]
        bound = refit(run, there, folder / "bound", identity)
        report = json.loads((folder / "report.json").read_text())
        moved, best = shifts(after, truth), shifts(bound, truth)
        rows.add([what, str(len(seen)), psnr(plain / "images", "", truth, seen),
                  psnr(after, ".png", truth, seen), psnr(bound, ".png", truth, seen),
                  psnr(after, ".png", truth, [view]), psnr(bound, ".png", truth, [view]),
                  f"{np.median(moved):.2f}", f"{np.quantile(moved, 0.95):.2f}",
                  f"{(moved <= 1).mean():.3f}", f"{(best <= 1).mean():.3f}",
                  f"{report['edit']['operations'][0]['explained']:.3f}"])

    run.each(measure, ["stripes", "letters"])
    return rows.rows


TABLES = {"operations": operations, "recolor": recolored, "highlight": highlights,
          "picture": pictures}


def main():
    parser = wb.arguments(__doc__, ["sample", "fox", "flower"])
    parser.add_argument("--tables", default=",".join(TABLES), help="separated by commas")
    parser.add_argument("--colors", default=",".join(COLORS), help="of the table `recolor`")
    parser.add_argument("--operations", default=";".join(OPERATIONS),
                        help="of the table `operations`, separated by semicolons")
    parser.add_argument("--painted", help="of the table `picture`: the view that is painted")
    parser.add_argument("--more", default="", help="further options of `retint recolor`")
    parser.add_argument("--holdout", type=int, default=4, help="every n-th view is held out")
    options = parser.parse_args()
    for name in options.operations.split(";"):
        if name not in OPERATIONS:
            sys.exit(f"operation '{name}' is unknown; there are: " + ", ".join(OPERATIONS))
    run = wb.Runner(options)
    paints = wb.make_scenes(options, run)
    wb.save(options, {name: TABLES[name](options, run, paints)
                      for name in options.tables.split(",")})
    print(f"\n{run.count} runs")


if __name__ == "__main__":
    main()
