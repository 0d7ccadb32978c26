"""What a laboratory procedure of the thesis consists of, and the lab it runs in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.files import DEFAULT
from macromicro.errors import InputError
from macromicro.settings import Settings
from macromicro.thesis.claims import Claim

if TYPE_CHECKING:
    from macromicro.rig.session import Fixture
    from macromicro.runs.machine import CycleBed, Machine, Oven
    from macromicro.runs.programmed import Runner


class Needs(Protocol):
    """What `Lab.check` looks at: a procedure's name and channels, as in `Procedure`."""

    @property
    def name(self) -> str:
        """The procedure's."""

    @property
    def channels(self) -> tuple[str, ...]:
        """What it needs of the rigs."""


class Lab(NamedTuple):
    """Where procedures run: the virtual benches of `settings`, noise from `seed`; or `rigs`, if
    there are any, and then nothing virtual. `figures`: formats of the files of their figures."""

    settings: Settings = Settings()
    seed: int = 0
    rigs: tuple[Fixture, ...] = ()
    figures: tuple[str, ...] = DEFAULT

    def bench(self) -> Machine:
        """The two-stage bench."""
        from macromicro.plant import bench

        if not self.rigs:
            return bench.prepare(self.settings.bench, self.settings.sensors)
        rig = self.rig("bench")
        return rig._replace(limits=rig.limits or self.settings.guard)

    def kiln(self) -> Oven:
        """The kiln of Section 5.2.1, with the bench's actuator in it."""
        from macromicro.plant import kiln

        return self.rig("kiln") if self.rigs else kiln.prepare(kiln.beside(self.settings.bench))

    def cycle(self) -> CycleBed:
        """The cycle bench of Appendix D, with the bench's actuator on it."""
        from macromicro.plant import cycle

        return self.rig("cycle") if self.rigs else cycle.prepare(cycle.beside(self.settings.bench))

    def runner(self) -> Runner:
        """What runs programmes on the two-stage bench."""
        from macromicro.runs.programmed import on_rig, on_twin

        return on_rig(self.rig("bench")) if self.rigs else on_twin

    def rig(self, kind: str) -> Fixture:
        """The first rig of a kind; InputError if there is none."""
        found = next((r for r in self.rigs if r.kind == kind), None)
        if found is None:
            there = ", ".join(f"{r.name} (a {r.kind})" for r in self.rigs)
            accepted = f"a {kind} among the rigs, by one more --rig, or the twin alone"
            raise InputError(f"no {kind} among the rigs", there, accepted)
        return found

    def check(self, procedure: Needs) -> None:
        """InputError unless the rigs measure what `procedure` needs."""
        if not self.rigs:
            return
        for kind, channels in needed(procedure.channels).items():
            self.rig(kind).need(f"the procedure {procedure.name}", *channels)


def needed(channels: tuple[str, ...]) -> dict[str, list[str]]:
    """A procedure's channels by the kind of rig: "kiln.encoder" is the kiln's, "laser" and
    whatever else has no dot the bench's."""
    found: dict[str, list[str]] = {}
    for name in channels:
        kind, dot, channel = name.partition(".")
        found.setdefault(kind if dot else "bench", []).append(channel if dot else name)
    return found


class Procedure(NamedTuple):
    """One laboratory procedure.

    `sections`: of the thesis; `channels`: what rigs must measure for it, fields of `Sample`
    for the bench, "kiln.encoder" and the like for another kind of rig, none for arithmetic;
    `ids`: the claims that it measures; `figures`: numbers of the figures and tables that
    `draw` yields; `diagrams`: numbers of the diagrams that belong to it; `seconds`: roughly
    how long it takes, for the order of work and the progress bar.

    `collect` gives recordings, `claims` and `draw` take what it gave. `arithmetic` gives those
    of its claims that take no recording, for where `collect` fails.
    """

    name: str
    title: str
    sections: tuple[str, ...]
    channels: tuple[str, ...]
    ids: tuple[str, ...]
    figures: tuple[str, ...]
    diagrams: tuple[str, ...]
    seconds: float
    collect: Callable[[Lab], Any]
    claims: Callable[[Any], list[Claim]]
    draw: Callable[[Any], Iterator[Drawn]]
    arithmetic: Callable[[], list[Claim]] | None = None
