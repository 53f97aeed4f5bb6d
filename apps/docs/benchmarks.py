#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/benchmarks.md and its charts from docs/benchmarks.json.

    python3 apps/docs/benchmarks.py          # write them
    python3 apps/docs/benchmarks.py --check  # compare them with what it would write

A claim has a title, sentences, one table or chart, a machine, a date and a command. A chart has rows, series and, for
each row and series, a value or two (null where nothing was measured): bars end at the first and have a tick at the
second; dots stand at both. Exit codes: 0 good, 1 --check found another file, or the data are not complete.
"""

import json
import math
import pathlib
import sys
import textwrap
from xml.sax.saxutils import escape

DOCS = pathlib.Path(__file__).resolve().parent.parent.parent / "docs"
# Colors of at least 3:1 on white and on black, so that a chart is read in light and in dark pages.
TEXT, GRID, SERIES = "#767676", "#999999", ("#3b82f6", "#d97706", "#2f9e6e", "#b45fcf")
LEFT, WIDE, LINE, TOP = 170, 420, 15, 44


class Chart:
    def __init__(self, spec):
        self.spec, self.parts = spec, []
        rows, count = len(spec["rows"]), len(spec["series"])
        assert all(len(values) == count for values in spec["values"].values()), spec["values"]
        assert list(spec["values"]) == spec["rows"], spec["rows"]
        self.row = LINE * count + 10
        self.bottom = TOP + rows * self.row
        self.draw()

    def x(self, value):
        low, high = self.spec["axis"][0], self.spec["axis"][-1]
        if self.spec.get("log"):
            low, high, value = math.log(low), math.log(high), math.log(value)
        return round(LEFT + WIDE * (value - low) / (high - low), 1)

    def text(self, x, y, text, anchor="start", color=TEXT):
        self.parts.append(f'<text x="{x}" y="{y}" text-anchor="{anchor}" fill="{color}">{escape(text)}</text>')

    def line(self, x1, y1, x2, y2, color, more=""):
        self.parts.append(f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{color}" {more}/>')

    def draw(self):
        spec, at = self.spec, LEFT
        for name, color in zip(spec["series"], SERIES):
            self.parts.append(f'<rect x="{at}" y="8" width="10" height="10" fill="{color}"/>')
            self.text(at + 14, 17, name)
            at += 34 + 7 * len(name)
        for tick in spec["axis"]:
            self.line(self.x(tick), TOP - 8, self.x(tick), self.bottom, GRID, 'stroke-opacity="0.4"')
            self.text(self.x(tick), self.bottom + 16, f"{tick:g}", "middle")
        self.text(LEFT + WIDE + 12, TOP - 12, spec["unit"])
        for mark in spec.get("targets", ()):
            self.line(self.x(mark), TOP - 8, self.x(mark), self.bottom, TEXT, 'stroke-dasharray="4 3"')
            self.text(self.x(mark), TOP - 12, f"target {mark:g}", "middle")
        for index, (name, values) in enumerate(spec["values"].items()):
            top = TOP + index * self.row
            self.text(LEFT - 10, top + self.row / 2 + 2, name, "end")
            for place, (value, color) in enumerate(zip(values, SERIES)):
                self.measure(value, top + place * LINE + LINE / 2 + 3, color)

    def measure(self, value, y, color):
        if value is None:
            self.text(LEFT + 4, y + 4, "not measured")
            return
        both = value if isinstance(value, list) else [value]
        ends = [self.x(one) for one in both]
        assert all(LEFT <= end <= LEFT + WIDE for end in ends), value
        if self.spec["kind"] == "bars":
            self.parts.append(f'<rect x="{LEFT}" y="{y - 5}" width="{round(ends[0] - LEFT, 1)}" height="10" '
                              f'fill="{color}"/>')
            if len(ends) > 1:
                self.line(ends[1], y - 5, ends[1], y + 5, "#ffffff", 'stroke-width="2"')
        else:
            self.line(ends[0], y, ends[-1], y, color, 'stroke-width="2"')
            self.parts += [f'<circle cx="{end}" cy="{y}" r="4" fill="{color}"/>' for end in ends]
        digits = self.spec["digits"]
        self.text(LEFT + WIDE + 12, y + 4, ", ".join(f"{one:.{digits}f}" for one in both))

    def svg(self):
        height = self.bottom + 26
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 760 {height}" width="760" height="{height}" '
                f'font-family="sans-serif" font-size="12" role="img">\n<title>{escape(self.spec["alt"])}</title>\n'
                + "\n".join(self.parts) + "\n</svg>\n")


def wrapped(paragraph, indent=""):
    return textwrap.fill(paragraph, 118, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def table(spec):
    assert all(len(row) == len(spec["columns"]) for row in spec["rows"]), spec["columns"]
    rows = [spec["columns"], ["---"] * len(spec["columns"]), *spec["rows"]]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def page(data):
    """The page, and the charts by the names of their files."""
    charts = {}
    blocks = ["# Benchmarks"]
    blocks += [wrapped(paragraph) for paragraph in data["about"]]
    blocks.append(wrapped(" ".join(f"*{name}*: {text}." for name, text in data["machines"].items())))
    for number, claim in enumerate(data["claims"], 1):
        blocks.append(f"## {number}. {claim['title']}")
        blocks += [wrapped(paragraph) for paragraph in claim["says"]]
        assert ("table" in claim) != ("chart" in claim), claim["title"]
        assert claim.get("machine") in data["machines"] or claim["as"] < number, claim["title"]
        if "table" in claim:
            blocks.append(table(claim["table"]))
        else:
            name = f"benchmark-{number}.svg"
            charts[name] = Chart(claim["chart"]).svg()
            blocks.append(f"![{claim['chart']['alt']}](images/{name})")
        if "as" not in claim:
            made, command = f"# {claim['machine']}, {claim['date']}", claim["command"]
            short = len(command) == 1 and len(command[0] + made) <= 118
            blocks.append("\n".join(["```", *([f"{command[0]}  {made}"] if short else [made, *command]), "```"]))
    return "\n\n".join(blocks) + "\n", charts


def main():
    text, charts = page(json.loads((DOCS / "benchmarks.json").read_text(encoding="utf-8")))
    files = {DOCS / "benchmarks.md": text, **{DOCS / "images" / name: svg for name, svg in charts.items()}}
    bad = 0
    for path in {*files, *(DOCS / "images").glob("benchmark-*.svg")}:
        if "--check" not in sys.argv[1:]:
            path.write_text(files[path], encoding="utf-8") if path in files else path.unlink()
        elif not path.exists() or path.read_text(encoding="utf-8") != files.get(path):
            bad = 1
            print(f"{path}: differs from benchmarks.json: run python3 apps/docs/benchmarks.py", file=sys.stderr)
    return bad


if __name__ == "__main__":
    sys.exit(main())
