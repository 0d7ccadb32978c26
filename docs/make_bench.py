"""Writes docs/validation/bench.md and the figures of docs/validation/reproduce.md and README.md.

    python docs/make_bench.py

What the bench is stands in docs/validation/bench.template.md. Parameters come from the `Par`
annotations, claims from the procedures that `macromicro reproduce` runs, and the tables of
what they hang on from benchmarks/calibration.py; all run here (about two minutes). `--quick`
runs one procedure and the first of each table, and writes nothing.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from measured_page import VALIDATION, put, table

from macromicro.schema.par import Entry, entries
from macromicro.settings import Settings
from macromicro.thesis import all_procedures, cycle_bench, kiln_bench
from macromicro.thesis.claims import KINDS, REPRODUCED, STATEMENTS, Claim, in_order
from macromicro.thesis.cycle_bench import CycleBench
from macromicro.thesis.errata import ERRATA
from macromicro.thesis.kiln_bench import KilnBench
from macromicro.thesis.page import claim_text
from macromicro.thesis.procedure import Lab
from macromicro.units import shown

ROOT = Path(__file__).resolve().parents[1]
TEMPLATE, PAGE = VALIDATION / "bench.template.md", VALIDATION / "bench.md"
README, REPRODUCE = ROOT / "README.md", VALIDATION / "reproduce.md"
BENCH, PHASE = ("bench.", "sensors."), "bench.phase"


def value(entry: Entry) -> str:
    """A parameter's default as a person reads it."""
    par, found = entry.par, entry.value
    if isinstance(found, str):
        return found
    several = found if isinstance(found, tuple) else (found,)
    texts = [shown(x, par.unit, par.shown, 6) for x in several]
    unit = texts[0].partition(" ")[2]
    numbers = ", ".join(text.partition(" ")[0] for text in texts)
    return f"{numbers} {unit}".strip()


def parameters(heading: str, found: list[Entry]) -> str:
    """A table of parameters, named by the last part of their path."""
    rows = [
        (f"`{e.path.rpartition('.')[2]}`", value(e), e.par.meaning, e.par.source) for e in found
    ]
    return f"### {heading}\n\n{table(('parameter', 'default', 'meaning', 'source'), rows)}"


def parameter_tables() -> str:
    """The kiln's own parameters, and what kiln and cycle bench change."""
    parts = [parameters("`KilnBench.oven`", list(entries(KilnBench().oven)))]
    for fixture, sources in (
        (KilnBench(), kiln_bench.OWN_SOURCES),
        (CycleBench(), cycle_bench.OWN_SOURCES),
    ):
        rows = [
            (f"`{e.path}`", value(e), e.par.meaning, sources[e.path])
            for e in entries(fixture)
            if e.path in sources
        ]
        changed = table(("parameter", "here", "meaning", "source"), rows)
        parts.append(f"### `{type(fixture).__name__}`: values of its own\n\n{changed}")
    return "\n".join(parts)


def render(measured: dict[str, str]) -> str:
    """The page: the template with parameters, defaults in the text, and what was measured."""
    known = {e.path: value(e) for e in entries(Settings())}
    known["parameters"] = parameter_tables().rstrip()

    def filled(match: re.Match[str]) -> str:
        name = match.group(1)
        if name in measured:
            return f"<!-- {name} -->\n{measured[name]}<!-- end -->"
        return known[name]

    return re.sub(r"<<([\w.]+)>>", filled, TEMPLATE.read_text(encoding="utf-8"))


def number(x: float, unit: str = "") -> str:
    """A measured value: three digits, four where it is large or has no unit."""
    if abs(x) >= 1000.0:
        return f"{x:.0f} {unit}".strip()
    return f"{x:.{4 if abs(x) >= 100.0 or not unit else 3}g} {unit}".strip()


def measured_text(claim: Claim) -> str:
    """What was measured, in the unit of the claim."""
    if claim.measured is None:
        return claim_text.NOTHING
    several = claim.measured if isinstance(claim.measured, list) else [claim.measured]
    texts = [x if isinstance(x, str) else number(x) for x in several]
    return claim_text.with_unit(", ".join(texts), claim.unit)


