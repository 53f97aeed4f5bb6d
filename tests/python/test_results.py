# SPDX-License-Identifier: BSD-3-Clause
"""What the command line writes comes out of Python bit for bit."""

import json
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
               "--depth", "gaussian", "--sample", 0.5, "--no-registration",
               "--complete", "off", "--iterations", 3, "--outside-weight", 2,
               "--output", folder / "cli.ply")
    session = retint.Session(scene.folder, scene.splat)
    selection = session.select([session.paint(scene.view, scene.mask)], method="gaussian",
                               sample_fraction=0.5, register_cloud=False)
    masks = session.complete(selection, "off")
    session.add_region("selection", masks, edit())
    figures = session.refit(iterations=3, mm={"outside_weight": 2})
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
    assert written == {f"{name}.png" for name in masks} | {"shares.bin"}
    for file in (folder / "cli").iterdir():
        if file.name == "confidence.bin":
            continue  # for people to look at; Python does not write it
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
    run_retint("evaluate", "--quiet", "--workspace", scene.folder, "--before", scene.splat,
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
    wrong = subprocess.run([sys.executable, "-m", "retint", "info", "--workspace", "/nowhere"],
                           capture_output=True, text=True, check=False)
    assert wrong.returncode == 3 and "/nowhere" in wrong.stderr
    assert retint.run_command(["info", "--quiet", "--workspace", str(scene.folder)]) == 0


def test_a_saved_session_goes_on(scene, folder):
    session, _, _, region = recolored(scene)
    session.save(folder / "a.retint")
    loaded = retint.Session.load(folder / "a.retint")
    assert np.array_equal(loaded.sh, session.sh)
    assert [r.name for r in loaded.regions] == ["selection"]
    assert np.array_equal(loaded.region(region).shares, session.region(region).shares)


@pytest.mark.parametrize("reach", ["near", "all"])
def test_complete_is_the_projection_of_that_reach(scene, reach):
    session = retint.Session(scene.folder, scene.splat)
    selection = session.select([session.paint(scene.view, scene.mask)])
    completed = session.complete(selection, reach)
    projected = session.project(selection, completion=reach)
    assert np.array_equal(completed.shares, projected.shares)
    # The two differ from no completion, or this test would show nothing.
    assert not np.array_equal(completed.shares, session.complete(selection, "off").shares)
