# SPDX-License-Identifier: BSD-3-Clause
"""Photos of distorted cameras, in their own pixels, as the command line has them."""

import numpy as np
import pytest

import retint
from conftest import TINT, make_scene, run_retint

SIZE = ["--width", 160, "--height", 120, "--photos", 4]


# One view undistorts the first; the second is shown by six.
@pytest.fixture(scope="module", params=["SIMPLE_RADIAL", "EQUIRECTANGULAR"])
def distorted(request):
    return make_scene(request.param.lower(), *SIZE, "--camera-model", request.param)


def test_photos_are_named_with_their_views(distorted):
    with retint.Session(distorted.folder, distorted.splat) as session:
        photos = session.photos
        views = [view for photo in photos for view in photo["views"]]
        assert sorted(views) == sorted(view.name for view in session.workspace.views)
        photo = photos[0]
        assert photo["distorted"] and distorted.view in {p["name"] for p in photos}
        shape = session.render_photo(photo["name"]).shape
        assert shape == (photo["height"], photo["width"], 3)
        with pytest.raises(retint.InputError, match="no such"):
            session.render_photo("no such")


def test_renders_are_those_of_the_command_line(distorted, folder):
    run_retint("render", *distorted.arguments(), "--view", distorted.view, "--what",
               "rgb,depth,alpha", "--output", folder / "cli")
    with retint.Session(distorted.folder, distorted.splat) as session:
        layers = session.render_photo(distorted.view, ["rgb", "depth", "alpha"])
    retint.write_png(folder / "python.png", layers["rgb"])
    name = distorted.view + ".png"
    assert (folder / "python.png").read_bytes() == (folder / "cli" / name).read_bytes()
    bytes_ = (folder / "cli" / f"{distorted.view}.depth.bin").read_bytes()
    values = np.frombuffer(bytes_.split(b"&", 3)[3], np.float32)
    assert np.array_equal(layers["depth"], values.reshape(layers["depth"].shape))
    assert layers["alpha"].shape == layers["depth"].shape


def test_a_painted_photo_is_recolored_as_on_the_command_line(distorted, folder):
    run_retint("recolor", *distorted.arguments(), *distorted.paint(), "--tint", TINT,
               "--output", folder / "cli.ply", "--save-stages", folder / "stages")
    with retint.Session(distorted.folder, distorted.splat) as session:
        painted = session.paint_photo(distorted.view, distorted.mask)
        photo = next(p for p in session.photos if p["name"] == distorted.view)
        assert {one.view for one in painted} <= set(photo["views"])
        masks = session.project(session.select(painted))
        session.add_region("selection", masks, retint.Edit(tint=(0.2, 0.4, 1.0)))
        session.refit()
        session.write_splat(folder / "python.ply")
        shown = session.photo_masks(masks)
        back = session.masks_of_photos(shown)
    assert (folder / "python.ply").read_bytes() == (folder / "cli.ply").read_bytes()
    files = {file.name for file in (folder / "stages" / "masks").glob("*.png")}
    assert files == {f"{name}.png" for name in shown}
    for name, mask in shown.items():
        assert np.array_equal(mask, retint.read_mask(folder / "stages" / "masks" / f"{name}.png"))
    assert set(back) == set(masks)


def test_tools_work_on_the_photo(distorted, folder):
    rows, columns = np.nonzero(retint.read_mask(distorted.mask) >= 128)
    x, y = int(np.median(columns)), int(np.median(rows))
    run_retint("mask", *distorted.arguments(), "--view", distorted.view, "--wand", f"{x},{y}",
               "--output", folder / "cli.png")
    with retint.Session(distorted.folder, distorted.splat) as session:
        mask = session.mask(distorted.view, wand=(x, y), pixels="photo")
        assert np.array_equal(mask, retint.read_mask(folder / "cli.png"))
        assert mask[y, x] >= 128
        with pytest.raises(retint.OptionError, match="pinhole"):
            session.mask(distorted.view, wand=(x, y), pixels="fisheye")


def test_masks_of_another_size_are_refused(distorted):
    with retint.Session(distorted.folder, distorted.splat) as session:
        with pytest.raises(retint.OptionError, match=r"\[\d+, \d+\]"):
            session.paint_photo(distorted.view, np.ones((3, 4), bool))
        with pytest.raises(retint.OptionError, match=r"\[\d+, \d+\]"):
            session.masks_of_photos({distorted.view: np.ones((3, 4), bool)})
        view = session.photos[0]["views"][0]
        with pytest.raises(retint.OptionError, match="size"):
            session.photo_masks(retint.Masks({view: np.ones((3, 4), bool)}))