def bands(claims: list[Claim]) -> str:
    """All claims with their commands, what counts as reproduced, for reproduce.md."""
    head = ("command", "claim", "printed", "accepted", "measured", "verdict", "kind", "rule")
    rows = []
    for c in claims:
        own = c.accept and not c.of
        accepted = claim_text.with_unit(claim_text.accepted_text(c), c.unit if own else "")
        rule = [f"band of: {c.of}"] if c.of else []
        rule += [" ".join(c.rule.split())] if c.rule else []
        cells = (
            *(f"`--only {c.id}`", " ".join(c.claim.split())),
            claim_text.with_unit(claim_text.printed_text(c), "" if c.printed is None else c.unit),
            *(accepted, measured_text(c), c.verdict, c.kind, "; ".join(rule)),
        )
        rows.append([cell.replace("|", "/") for cell in cells])
    return table(head, rows)


def turned() -> str:
    """Each claim with the parameters whose source names it, for reproduce.md."""
    sources = {e.path: e.par.source for e in entries(Settings()) if e.path.startswith(BENCH)}
    for own, fixture in (("kiln", kiln_bench), ("cycle", cycle_bench)):
        sources |= {f"{own}: {path}": words for path, words in fixture.OWN_SOURCES.items()}
    rows = []
    for name in STATEMENTS:
        found = [path for path, words in sources.items() if re.search(rf"\b{name}\b", words)]
        if phase := [path for path in found if path.startswith(PHASE)]:
            found = [PHASE, *(path for path in found if path not in phase)]
        if found:
            rows.append((name, ", ".join(f"`{path}`" for path in found)))
    return table(("claim", "parameters to turn"), rows)


def misprints() -> str:
    """The thesis' misprints and contradictions, from the package's list."""
    rows = [
        [cell.replace("|", r"\|") for cell in (str(e.number), e.place, e.printed, e.reading)]
        for e in ERRATA
    ]
    return table(("#", "place", "printed", "reading used here"), rows)


def claims_now(quick: bool = False) -> list[Claim]:
    """Every claim, measured as `macromicro reproduce` does; those of one procedure if `quick`."""
    lab, procedures = Lab(), all_procedures()
    chosen = procedures[:1] if quick else procedures
    return in_order(c for p in chosen for c in p.claims(p.collect(lab)))


def counted(claims: list[Claim]) -> str:
    """How many are reproduced, in all and by kind, as a sentence."""
    good = [c for c in claims if c.verdict == REPRODUCED]
    parts = [
        f"{sum(c.kind == kind for c in good)} of {sum(c.kind == kind for c in claims)} {kind}"
        for kind in KINDS
    ]
    return f"{len(good)} of the {len(claims)} claims are reproduced: {', '.join(parts)}.\n"


def measure(quick: bool = False) -> tuple[dict[str, str], list[Claim]]:
    """Carry out the procedures: the page's blocks, and the claims."""
    few = 1 if quick else None
    sys.path.insert(0, str(ROOT / "benchmarks"))
    import calibration

    claims = claims_now(quick)
    belt = table(
        ("belt frequency", "least of 8 moves", "greatest", "slowest decay to 2 um"),
        [
            (
                f"{b.frequency:g} Hz",
                f"{b.least:.1f} um",
                f"{b.greatest:.1f} um",
                f"{b.slowest:.2f} s",
            )
            for b in calibration.belt_sensitivity(calibration.BELTS[:few])
        ],
    )
    body = table(
        ("R3", "S7: NRMSE against (5.6)", "I3: cycle 10 slower by", "mean error in cycle 10"),
        [
            (f"{b.resistance:g}", f"{b.fit:.2f} %", f"{b.growth:.0f} %", f"{b.bias:.1f} um")
            for b in calibration.body_sensitivity(calibration.BODIES[:few])
        ],
    )
    heat = table(
        ("heat at 5 V", "S12: error 1 s after the step from 3 to 2 mm"),
        [
            (f"{h.heat:.3g} W", f"{h.error:.1f} um")
            for h in calibration.heat_sensitivity(calibration.HEATS[:few])
        ],
    )
    return {"belt": belt, "body": body, "heat": heat}, claims


def main() -> None:
    """Measure and write."""
    quick = "--quick" in sys.argv
    measured, claims = measure(quick)
    if quick:
        return
    PAGE.write_text(render(measured), encoding="utf-8")
    put(README, "count", counted(claims))
    put(REPRODUCE, "count", counted(claims))
    put(REPRODUCE, "bands", bands(claims))
    put(REPRODUCE, "turned", turned())
    put(REPRODUCE, "misprints", misprints())


if __name__ == "__main__":
    main()
