#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks links: of the repository's Markdown, and of the pages of a built site.

    python3 apps/docs/check_links.py [SITE]

Every link to a file must find it, and the place in it where one is named. A site must need no network: what
its pages load is in it. Links to other sites are not visited. Exit codes: 0 all are right, 1 some are not.
"""

import html.parser
import pathlib
import re
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FENCE = re.compile(r"^ *```.*?^ *```$", re.S | re.M)
INDENTED = re.compile(r"(?<=\n\n)(?:(?: {4}|\t).*\n|\n)+")
CODE = re.compile(r"`[^`\n]*`")
COMMENT = re.compile(r"<!--.*?-->", re.S)
LINK = re.compile(r"\]\(([^)\s]+)(?:\s+\"[^\"]*\")?\)")
HEADING = re.compile(r"^#{1,6} +(.*?)(?: +#+)?$", re.M)


def slugs(text):
    """The places that GitHub makes of the headings of a text."""
    found, names = {}, set()
    for heading in HEADING.findall(FENCE.sub("", text)):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        name = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        count = found.get(name, 0)
        found[name] = count + 1
        names.add(name if count == 0 else f"{name}-{count}")
    return names


def markdown_faults(path, text):
    for code in (COMMENT, FENCE, INDENTED, CODE):
        text = code.sub("", text)
    for link in LINK.findall(text):
        if "://" in link or link.startswith("mailto:"):
            continue
        name, _, place = link.partition("#")
        target = (path.parent / urllib.parse.unquote(name)).resolve() if name else path
        if not target.exists():
            yield f"{link}: there is no such file"
        elif place and target.suffix == ".md":
            if place not in slugs(target.read_text(encoding="utf-8")):
                yield f"{link}: there is no such heading"


class Page(html.parser.HTMLParser):
    """What a page loads, where its links lead, and the places in it."""

    def __init__(self, path):
        super().__init__()
        self.loads, self.links, self.places = [], [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.places |= {values[key] for key in ("id", "name") if values.get(key)}
        if tag == "a" and values.get("href"):
            self.links.append(values["href"])
        elif tag == "link" and values.get("rel") not in ("canonical", "next", "prev"):
            self.loads.append(values.get("href", ""))
        elif tag in ("script", "img", "iframe", "source") and values.get("src"):
            self.loads.append(values["src"])


def site_faults(root):
    pages = {path: Page(path) for path in sorted(root.rglob("*.html"))}
    for path, page in pages.items():
        if path.name == "404.html":
            continue  # a server shows it at any place: its links begin at the root
        name = path.relative_to(root)
        for link in page.loads + page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme in ("data", "javascript", "mailto"):
                continue
            if parts.scheme or parts.netloc:
                if link in page.loads:
                    yield f"{name}: loads {link} from the network"
                continue
            target = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            if target.is_dir():
                target = target / "index.html"
            if not target.exists():
                yield f"{name}: {link}: there is no such file"
            elif parts.fragment and target in pages and path.parts[-2] != "cpp":
                if urllib.parse.unquote(parts.fragment) not in pages[target].places:
                    yield f"{name}: {link}: there is no such place"


def main():
    faults = []
    documents = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    for path in documents:
        text = path.read_text(encoding="utf-8")
        faults += [f"{path.relative_to(ROOT)}: {fault}" for fault in markdown_faults(path, text)]
    if len(sys.argv) > 1:
        site = pathlib.Path(sys.argv[1]).resolve()
        if not (site / "index.html").is_file():
            sys.exit(f"{site}: there is no site")
        faults += site_faults(site)
    print("\n".join(faults) or "every link leads somewhere")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
