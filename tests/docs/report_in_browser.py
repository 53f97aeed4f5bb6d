#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The page of `retint recolor --report-html` in headless Chromium: report_in_browser.py RETINT. Its pixels change with
the slider, its accessibility tree names what there is, and it loads nothing. Exit code 77: there is no Chromium."""

import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "support"))
from browser import Browser, find  # noqa: E402

BLUE = "#2040ff"


def make_page(retint, folder):
    def run(*arguments):
        subprocess.run([retint, *map(str, arguments), "--quiet"], check=True)

    scene = folder / "scene"
    run("synth", "--output", scene, "--width", 240, "--height", 180, "--photos", 5)
    truth = scene / "truth" / "masks" / "ball" / "002.png.png"
    page = folder / "report.html"
    run("recolor", scene, "--splat", scene / "splat.ply", "--view", "002.png", "--mask", truth, "--to",
        BLUE, "--output", folder / "blue.ply", "--report-html", page)
    return page


def blue_share(rows, first, last):
    """How much of the columns from first to last (fractions) is more blue than anything else."""
    width = len(rows[0])
    pixels = [pixel for row in rows for pixel in row[int(first * width):int(last * width)]]
    return sum(b > 1.3 * max(r, g) + 20 for r, g, b in pixels) / len(pixels)


def check_slider(browser):
    """Left of the slider is before, where nothing is blue; right of it after, where the ball is."""
    figure = "figure:has(img[alt='002.png after'])"
    shares = {}
    for at in (0, 50, 100):
        browser.evaluate(f"(() => {{ const s = document.querySelector({figure!r} + ' input'); s.value = {at};"
                         "s.dispatchEvent(new Event('input')); })()")
        _, _, rows = browser.pixels(figure + " .pair")
        shares[at] = (blue_share(rows, 0, 1), rows)
    # The ball covers 3 % of the view.
    assert shares[0][0] > 0.01, f"at 0 all is after, but {shares[0][0]:.4f} of it is blue"
    assert shares[100][0] < 0.001, f"at 100 all is before, but {shares[100][0]:.4f} of it is blue"
    half = shares[50][1]
    assert blue_share(half, 0, 0.49) < 0.001, "left of the middle is before"
    width = len(half[0])
    right = slice(int(0.55 * width), width)
    assert [row[right] for row in half] == [row[right] for row in shares[0][1]], "right of the middle is after"

    # A key moves the slider as well.
    browser.evaluate(f"document.querySelector({figure!r} + ' input').focus()")
    for kind in ("keyDown", "keyUp"):
        browser.call("Input.dispatchKeyEvent", type=kind, key="Home", code="Home", windowsVirtualKeyCode=36)
    assert browser.evaluate(f"document.querySelector({figure!r} + ' input').value") == "0"
    assert blue_share(browser.pixels(figure + " .pair")[2], 0, 1) == shares[0][0]

    # So does the mask show by its button, and go again.
    before = browser.pixels(figure + " .pair")[2]
    browser.evaluate(f"document.querySelector({figure!r} + ' button').click()")
    assert browser.pixels(figure + " .pair")[2] != before
    assert browser.evaluate(f"document.querySelector({figure!r} + ' button').getAttribute('aria-pressed')") == "true"
    browser.evaluate(f"document.querySelector({figure!r} + ' button').click()")
    assert browser.pixels(figure + " .pair")[2] == before


def check_tree(browser):
    """What a screen reader is told."""
    browser.call("Accessibility.enable")
    nodes = [node for node in browser.call("Accessibility.getFullAXTree")["nodes"] if not node.get("ignored")]
    named = {}
    for node in nodes:
        role, name = node["role"]["value"], node.get("name", {}).get("value", "")
        named.setdefault(role, []).append(name)
    views = [f"00{i}.png" for i in range(5)]
    assert sorted(named["slider"]) == sorted(f"Before and after of {view}" for view in views), named.get("slider")
    for view in views:
        for side in ("before", "after"):
            assert f"{view} {side}" in named["image"], f"no picture is called {view} {side}"
        assert f"Mask of {view}" in named["button"], named["button"]
    headings = " / ".join(named["heading"])
    for part in ("Recoloring of", "PSNR inside", "Loss of the fit", "Paint and registration", "Options",
                 "The command that repeats it"):
        assert part in headings, f"{part} is no heading: {headings}"
    assert len(named["table"]) >= 3 and "main" in named
    for role in ("image", "slider", "button", "heading"):
        assert all(named[role]), f"a {role} has no name"


def main():
    program = find()
    if program is None:
        print("there is no Chromium")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as name:
        page = make_page(sys.argv[1], pathlib.Path(name))
        browser = Browser(program)
        try:
            browser.open(page)
            # All that it shows came with it.
            assert browser.evaluate("performance.getEntriesByType('resource')"
                                    ".filter(r => !r.name.startsWith('data:')).length") == 0
            check_slider(browser)
            check_tree(browser)
        finally:
            browser.close()
    print("the report works in", program)


if __name__ == "__main__":
    main()
