# SPDX-License-Identifier: BSD-3-Clause
"""Regions and undo, errors, progress, threads, lifetimes."""

import ast
import copy
import gc
import itertools
import os
import pathlib
import pickle
import signal
import threading
import types
import weakref

import numpy as np
import pytest

import retint


@pytest.fixture
def session(scene):
    with retint.Session(scene.folder, scene.splat) as opened:
        yield opened


def square(session, scene):
    """A mask of one view: an array where something is inside."""
    camera = session.workspace[scene.view].camera
    mask = np.zeros((camera.height, camera.width), bool)
    mask[40:80, 60:100] = True
    return {scene.view: mask}


def test_regions_and_undo(session, scene):
    before = session.sh
    region = session.add_region("a", square(session, scene), retint.Edit(tint="#ff0000"))
    red = session.sh
    assert not np.array_equal(red, before)
    session.set_edit(region, retint.Edit(exposure=1), strength=0.5)
    assert session.region(region).strength == 0.5
    assert session.region(region).edit == retint.Edit(exposure=1)
    assert not np.array_equal(session.sh, red)
    assert len(session.history) == 2
    assert session.undo() and np.array_equal(session.sh, red)
    assert session.undo() and np.array_equal(session.sh, before)
    assert session.regions == [] or session.regions[0].visible is False
    assert not session.undo()
    assert session.redo() and np.array_equal(session.sh, red)

    copy = session.duplicate(region)
    session.rename(copy, "b")
    assert [r.name for r in session.regions] == ["a", "b"]
    session.move_region(copy, 0)
    assert [r.name for r in session.regions] == ["b", "a"]
    session.set_visible(copy, False)
    assert np.array_equal(session.sh, red)
    session.remove(copy)
    assert [r.id for r in session.regions] == [region]


def test_gaussians_are_split(session, scene, folder):
    region = session.add_region("a", square(session, scene), retint.Edit(to="#3060ff"))
    finer, figures = session.refine_gaussians(region, pixels=0.5, splat=folder / "finer.ply")
    assert figures["split"] > 0 and figures["psnr"] > 30
    stayed = len(session.original.means) - figures["split"]
    assert len(finer.original.means) == stayed + figures["parts"]
    assert [r.name for r in finer.regions] == ["a"]
    finer.refit(iterations=2)
    assert finer.sh.shape[0] == len(finer.original.means)
    finer.save(folder / "finer.retint")
    again = retint.Session.load(folder / "finer.retint")
    assert len(again.original.means) == len(finer.original.means)
    assert [r.name for r in again.regions] == ["a"]
    assert session.refine_gaussians(region, pixels=50)[0] is None
    with pytest.raises(retint.OptionError):
        session.refine_gaussians(region, pixels=-1)


def test_masks_of_every_type_mean_the_same(session, scene):
    inside = square(session, scene)[scene.view]
    given = [inside, inside.astype(np.uint8) * 255, inside.astype(np.float32),
             np.asfortranarray(inside)]
    for mask in given:
        painted = session.paint(scene.view, mask)
        assert np.array_equal(painted.mask, inside * np.uint8(255))
    with pytest.raises(retint.OptionError, match="floats"):
        session.paint(scene.view, inside * 2.0)
    with pytest.raises(retint.OptionError, match=r"\[120, 160\]"):
        session.paint(scene.view, inside[:50])
    with pytest.raises(retint.InputError, match="no pixel"):
        session.paint(scene.view, ~(inside | True))


def test_edits_are_lists_of_operations():
    edit = retint.Edit(tint="#ff8000", exposure=0.5) + retint.Edit(exposure={"stops": 0.25})
    assert [op["op"] for op in edit.operations] == ["tint", "exposure", "exposure"]
    # Of an edit that is gone; PYTHONMALLOC=debug, as ctest sets it, shows what would outlive it.
    assert retint.Edit(exposure=0.5).operations == [{"op": "exposure", "stops": 0.5}]
    assert retint.Edit.from_json(edit.to_json()) == edit
    colors = np.array([[0.5, 0.25, 0.125]], np.float32)
    # A tint multiplies each channel.
    assert np.allclose(retint.Edit(tint=(0.5, 1, 2)).apply(colors), [[0.25, 0.25, 0.25]])
    with pytest.raises(retint.OptionError, match="no operation 'tnt'"):
        retint.Edit(tnt=1)
    with pytest.raises(retint.OptionError):
        retint.Edit(tint="#ff")


