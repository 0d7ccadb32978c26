"""The benches' parameters, each once, sorted by the origin of their values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from macromicro.schema.par import Entry, Par, entries
from macromicro.settings import Settings
from macromicro.thesis import cycle_bench, kiln_bench
from macromicro.units import shown

CALIBRATED = "calibrated to claims"
ASSUMED = "bench assumptions"
THESIS = "given by the thesis"
LITERATURE = "from the literature"
DERIVED = "derived from other figures"
GROUPS = (CALIBRATED, ASSUMED, THESIS, LITERATURE, DERIVED)

_TO = "calibrated to "
_CLAIMS = re.compile(r"\b([A-Z])(\d+)([a-z]?)(?:-\1(\d+))?\b")
_DIGITS = 5


class Free(NamedTuple):
    path: str  # within its bench; the kiln's or cycle bench's own begin with its name
    meaning: str
    value: str
    source: str
    group: str
    claims: tuple[str, ...]  # ids of those that it was chosen for
    numbers: int  # how many it holds


def free_parameters(settings: Settings) -> list[Free]:
    """All parameters of the two-stage bench with its sensors, the kiln and the cycle bench.

    A shared parameter, known by its meaning, is listed once; one whose value has a source of its
    own on a bench (`OWN_SOURCES`) belongs to that bench.
    """
    found: dict[tuple[str, str], Free] = {}
    for bench, entry, own in _all(settings):
        value = _describe(entry.par, entry.value)
        key = ("" if own is None else bench, entry.par.meaning)
        if key not in found:
            path = entry.path if own is None else f"{bench}: {entry.path}"
            found[key] = _free(path, entry, value, own or entry.par.source)
    return list(found.values())


def group(parameters: list[Free]) -> dict[str, list[Free]]:
    return {group: [p for p in parameters if p.group == group] for group in GROUPS}


def _all(settings: Settings) -> Iterator[tuple[str, Entry, str | None]]:
    """Bench, parameter, and the source of its value on this bench alone, if any."""
    trees: list[tuple[str, Any, dict[str, str]]] = [
        ("two-stage bench", settings.bench, {}),
        ("two-stage bench", settings.sensors, {}),
        ("kiln", kiln_bench.with_bench(settings.bench), kiln_bench.OWN_SOURCES),
        ("cycle bench", cycle_bench.with_bench(settings.bench), cycle_bench.OWN_SOURCES),
    ]
    for bench, tree, own in trees:
        for entry in entries(tree):
            yield bench, entry, own.get(entry.path)


def _free(path: str, entry: Entry, value: str, source: str) -> Free:
    count = len(entry.value) if isinstance(entry.value, tuple) else 1
    claims = _named_claims(source) if source.startswith(_TO) else ()
    return Free(path, entry.par.meaning, value, source, _group(source), claims, count)


def _group(source: str) -> str:
    if source.startswith(_TO):
        return CALIBRATED
    if "assum" in source:  # also "Section 3.2.1; value assumed"
        return ASSUMED
    if "Section" in source or "Appendix" in source:
        return THESIS
    return LITERATURE if "literature" in source else DERIVED


def _named_claims(source: str) -> tuple[str, ...]:
    """Ids of claims in a source: "calibrated to S3-S5, I3" names S3, S4, S5 and I3."""
    found = []
    for letter, first, suffix, last in _CLAIMS.findall(source):
        if last:
            found += [f"{letter}{n}" for n in range(int(first), int(last) + 1)]
        else:
            found.append(f"{letter}{first}{suffix}")
    return tuple(found)


def _describe(par: Par, value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        texts = [shown(v, par.unit, par.shown, _DIGITS).partition(" ") for v in value]
        return " ".join((", ".join(t[0] for t in texts), texts[0][2])).strip()
    return shown(value, par.unit, par.shown, _DIGITS)
