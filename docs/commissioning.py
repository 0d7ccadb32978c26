"""Random machines commissioned, and what was found beside the truth: what the scripts share."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import measured_page
import numpy as np

from macromicro.commission.procedure import Kind, Options
from macromicro.commission.running import Commissioned, Place, commission
from macromicro.errors import InputError
from macromicro.machines import machine, results, rig
from macromicro.schema import config

SPEED, TRAVEL = 0.5, 1.0  # m/s, m: what a person allows
TURNING = math.radians(720.0), math.radians(400.0)  # rad/s, rad: of an axis that turns

Tried = dict[str, Any]  # what came of one: `errors`, why it was `refused`, or not verified: `unmet`


class Machines(NamedTuple):
    """Random machines of a kind: how many are published and of which seed, how as many are drawn as
    one likes, and what comes of one that is commissioned."""

    label: str
    number: int
    seed: int
    drawn: Callable[[np.random.Generator, int], Iterator[Any]]
    tried: Callable[[Any, int], Tried]


def of_figures(
    kind: Kind,
    figures: Callable[[np.random.Generator], dict[str, Any]],
    truth: Callable[[Any, Commissioned], Mapping[str, float]],
    number: int,
    seed: int,
) -> Machines:
    """Machines of a kind, drawn over ranges of data-sheet figures: settings by their paths.

    Only the comparison reads the truth, which has the names of the estimates.
    """
    return Machines(
        kind.name, number, seed, partial(_settled, kind, figures), partial(_tried, kind, truth)
    )


def between(random: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(random.uniform(math.log(low), math.log(high))))


def _settled(
    kind: Kind,
    figures: Callable[[np.random.Generator], dict[str, Any]],
    random: np.random.Generator,
    number: int,
) -> Iterator[Any]:
    """Settings of machines that can work, by the rules that a file meets, too."""
    first = machine.named(kind.name, "kind").settings
    found = 0
    while found < number:
        try:
            yield config.overridden(first, figures(random), "a random machine")
        except InputError:
            continue
        found += 1


def _commissioned(kind: Kind, tree: Any, seed: int) -> Commissioned:
    """One machine, commissioned; only what a person knows of it is said."""
    chosen = machine.named(kind.name, "kind")
    gains = tree.controller
    both = hasattr(gains, "limit")
    effort = tree.amplifier.full_scale if both else gains.high
    lowest = None if both else gains.low
    place = Place(
        f"a random {kind.name}",
        lambda seed: rig.CompiledTwin(chosen.kind, tree, seed),
        tree.timing.period,
        tree.encoder.pitch,
        effort,
        False,
        kind,
        lowest,
    )
    fast, far = TURNING if kind.place.turns else (SPEED, TRAVEL)
    options = Options(effort, fast, fast / 25.0, far, lowest=lowest)
    return commission(place, options, seed=seed)


def _tried(
    kind: Kind,
    truth: Callable[[Any, Commissioned], Mapping[str, float]],
    tree: Any,
    seed: int,
) -> Tried:
    """One machine, commissioned and compared with the truth."""
    found = _commissioned(kind, tree, seed)
    unmet = ""
    if not found.verified.met:
        there = results.count_arrived(found.verified.moves)
        unmet = found.verified.fault or f"{there} of {found.verified.asked} moves arrived"
    errors = compared(kind.estimates(found.model), truth(tree, found))
    return {"errors": errors, "unmet": unmet}


def compared(
    estimates: Mapping[str, Any], truth: Mapping[str, float]
) -> dict[str, tuple[float, bool]]:
    """Of each parameter: its error as a share of the truth, and whether the interval holds it."""
    found = {}
    for name, true in truth.items():
        off = abs(estimates[name].value - true)
        found[name] = off / abs(true), bool(off <= estimates[name].half)
    return found


def summarise(those: Sequence[Tried]) -> str:
    """What came of random machines of a kind: a table in Markdown."""
    done = [one for one in those if not one["refused"]]
    lines = []
    for name in done[0]["errors"] if done else ():
        inside = sum(one["errors"][name][1] for one in done)
        off = np.median([one["errors"][name][0] for one in done])
        lines.append([name, f"{inside} of {len(done)}", f"{100.0 * off:.2g}%"])
    table = measured_page.table(["parameter", "true value in the interval", "median error"], lines)
    unmet = [(one["label"], one["unmet"]) for one in done if one["unmet"]]
    refused = [(one["label"], one["refused"]) for one in those if one["refused"]]
    met = len(done) - len(unmet)
    words = []
    if done:
        share = f"{met} of {len(done)} ({met / len(done):.0%})"
        words += ["", f"All moves of the verification arrived on {share}."]
    for title, named in (("Not verified", unmet), ("Refused", refused)):
        if named:
            words += ["", f"{title}: {len(named)}.", *by_reason(named)]
    return table + "".join(f"{line}\n" for line in words)


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