def test_three_kinds_of_errors(scene, folder):
    assert issubclass(retint.OptionError, retint.Error)
    with pytest.raises(retint.InputError, match="/nowhere"):
        retint.Workspace("/nowhere")
    with pytest.raises(retint.InputError, match=str(folder / "a.ply")):
        retint.Splat.read(folder / "a.ply")
    splat = retint.Splat.read(scene.splat)
    with pytest.raises(retint.OptionError, match="xyz"):
        splat.write(folder / "a.xyz")
    (folder / "file").write_text("")
    with pytest.raises(retint.RunError, match="file"):
        splat.write(folder / "file" / "a.ply")
    with pytest.raises(retint.OptionError, match="not auto, cpu or cuda"):
        retint.Session(scene.folder, scene.splat, backend="gpu")
    session = retint.Session(scene.folder, scene.splat)
    with pytest.raises(retint.InputError, match="000.pgn"):
        session.render("000.pgn")
    with pytest.raises(retint.OptionError, match="no option 'iteration'.*iterations"):
        session.refit(iteration=5)
    with pytest.raises(retint.OptionError, match="iterations"):
        session.refit(iterations=-1)
    with pytest.raises(retint.OptionError, match="no region 7"):
        session.region(7)
    with pytest.raises(retint.OptionError, match="expected"):
        session.render(scene.view, sh=np.zeros((3, 16, 3)))
    session.close()
    session.close()
    with pytest.raises(retint.RunError, match="closed"):
        session.undo()


def test_options_describe_themselves():
    names = {}
    for option in retint.options("refit"):
        names.setdefault(option["name"], []).append(option["applies"])
    assert names["iterations"] == ["mm", "adam"]
    solver = next(o for o in retint.options("refit") if o["name"] == "solver")
    assert solver["default"] == "mm" and "adam" in solver["range"]
    assert "outside_weight=" in retint.Session.refit.__doc__
    cache = next(o for o in retint.options("refit") if o["name"] == "region_cache_mb")
    assert cache["unit"] == "MiB" and cache["default"] == 1000
    paper = next(o for o in retint.options("refit", "paper") if o["name"] == "solver")
    assert paper["default"] == "adam"


def test_progress_is_told_and_may_stop_the_work(session, scene):
    masks = square(session, scene)
    region = session.add_region("a", masks, retint.Edit(tint="#0000ff"))
    before = session.sh
    told = []

    def stop(stage, fraction):
        told.append((stage, fraction))
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        session.refit(progress=stop)
    assert len(told) == 1
    assert np.array_equal(session.sh, before)
    assert session.region(region).refit is None

    told.clear()
    session.refit(progress=lambda stage, fraction: told.append((stage, fraction)))
    assert "refit" in {stage for stage, _ in told}
    assert all(0 <= fraction <= 1 for _, fraction in told)
    assert session.region(region).refit["iterations"] > 0


def test_ctrl_c_stops_the_work(session, scene):
    session.add_region("a", square(session, scene), retint.Edit(tint="#0000ff"))
    before = session.sh
    with pytest.raises(KeyboardInterrupt):
        session.refit(progress=lambda *_: os.kill(os.getpid(), signal.SIGINT))
    assert np.array_equal(session.sh, before)


def test_a_callback_cannot_call_its_session(session, scene):
    session.add_region("a", square(session, scene), retint.Edit(tint="#0000ff"))
    with pytest.raises(retint.RunError, match="at work"):
        session.refit(progress=lambda *_: session.undo())
    with pytest.raises(retint.RunError, match="at work"):
        session.refit(progress=lambda *_: session.close())
    assert not session.closed


