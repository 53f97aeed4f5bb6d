# SPDX-License-Identifier: BSD-3-Clause
"""What the command line writes comes out of Python bit for bit."""

import json
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import retint
from conftest import TINT, run_retint


def edit():
    return retint.Edit(tint=(0.2, 0.4, 1.0))


def recolored(scene, **session_options):
    session = retint.Session(scene.folder, scene.splat, **session_options)
    selection = session.select([session.paint(scene.view, scene.mask)])
    masks = session.project(selection)
    region = session.add_region("selection", masks, edit())
    session.refit()
    return session, selection, masks, region


def test_recolor_writes_the_same_splat_and_figures(scene, folder):
    run_retint("recolor", *scene.arguments(), *scene.paint(), "--tint", TINT, "--holdout", 4,
               "--output", folder / "cli.ply", "--report", folder / "cli.json")
    session, _, masks, region = recolored(scene, holdout=4)
    session.write_splat(folder / "python.ply")
    assert (folder / "python.ply").read_bytes() == (folder / "cli.ply").read_bytes()
    assert np.array_equal(session.splat().sh, retint.Splat.read(folder / "cli.ply").sh)

    report = json.loads((folder / "cli.json").read_text(encoding="utf-8"))
    quality = session.evaluate(region)
    # JSON holds the shortest text that gives a double back exactly.
    assert quality["train"] == report["quality"]["train"]
    assert quality["heldout"] == report["quality"]["heldout"]
    assert quality["views"][:5] == report["quality"]["worst"]
    assert session.evaluate(region, session.sh) == quality
    own = session.report()
    assert own["quality"] == report["quality"]
    assert own["refit"] == report["refit"]
    assert own["painted"] == report["painted"]
    assert len(masks) == report["masks"]["views"] == 8


def test_every_option_reaches_the_work(scene, folder):
    run_retint("recolor", *scene.arguments(), *scene.paint(), "--tint", TINT,
               "--depth-method", "gaussian", "--set", "sample_fraction=0.5", "--set", "register_cloud=false",
               "--completion", "off", "--set", "iterations=3", "--outside-weight", 2, "--set", "region_cache_mb=0.25",
               "--output", folder / "cli.ply")
    session = retint.Session(scene.folder, scene.splat)
    selection = session.select([session.paint(scene.view, scene.mask)], depth_method="gaussian",
                               sample_fraction=0.5, register_cloud=False)
    masks = session.complete(selection, "off")
    session.add_region("selection", masks, edit())
    figures = session.refit(iterations=3, mm={"outside_weight": 2}, region_cache_mb=0.25)
    assert 0 < figures["iterations"] <= 3
    session.write_splat(folder / "python.ply")
    assert (folder / "python.ply").read_bytes() == (folder / "cli.ply").read_bytes()


def test_the_stages_write_the_same_files(scene, folder):
    run_retint("select", *scene.arguments(), *scene.paint(), "--output", folder / "cli.ply")
    run_retint("project", *scene.arguments(), *scene.paint(), "--cloud", folder / "cli.ply",
               "--output", folder / "cli")
    run_retint("refit", *scene.arguments(), "--masks", folder / "cli", "--tint", TINT,
               "--output", folder / "cli-out.ply")
    session = retint.Session(scene.folder, scene.splat)
    selection = session.select([session.paint(scene.view, scene.mask)])
    selection.write(folder / "python.ply")
    assert (folder / "python.ply").read_bytes() == (folder / "cli.ply").read_bytes()
    read = retint.Selection.read(folder / "cli.ply")
    assert np.array_equal(read.positions, selection.positions)
    assert read.sources == selection.sources == [scene.view]

    masks = session.project(selection)
    masks.write(folder / "python")
    written = {file.name for file in (folder / "python").iterdir()}
    assert written == {file.name for file in (folder / "cli").iterdir()}
    assert written == {f"{name}.png" for name in masks} | {"shares.bin", "confidence.bin"}
    assert masks.confidence.shape == masks.shares.shape
    # Some of it was painted, and some was concluded.
    assert masks.confidence.max() == 1 and masks.confidence.min() < 1
    for file in (folder / "cli").iterdir():
        assert (folder / "python" / file.name).read_bytes() == file.read_bytes(), file.name
    for name, mask in masks.items():
        assert np.array_equal(mask, retint.read_mask(folder / "cli" / f"{name}.png"))

    back = session.read_masks(folder / "cli")
    assert np.array_equal(back.shares, masks.shares) and back.warning == ""
    session.add_region("selection", back, edit())
    session.refit()
    session.write_splat(folder / "python-out.ply")
    assert (folder / "python-out.ply").read_bytes() == (folder / "cli-out.ply").read_bytes()


