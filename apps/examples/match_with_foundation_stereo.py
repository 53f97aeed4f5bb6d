#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""FoundationStereo as a matcher: retint ... --matcher "exec:python3 match_with_foundation_stereo.py MODEL.pth"

Run it in a checkout of FoundationStereo, in its own environment. MODEL.pth lies beside its cfg.yaml.
"""

import pathlib
import sys

import numpy
import torch
from core.foundation_stereo import FoundationStereo
from core.utils.utils import InputPadder
from omegaconf import OmegaConf
from PIL import Image

weights = pathlib.Path(sys.argv[1])
model = FoundationStereo(OmegaConf.load(weights.parent / "cfg.yaml"))
model.load_state_dict(torch.load(weights, weights_only=False)["model"])
model.cuda().eval()


def image_of(path):
    pixels = numpy.array(Image.open(path).convert("RGB"))
    return torch.as_tensor(pixels).cuda().float()[None].permute(0, 3, 1, 2)


for line in sys.stdin:
    left, right, output = line.rstrip("\n").split("\t")
    pair = image_of(left), image_of(right)
    padder = InputPadder(pair[0].shape, divis_by=32, force_square=False)
    with torch.no_grad():
        disparity = model(*padder.pad(*pair), iters=32, test_mode=True)
    numpy.save(output + ".npy", padder.unpad(disparity.float()).cpu().numpy())
    print("ok", flush=True)