def test_regions_are_named_by_themselves_or_by_their_ids(session, scene):
    masks = retint.Masks({scene.view: square(session, scene)[scene.view]})
    region = session.add_region("a", types.MappingProxyType(dict(masks.items())),
                                retint.Edit(tint="#0000ff"))
    seen = session.seen_from(region, scene.view)
    assert np.array_equal(seen, masks[scene.view])
    assert np.array_equal(seen, session.seen_from(session.region(region), scene.view))
    session.set_selection(session.region(region), masks)
    round_of_id = session.select_round(scene.view, seen, region, before=seen)
    round_of_region = session.select_round(scene.view, seen, session.region(region), before=seen)
    assert np.array_equal(round_of_id.shares, round_of_region.shares)
    with pytest.raises(retint.OptionError, match="no region 99"):
        session.seen_from(99, scene.view)
    with pytest.raises(retint.OptionError, match="a dict of image names"):
        session.add_region("a", [1], retint.Edit(gray=True))


def test_what_is_no_picture_or_camera_is_refused(folder, session, scene):
    with pytest.raises(retint.OptionError, match="floats or uint8"):
        retint.write_png(folder / "a.png", np.full((4, 4, 3), 128))
    retint.write_png(folder / "a.png", np.full((4, 4, 3), 128, np.uint8))
    assert abs(retint.read_image(folder / "a.png") - 128 / 255).max() < 1e-6
    for bad in (float("nan"), float("inf")):
        with pytest.raises(retint.OptionError, match="finite"):
            retint.Camera(8, 8, 10, 10, bad, 4)
    with pytest.raises(retint.OptionError, match="or a list of them"):
        session.palette("red")
    with pytest.raises(retint.OptionError, match="or a list of them"):
        session.select(scene.view)
    for side in (10**6, 2**31 - 1):
        with pytest.raises(retint.OptionError, match="at most"):
            retint.Camera(side, side, side, side, side / 2, side / 2)


def test_one_painted_view_needs_no_list(session, scene):
    painted = session.paint(scene.view, scene.mask)
    assert np.array_equal(session.select(painted).positions, session.select([painted]).positions)
    assert session.palette(painted) == session.palette([painted])


def test_every_object_shows_what_it_is(session, scene):
    painted = session.paint(scene.view, square(session, scene)[scene.view])
    assert repr(painted) == f"<retint.Painted {scene.view}, 1600 pixels>"
    count = len(session.original)
    assert repr(session) == f"<retint.Session 8 views, {count} Gaussians>"
    depth = session.depth(scene.view, depth_method="gaussian")
    assert repr(depth).startswith("<retint.Depth 160x120 by gaussian, ")
    session.close()
    assert repr(session) == f"<retint.Session 8 views, {count} Gaussians, closed>"


def test_a_splat_is_pickled_whole(scene, folder):
    """With what a file holds beside the arrays, so that it writes the same bytes."""
    read = retint.Splat.read(scene.splat)
    read.write(folder / "a.spz")
    header, body = scene.splat.read_bytes().split(b"end_header\n", 1)
    columns = header.count(b"property")
    rows = np.frombuffer(body, np.float32).reshape(len(read), columns)
    more = np.hstack([rows, np.arange(len(read), dtype=np.float32)[:, None]])
    (folder / "a.ply").write_bytes(header + b"property float votes\nend_header\n" + more.tobytes())
    for name in ("a.ply", "a.spz"):
        splat = retint.Splat.read(folder / name)
        for other in (pickle.loads(pickle.dumps(splat)), copy.deepcopy(splat)):
            assert other.comments == splat.comments
            other.write(folder / ("b" + name))
            assert (folder / ("b" + name)).read_bytes() == (folder / name).read_bytes()
            other.sh[:] = 0
        assert splat.sh.any()
    with retint.Session(scene.folder, scene.splat) as session:
        own = copy.deepcopy(session.original)
        own.means[0] = 0  # of the copy
        assert np.array_equal(session.original.means[1:], own.means[1:])


