#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that no library names a flag of the command line.

    python3 tests/docs/library_flags.py [ROOT]

Messages name an option with OptionName() (base/option_name.h), and every program spells it as its users do. Only
Option::Flag() makes flags. A property of CSS is none. COLMAP's own flags, which have "_" or ".", may be in what is passed to it.
Exit codes: 0 no string literal has a flag, 1 some have.
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else __file__.rsplit("/tests/", 1)[0])
COMMENT_OR_LITERAL = re.compile(r'//[^\n]*|"(?:[^"\\\n]|\\.)*"')
FLAG = re.compile(r'(?<![\w-])--(?:"|(?=([a-z][a-z0-9-]*))\1(?![_A-Z]|\.[A-Za-z]|: \{))')
MAKES_FLAGS = re.compile(r"std::string flag = $")


def flags(text):
    """Line numbers and literals with a flag."""
    for found in COMMENT_OR_LITERAL.finditer(text):
        literal = found.group()
        if literal.startswith("//") or MAKES_FLAGS.search(text, max(0, found.start() - 19), found.start()):
            continue
        if FLAG.search(literal):
            yield text.count("\n", 0, found.start()) + 1, literal


def main():
    assert list(flags('f("give --a-b c"); // "--d"')) == [(1, '"give --a-b c"')]
    assert list(flags('std::string flag = "--" + name\n"--" + name\n"--path_f X --G.h"')) == [(2, '"--"')]
    bad = 0
    for folder in ("src", "kernels", "colmap_io"):
        paths = [path for path in sorted((ROOT / folder).rglob("*")) if path.suffix in (".h", ".cc", ".cu", ".cuh")]
        assert paths, folder
        for path in paths:
            for line, literal in flags(path.read_text()):
                bad += 1
                print(f"{path.relative_to(ROOT)}:{line}: {literal} names a flag; use OptionName()", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
