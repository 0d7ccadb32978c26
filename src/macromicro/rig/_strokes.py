"""Measurements of a first power-up: a rig driven, or pushed by hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from macromicro.rig.cards._wiring import ROLES
from macromicro.rig.session import Fixture, Session

LIMITS = ("limit_low", "limit_high")
HAND = 20.0  # s that a person has
ENOUGH = 200.0  # counts by hand
BREAK = 20.0  # counts that it has broken away by
RISE = 1.0  # V/s
STILL = 0.3  # s without a count are a stop
LONGEST = 20.0  # s on the way to an end


class Seen(NamedTuple):
    t: float  # s
    place: float  # counts; the one before where the encoder gave none
    hall: float  # V, so too
    tripped: tuple[str, ...]  # of `LIMITS`, by name


def safe(fixture: Fixture) -> Any:
    written = ROLES[fixture.kind].written
    return written(*[0.0] * len(written._fields))


class Driven:
    """A rig under a voltage that a step decides on."""

    def __init__(self, fixture: Fixture, rig: Session) -> None:
        self.fixture, self.rig, self.quiet = fixture, rig, safe(fixture)
        self.last = Seen(0.0, math.nan, math.nan, ())
        self.look()

    def look(self) -> Seen:
        sample, last = self.rig.read(), self.last
        lines = [n for n in LIMITS if n in self.fixture.channels]
        self.last = Seen(
            float(sample.t),
            _keep_known(getattr(sample, "encoder", math.nan), last.place),
            _keep_known(getattr(sample, "hall", math.nan), last.hall),
            tuple(n for n in lines if getattr(sample, n) != 0.0),
        )
        return self.last

    def run(
        self,
        outputs: Callable[[float], dict[str, float]],
        until: Callable[[Seen], bool],
        longest: float,
    ) -> list[Seen]:
        """Run until a condition holds; then all outputs are safe."""
        seen = [self.look()]
        try:
            for k in range(round(longest / self.fixture.dt)):
                given: Any = self.quiet._replace(**outputs(k * self.fixture.dt))
                self.rig.write(given)
                self.rig.wait(self.fixture.dt)
                seen.append(self.look())
                if until(seen[-1]):
                    break
        finally:
            self.rig.stop()  # and a board that a limit switch has stopped may drive again
        return seen

    def rest(self, seconds: float) -> list[Seen]:
        """Readings with safe outputs."""
        return self.run(lambda t: {}, lambda seen: False, seconds)


def breakaway(driven: Driven, sign: float, most: float) -> tuple[float, float]:
    """Increase the motor voltage until the stage moves; distances in counts."""
    first = driven.last
    seen = driven.run(
        lambda t: {"motor": sign * min(RISE * t, most)},
        lambda s: abs(s.place - first.place) >= BREAK or bool(set(s.tripped) - set(first.tripped)),
        most / RISE + 0.2,
    )
    volts = min(RISE * driven.fixture.dt * (len(seen) - 2), most)
    return sign * volts, seen[-1].place - first.place


class Standing:
    """For how long the stage has stood."""

    def __init__(self, first: Seen) -> None:
        self.moved = first  # the first reading with the present count

    def seconds(self, s: Seen) -> float:
        if s.place != self.moved.place:
            self.moved = s
        return s.t - self.moved.t


def to_end(driven: Driven, volts: float) -> Seen | None:
    """Drive until a limit switch trips or the stage stands."""
    first, standing = driven.last, Standing(driven.last)

    def over(s: Seen) -> bool:
        stands = standing.seconds(s) >= STILL
        return stands or bool(set(s.tripped) - set(first.tripped))

    last = driven.run(lambda t: {"motor": volts}, over, LONGEST)[-1]
    return last if over(last) else None


def to_place(driven: Driven, volts: float, place: float) -> None:
    """Drive back to a place (counts) until it is passed or the stage stands."""
    first, standing = driven.last, Standing(driven.last)

    def over(s: Seen) -> bool:
        passed = (s.place - place) * (first.place - place) <= 0.0
        return standing.seconds(s) >= STILL or passed

    driven.run(lambda t: {"motor": volts}, over, LONGEST)


def _keep_known(value: float, before: float) -> float:
    return before if math.isnan(value) else float(value)