def test_depth_and_render_are_the_same(scene, folder):
    run_retint("depth", *scene.arguments(), "--view", scene.view, "--output", folder / "cli.bin")
    run_retint("render", *scene.arguments(), "--view", scene.view, "--what", "rgb,depth,alpha",
               "--output", folder / "cli")
    with retint.Session(scene.folder, scene.splat) as session:
        depth = session.depth(scene.view)
        layers = session.render(scene.view, ["rgb", "depth", "alpha"])
    depth.write(folder / "python.bin")
    assert (folder / "python.bin").read_bytes() == (folder / "cli.bin").read_bytes()
    assert depth.depth.shape == depth.valid.shape == (120, 160)
    assert depth.method == "stereo-hv"
    retint.write_png(folder / "python.png", layers["rgb"])
    name = scene.view + ".png"
    assert (folder / "python.png").read_bytes() == (folder / "cli" / name).read_bytes()
    # The header of COLMAP's maps is text up to the third &.
    bytes_ = (folder / "cli" / f"{scene.view}.depth.bin").read_bytes()
    values = np.frombuffer(bytes_.split(b"&", 3)[3], np.float32).reshape(120, 160)
    assert np.array_equal(layers["depth"], values)
    assert layers["alpha"].shape == (120, 160) and 0 <= layers["alpha"].min()

    # Without a session, from the splat and the camera alone.
    splat = retint.Splat.read(scene.splat)
    view = retint.Workspace(scene.folder)[scene.view]
    assert np.array_equal(retint.render(splat, view), layers["rgb"])
    assert np.array_equal(retint.depth(splat, view).depth, depth.depth)


def test_evaluate_measures_another_splat(scene, folder):
    session, _, masks, region = recolored(scene)
    session.write_splat(folder / "after.ply")
    masks.write(folder / "masks")
    run_retint("evaluate", "--quiet", scene.folder, "--splat", scene.splat,
               "--after", folder / "after.ply", "--masks", folder / "masks", "--tint", TINT,
               "--report", folder / "cli.json")
    report = json.loads((folder / "cli.json").read_text(encoding="utf-8"))
    after = retint.Splat.read(folder / "after.ply").sh
    assert session.evaluate(region, after)["train"] == report["quality"]["train"]


def test_convert_is_reading_and_writing(scene, folder):
    run_retint("convert", "--quiet", scene.splat, folder / "cli.spz")
    retint.Splat.read(scene.splat).write(folder / "python.spz")
    assert (folder / "python.spz").read_bytes() == (folder / "cli.spz").read_bytes()


def test_the_package_is_the_command_line(scene):
    version = subprocess.run([sys.executable, "-m", "retint", "--version"], capture_output=True,
                             text=True, check=True).stdout
    assert version == run_retint("--version")
    assert version.startswith(f"retint {retint.__version__}\n")
    wrong = subprocess.run([sys.executable, "-m", "retint", "info", "/nowhere"],
                           capture_output=True, text=True, check=False)
    assert wrong.returncode == 3 and "/nowhere" in wrong.stderr
    assert retint.run_command(["info", "--quiet", str(scene.folder)]) == 0


def test_a_saved_session_goes_on(scene, folder):
    session, _, _, region = recolored(scene)
    session.save(folder / "a.retint")
    loaded = retint.Session.load(folder / "a.retint")
    assert np.array_equal(loaded.sh, session.sh)
    assert [r.name for r in loaded.regions] == ["selection"]
    assert np.array_equal(loaded.region(region).shares, session.region(region).shares)
    assert loaded.warnings == session.warnings
    fit, = (folder / "a.retint").glob("fit-*.bin")
    fit.write_bytes(b"")
    warning, = retint.Session.load(folder / "a.retint").warnings[len(session.warnings):]
    assert fit.name in warning


@pytest.mark.parametrize("reach", ["near", "all"])
def test_complete_is_the_projection_of_that_reach(scene, reach):
    session = retint.Session(scene.folder, scene.splat)
    selection = session.select([session.paint(scene.view, scene.mask)])
    completed = session.complete(selection, reach)
    projected = session.project(selection, completion=reach)
    assert np.array_equal(completed.shares, projected.shares)
    # The two differ from no completion, or this test would show nothing.
    assert not np.array_equal(completed.shares, session.complete(selection, "off").shares)


