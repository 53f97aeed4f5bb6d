#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/python-reference.md: every class, function and option of the built Python module.

    python3 apps/docs/python_reference.py [--check] [FOLDER]    default build/release/apps/python

FOLDER holds the package `retint`. Signatures come from its stub, texts from its docstrings, options from
retint.options(). With --check, nothing is written. Exit codes: 0 done, 1 the page is out of date, or a docstring is
missing.
"""

import argparse
import ast
import inspect
import pathlib
import re
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs" / "python-reference.md"
CLASSES = ["Session", "Workspace", "View", "Camera", "Splat", "Edit", "Painted", "Selection", "Masks", "Region",
           "Depth"]
CALLS = ["depth", "select", "project", "refit", "refine_gaussians"]  # with options; select has those of depth too
COLUMNS = 116
PLAIN = {"__len__", "__iter__", "__contains__", "__enter__", "__exit__"}  # Python's own meaning says enough
INTRODUCTION = """
# Python reference

Every class, function and option of the module `retint`. [Python](python.md) is the guide, with examples. This page is
generated: after a change, run `python3 apps/docs/python_reference.py`; a test compares.

`[N, 3]` is the shape of an array: N Gaussians, P points, H rows, W columns, K coefficients. "World" is the frame and
the unit of the workspace. `progress` is a callable of a stage's name and a fraction in [0, 1], or `None`. Arguments
after `*` are passed by name. Every call can raise the [errors](#errors) below.
"""


class ShortUnions(ast.NodeTransformer):
    """Union[A, B] as A | B and Optional[A] as A | None."""

    def visit_Subscript(self, node):
        self.generic_visit(node)
        kind = node.value.id if isinstance(node.value, ast.Name) else ""
        if kind not in ("Union", "Optional"):
            return node
        parts = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
        parts += [ast.Constant(None)] if kind == "Optional" else []
        joined = parts[0]
        for part in parts[1:]:
            joined = ast.BinOp(joined, ast.BitOr(), part)
        return joined


def signature(name, function):
    """One line if it fits, otherwise one argument a line."""
    given = function.args
    arguments = [one for one in given.args if one.arg != "self"]
    defaults = [None] * (len(arguments) - len(given.defaults)) + given.defaults + given.kw_defaults
    texts = [f"{one.arg}: {ast.unparse(one.annotation)}" + (f" = {ast.unparse(default)}" if default else "")
             for one, default in zip(arguments + given.kwonlyargs, defaults)]
    if given.vararg or given.kwonlyargs:
        texts.insert(len(arguments), f"*{given.vararg.arg}" if given.vararg else "*")
    texts += [f"**{given.kwarg.arg}"] if given.kwarg else []
    result = "" if function.name == "__init__" else f" -> {ast.unparse(function.returns)}"
    line = f"{name}({', '.join(texts)}){result}"
    return line if len(line) <= COLUMNS else f"{name}(\n" + "".join(f"    {text},\n" for text in texts) + f"){result}"


def docstring(where, thing):
    """Without the signature that pybind11 puts first."""
    text = inspect.cleandoc(getattr(thing, "__doc__", None) or "")
    name = where.rsplit(".", 1)[-1]
    text = re.sub(rf"\A{name}\([^\n]*\n*", "", text).strip()
    if not text and name not in PLAIN:
        sys.exit(f"python_reference.py: {where} has no docstring")
    return text


def outside_code(text):
    """HTML that is meant as text."""
    parts = text.split("`")
    return "`".join(part if at % 2 else part.replace("<", "&lt;") for at, part in enumerate(parts))


def paragraphs(text):
    """A docstring as Markdown: indented lines are code, lines that begin with a dash are items."""
    blocks = [("", [])]
    for line in text.split("\n"):
        kind = "code" if line.startswith("  ") else "item" if line.startswith("- ") else "text" if line else ""
        if kind == "item" or kind != blocks[-1][0]:
            blocks.append((kind, []))
        blocks[-1][1].append(line)
    parts = []
    for at, (kind, lines) in enumerate(blocks):
        if kind == "code":
            shown = [part for line in textwrap.dedent("\n".join(lines)).split("\n") for part in
                     textwrap.wrap(line, COLUMNS, subsequent_indent="    ", break_on_hyphens=False)]
            parts.append("```text\n" + "\n".join(shown) + "\n```")
        elif kind == "item" and blocks[at - 1][0] == "item":
            parts[-1] += "\n" + wrap(lines[0][2:], "- ", "  ")
        elif kind:
            parts.append(wrap(lines[0][2:], "- ", "  ") if kind == "item" else wrap(" ".join(lines)))
    return "\n\n".join(parts)


def wrap(text, first="", rest=""):
    return "\n".join(textwrap.wrap(outside_code(" ".join(text.split())), COLUMNS, initial_indent=first,
                                   subsequent_indent=rest, break_long_words=False, break_on_hyphens=False))


def item(code, text):
    return wrap(f"`{code}`" + (f": {text}" if text else ""), "- ", "  ")


def call(where, name, functions, thing):
    """A heading, all signatures and the text of a function."""
    text = docstring(where, thing)
    text, has_options, _ = text.partition("\n\nOptions (keyword arguments")
    shown = "\n".join(signature(name, function) for function in functions)
    options = f"\n\nOptions: [options of {where.split('.')[-1]}](#options-of-{where.split('.')[-1]})."
    return f"### {where}\n\n```text\n{shown}\n```\n\n{paragraphs(text)}" + (options if has_options else "")


def is_property(node):
    return any(isinstance(one, ast.Name) and one.id == "property" for one in node.decorator_list)


def of_class(name, node, thing):
    parts = [f"## {name}", paragraphs(docstring(name, thing))]
    attributes, special, methods = [], [], {}
    for member in node.body:
        if isinstance(member, ast.AnnAssign):
            label = member.target.id
            attributes.append(item(f"{label}: {ast.unparse(member.annotation)}",
                                   docstring(f"{name}.{label}", vars(thing)[label])))
        elif not isinstance(member, ast.FunctionDef):
            continue
        elif is_property(member):
            attributes.append(item(f"{member.name}: {ast.unparse(member.returns)}",
                                   docstring(f"{name}.{member.name}", vars(thing)[member.name])))
        elif member.name == "__init__":
            text = docstring(f"{name}.__init__", thing.__init__)
            parts.append(f"```text\n{signature(name, member)}\n```\n\n{paragraphs(text)}")
        elif member.name.startswith("__"):
            special.append(item(signature(member.name, member),
                                docstring(f"{name}.{member.name}", getattr(thing, member.name))))
        else:
            methods.setdefault(member.name, []).append(member)
    if attributes:
        parts.append("Attributes:\n\n" + "\n".join(attributes))
    if special:
        parts.append("Python's own methods:\n\n" + "\n".join(special))
    parts += [call(f"{name}.{label}", label, functions, getattr(thing, label))
              for label, functions in methods.items()]
    return "\n\n".join(parts)


def of_options(label, rows, without=()):
    lines = []
    for row in rows:
        if row in without:
            continue
        choices = row["range"] if isinstance(row["range"], str) else " or ".join(f"`{one!r}`" for one in row["range"])
        notes = "; ".join(filter(None, [choices, row["unit"], row["applies"] and f"for `{row['applies']}`"]))
        lines.append(wrap(f"`{row['name']}={row['default']!r}`" + (f" ({notes})" if notes else "") + f": {row['help']}",
                          "- ", "  "))
    more = "Those of [depth](#options-of-depth), and these.\n\n" if without else ""
    return f"### Options of {label}\n\n{more}" + "\n".join(lines)


def page(retint):
    stub = pathlib.Path(retint.__file__).with_name("_retint.pyi").read_text(encoding="utf-8")
    tree = ShortUnions().visit(ast.parse(stub))
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    functions = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            functions.setdefault(node.name, []).append(node)
    own = ast.parse(pathlib.Path(retint.__file__).with_name("_progress.py").read_text(encoding="utf-8"))
    functions["progress_bar"] = [node for node in ShortUnions().visit(own).body
                                 if isinstance(node, ast.FunctionDef) and node.name == "progress_bar"]
    types = [ast.unparse(node) for node in tree.body if isinstance(node, ast.Assign)]
    errors = [name for name, node in classes.items() if issubclass(getattr(retint, name), Exception)]
    missing = set(retint.__all__) - {*CLASSES, *errors, *functions, "__version__"}
    if missing:
        sys.exit(f"python_reference.py: {sorted(missing)} have no place on the page")

    parts = [INTRODUCTION.strip()]
    parts += [of_class(name, classes[name], getattr(retint, name)) for name in CLASSES]
    parts.append("## Functions")
    parts += [call(f"retint.{name}", name, functions[name], getattr(retint, name)) for name in sorted(functions)]
    parts.append("## Errors\n\n" + "\n".join(
        item(f"{name}({', '.join(ast.unparse(base) for base in classes[name].bases)})",
             docstring(name, getattr(retint, name))) for name in errors))
    parts.append("## Types of arguments\n\n```text\n" + "\n".join(
        "\n".join(textwrap.wrap(one, COLUMNS, subsequent_indent="    ")) for one in types) + "\n```")
    parts.append("## Options\n\n" + wrap(
        "Keyword arguments of the calls that name them, with their defaults. \"For `adam`\" means that the option "
        "matters only if another option has that value. `preset='paper'` starts from the options of the paper."))
    depth = retint.options("depth")
    parts += [of_options(label, retint.options(label), depth if label == "select" else ()) for label in CALLS]
    return "\n\n".join(parts) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--check", action="store_true", help="compare only")
    parser.add_argument("folder", nargs="?", default=ROOT / "build/release/apps/python", help="holds the package")
    arguments = parser.parse_args()
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(pathlib.Path(arguments.folder).resolve()))
    import retint

    text = page(retint)
    if not arguments.check:
        PAGE.write_text(text, encoding="utf-8")
    elif not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != text:
        sys.exit(f"{PAGE.relative_to(ROOT)} is out of date: run python3 apps/docs/python_reference.py")


if __name__ == "__main__":
    main()
