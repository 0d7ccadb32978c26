"""Random machines commissioned, and what was found beside the truth: what the scripts share."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro.commission import places
from macromicro.commission.procedure import Kind, Options
from macromicro.commission.running import Commissioned, Place, commission
from macromicro.commission.stand import CommissionError
from macromicro.errors import InputError
from macromicro.machines import machine, results, rig
from macromicro.schema import config

EXAMPLES = Path(__file__).resolve().parents[1] / "examples" / "machines"
SHOWN = {
    "axis": ("mass", "coulomb", "offset"),
    "rotary": ("mass", "coulomb", "offset"),
    "piezo": ("stroke", "hysteresis", "resonance"),
    "wire": ("way", "start", "tau"),
}
SPEED, TRAVEL = 0.5, 1.0  # m/s, m: what a person allows
TURNING = math.radians(720.0), math.radians(400.0)  # rad/s, rad: of an axis that turns


class Drawn(NamedTuple):
    """Machines of a kind, drawn over ranges of data-sheet figures.

    Attributes
    ----------
    kind : Kind
        How they are commissioned.
    figures : Callable[[np.random.Generator], dict[str, Any]]
        Settings of one, by paths.
    truth : Callable[[Any, Commissioned], Mapping[str, float]]
        What is true of settings, by the names of the estimates; only the comparison reads it.
    number : int
        How many.
    seed : int
        Of the draws.
    """

    kind: Kind
    figures: Callable[[np.random.Generator], dict[str, Any]]
    truth: Callable[[Any, Commissioned], Mapping[str, float]]
    number: int
    seed: int


def settled(what: Drawn, random: np.random.Generator) -> Any:
    """Settings of a random machine that can work, by the rules that a file meets, too."""
    chosen = machine.named(what.kind.name, "kind")
    while True:
        try:
            return config.overridden(chosen.settings, what.figures(random), "a random machine")
        except InputError:
            continue


def commissioned(what: Drawn, tree: Any, seed: int) -> Commissioned:
    """One machine, commissioned; only what a person knows of it is said."""
    chosen = machine.named(what.kind.name, "kind")
    gains = tree.controller
    both = hasattr(gains, "limit")
    effort = tree.amplifier.full_scale if both else gains.high
    lowest = None if both else gains.low
    place = Place(
        f"a random {what.kind.name}",
        lambda seed: rig.CompiledTwin(chosen.kind, tree, seed),
        tree.timing.period,
        tree.encoder.pitch,
        effort,
        False,
        what.kind,
        lowest,
    )
    fast, far = TURNING if what.kind.place.turns else (SPEED, TRAVEL)
    options = Options(effort, fast, fast / 25.0, far, lowest=lowest)
    return commission(place, options, seed=seed)


def examples() -> str:
    """Every example machine commissioned, with no option but its file: a table in Markdown."""
    lines = ["| file | found | moves that arrived |", "|---|---|---|"]
    for path in sorted(EXAMPLES.glob("[!x]*.toml")):
        place = places.virtual(path)
        fast, far = TURNING if place.kind.place.turns else (SPEED, SPEED)
        options = Options(place.effort, fast, fast / 25.0, far, lowest=place.lowest)
        try:
            found = commission(place, options)
        except (CommissionError, InputError) as error:
            lines.append(f"| `{path.name}` | refused: {error} | |")
            continue
        estimates = place.kind.estimates(found.model)
        words = ", ".join(
            f"{name} {estimates[name].value:.4g} +- {estimates[name].half:.2g} "
            f"{estimates[name].unit}"
            for name in SHOWN[place.kind.name]
        )
        there = results.arrived(found.verified.moves)
        met = found.verified.fault or f"{there}/{found.verified.asked}"
        lines.append(f"| `{path.name}` | {words} | {met} |")
        print(lines[-1], flush=True)
    return "\n".join(lines) + "\n"


class Tried(NamedTuple):
    """What came of one random machine.

    Attributes
    ----------
    label : str
        Its kind and number.
    errors : dict[str, tuple[float, bool]]
        Of each parameter: the error as a share of the truth, and whether the interval holds it.
    refused, unmet : str
        Why it was refused, or not verified; empty where it was not.
    """

    label: str
    errors: dict[str, tuple[float, bool]]
    refused: str = ""
    unmet: str = ""


def compared(
    estimates: Mapping[str, Any], truth: Mapping[str, float]
) -> dict[str, tuple[float, bool]]:
    """Of each parameter: its error as a share of the truth, and whether the interval holds it."""
    found = {}
    for name, true in truth.items():
        off = abs(estimates[name].value - true)
        found[name] = off / abs(true), bool(off <= estimates[name].half)
    return found


class Case(NamedTuple):
    """A random machine.

    Attributes
    ----------
    label : str
        By which it is known again.
    commission : Callable[[], Tried]
        Commissions it and compares it with the truth.
    """

    label: str
    commission: Callable[[], Tried]


def cases(what: Drawn, number: int | None = None) -> Iterator[Case]:
    """So many random machines of a kind."""
    random = np.random.Generator(np.random.PCG64(what.seed))
    for k in range(what.number if number is None else number):
        tree, label = settled(what, random), f"{what.kind.name} {k}"
        yield Case(label, partial(one, what, tree, k, label))


def one(what: Drawn, tree: Any, seed: int, label: str) -> Tried:
    """One machine, commissioned and compared with the truth."""
    try:
        found = commissioned(what, tree, seed)
    except (CommissionError, InputError) as error:
        return Tried(label, {}, refused=str(error))
    errors = compared(what.kind.estimates(found.model), what.truth(tree, found))
    unmet = ""
    if not found.verified.met:
        there = results.arrived(found.verified.moves)
        unmet = found.verified.fault or f"{there} of {found.verified.asked} moves arrived"
    return Tried(label, errors, unmet=unmet)


def told(those: Sequence[Tried]) -> str:
    """What came of random machines of a kind: a table in Markdown."""
    done = [one for one in those if not one.refused]
    lines = ["| parameter | true value in the interval | median error |", "|---|---|---|"]
    for name in done[0].errors if done else ():
        inside = sum(one.errors[name][1] for one in done)
        off = np.median([one.errors[name][0] for one in done])
        lines.append(f"| {name} | {inside} of {len(done)} | {100.0 * off:.2g}% |")
    unmet = [(one.label, one.unmet) for one in done if one.unmet]
    refused = [(one.label, one.refused) for one in those if one.refused]
    met = len(done) - len(unmet)
    if done:
        share = f"{met} of {len(done)} ({met / len(done):.0%})"
        lines += ["", f"All moves of the verification arrived on {share}."]
    for title, named in (("Not verified", unmet), ("Refused", refused)):
        if named:
            lines += ["", f"{title}: {len(named)}.", *by_reason(named)]
    return "\n".join(lines) + "\n"


def by_reason(named: Sequence[tuple[str, str]]) -> list[str]:
    """A line for each reason, whatever its figures, with the numbers of the machines."""
    alike: dict[str, list[tuple[str, str]]] = {}
    for label, words in named:
        problem = words.partition(". ")[0]
        alike.setdefault(re.sub(r"[\d.]+", "#", problem), []).append((label, problem))
    lines = []
    for group in alike.values():
        numbers = ", ".join(label.rpartition(" ")[2] for label, _ in group)
        (first, problem), of_first = group[0], ""
        kind, _, number = first.rpartition(" ")
        if any(words != problem for _, words in group):
            of_first = f" (figures of {number})"
        lines.append(f"* {kind} {numbers}: {problem}{of_first}")
    return lines


def table(every: Iterator[Case], rows: Path | None = None) -> str:
    """A table in Markdown of machines that are tried one after the other.

    Each is added to the file of rows, if one is named; what is there is not tried again.
    """
    known = {}
    if rows is not None and rows.exists():
        for line in rows.read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            errors = {name: tuple(error) for name, error in row["errors"].items()}
            known[row["label"]] = Tried(row["label"], errors, row["refused"], row["unmet"])
    those = []
    for case in every:
        if case.label not in known:
            found = case.commission()
            print(found, flush=True)
            known[case.label] = found
            if rows is not None:
                with rows.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(found._asdict()) + "\n")
        those.append(known[case.label])
    return told(those)
