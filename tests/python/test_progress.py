# SPDX-License-Identifier: BSD-3-Clause
"""What a progress callback is told, and the bar."""

import numpy as np

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
    for name in ("a.ply", "a.spz", "a.sog", "a.glb", "a.splat", "a.compressed.ply"):
        check(name, session.write_splat(folder / name, progress=tell))
        check(name, retint.Splat.read(folder / name, progress=tell))
    check("save", session.save(folder / "a.retint", progress=tell))
    check("load", retint.Session.load(folder / "a.retint", progress=tell))
    check("write", masks.write(folder / "masks", progress=tell))
    check("write_masks", session.write_masks(folder / "m", region, progress=tell))
    check("write_cameras", session.write_cameras(folder / "cameras", progress=tell))
    for method in ("gaussian", "stereo-hv"):
        check(method, session.depth(scene.view, method=method, progress=tell))
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