def test_suggest_names_the_same_views(scene, folder):
    run_retint("suggest", *scene.arguments(), *scene.paint(), "--report", folder / "cli.json")
    session = retint.Session(scene.folder, scene.splat)
    masks = session.project(session.select([session.paint(scene.view, scene.mask)]))
    suggested = json.loads((folder / "cli.json").read_text(encoding="utf-8"))["views"]
    assert session.suggest(masks) == suggested and len(suggested) == 7
    with pytest.raises(retint.OptionError, match="completion"):
        session.suggest(session.read_masks(scene.folder / "truth" / "masks" / "ball"))


def test_score_gives_the_same_figures(scene, folder):
    truth = scene.folder / "truth" / "masks" / "ball"
    others = scene.folder / "truth" / "masks" / "box"
    run_retint("score", "--quiet", "--truth", truth, "--masks", others, "--painted", scene.view,
               "--cameras", scene.folder, "--report", folder / "cli.json")
    report = retint.score(truth, others, [scene.view], retint.Workspace(scene.folder))
    assert report == json.loads((folder / "cli.json").read_text(encoding="utf-8"))


def moved_splat(scene, path):
    """The splat twice as large and somewhere else; world_from_splat of it."""
    splat = retint.Splat.read(scene.splat)
    splat.means[:] = 2 * splat.means + np.float32([1, 2, 3])
    splat.log_scales[:] += np.float32(np.log(2))
    splat.write(path)
    matrix = 0.5 * np.eye(4)
    matrix[:, 3] = [-0.5, -1, -1.5, 1]
    return matrix


def test_a_splat_in_another_frame(scene, folder):
    moved = folder / "moved.ply"
    matrix = moved_splat(scene, moved)
    numbers = " ".join(map(str, matrix.ravel()))
    run_retint("recolor", "--quiet", scene.folder, "--splat", moved, *scene.paint(),
               "--world-from-splat", numbers, "--tint", TINT, "--output", folder / "cli.ply")
    at = retint.Session(scene.folder, moved, world_from_splat=matrix)
    masks = at.project(at.select([at.paint(scene.view, scene.mask)]))
    at.add_region("selection", masks, edit())
    at.refit()
    at.write_splat(folder / "python.ply")
    assert (folder / "python.ply").read_bytes() == (folder / "cli.ply").read_bytes()
    # From a file it is the same.
    (folder / "t.json").write_text(json.dumps({"world_from_splat": matrix.tolist()}),
                                   encoding="utf-8")
    other = retint.Session(scene.folder, moved, world_from_splat=folder / "t.json")
    assert np.array_equal(other.render(scene.view), at.render(scene.view, sh=at.original.sh))
    with pytest.raises(retint.OptionError, match=r"\[4, 4\]"):
        retint.Session(scene.folder, moved, world_from_splat=np.eye(3))
    with pytest.raises(retint.OptionError, match=r"\[4, 4\]"):
        retint.Session(scene.folder, moved, world_from_splat={"world_from_splat": matrix})
    with pytest.raises(retint.OptionError, match=r"\[N, K, 3\]"):
        at.render(scene.view, sh="colors")
    with pytest.raises(retint.OptionError, match="folder of a workspace"):
        retint.Session(None, moved, world_from_splat=matrix)


def test_align_finds_the_same_similarity(scene, folder):
    moved = folder / "moved.ply"
    matrix = moved_splat(scene, moved)
    run_retint("align", "--quiet", scene.folder, "--splat", moved, "--compare", 3,
               "--transform", folder / "cli.json")
    found = retint.align(retint.Workspace(scene.folder), retint.Splat.read(moved), views=3)
    expected = json.loads((folder / "cli.json").read_text(encoding="utf-8"))["world_from_splat"]
    assert found["world_from_splat"] == expected
    assert found["psnr_after"] > found["psnr_before"]
    # Photos of 160x120 settle a scale of this scene to some parts in a thousand.
    assert np.allclose(np.array(expected)[:3, :3], matrix[:3, :3], atol=0.02)


def test_match_finds_what_the_command_line_finds(scene, folder):
    bright = retint.Splat.read(scene.splat)
    bright.sh[:, 0] += 0.2
    bright.write(folder / "bright.ply")
    run_retint("match", "--quiet", scene.folder, "--splat", folder / "bright.ply",
               "--map", "balance", "--output", folder / "cli.ply", "--report", folder / "cli.json")
    stages = set()
    with retint.Session(scene.folder, folder / "bright.ply", holdout=4) as session:
        before = session.sh
        found = session.match(map="balance", progress=lambda stage, fraction: stages.add(stage))
        assert session.region(found["region"]).name == "match"
        assert np.array_equal(session.sh, retint.Splat.read(folder / "cli.ply").sh)
        assert session.undo() and np.array_equal(session.sh, before)
        with pytest.raises(retint.OptionError, match="only one of"):
            session.match(scene.splat, gray="a.png:1,2,3,4")
    expected = json.loads((folder / "cli.json").read_text(encoding="utf-8"))
    assert found["after"] == expected["after"] < expected["before"]
    assert "match" in stages


