"""Moves on the stage: they verify the gains, and compare those of the rules with a search's."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np

from macromicro.commission.procedure import Kind, Step, Tuned
from macromicro.commission.stand import Stand
from macromicro.machines import machine as machines
from macromicro.machines import planning, results, runs
from macromicro.machines.results import MoveResult
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.types import SAFE, Outputs, Sample


def test_moves(
    title: str, meaning: str, shares: Sequence[float], hold: float, settings: Any
) -> Programme:
    """A move to each position, in counts."""
    n = len(shares)
    return Programme(
        title,
        np.full(n, math.nan),
        np.zeros(n, np.int64),
        np.floor(np.array(shares) * settings.travel.high / settings.encoder.pitch),
        np.full(n, hold),
        math.nan,
        meaning,
    )


SHARES = (0.15, 0.85, 0.86, 0.4, 0.39, 0.9, 0.05)  # of the travel: long moves and short ones
HOLD = 0.3  # s
SEED = 7  # of the places, which differ a little from SHARES


class Verified(NamedTuple):
    recording: Recording  # of the run
    moves: list[MoveResult]  # those that began
    asked: int  # number of moves
    fault: str  # of the guard; "" for none

    @property
    def met(self) -> bool:
        return not self.fault and results.count_arrived(self.moves) == self.asked


class Shifted:
    """A rig with its zeros at the present position, a positive effort counting up."""

    def __init__(self, stand: Stand) -> None:
        self._rig, self._sign, self._check = stand.rig, stand.sign, stand.check
        self._facing = stand.facing
        self._zero = stand.zero + round(self._facing * stand.position() / stand.pitch)
        self._reference = float(stand.rig.read().laser)
        self.channels = tuple(c for c in stand.rig.channels if c in ("encoder", "laser"))
        self.clock = stand.rig.clock

    def read(self) -> Sample:
        sample: Sample = self._rig.read()
        return sample._replace(
            encoder=self._facing * (sample.encoder - self._zero),
            laser=self._facing * (sample.laser - self._reference),
        )

    def write(self, outputs: Outputs) -> None:
        self._check()
        self._rig.write(SAFE._replace(motor=self._sign * outputs.motor))

    def stop(self) -> None:
        self._rig.stop()

    def __enter__(self) -> Self:
        self._rig.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._rig.__exit__(kind, error, trace)


def programme(settings: Any) -> Programme:
    """Test moves within this machine's travel, in counts."""
    random = np.random.Generator(np.random.PCG64(SEED))
    shares = np.array(SHARES) + random.uniform(-0.004, 0.004, len(SHARES))
    meaning = "the moves that verify a commissioning"
    return test_moves("verification", meaning, shares.tolist(), HOLD, settings)


def verify(on: Shifted, machine: machines.Machine, settings: Any) -> Verified:
    return verify_moves(on, machine, settings, programme(settings))


def verify_moves(
    on: Shifted, machine: machines.Machine, settings: Any, what: Programme
) -> Verified:
    """Run any moves from the present position."""
    done = runs.record(machine, settings, what, on=on, warn=False)
    plan = planning.plan(what, settings)
    found = results.moves(done.recording, plan, settings.arrival, machine.kind.place)
    fault = done.outcome.fault
    words = "" if fault is None else f"{fault.message} {fault.evidence}"
    return Verified(done.recording, found, len(plan.target), words)


# A search uses models, which hardly know how friction fades with speed, so it may be slower on the
# stage.

# Of the travel: neither those of the rehearsal, on which gains are searched, nor those that verify.
COMPARED_SHARES = (0.2, 0.75, 0.77, 0.5, 0.48, 0.12, 0.8, 0.25)
COMPARED_HOLD = 0.1  # s
BETTER = 0.95  # of what it takes by the rules: no less is worth other gains


class Compared(NamedTuple):
    # rules, search: as `settling` gives it, s
    rules: float
    search: float
    faults: tuple[str, ...]  # of a guard with the rules' and the search's gains; "" for none
    gains: tuple[str, ...]  # the search's: path and value, one after the other


# Kept as the steps of a kind are; `running` says and does what depends on the gains.
STEP = Step("comparison", "both gains on the stage", lambda _: "", lambda _: None, Compared)


def kept_steps(kind: Kind) -> tuple[Step, ...]:
    """Results of a kind that are saved, in order."""
    return tuple(kind.steps) if kind.compare is None else (*kind.steps, STEP)


def is_better(after: float, before: float) -> bool:
    """Whether other gains are worth the change."""
    return after < math.inf and after <= BETTER * before


def settling(stand: Stand, machine: machines.Machine, settings: Any) -> tuple[float, str]:
    """Settling time after the end of a profile."""
    what = test_moves(
        "comparison", "moves by two sets of gains", COMPARED_SHARES, COMPARED_HOLD, settings
    )
    done = verify_moves(Shifted(stand), machine, settings, what)
    if not done.met:
        return math.inf, done.fault
    return max(0.0, float(np.mean(results.settling(done.moves)))), ""


def gain_columns(tuned: Tuned) -> tuple[str, ...]:
    """Gains that identify a comparison."""
    return tuple(word for pair in tuned.gains.items() for word in pair)


def compare(tried: Callable[[Tuned], tuple[float, str]], tuned: Tuned) -> Compared:
    """Try both gains, the rules' first, which are safe."""
    rules, fault_rules = tried(Tuned())
    search, fault_search = tried(tuned)
    return Compared(rules, search, (fault_rules, fault_search), gain_columns(tuned))


def faster(found: Compared, tuned: Tuned) -> Tuned:
    before, after = found.rules, found.search
    doubts = tuple(
        f"With the gains of the {name}, a guard stopped the comparison: {fault}"
        for name, fault in zip(("rules", "search"), found.faults, strict=True)
        if fault
    )
    what, unit = "settling on the stage", "ms"
    by_search, by_rules = f"{1e3 * after:.4g}", f"{1e3 * before:.4g}"
    if is_better(after, before):
        row = (what, by_search, f"{by_rules} {unit} by the rules", unit)
        return tuned._replace(rows=(row, *tuned.rows), doubts=(*tuned.doubts, *doubts))
    row = (what, by_rules, f"{by_search} {unit} by the search, whose gains are rejected", unit)
    return Tuned(rows=(row,), doubts=(*tuned.doubts, *doubts))
