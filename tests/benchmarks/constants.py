#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Counts the constants that decide what is selected and recolored, by what they rest on.

    python3 tests/benchmarks/constants.py          # the table of docs/decisions/0013-tuned-constants.md
    python3 tests/benchmarks/constants.py --list   # every constant with its value

  bound     limits time or memory, or refuses absurd input; no result depends on it
  derived   follows from a format, a paper, a window, rounding or another constant
  promised  a number of the manual; tests have a case just inside and one just outside
  measured  docs/decisions has figures of other values on captures
  chosen    none of these was found: what other values would do is not known
"""

import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FOLDERS = [f"src/{name}" for name in ("selection", "recolor", "selecting", "editing", "opening", "depth")]
DEFINITION = re.compile(r"^[ \t]*(?:static |inline )*constexpr\s+[\w:<>, ]+?\s+(k\w+\s*=\s*[^;]*);", re.M)
NUMBER = re.compile(r"(k\w+)\s*=\s*(-?[\d.][^,]*)")

# What is not listed is chosen.
KINDS = {
    "bound": """
        *: kGrain kPiece kBatch kBatchViews kGroup kRows
        selection/completion.cc: kOpen
        selection/gaussian_mixture.h: kVector
        selection/graph_hierarchy.cc: kFewNodes kMostLevels kCoarsestSteps kParts
        selection/graph_solver.cc: kMaxIterations kMaxDeviceIterations
        selection/lifted_surfaces.cc: kChannels
        selection/registration.cc: kUnknown
        recolor/adam_solver.cc: kLossInterval
        recolor/operation_table.cc: kHuge
        recolor/edit_json.cc: kMost
        recolor/finer_gaussians.cc: kMostParts
        recolor/lut.cc: kMost1dSize
        recolor/lut.h: kMaxColorTableSize
        recolor/palette.h: kMaxPaletteColors
        recolor/quality_report.cc: kPerfectPsnr kMaxWorst
        recolor/refit_options.h: kMostSweeps
        recolor/mm_targets.cc: kMostRowsPerRow
        recolor/refit_target.cc: kPixels
        recolor/refit_views.cc: kGaussians
        opening/virtual_views.cc: kVersion
        depth/colmap_mvs.cc: kToldLines
        depth/stereo_hv.cc: kMost""",
    "derived": """
        *: kHalf
        selection/gaussian_mixture.h: kLeastLog kSmallest
        selection/graph_hierarchy.cc: kDamping
        selection/mask_tools/guided_matte.cc: kGuide
        selection/mask_tools/pixel_graph.cc: kWidth
        selection/mask_tools/pixel_graph.h: kWindow
        selection/mask_tools/scribbles.cc: kNeither
        selection/registration.cc: kSame
        selection/registration_solver.cc: kTiny
        recolor/adam_solver.cc: kBeta1 kBeta2 kEpsilon
        recolor/operation_table.cc: kDaylight
        recolor/color_edit.h: kRounding
        recolor/color_map_fit.cc: kLeastScale
        recolor/color_operation.h: kUnset kPairValues
        recolor/finer_gaussians.cc: kMostOpacity kRendererBlur kLeastPart
        recolor/gaussian_paint.cc: kChannels kLeastAlpha
        recolor/main_color.cc: kReach
        recolor/mm_solver.cc: kArmijo
        recolor/adam_boxes.cc: kLossHalo
        recolor/adam_boxes.h: kUnit
        opening/virtual_views.cc: kNearest""",
    "promised": """
        selection/completion.cc: kKnownFraction kPaintedFraction kReach
        selection/mask_tools/scissors.cc: kReach
        selection/share_renderer.cc: kSoftBorder
        recolor/mm_solver.cc: kSquaredSweeps
        selecting/selection_pipeline.cc: kLeast kMost
        opening/scene_check.cc: kMostColor""",
    "measured": """
        selection/completion.cc: kSmoothness kLogPrior kColorSamples
        selection/gaussian_graph.cc: kNeighbors kColorSigma
        selection/gaussian_graph.h: kFloating
        selection/gaussian_mixture.h: kMaxSamples kRounds
        selection/graph_hierarchy.cc: kStrong
        selection/lifted_surfaces.cc: kMostViews kLiftedRows kBehind
        selection/mask_projector.cc: kManyViews
        selection/mask_tools/pixel_graph.cc: kSmoothness kValley
        selection/mask_tools/scribbles.cc: kLogLimit kReach
        recolor/main_color.cc: kBandwidth kLit
        editing/compare_pictures.cc: kTaken kHelped""",
}


def kinds():
    """The kind of (file below src, name); the file "*" stands for all."""
    found = {}
    for kind, text in KINDS.items():
        for line in text.strip().splitlines():
            file, names = line.split(":")
            found.update({(file.strip(), name): kind for name in names.split()})
    return found


def main():
    known, used, counts = kinds(), set(), collections.defaultdict(collections.Counter)
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix not in (".h", ".cc"):
                continue
            file = str(path.relative_to(ROOT / "src"))
            for definition in DEFINITION.finditer(path.read_text()):
                for name, value in NUMBER.findall(definition[1]):
                    key = (file, name) if (file, name) in known else ("*", name)
                    used.add(key)
                    kind = known.get(key, "chosen")
                    counts[folder][kind] += 1
                    if "--list" in sys.argv:
                        print(f"{kind:9} {file}: {name} = {value.strip()}")
    gone = sorted(f"{file}: {name}" for file, name in known if (file, name) not in used)
    order = [*KINDS, "chosen"]
    print(f"| folder | {' | '.join(order)} |\n|---|{'---:|' * len(order)}")
    for folder, of in counts.items():
        print(f"| `{folder}` | {' | '.join(str(of[kind]) for kind in order)} |")
    for entry in gone:
        print(f"there is no {entry}", file=sys.stderr)
    return 1 if gone else 0


if __name__ == "__main__":
    sys.exit(main())
