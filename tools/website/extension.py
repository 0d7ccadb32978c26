"""What Sphinx lacks here: maths as MathML, parameters with their units, and the pages' own text."""

from __future__ import annotations

from dataclasses import is_dataclass
from importlib import import_module
from inspect import isfunction
from pathlib import Path
from textwrap import dedent
from typing import Any

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml
from pygments.lexers.special import TextLexer
from sphinx.errors import ExtensionError, PycodeError
from sphinx.pycode import ModuleAnalyzer

from website import pages
from website.docstrings import escaped, fields, literal

FRONT_DOORS = ("macromicro", "macromicro.design", "macromicro.identify")


def source(app: Any, name: str, content: list[str]) -> None:
    """Sphinx' event for the text of a page."""
    content[0] = pages.linked(content[0])
    if name == app.config.root_doc:
        content[0] = pages.front(content[0])


def inline(translator: Any, node: Any) -> None:
    """A formula within a line."""
    translator.body.append(str(tex2mathml(node.astext(), as_block=False)))
    raise SkipNode


def block(translator: Any, node: Any) -> None:
    """A formula on a line of its own."""
    maths = str(tex2mathml(node.astext(), as_block=True))
    translator.body.append(f'<div class="equation">{maths}</div>')
    raise SkipNode


def docstring(app: Any, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """Sphinx' event for a docstring: examples as code, parameters of a set as a list."""
    lines[:] = [escaped(line) for line in lines]
    if what == "module":
        lines[:] = literal(lines)
    elif what == "class" and (hasattr(found, "_field_defaults") or is_dataclass(found)):
        lines += fields(found, beside(found))


def plain(app: Any, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """A property's own words again: napoleon takes what stands before a colon for a type."""
    if what == "property":
        lines[:] = [escaped(line) for line in (found.__doc__ or "").expandtabs().splitlines()]
        lines[1:] = dedent("\n".join(lines[1:])).splitlines()


def skipped(app: Any, what: str, name: str, found: Any, skip: bool, options: Any) -> bool | None:
    """Sphinx' event for a member: a tuple's fields are left out, a module's functions are shown
    even without words of their own."""
    if type(found).__name__ == "_tuplegetter":
        return True
    if what == "module" and isfunction(found) and not found.__doc__ and not name.startswith("_"):
        return False
    return None


def beside(kind: type) -> dict[str, str]:
    """The comments beside the fields of a class."""
    try:
        known = ModuleAnalyzer.for_module(kind.__module__).find_attr_docs()
    except PycodeError:  # an imported class, which Sphinx leaves out later
        return {}
    return {
        name: " ".join(words).strip()
        for (owner, name), words in known.items()
        if owner == kind.__qualname__
    }


def checked(app: Any, error: Exception | None) -> None:
    """Sphinx' event for the end: an error where a page would fetch something."""
    if error is None and (found := pages.fetched(Path(app.outdir))):
        raise ExtensionError("fetched from elsewhere:\n" + "\n".join(found))


def setup(app: Any) -> dict[str, bool]:
    """Sphinx' entry."""
    for name in FRONT_DOORS:
        module: Any = import_module(name)
        module.__all__ = sorted(module._HOMES)
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    app.add_lexer("csv", TextLexer)
    app.connect("source-read", source)
    app.connect("autodoc-process-docstring", docstring, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", plain, priority=600)
    app.connect("autodoc-skip-member", skipped)
    app.connect("build-finished", checked)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
