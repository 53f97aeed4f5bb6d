#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the English of README.md, CONTRIBUTING.md and docs/, without generated pages and decisions; and of comments.

    python3 tests/docs/english.py [ROOT]
    python3 tests/docs/english.py --messages [ROOT]  # string literals of four words and more in src/ and apps/

For each 1,000 words it counts clauses with "what" that stand for a noun, and "where" for "if". It reports sentences,
lines and pages that are too long, and WORDS. Of code in pages, only the length of lines counts. COMMENTS of C++ are
counted by folder. Exit codes: 0 good, 1 not.
"""

import pathlib
import re
import sys

MOST_WORDS, MOST_COLUMNS, MOST_LINES = 30, 120, 140
# Most for each 1,000 words: over all pages, and in a page with at least two.
RATES = {"what": (1.5, 4.0), "where": (0.5, 2.0)}
KINDS = (*RATES, "long", "columns", "lines", "word")
# Most sentences of comments, for each 1,000 words of a folder, that are too long or have such a clause.
COMMENTS = {"kernels": 0.5, "src/viewer": 1.0, "src/splat_io": 1.0, "src/selection": 1.0, "src": 2.5, "colmap_io": 1.5,
            "apps": 2.5, "tests": 1.5}
GENERATED = ("docs/python-reference.md", "docs/viewer-keys.md", "docs/decisions/")
LISTED = {"docs/cli.md": (10_000,)}  # lines at most: mostly help, as the program prints it

# "Decide what to keep" is a question; "Where the files are" is a place, and "Where none are, ..." a condition.
ASKS = r"(?:ask|say|said|see|know|explain|decide|check|learn|find out|understand|guess|wonder|no matter)(?:s|ed|ing)?"
WHAT = re.compile(rf"\b({ASKS} )?what\b", re.I)
WHERE = re.compile(r"^Where\b[^,]*,|\bwhere (?:there|no|none|nothing|neither)\b")
WORDS = [(re.compile(pattern, re.I), remedy) for pattern, remedy in (
    (r"\w*(?:colour|neighbour|behaviour)\w*|\b(?:grey|centre|licence|(?:optim|real|recogn)is[ei])\w*", "American"),
    (r"(?<!it )(?<!them )(?<!stands )\balone\b", "only"), (r"\bin (?:the )?place of\b", "instead of"),
    (r"\b(?:is|are) to be\b", "must be"), (r"\b(?:is|are) no numbers?\b", "NaN"),
    (r"\b(?:is|are|be) told\b", "name who reports it"), (r"\ba half of\b|\bfive quarters\b", "half of, 125 %"),
    (r"\b(?:was|were) asked\b|\basked (?:was|were|are)\b", "the target"), (r"\bg[ai]ves? up\b", "free, or stop"),
    (r"\btoday\b|\bas (?:it was|ever)\b|\bearlier program\b|\bprogram (?:before|of that)\b", "no history"),
    (r"\b(?:the|of|its|that|this|with|such) paint\b(?! program)|\bpaint's\b", "mask, or strokes"),
    (r"\b(?:the|their|its|of|soft) shares\b", "coverage"), (r"\bstained\b", "changed; `stained` is the key"),
    (r"\bthe scene decides\b|\bvalleys?\b|\blifted\b|\bveil\b|\bown masks\b|\bpasses everything\b", "a private word"))]


def clean(text):  # without markup, but of as many lines: code is one word, links are their text
    def blank(found, word=" "):
        return word + "\n" * found.group().count("\n")
    text = re.sub(r"<!--.*?-->", blank, text, flags=re.S)
    text = re.sub(r"(`+)(?!`).+?(?<!`)\1(?!`)", lambda found: blank(found, "code"), text, flags=re.S)
    text = re.sub(r"!?\[([^\]]*)\](?:\([^)]*\)|\[[^\]]*\])", r"\1", text)
    return re.sub(r"</?[a-z][^<>]*>|[*_]{2}|(?<!\w)[*_]|[*_](?!\w)", blank, text)


def blocks(lines):  # line numbers and texts of paragraphs, items of lists and cells of tables
    fence, start, block, nested = None, 0, [], False
    for number, line in enumerate([*lines, ""], 1):
        bare = line.strip()
        mark = re.match(r"`{3,}|~{3,}", bare)
        item = re.match(r"\s*(?:[-*+]|\d+[.)])\s+|\s*[!?]{3}\s", line)
        code = line.startswith(("    ", "\t")) and not block and not nested
        other = fence or mark or not bare or code or bare[0] in "|#="
        if (other or item) and block:
            yield start, "\n".join(block)
            block = []
        if mark and (not fence or bare.startswith(fence)):
            fence = None if fence else mark.group()
        elif bare.startswith("|") and not fence:
            yield from ((number, cell) for cell in re.split(r"(?<!\\)\|", bare) if cell.strip())
        elif not other:
            nested = bool(item) or (nested and line[0] == " ")
            start = start if block else number
            block.append(re.sub(r"^[>\s]*", "", line[item.end():] if item else line))


def sentences(start, text):  # line numbers and sentences of a block
    end = r"(?<!\be\.g)(?<!\bi\.e)(?<!\bal)(?<!\bvs)[.!?][\"”)]*(?=\s+[A-Z0-9\"“(]|\s+code\b|\s*$)"
    text = clean(text)
    for found in re.finditer(rf"\S.*?(?:{end}|\Z)", text, re.S):
        yield start + text.count("\n", 0, found.start()), " ".join(found.group().split())


def judge(start, text):
    """The number of words of a block, and its findings: line, kind, reason."""
    count, findings = 0, []
    for line, plain in sentences(start, text):
        words = sum(any(letter.isalnum() for letter in word) for word in plain.split())
        count += words
        findings += [(line, "long", f"{words} words: {plain[:50]}...")] if words > MOST_WORDS else []
        if not plain.endswith("?"):
            said = [("what", found) for found in WHAT.finditer(plain) if not found.group(1)]
            said += [("where", found) for found in WHERE.finditer(plain)]
            findings += [(line, kind, f"...{plain[max(0, found.start() - 10):][:50]}...") for kind, found in said]
        findings += [(line, "word", f'"{found.group()}": {remedy}')
                     for pattern, remedy in WORDS for found in pattern.finditer(plain)]
    return count, findings


def judge_page(text, most_lines=MOST_LINES):
    lines = text.splitlines()
    judged = [judge(*block) for block in blocks(lines)]
    findings = [(1 + at, "columns", f"{len(line)}") for at, line in enumerate(lines) if len(line) > MOST_COLUMNS]
    findings += [(len(lines), "lines", f"{len(lines)}")] if len(lines) > most_lines else []
    return sum(count for count, _ in judged), sum((found for _, found in judged), findings)


def judge_source(text):
    words, findings, token = 0, [], r'"(?:[^"\\\n]|\\.)*"'
    for found in re.finditer(rf"//[^\n]*|/\*.*?\*/|#include[^\n]*|'(?:[^'\\]|\\.)'|{token}(?:\s*{token})*", text, re.S):
        literal = re.sub(r'(?<!\\)"\s*"', "", found.group())[1:-1] if found.group()[0] == '"' else ""
        if len(re.findall(r"[A-Za-z]{2,}", literal)) >= 4:
            judged = judge(text.count("\n", 0, found.start()) + 1, literal.replace(r"\n", " ").replace(r"\"", '"'))
            words, findings = words + judged[0], findings + judged[1]
    return words, findings


def judge_comments(text):  # lines of // and the paragraphs that they make, and comments behind code
    words, findings = 0, []
    for found in re.finditer(r"(?:^ *//(?! SPDX)[^\n]+(?:\n|\Z))+|(?<=\S)  // [^\n]*", text, re.M):
        block = re.sub(r"^ *// ?", "", found.group(), flags=re.M).rstrip()
        for paragraph in re.finditer(r"\S.*?(?=\n\n|\Z)", block, re.S):
            judged = judge(text.count("\n", 0, found.start()) + 1 + block.count("\n", 0, paragraph.start()),
                           paragraph.group())
            words, findings = words + judged[0], findings + [one for one in judged[1] if one[1] != "word"]
    return words, findings


def check_comments(root):  # prints folders with too many findings
    counts, shown = {}, {}
    for name in sorted(str(path.relative_to(root)) for kind in ("h", "cc", "cuh", "cu") for top in ("src", "kernels",
                       "colmap_io", "apps", "tests") for path in (root / top).glob(f"**/*.{kind}")):
        limit = next(folder for folder in COMMENTS if name.startswith(folder + "/"))
        folder = "/".join(name.split("/")[:2 if limit.startswith("src") else 1])
        words, findings = judge_comments((root / name).read_text())
        before = counts.get(folder, (0, 0, COMMENTS[limit]))
        counts[folder] = before[0] + words, before[1] + len(findings), COMMENTS[limit]
        shown.setdefault(folder, []).extend(f"{name}:{line}: {kind}: {why}" for line, kind, why in findings)
    bad = [folder for folder, (words, found, most) in counts.items() if found * 1000 > most * words]
    for folder in bad:
        words, found, most = counts[folder]
        print(*shown[folder], f"{folder}: {found} in {words} words of comments; at most {most} of 1,000", sep="\n",
              file=sys.stderr)
    print("comments:", ", ".join(f"{folder} {1000 * found / max(1, words):.1f}" for folder, (words, found, _) in
                                 sorted(counts.items(), key=lambda entry: entry[0])))
    return bad


def check():  # holds the rules to texts of known faults
    kinds = lambda text: sorted(kind for _, kind, _ in judge_page(text)[1])  # noqa: E731
    assert kinds("You can leave it alone. Decide what to keep. What if?\n\n    what of code") == []
    assert kinds("It takes what is faint.\nWhere none is, it stops. Where files are.") == ["what", "where"]
    assert kinds("# What\n| what | b |\n|---|---|\n```\nwhat\n```\n- in place of\n  what") == ["what", "what", "word"]
    assert kinds("a " * 30 + "b.") == kinds("a " * 20 + "e.g. B" + " a" * 20) == ["long"]
    assert not kinds("A b.\n" * 40 + f"\n|{' a' * 20}|{' a' * 20}|") and judge_page("a `b c` 3 -\n")[0] == 3
    assert kinds("x.\n\n" * 71) == ["lines"] and kinds("x" * 121) == ["columns"] and not kinds("x" * 120)
    assert judge_page("a\nb\n\nc.\nIt is grey.")[1] == [(5, "word", '"grey": American')]
    assert judge_source('// "what is so bad"\nf("a file of "\n  "what is \\"so\\"", "what")')[1][0][:2] == (2, "what")
    assert judge_comments("// It takes what is\n// faint.\n\nf();  // what is new\n")[1] == [
        (1, "what", "...It takes what is faint...."), (4, "what", "...what is new...")]


def main():
    check()
    messages = "--messages" in sys.argv
    root = pathlib.Path([*filter("--messages".__ne__, sys.argv[1:]), __file__.rsplit("/tests/", 1)[0]][0])
    patterns = ("README.md", "CONTRIBUTING.md", "docs/**/*.md")
    patterns = ("src/**/*.h", "src/**/*.cc", "apps/**/*.h", "apps/**/*.cc") if messages else patterns
    names = [str(path.relative_to(root)) for pattern in patterns for path in sorted(root.glob(pattern))]
    read = judge_source if messages else judge_page
    names = [name for name in names if not name.startswith(GENERATED)]
    pages = {name: read((root / name).read_text(), *LISTED.get(name, ())) for name in names}
    assert sum(words for words, _ in pages.values()) > 0, root
    pages["all"] = sum(words for words, _ in pages.values()), [one for _, found in pages.values() for one in found]
    bad = over = set()
    for name in sorted(pages, key="all".__ne__):
        words, findings = pages[name]
        count = {kind: sum(kind == found for _, found, _ in findings) for kind in KINDS}
        rate = {kind: count[kind] * 1000 / max(1, words) for kind in KINDS}
        here = over | {kind for kind, most in RATES.items() if rate[kind] > most[name != "all"] and count[kind] >= 2}
        over = here if name == "all" else over
        shown = [finding for finding in sorted(findings) if finding[1] in here or finding[1] not in RATES]
        bad = bad or here or shown
        for line, kind, reason in shown if name != "all" else ():
            print(f"{name}:{line}: {kind}: {reason}", file=sys.stderr)
        tail = [f"{kind} {count[kind]}" + (f" ({rate[kind]:.2f} of 1,000)" if kind in RATES else "") for kind in KINDS]
        if words:
            print(f"{name}: {words} words; {', '.join(tail)}")
    worse = [] if messages else check_comments(root)
    return 1 if bad or worse else 0


if __name__ == "__main__":
    sys.exit(main())
