# SPDX-License-Identifier: BSD-3-Clause
"""What a progress callback is told, and the bar."""

import io

import numpy as np
import pytest

import retint


def visits(told):
    """The fractions of each visit to a stage; one that is back at its beginning is another."""
    found = []
    for stage, fraction in told:
        if not found or found[-1][0] != stage or fraction + 0.5 < found[-1][1][-1]:
            found.append((stage, []))
        found[-1][1].append(fraction)
    return found


def test_each_stage_that_is_begun_reaches_its_end(scene, folder):
    told, stages = [], set()

    def tell(stage, fraction):
        told.append((stage, fraction))

    def check(name, result):
        for stage, fractions in visits(told):
            stages.add(stage)
            assert fractions[-1] == 1, (name, stage, fractions)
        told.clear()
        return result

    session = check("open", retint.Session(scene.folder, scene.splat, holdout=4, progress=tell))
    painted = session.paint(scene.view, scene.mask)
    selection = check("select", session.select(painted, progress=tell))
    masks = check("project", session.project(selection, progress=tell))
    check("complete", session.complete(selection, "off", progress=tell))
    check("suggest", session.suggest(masks, progress=tell))
    edit = retint.Edit(to="#3060ff")
    region = check("add_region", session.add_region("a", dict(masks.items()), edit, progress=tell))
    check("refit", session.refit(progress=tell))
    session.set_edit(region, retint.Edit(exposure=0.5))
    check("adam", session.refit(solver="adam", iterations=20, progress=tell))
    session.set_edit(region, retint.Edit(exposure=1))
    session.start_refit(iterations=2)
    check("wait_refit", session.wait_refit(progress=tell))
    check("evaluate", session.evaluate(region, target="photo", progress=tell))
    check("report", session.report(progress=tell))
    for name in ("a.ply", "a.spz", "a.sog", "a.glb", "a.splat", "a.compressed.ply", "a.usda"):
        check(name, session.write_splat(folder / name, progress=tell))
        check(name, retint.Splat.read(folder / name, progress=tell))
    check("save", session.save(folder / "a.retint", progress=tell))
    check("load", retint.Session.load(folder / "a.retint", progress=tell))
    check("write", masks.write(folder / "masks", progress=tell))
    check("write_masks", session.write_masks(folder / "m", region, progress=tell))
    check("write_cameras", session.write_cameras(folder / "cameras", progress=tell))
    for method in ("gaussian", "stereo-hv"):
        check(method, session.depth(scene.view, depth_method=method, progress=tell))
    check("refine", session.refine_gaussians(region, pixels=0.5, progress=tell))
    check("erase", session.erase(selection, scene.view, scene.mask, progress=tell))
    whole = retint.read_mask(scene.mask)
    check("set_selection", session.set_selection(region, masks, progress=tell))
    check("round", session.select_round(scene.view, whole, region, whole, progress=tell))
    y, x = (int(np.median(at)) for at in np.nonzero(whole >= 128))
    check("mask", session.mask(scene.view, inside=[[(x - 4, y), (x + 4, y)]], progress=tell))
    check("views", retint.Session(None, scene.splat, views=4, progress=tell))
    truth = scene.folder / "truth" / "masks"
    check("score", retint.score(truth / "ball", truth / "box", progress=tell))
    expected = {"load", "depth", "cloud", "registration", "completion", "projection", "suggestion",
                "shares", "refit", "evaluate", "save", "refine"}
    assert expected - stages == set()


class Terminal(io.StringIO):
    def isatty(self):
        return True


def percents(text):
    return [int(line.split("]")[1].split("%")[0]) for line in text.split("\n") if line]


def test_a_bar_has_one_total_that_never_falls(scene):
    session = retint.Session(scene.folder, scene.splat)
    lines = io.StringIO()
    bar = retint.progress_bar("select", "project", "add_region", "refit", "evaluate", file=lines)
    selection = session.select(session.paint(scene.view, scene.mask), progress=bar)
    masks = dict(session.project(selection, progress=bar).items())
    region = session.add_region("a", masks, retint.Edit(to="#3060ff"), progress=bar)
    session.refit(progress=bar)
    before = percents(lines.getvalue())
    assert before[-1] < 100
    session.evaluate(region, progress=bar)
    told = percents(lines.getvalue())
    assert told == sorted(set(told)) and told[-1] == 100 and len(told) <= 11
    assert " left" in lines.getvalue() and "done in" in lines.getvalue().splitlines()[-1]
    # Another run with the same bar.
    session.evaluate(region, progress=bar)
    assert percents(lines.getvalue())[-1] == 100


def test_a_bar_follows_its_plan():
    lines = Terminal()
    bar = retint.progress_bar("select", "refit", file=lines)
    for stage, fraction in [("load", 0.5), ("depth", 0.5), ("depth", 0.4), ("depth", 1),
                            ("load", 0), ("load", 1), ("refit", 0.5), ("load", 1), ("refit", 0.6),
                            ("depth", 0), ("refit", 1), ("save", 0)]:
        bar(stage, fraction)
    text = lines.getvalue()
    told = percents(text.replace("\r\033[K", "\n"))
    assert told == sorted(set(told)) and told[-1] == 100
    assert text.endswith("\n") and text.count("\n") == 1
    bar("depth", 0.5)  # of another run
    assert percents(lines.getvalue().replace("\r\033[K", "\n"))[-1] < 50
    with pytest.raises(ValueError, match="no call 'reft'"):
        retint.progress_bar("reft")
