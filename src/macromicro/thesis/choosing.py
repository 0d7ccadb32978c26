"""Procedures chosen by a claim, figure, table, equation, section or name: `--only`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from macromicro.errors import InputError
from macromicro.schema.text import printable
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import Chosen

# What measures each equation, or else what shows it, in words that `--only` takes.
EQUATIONS: dict[str, tuple[str, ...]] = {
    "2.1": ("(2.1)",),
    **{f"2.{k}": ("preisach-geometry",) for k in range(2, 11)},
    "2.11": ("S2", "preisach-geometry"),
    "3.1": ("D1",),
    # The motor: no claim measures its constants one by one, the diagrams show what they make.
    "4.1": ("Figure 4.3",),
    "4.2": ("Figure 4.6",),
    "4.3": ("M4a", "M4b"),
    "4.4": ("M5",),
    "4.5": ("M6a", "M6b"),
    "4.6": ("M3b",),
    "4.7": ("M6a", "M6b"),
    "4.8": ("M6a", "M6b"),
    "4.9": ("M11b",),
    "4.10": ("M11",),
    "5.1": ("S2",),
    "5.2": ("S5a", "S5b"),
    "5.3": ("S5a",),
    "5.4": ("S5b",),
    "5.5": ("S5b",),
    "5.6": ("S7",),
    "5.7": ("S9",),
    "5.8": ("S9",),
    "5.9": ("S8",),
}

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
    found = [chosen for name in names for chosen in _found(name.strip(), procedures)]
    merged = [_merged([c for c in found if c.procedure is p]) for p in procedures]
    return [chosen for chosen in merged if chosen is not None]


def _merged(chosen: Sequence[Chosen]) -> Chosen | None:
    """Selections of one procedure as one."""
    whole = [c for c in chosen if c.ids is None]
    if whole or not chosen:
        return next(iter(whole), None)
    ids = (c.ids or frozenset() for c in chosen)
    figures = (c.figures or frozenset() for c in chosen)
    return Chosen(chosen[0].procedure, frozenset().union(*ids), frozenset().union(*figures))


def _found(name: str, procedures: Sequence[Procedure]) -> list[Chosen]:
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
        return [chosen for each in EQUATIONS[number] for chosen in _found(each, procedures)]
    found = [] if figure else [Chosen(p) for p in procedures if _within(name, p.sections)]
    if found:
        return found
    raise InputError("--only", printable(name), _accepted(procedures))


def _within(name: str, sections: Sequence[str]) -> bool:
    """Whether one of `sections` is the named one, or below it."""
    appendix, section = _APPENDIX.fullmatch(name), _SECTION.fullmatch(name)
    if appendix:
        wanted = f"Appendix {appendix.group(1).upper()}"
    else:
        wanted = section.group(1) if section else name
    return any(s == wanted or s.startswith(f"{wanted}.") for s in sections)


def _accepted(procedures: Sequence[Procedure]) -> str:
    names = ", ".join(p.name for p in procedures)
    return (
        "a claim (M1), a figure or table (Figure 4.8, Table 2.1), a section (4.2, Appendix D) "
        f"or a procedure: {names}; `macromicro reproduce --list` shows them all"
    )