def test_views_around_a_splat_alone(scene, folder):
    run_retint("cameras", "--quiet", scene.splat, "--views", 4, "--no-images",
               "--output", folder / "cameras")
    written = retint.Workspace(folder / "cameras")
    placed = retint.Session(None, scene.splat, views=4)
    names = [view.name for view in written]
    assert names == [view.name for view in placed.workspace] and len(names) == 4
    for name in names:
        # The files hold poses as quaternions: rounding of doubles.
        assert np.allclose(written[name].camera.cam_from_world,
                           placed.workspace[name].camera.cam_from_world, atol=1e-12)
    again = retint.Session(None, scene.splat, view_folder=folder / "cameras" / "sparse" / "0")
    assert [view.name for view in again.workspace] == names
    with pytest.raises(retint.OptionError, match="without a workspace"):
        retint.Session(scene.folder, scene.splat, view_folder=folder / "cameras")


def test_errors_name_keywords(scene):
    with pytest.raises(retint.OptionError, match="^`holdout` must be 0"):
        retint.Session(scene.folder, scene.splat, holdout=1)


def test_a_fit_in_the_background_is_the_same(scene):
    session, _, masks, region = recolored(scene)
    other = retint.Session(scene.folder, scene.splat)
    other.add_region("selection", masks, edit())
    assert other.refit_state == "idle"
    job = other.start_refit()
    assert other.wait_refit() == "finished"
    snapshot = other.refit_snapshot
    assert snapshot["job"] == job and snapshot["finished"] and snapshot["steps"] > 0
    assert np.array_equal(other.sh, session.sh) and np.array_equal(snapshot["sh"], session.sh)
    # One that would go on for long is stopped.
    other.set_edit(other.regions[0], retint.Edit(exposure=1))
    other.start_refit(solver="adam", iterations=100000)
    other.cancel_refit()
    assert other.wait_refit() == "cancelled"


def test_rounds_add_and_erase(scene):
    session = retint.Session(scene.folder, scene.splat)
    whole = retint.read_mask(scene.mask)
    columns = np.flatnonzero(whole.max(axis=0))
    middle = (columns[0] + columns[-1]) // 2
    left = whole.copy()
    left[:, middle:] = 0
    first = session.select_round(scene.view, left)
    region = session.add_region("half", first, edit())
    second = session.select_round(scene.view, whole, session.region(region), before=left)
    session.set_selection(region, second)
    shares = session.region(region).shares
    assert shares.sum() > 1.2 * first.shares.sum()
    third = session.select_round(scene.view, left, session.region(region), before=whole)
    assert third.shares.sum() < 0.9 * shares.sum()
    assert session.undo() and np.array_equal(session.region(region).shares, first.shares)
    with pytest.raises(retint.InputError):
        session.select_round(scene.view, np.zeros_like(whole), session.region(region), before=left)


def test_masks_of_one_view_are_those_of_the_command_line(scene, folder):
    session = retint.Session(scene.folder, scene.splat)
    truth = retint.read_mask(scene.mask) >= 128
    rows, columns = np.nonzero(truth)
    x, y = int(np.median(columns)), int(np.median(rows))
    inside, outside = [(x - 4, y), (x + 4, y)], [(2, 2), (157, 2), (157, 117)]

    def text(points):
        return ",".join(f"{value}" for point in points for value in point)

    point = session.render(scene.view, "depth")[y, x]
    assert point > 0
    cases = [
        (["--scribble", text(inside), "--scribble-outside", text(outside), "--brush", 5],
         {"inside": [inside], "outside": [outside], "brush": 5}),
        (["--scribble", text(inside), "--this-view-alone"],
         {"inside": [inside], "brush": 6, "this_view_alone": True}),
        (["--wand", f"{x},{y},0.2,0.05,60"], {"wand": (x, y, 0.2, 0.05, 60)}),
        (["--scissors", "40,30,120,30,120,90,40,90", "--image", "photo"],
         {"scissors": [[40, 30], [120, 30], [120, 90], [40, 90]], "image": "photo"}),
        (["--mask", scene.mask, "--snap-edge", 4], {"mask": scene.mask, "snap_edge": 4}),
        (["--like", f"{x},{y},0.1"], {"like": (x, y, 0.1)}),
    ]
    for arguments, keywords in cases:
        run_retint("mask", *scene.arguments(), "--view", scene.view, *arguments, "--output",
                   folder / "cli.png")
        mask = session.mask(scene.view, **keywords)
        assert np.array_equal(mask, retint.read_mask(folder / "cli.png")), arguments
        assert 0 < np.mean(mask >= 128) < 1
    # Strokes may be drawn as a mask, too.
    drawn = np.zeros(truth.shape, bool)
    drawn[y - 2:y + 3, x - 4:x + 5] = True
    assert session.mask(scene.view, inside=drawn)[y, x] >= 128
    with pytest.raises(retint.OptionError, match="nothing to select by"):
        session.mask(scene.view)
    with pytest.raises(retint.OptionError, match="not by more"):
        session.mask(scene.view, wand=(x, y), mask=scene.mask)
    with pytest.raises(retint.OptionError, match="sphere has 4 to 4"):
        session.mask(scene.view, sphere=(0, 0, 0))
    with pytest.raises(retint.InputError, match="no pixel"):
        session.mask(scene.view, sphere=(1e6, 0, 0, 1))


