#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""SAM 2 as an outline: retint mask ... --network "exec:python3 outline_with_sam2.py CONFIG.yaml MODEL.pt" --scribble X,Y

Run it where the package sam2 is installed. Without strokes, the object is at the middle of the picture.
"""

import sys

import numpy
from PIL import Image
from sam2.build_sam import build_sam2
from sam2.sam2_image_predictor import SAM2ImagePredictor

predictor = SAM2ImagePredictor(build_sam2(*sys.argv[1:3]))


def points_in(strokes, channel, count=8):
    """Up to `count` points (x, y), spread over what is drawn in a channel: 1 inside, 0 outside."""
    drawn = numpy.argwhere(strokes[:, :, channel] > 127)[:, ::-1]
    return drawn[numpy.linspace(0, len(drawn) - 1, min(count, len(drawn))).astype(int)]


for line in sys.stdin:
    image, *strokes, output = line.rstrip("\n").split("\t")
    picture = numpy.array(Image.open(image).convert("RGB"))
    inside, outside, box = [numpy.array(picture.shape[1::-1]) // 2], [], None
    if strokes:
        drawn = numpy.array(Image.open(strokes[0]).convert("RGB"))
        inside, outside = points_in(drawn, 1), points_in(drawn, 0)
        blue = numpy.argwhere(drawn[:, :, 2] > 127)[:, ::-1]
        box = numpy.concatenate([blue.min(0), blue.max(0)]) if len(blue) else None
    points = numpy.array([*inside, *outside], dtype=numpy.float32)
    labels = numpy.array([1] * len(inside) + [0] * len(outside))
    points, labels = (points, labels) if len(points) else (None, None)
    predictor.set_image(picture)
    masks, _, _ = predictor.predict(points, labels, box=box, multimask_output=False)
    numpy.save(output + ".npy", masks[0].astype(numpy.uint8) * 255)
    print("ok", flush=True)
