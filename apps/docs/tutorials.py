#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the tutorials and the examples of REFERENCE as they are written, so that their commands cannot become wrong.

    python3 apps/docs/tutorials.py --retint build/release/apps/retint [--python build/release/apps/python] [--pictures]

Every block of sh, python or json in docs/tutorials/ is run (or, for json, saved) in one folder, page by page. So is
the Python of GUIDE, on the sample scene by the names of that page.
Each picture of a page names the file that it is made from; --pictures makes it anew, which needs python3-pil.
Pictures of ../images are made by other programs, such as apps/screenshots.sh. Indented commands are not run: they
need a desktop, a trainer or the network.
Pages with Python are skipped without --python. Exit codes: 0 done, 1 a page is wrong.
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGES = ROOT / "docs" / "tutorials"
ORDER = ["first-recolor", "all-sides", "grade", "job-file", "python", "editor", "photos"]
REFERENCE = ["cli", "masks", "edits", "edited-photos", "matching"]  # pages whose blocks of sh are run
GUIDE = "python"  # a page whose blocks of python are one program
GUIDE_SCENE = """retint synth --output workspace --width 240 --height 180 --quiet
mv workspace/splat.ply splat.ply
cp workspace/masks/*.png mask.png
cp workspace/truth/masks/ball/007.png.png missing.png
basename workspace/masks/*.png .png >view.txt
"""
MOST_BYTES = 100_000  # of a picture
BLOCK = re.compile(r"(?:<!-- file: (?P<file>\S+) -->\n)?```(?P<kind>\w+)\n(?P<text>.*?)^```$", re.S | re.M)
PICTURE = re.compile(r"<!-- picture: (?P<picture>\S+) = (?P<source>\S+) -->")


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--retint", required=True, type=pathlib.Path, help="the executable")
    parser.add_argument("--python", type=pathlib.Path, help="folder that the module retint is in")
    parser.add_argument("--pictures", action="store_true", help="make the pictures anew")
    return parser.parse_args()


def run(command, text, folder, environment):
    done = subprocess.run(command, input=text, cwd=folder, env=environment, text=True, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode != 0:
        sys.exit(f"{done.stdout}\ntutorials.py: this failed with {done.returncode}:\n{text}")


def run_shell(text, folder, environment):
    run(["bash", "-euo", "pipefail", "-s"], text, folder, environment)


def run_page(text, folder, environment):
    """Its blocks in their order; what is Python is one program."""
    program = ""
    for block in BLOCK.finditer(text):
        if block["kind"] == "sh":
            run_shell(block["text"], folder, environment)
        elif block["kind"] == "json":
            (folder / block["file"]).write_text(block["text"], encoding="utf-8")
        elif block["kind"] == "python":
            program += block["text"]
        else:
            sys.exit(f"tutorials.py: nothing is known of {block['kind']}")
    if program:
        run([sys.executable, "-B", "-"], program, folder, environment)


def check_pictures(name, text, folder, make):
    made = {match["picture"]: match["source"] for match in PICTURE.finditer(text)}
    for picture in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text):
        if picture.startswith("../images/"):
            continue
        if picture not in made:
            sys.exit(f"{name}: {picture} does not say what it is made from")
    for picture, source in made.items():
        if not (folder / source).is_file():
            sys.exit(f"{name}: no block wrote {source}")
        if make:
            shrink(folder / source, PAGES / picture)
        if not 0 < (PAGES / picture).stat().st_size < MOST_BYTES:
            sys.exit(f"{name}: {picture} is empty or too large")


def shrink(source, target):
    from PIL import Image

    image = Image.open(source).convert("RGB")
    width = min(960, image.width)
    image = image.resize((width, image.height * width // image.width), Image.LANCZOS)
    for quality in range(90, 20, -5):
        image.save(target, quality=quality, optimize=True)
        if target.stat().st_size < MOST_BYTES:
            return


def run_guide(folder, environment):
    run_shell(GUIDE_SCENE, folder, environment)
    text = (PAGES.parent / f"{GUIDE}.md").read_text(encoding="utf-8")
    program = "".join(block["text"] for block in BLOCK.finditer(text) if block["kind"] == "python")
    view = (folder / "view.txt").read_text(encoding="utf-8").strip()
    program = program.replace("0001.jpg", view).replace("0007.jpg", "007.png")
    run([sys.executable, "-B", "-"], program, folder, environment)
    print(f"{GUIDE}.md: done", flush=True)


def main():
    arguments = parse_arguments()
    pages = {path.stem for path in PAGES.glob("*.md")}
    if pages != set(ORDER):
        sys.exit(f"tutorials.py: {sorted(pages ^ set(ORDER))} are not in the order of the tutorials")
    environment = dict(os.environ)
    environment["PATH"] = f"{arguments.retint.resolve().parent}:{environment['PATH']}"
    if arguments.python:
        environment["PYTHONPATH"] = str(arguments.python.resolve())
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for page in ORDER:
            text = (PAGES / f"{page}.md").read_text(encoding="utf-8")
            if "```python" in text and not arguments.python:
                print(f"{page}: skipped, there is no Python module")
                continue
            run_page(text, folder, environment)
            check_pictures(page, text, folder, arguments.pictures)
            print(f"{page}: done", flush=True)
        if arguments.python:
            guide = folder / "guide"
            guide.mkdir()
            run_guide(guide, environment)
        for page in REFERENCE:
            text = (PAGES.parent / f"{page}.md").read_text(encoding="utf-8")
            blocks = [block["text"] for block in BLOCK.finditer(text) if block["kind"] == "sh"]
            if not blocks:
                sys.exit(f"tutorials.py: {page}.md has no block of sh")
            for block in blocks:
                run_shell(block, folder, environment)
            print(f"{page}: done", flush=True)


if __name__ == "__main__":
    main()
