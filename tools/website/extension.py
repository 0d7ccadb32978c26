"""What Sphinx lacks here: maths as MathML, and parameters with their units."""

from __future__ import annotations

from dataclasses import is_dataclass
from textwrap import dedent
from typing import Any

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.pycode import ModuleAnalyzer

from website.docstrings import escaped, fields, literal


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


def beside(kind: type) -> dict[str, str]:
    """The comments beside the fields of a class."""
    known = ModuleAnalyzer.for_module(kind.__module__).find_attr_docs()
    return {
        name: " ".join(words).strip()
        for (owner, name), words in known.items()
        if owner == kind.__qualname__
    }


def plain(app: Any, what: str, name: str, found: Any, options: Any, lines: list[str]) -> None:
    """A property's own words again: napoleon takes what stands before a colon for a type."""
    if what == "property":
        lines[:] = [escaped(line) for line in (found.__doc__ or "").expandtabs().splitlines()]
        lines[1:] = dedent("\n".join(lines[1:])).splitlines()


def skipped(app: Any, what: str, name: str, found: Any, skip: bool, options: Any) -> bool | None:
    """Sphinx' event for a member: a tuple's fields and what it inherits are left out."""
    return True if type(found).__name__ == "_tuplegetter" else None


def setup(app: Any) -> dict[str, bool]:
    """Sphinx' entry."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    app.connect("autodoc-process-docstring", docstring, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", plain, priority=600)
    app.connect("autodoc-skip-member", skipped)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
