"""Procedures chosen by a claim, figure, table, equation, section or name: `--only`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from macromicro.errors import InputError
from macromicro.schema.text import printable
from macromicro.thesis.contents import EQUATIONS
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import Chosen

_FIGURE = re.compile(r"(?:figure|fig\.?)\s*(\S.*)", re.IGNORECASE)
_APPENDIX = re.compile(r"(?:appendix|app\.?)\s*(\S.*)", re.IGNORECASE)
_EQUATION = re.compile(r"(?:equations?|eqs?\.?)?\s*\(([^()\s]+)\)|(?:equation|eq\.?)\s*(\S+)", re.I)
_SECTION = re.compile(r"(?:section|sec\.?|chapter|ch\.?)\s*(\S.*)", re.IGNORECASE)


def choose(names: Sequence[str], procedures: Sequence[Procedure]) -> list[Chosen]:
    """The procedures that `names` select, in their own order; all without names.

    A name is a claim's id ("M1"), a label ("Figure 4.8", "Table 2.1", "Equation (2.1)"), a
    section with all below it ("4.2", "Appendix D") or a procedure.
    """
    if not names:
        return [Chosen(p) for p in procedures]
    found = [chosen for name in names for chosen in _find(name.strip(), procedures)]
    merged = [_merge([c for c in found if c.procedure is p]) for p in procedures]
    return [chosen for chosen in merged if chosen is not None]


def _merge(chosen: Sequence[Chosen]) -> Chosen | None:
    """Selections of one procedure as one."""
    whole = [c for c in chosen if c.ids is None]
    if whole or not chosen:
        return next(iter(whole), None)
    ids = (c.ids or frozenset() for c in chosen)
    figures = (c.figures or frozenset() for c in chosen)
    return Chosen(chosen[0].procedure, frozenset().union(*ids), frozenset().union(*figures))


def _find(name: str, procedures: Sequence[Procedure]) -> list[Chosen]:
    """What one name selects."""
    low, none = name.lower(), frozenset[str]()
    for p in procedures:
        if low == p.name:
            return [Chosen(p)]
        for claim in p.ids:
            if low == claim.lower():
                return [Chosen(p, frozenset({claim}), none)]
    figure = _FIGURE.fullmatch(name)
    if figure or low.startswith(("table", "(")):
        label = figure[1].lower() if figure else low
        for p in procedures:
            for number in (*p.figures, *p.diagrams):
                if label == number.lower():
                    return [Chosen(p, none, frozenset({number}))]
    equation = _EQUATION.fullmatch(name)
    if equation:
        number = equation[1] or equation[2]
        if number not in EQUATIONS:
            accepted = "an equation of the thesis: " + ", ".join(f"({n})" for n in EQUATIONS)
            raise InputError("--only", f"({printable(number)})", accepted)
        return [chosen for each in EQUATIONS[number] for chosen in _find(each, procedures)]
    found = [] if figure else [Chosen(p) for p in procedures if _within(name, p.sections)]
    if found:
        return found
    raise InputError("--only", printable(name), _accepted_names(procedures))


def _within(name: str, sections: Sequence[str]) -> bool:
    """Whether one of `sections` is the named one, or below it."""
    appendix, section = _APPENDIX.fullmatch(name), _SECTION.fullmatch(name)
    if appendix:
        wanted = f"Appendix {appendix.group(1).upper()}"
    else:
        wanted = section.group(1) if section else name
    return any(s == wanted or s.startswith(f"{wanted}.") for s in sections)


def _accepted_names(procedures: Sequence[Procedure]) -> str:
    names = ", ".join(p.name for p in procedures)
    return (
        "a claim (M1), a figure or table (Figure 4.8, Table 2.1), a section (4.2, Appendix D) "
        f"or a procedure: {names}; `macromicro reproduce --list` shows them all"
    )