def test_threads_wait_for_their_turn_and_the_lock_is_free(session, scene):
    expected = session.render(scene.view)
    results, seen = [None] * 4, threading.Event()

    def work(i):
        results[i] = session.render(scene.view)

    def during(stage, fraction):
        # Another thread runs Python while the work waits here.
        other = threading.Thread(target=seen.set)
        other.start()
        other.join()

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    session.depth(scene.view, depth_method="gaussian", progress=during)
    for thread in threads:
        thread.join()
    assert seen.is_set()
    assert all(np.array_equal(result, expected) for result in results)


def test_sessions_work_side_by_side(scene):
    def work(i, results):
        with retint.Session(scene.folder, scene.splat) as own:
            own.add_region("a", square(own, scene), retint.Edit(tint="#0000ff"))
            own.refit(iterations=2)
            results[i] = own.sh

    results = [None] * 2
    threads = [threading.Thread(target=work, args=(i, results)) for i in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results[0] is not None and np.array_equal(results[0], results[1])


def test_arrays_show_memory_and_keep_it_alive(scene):
    splat = retint.Splat.read(scene.splat)
    alive = weakref.ref(splat) if hasattr(splat, "__weakref__") else None
    sh = splat.sh
    assert sh.shape == (len(splat), 16, 3) and sh.dtype == np.float32
    assert np.shares_memory(sh, splat["sh"])
    sh[0, 0] = [1, 2, 3]
    assert splat["sh"][0, 0].tolist() == [1, 2, 3]
    copy = splat.copy()
    assert not np.shares_memory(copy.sh, sh) and np.array_equal(copy.sh, sh)
    total = float(sh.sum(dtype=np.float64))
    del splat
    gc.collect()
    assert alive is None or alive() is None
    assert float(sh.sum(dtype=np.float64)) == total

    session = retint.Session(scene.folder, scene.splat)
    original = session.original
    means, masks = original.means, None
    region = session.add_region("a", square(session, scene), retint.Edit(tint="#0000ff"))
    masks, shares = session.region(region).masks[scene.view], session.region(region).shares
    painted = session.paint(scene.view, masks).mask
    workspace = session.workspace
    with pytest.raises(ValueError):
        means[0] = 0
    with pytest.raises(retint.OptionError, match="copy"):
        original["means"] = means
    expected = retint.Splat.read(scene.splat).means
    session.close()
    del session, original
    gc.collect()
    assert np.array_equal(means, expected)
    assert masks.any() and 0 < shares.max() <= 1 and np.array_equal(painted, masks)
    assert workspace[scene.view].camera.width == 160


def test_a_splat_from_arrays(scene, folder):
    read = retint.Splat.read(scene.splat)
    made = retint.Splat(**{name: read[name] for name in read.keys()})
    made.write(folder / "made.ply")
    again = retint.Splat.read(folder / "made.ply")
    assert all(np.array_equal(again[name], read[name]) for name in read.keys())
    with pytest.raises(retint.OptionError, match="quats_wxyz"):
        retint.Splat(read.means, read.quats_wxyz[:5], read.log_scales, read.opacity_logits, read.sh)
    # A session of objects is one of files.
    workspace = retint.Workspace(scene.folder)
    view = workspace.views[0]
    from_objects = retint.Session(workspace, made).render(view)
    assert np.array_equal(from_objects, retint.Session(scene.folder, scene.splat).render(view.name))


def test_cameras_and_a_turn(session, scene):
    camera = session.workspace[scene.view].camera
    k = camera.K
    same = retint.Camera(camera.width, camera.height, k[0, 0], k[1, 1], k[0, 2], k[1, 2],
                         camera.cam_from_world)
    # The pose goes through a matrix and back to a quaternion: rounding of doubles, floats inside.
    assert np.abs(session.render(same) - session.render(scene.view)).mean() < 1e-4
    xyz, rgb = session.workspace.points
    assert xyz.shape == rgb.shape and xyz.shape[1] == 3
    turn = retint.orbit(camera, xyz.mean(axis=0), [0, -1, 0], 4)
    assert len(turn) == 4
    distances = [np.linalg.norm(c.center - xyz.mean(axis=0)) for c in turn]
    assert np.allclose(distances, distances[0])
    # Half a turn on, the camera stands across the axis.
    across = (turn[0].center + turn[2].center) / 2 - xyz.mean(axis=0)
    assert np.allclose(across[[0, 2]], 0, atol=1e-9)
    with pytest.raises(retint.OptionError, match="rotation"):
        retint.Camera(10, 10, 5, 5, 5, 5, 2 * np.eye(4))


def resident_bytes():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_a_thousand_sessions_leave_nothing_behind(scene):
    read = retint.Splat.read(scene.splat)
    few = {name: read[name][:200] for name in read.keys()}
    workspace, splat = retint.Workspace(scene.folder), retint.Splat(**few)
    camera = retint.Camera(16, 16, 16, 16, 8, 8, workspace[scene.view].camera.cam_from_world)

    def some(count):
        for _ in range(count):
            with retint.Session(workspace, splat) as opened:
                opened.render(camera)
        gc.collect()
        return resident_bytes()

    first, last = some(200), some(800)
    # Of 800 sessions that stayed, the copies of the splat alone, 47 kB each, would be 38 MB. The
    # allocator's own pools vary by a few.
    assert last - first < 8e6, f"{first} -> {last} bytes"


def test_the_stub_names_what_there_is():
    """Every class, method and function of the module, and nothing else."""
    stub = pathlib.Path(retint.__file__).with_name("_retint.pyi").read_text(encoding="utf-8")
    named = set()
    for node in ast.parse(stub).body:
        if isinstance(node, ast.FunctionDef):
            named.add(node.name)
        if not isinstance(node, ast.ClassDef):
            continue
        named.add(node.name)
        for member in node.body:
            if isinstance(member, ast.FunctionDef):
                named.add(f"{node.name}.{member.name}")
            elif isinstance(member, ast.AnnAssign):
                named.add(f"{node.name}.{member.target.id}")
    there = set()
    for name, thing in vars(retint._retint).items():
        if name.startswith("_"):
            continue
        there.add(name)
        if isinstance(thing, type) and not issubclass(thing, Exception):
            there |= {f"{name}.{member}" for member in vars(thing) if not member.startswith("_")}
            assert thing.__doc__
    assert {name for name in named if "._" not in name} == there
    for name in there & set(retint.__all__):
        assert getattr(retint, name).__doc__, name


def test_everything_has_a_docstring():
    undocumented = []
    for name, thing in vars(retint._retint).items():
        members = vars(thing).items() if isinstance(thing, type) else []
        for member, what in itertools.chain([("", thing)], members):
            if name.startswith("_") or member.startswith("_"):
                continue
            text = what.__doc__ or ""
            if not isinstance(what, (type, property)):  # the first line is pybind11's signature
                text = text.partition("\n\n")[2]
            if not text.strip():
                undocumented.append(f"{name}.{member}")
    assert undocumented == []


def test_a_color_space_of_a_config(scene, tmp_path):
    config = tmp_path / "config.ocio"
    config.write_text("""ocio_profile_version: 2
roles: {default: light, scene_linear: light}
file_rules: [!<Rule> {name: Default, colorspace: default}]
displays: {sRGB: [!<View> {name: plain, colorspace: sRGB}]}
colorspaces:
  - !<ColorSpace> {name: light}
  - !<ColorSpace>
    name: sRGB
    from_scene_reference: !<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055, direction: inverse}
""")
    with retint.Session(scene.folder, scene.splat) as session:
        numbers = session.render(scene.view)
    with retint.Session(scene.folder, scene.splat, space="light", ocio=config) as session:
        shown = session.render(scene.view)
        session.write_splat(tmp_path / "same.ply")
    assert (tmp_path / "same.ply").read_bytes() == pathlib.Path(scene.splat).read_bytes()
    expected = np.where(numbers <= 0.0031308, 12.92 * numbers, 1.055 * numbers ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(shown, expected, atol=1e-4)
    with pytest.raises(retint.InputError, match="no color space 'lamp'.*light"):
        retint.Session(scene.folder, scene.splat, space="lamp", ocio=config)
