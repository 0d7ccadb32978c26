"""What `--only` selects: claims, figures, tables, equations, sections or procedures."""

from __future__ import annotations

import re
from collections.abc import Sequence

from macromicro.errors import InputError
from macromicro.schema.text import printable
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import Chosen

_PREISACH = "preisach-geometry"

# Number: claims that measure it, or else the figure, table, diagram or procedure that shows it.
EQUATIONS: dict[str, tuple[str, ...]] = {
    "2.1": ("(2.1)",),
    **{f"2.{k}": (_PREISACH,) for k in range(2, 11)},
    "2.11": ("S2", _PREISACH),
    "3.1": ("D1",),
    # The motor: no claim measures its constants one by one, the diagrams show what they make.
    "4.1": ("4.3",),
    "4.2": ("4.6",),
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
    ids: dict[str, set[str]] = {}
    figures: dict[str, set[str]] = {}
    whole: set[str] = set()
    for name in names:
        wanted = _found(name.strip(), procedures)
        for procedure, kind, what in wanted:
            if kind == "whole":
                whole.add(procedure.name)
            else:
                place = ids if kind == "claim" else figures
                place.setdefault(procedure.name, set()).add(what)
    return [
        Chosen(p)
        if p.name in whole
        else Chosen(p, frozenset(ids.get(p.name, ())), frozenset(figures.get(p.name, ())))
        for p in procedures
        if p.name in whole or p.name in ids or p.name in figures
    ]


def _found(name: str, procedures: Sequence[Procedure]) -> list[tuple[Procedure, str, str]]:
    """Procedure, "whole", "claim" or "figure", and which, for one name."""
    low = name.lower()
    for p in procedures:
        if low == p.name:
            return [(p, "whole", "")]
        for claim in p.ids:
            if low == claim.lower():
                return [(p, "claim", claim)]
    figure, equation = _FIGURE.fullmatch(name), _EQUATION.fullmatch(name)
    number = figure.group(1) if figure else name
    if equation:
        return _by_equation(str(equation.group(1) or equation.group(2)), procedures)
    if figure or low.startswith("table"):
        for p in procedures:
            for each in (*p.figures, *p.diagrams):
                if number.lower() == each.lower():
                    return [(p, "figure", each)]
    found = [(p, "whole", "") for p in procedures if _within(name, p.sections)]
    if found and not figure:
        return found
    raise InputError("--only", printable(name), _accepted(procedures))


def _by_equation(number: str, procedures: Sequence[Procedure]) -> list[tuple[Procedure, str, str]]:
    wanted = EQUATIONS.get(number)
    found = [
        (p, kind, what)
        for what in wanted or (f"({number})",)
        for p in procedures
        for kind, there in (
            ("whole", (p.name,)),
            ("claim", p.ids),
            ("figure", (*p.figures, *p.diagrams)),
        )
        if what in there
    ]
    if not found:
        accepted = "an equation of the thesis: " + ", ".join(f"({n})" for n in EQUATIONS)
        raise InputError("--only", f"({printable(number)})", accepted)
    return found


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
