"""Writes docs/bench.md and the table of figures in README.md.

    python docs/make_bench.py

What the bench is stands in docs/bench.template.md. Parameters come from the `Par`
annotations, figures from the procedures in benchmarks/, which run here (half a minute).
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from macromicro.parameters import Entry, entries
from macromicro.plant import cycle, kiln
from macromicro.plant.cycle import CycleBench
from macromicro.plant.kiln import KilnBench
from macromicro.settings import Settings
from macromicro.units import shown

ROOT = Path(__file__).resolve().parents[1]
TEMPLATE, PAGE = ROOT / "docs" / "bench.template.md", ROOT / "docs" / "bench.md"
README = ROOT / "README.md"
# What was measured when the page was made, fenced so that a test can tell it apart.
MEASURED = re.compile(r"<!-- measured: (\w+) -->\n(.*?)<!-- end -->", re.DOTALL)
HEAD = "| parameter | default | meaning | source |\n|---|---|---|---|\n"
BELTS = (20.0, 21.0, 21.4, 21.8, 22.0, 22.2, 22.6, 23.0, 24.0)
BODIES = (0.0517, 0.065, 0.08, 0.1)
# What the README shows of the calibration: (what the figure is, words for it there).
SHORT = (
    ("2800 counts to within 2 %", "200 mm move, to within 2 %"),
    ("its overshoot", "its overshoot"),
    ("worst of 16 holds, 0.3-3.8 mm", "micro-stage, worst error of 16 holds"),
    ("contraction 0-2, 2-3 mm, settling", "contraction, settling to 10 um"),
    ("extension 3-2, 2-0 mm, settling", "extension, settling to 10 um"),
    ("vibration, least of 8 moves", "vibration a macro move leaves, least"),
    ("vibration, greatest", "vibration a macro move leaves, greatest"),
    ("down to 2 um, slowest", "its decay to 2 um, slowest"),
    ("slower in cycle 10 by", "return to zero, cycle 10 slower by"),
    ("largest bias in cycle 10", "bias in cycle 10"),
    ("return to zero, cycle 10, fan", "with a fan: return to zero, cycle 10"),
    ("largest bias in cycle 10, fan", "with a fan: bias in cycle 10"),
)


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


def rows(found: list[Entry]) -> str:
    """A table of parameters, named by the last part of their path."""
    return HEAD + "".join(
        f"| `{e.path.rpartition('.')[2]}` | {value(e)} | {e.par.meaning} | {e.par.source} |\n"
        for e in found
    )


def table(path: str, part: Any) -> str:
    """Heading, the part's own words and its parameters."""
    about = (type(part).__doc__ or "").strip().split("\n\n")
    words = " ".join(" ".join(about).split())
    return f"### `{path}`\n\n{words}\n\n{rows(list(entries(part)))}"


def parameter_tables() -> str:
    """Every parameter of the bench, its sensors and the kiln; what the cycle bench changes."""
    settings = Settings()
    parts = []
    for name in ("bench", "sensors"):
        tree = getattr(settings, name)
        parts += [table(f"{name}.{field}", getattr(tree, field)) for field in tree._fields]
    parts.append("## Parameters of the other two fixtures\n")
    parts.append(
        "Both are made of the same parts with the same defaults, except what follows. "
        "`--config` does not reach them.\n"
    )
    parts.append(table("KilnBench.oven", KilnBench().oven))
    for fixture, sources in (
        (KilnBench(), kiln.OWN_SOURCES),
        (CycleBench(), cycle.OWN_SOURCES),
    ):
        changed = [e for e in entries(fixture) if e.path in sources]
        name = type(fixture).__name__
        parts.append(f"### `{name}`: values of its own\n\n{paths(changed, sources)}")
    return "\n".join(parts)


def paths(found: list[Entry], sources: dict[str, str]) -> str:
    """A table of parameters by their whole path."""
    lines = "".join(
        f"| `{e.path}` | {value(e)} | {e.par.meaning} | {sources[e.path]} |\n" for e in found
    )
    return "| parameter | here | meaning | source |\n|---|---|---|---|\n" + lines


def render(measured: dict[str, str]) -> str:
    """The page: the template with parameters, defaults in the text, and what was measured."""
    known = {e.path: value(e) for e in entries(Settings())}
    known["parameters"] = parameter_tables().rstrip()

    def filled(match: re.Match[str]) -> str:
        name = match.group(1)
        if name in measured:
            return block(name, measured[name])
        return known[name]

    return re.sub(r"<<([\w.]+)>>", filled, TEMPLATE.read_text(encoding="utf-8"))


def block(name: str, text: str) -> str:
    """Text in the fence that `MEASURED` finds."""
    return f"<!-- measured: {name} -->\n{text}<!-- end -->"


def blocks(page: Path) -> dict[str, str]:
    """What a page says was measured, by name."""
    return dict(MEASURED.findall(page.read_text(encoding="utf-8")))


def number(figure: Any) -> str:
    """A figure's measured value: three digits, four where it is large or has no unit."""
    x, unit = figure.measured, figure.unit
    return (
        f"{x:.0f} {unit}"
        if abs(x) >= 1000.0
        else f"{x:.{4 if abs(x) >= 100.0 or not unit else 3}g} {unit}".strip()
    )


def measure() -> tuple[dict[str, str], str]:
    """Carry out the procedures: the page's blocks, and the README's table."""
    sys.path.insert(0, str(ROOT / "benchmarks"))
    import calibration

    figures = calibration.figures()
    head = (
        "| claim | figure | printed | accepted | measured | within |\n|---|---|---|---|---|---|\n"
    )
    lines = [
        f"| {f.claim} | {f.what} | {f.printed} | {f.accepted} "
        f"| {number(f)} | {'yes' if f.within else '**no**'} |\n"
        for f in figures
    ]
    by = {f.what: f for f in figures}
    short = "| figure | thesis | accepted | here |\n|---|---|---|---|\n" + "".join(
        f"| {words} | {by[what].printed} | {by[what].accepted} | {number(by[what])} |\n"
        for what, words in SHORT
    )
    belt = "| belt frequency | least of 8 moves | greatest | slowest decay to 2 um |\n"
    belt += "|---|---|---|---|\n" + "".join(
        f"| {b.frequency:g} Hz | {b.least:.1f} um | {b.greatest:.1f} um | {b.slowest:.2f} s |\n"
        for b in calibration.belt_sensitivity(BELTS)
    )
    body = "| R3 | NRMSE against (5.6) | cycle 10 slower by | largest bias in cycle 10 |\n"
    body += "|---|---|---|---|\n" + "".join(
        f"| {b.resistance:g} | {b.fit:.2f} % | {b.growth:.0f} % | {b.bias:.1f} um |\n"
        for b in calibration.body_sensitivity(BODIES)
    )
    return {"calibration": head + "".join(lines), "belt": belt, "body": body}, short


def main() -> None:
    """Measure and write."""
    measured, short = measure()
    PAGE.write_text(render(measured), encoding="utf-8")
    if README.exists():
        text = README.read_text(encoding="utf-8")
        fenced = block("figures", short)
        README.write_text(MEASURED.sub(lambda _: fenced, text), encoding="utf-8")


if __name__ == "__main__":
    main()
