# SPDX-License-Identifier: BSD-3-Clause
"""What the site shows besides docs/: CONTRIBUTING.md, and the C++ headers where Doxygen is installed."""

import logging
import pathlib
import re
import shutil
import subprocess
import tempfile

from mkdocs.structure.files import File

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
LOG = logging.getLogger("mkdocs.plugins")  # warnings there fail a strict build
MARKER = "<!-- doxygen -->"

made = tempfile.TemporaryDirectory()  # pylint: disable=consider-using-with


def on_files(files, config):
    add(files, config, ROOT, "CONTRIBUTING.md")
    add(files, config, HERE, "site.css")
    complete_theme(files, config)
    if shutil.which("doxygen") is None:
        LOG.info("doxygen is not installed: the site comes without the C++ headers")
        return files
    text = (HERE / "Doxyfile").read_text(encoding="utf-8")
    done = subprocess.run(["doxygen", "-"], input=f"{text}\nOUTPUT_DIRECTORY = {made.name}\n",
                          text=True, cwd=ROOT, stderr=subprocess.PIPE, check=False)
    if done.returncode != 0:
        raise SystemExit(f"doxygen failed:\n{done.stderr}")
    for path in sorted(pathlib.Path(made.name, "cpp").rglob("*")):
        if path.is_file():
            add(files, config, made.name, path.relative_to(made.name).as_posix())
    return files


def add(files, config, folder, name, place=None):
    file = File(name, str(folder), config["site_dir"], config["use_directory_urls"])
    if place:
        file.dest_path = file.dest_uri = file.url = place
        file.abs_dest_path = str(pathlib.Path(config["site_dir"], place))
    files.append(file)


def complete_theme(files, config):
    """Debian's theme names two scripts that it does not have; one of them is there by another name."""
    for folder in map(pathlib.Path, config["theme"].dirs):
        page = folder / "base.html"
        if not page.is_file():
            continue
        for name in re.findall(r"js/(jquery[^']*\.js|theme_extra\.js)'", page.read_text("utf-8")):
            if (folder / "js" / name).is_file():
                continue
            if name.startswith("jquery"):
                own = min(folder.glob("js/jquery*.js"))
                add(files, config, folder, own.relative_to(folder).as_posix(), f"js/{name}")
            else:
                add(files, config, HERE, name, f"js/{name}")


def on_page_markdown(markdown, page, files, **_):
    # The repository's files link to each other by their places there.
    if page.file.src_uri == "CONTRIBUTING.md":
        markdown = markdown.replace("](docs/", "](")
    markdown = markdown.replace("](../CONTRIBUTING.md", "](CONTRIBUTING.md")
    if MARKER in markdown:
        there = files.get_file_from_path("cpp/index.html") is not None
        markdown = markdown.replace(MARKER, "[Browse the headers](cpp/index.html)." if there else
                                    "This copy was built without Doxygen: read the headers in `src/`.")
    return as_python_markdown(markdown)


def as_python_markdown(text):
    """GitHub's Markdown in the dialect of MkDocs: a list may follow a paragraph at once there, and
    what belongs to an item is indented by the width of its bullet rather than by four."""
    lines, fenced, in_list = [], False, False
    for line in text.split("\n"):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        bullet = re.match(r"( *)([-*]|\d+\.) ", line)
        indent = len(line) - len(line.lstrip())
        if not fenced and bullet and (in_list or indent < 4):
            before = lines[-1] if lines else ""
            if not in_list and before.strip():
                lines.append("")
            in_list = True
            line = " " * (4 * ((indent + 2) // 3)) + line.lstrip()
        elif in_list and line.strip():
            if indent == 0:
                in_list = bool(lines and lines[-1].strip()) and not line.startswith("#")
            elif indent < 4:
                line = "    " + line.lstrip()
        lines.append(line)
    return "\n".join(lines)