def test_palettes_and_placed_views_are_those_of_the_command_line(scene, folder):
    session = retint.Session(scene.folder, scene.splat)
    run_retint("palette", *scene.arguments(), *scene.paint(), "--colors", 3, "--report",
               folder / "cli.json")
    told = json.loads((folder / "cli.json").read_text(encoding="utf-8"))["colors"]
    found = session.palette([session.paint(scene.view, scene.mask)], 3)
    assert [color["hex"] for color in found] == [color["hex"] for color in told]
    assert [color["share"] for color in found] == pytest.approx([color["share"] for color in told])
    with pytest.raises(retint.OptionError):
        session.palette([session.paint(scene.view, scene.mask)], 17)

    run_retint("cameras", scene.splat, "--views", 6, "--quiet", "--no-images",
               "--output", folder / "cli")
    with retint.Session(None, scene.splat, views=6) as alone:
        alone.write_cameras(folder / "python", images=False)
        with pytest.raises(retint.OptionError):
            alone.write_cameras(folder / "python", images=False)
        alone.write_cameras(folder / "python", images=False, overwrite=True)
    for name in ("cameras.bin", "images.bin", "points3D.bin"):
        model = pathlib.Path("sparse", "0", name)
        assert (folder / "python" / model).read_bytes() == (folder / "cli" / model).read_bytes()


def write_job(scene, folder):
    """A job that paints the scene's mask blue, in a folder of its own."""
    folder.mkdir()
    job = folder / "job.json"
    job.write_text(json.dumps({
        "retint_job": 1,
        "scene": {"workspace": str(scene.folder), "splat": str(scene.splat)},
        "regions": [{"name": "ball", "paint": [{"view": scene.view, "mask": str(scene.mask)}],
                     "edit": {"operations": [{"op": "recolor", "to": "#3060ff"}]}}],
        "outputs": {"splats": ["out.ply"], "report": "report.json"},
    }), encoding="utf-8")
    return job


def test_jobs_are_those_of_the_command_line(scene, tmp_path):
    told, called = write_job(scene, tmp_path / "told"), write_job(scene, tmp_path / "called")
    run_retint("run", told, "--no-cache", "--quiet")
    result = retint.run_job(called, cache=tmp_path / "kept")
    assert (called.parent / "out.ply").read_bytes() == (told.parent / "out.ply").read_bytes()
    assert [one["stage"] for one in result["stages"]] == ["select", "project", "refit"]
    assert not any(one["kept"] for one in result["stages"])
    assert result["report"].keys() == json.loads((told.parent / "report.json").read_text()).keys()
    again = retint.run_job(called, cache=tmp_path / "kept")
    assert all(one["kept"] for one in again["stages"])


def test_jobs_open_scenes_in_parts(scene, tmp_path):
    whole, parts = write_job(scene, tmp_path / "whole"), write_job(scene, tmp_path / "parts")
    retint.run_job(whole)
    seen = []
    retint.run_job(parts, in_parts="on", progress=lambda stage, fraction: seen.append(stage))
    assert "index" in seen
    assert (parts.parent / "out.ply").read_bytes() == (whole.parent / "out.ply").read_bytes()


def test_jobs_name_their_faults(scene, tmp_path):
    job = write_job(scene, tmp_path / "job")
    with pytest.raises(retint.OptionError, match="in_parts"):
        retint.run_job(job, in_parts="maybe")
    job.write_text(job.read_text().replace("0ff", "0fx"), encoding="utf-8")
    with pytest.raises(retint.InputError, match="job.json"):
        retint.run_job(job)
