# SPDX-License-Identifier: BSD-3-Clause
"""Recolors regions of 3D Gaussian Splatting scenes from COLMAP workspaces.

    import retint

    session = retint.Session("workspace", "splat.ply")
    painted = session.paint("0001.jpg", "mask.png")
    masks = session.project(session.select([painted]))
    region = session.add_region("car", masks, retint.Edit(to="#3060ff"))
    session.refit(progress=retint.progress_bar("refit"))
    print(session.evaluate(region)["train"])
    session.write_splat("recolored.ply")

Arrays are numpy's. Images are [H, W, 3] float32, RGB in [0, 1] as the file stores them; masks are
[H, W] uint8, 0 outside and 255 inside; depth is z along the viewing axis in the workspace's unit, 0
where there is none. docs/python.md is the guide.
"""

from ._progress import progress_bar
from ._retint import (
    Camera,
    Depth,
    Edit,
    Error,
    InputError,
    Masks,
    OptionError,
    Painted,
    Region,
    RunError,
    Selection,
    Session,
    Splat,
    View,
    Workspace,
    __version__,
    align,
    backends,
    depth,
    options,
    orbit,
    read_image,
    read_mask,
    render,
    run_command,
    run_job,
    score,
    write_png,
)

__all__ = [
    "Camera", "Depth", "Edit", "Error", "InputError", "Masks", "OptionError", "Painted", "Region",
    "RunError", "Selection", "Session", "Splat", "View", "Workspace", "__version__", "align",
    "backends", "depth", "options", "orbit", "progress_bar", "read_image", "read_mask", "render",
    "run_command", "run_job", "score", "write_png",
]

for _name in __all__:
    _thing = globals()[_name]
    if isinstance(_thing, type):
        _thing.__module__ = __name__
del _name, _thing
