"""Two simulated axes under the live machine, without a server."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from macromicro.control.live import messages as m
from macromicro.machines.rig import CompiledTwin
from macromicro.serve import settings
from macromicro.serve.persist import Restored
from macromicro.serve.stage import opening
from macromicro.serve.stage.rig import Real

PLOTTER = Path(__file__).parents[3] / "examples" / "machines" / "xy-plotter.toml"


class Bed:
    """A machine of two axes; known: it stands at 0, 0 and knows it; real: its axes are rigs,
    each made by `twin`."""

    def __init__(
        self,
        file: Path = PLOTTER,
        *,
        known: bool = True,
        real: bool = False,
        twin: Any = CompiledTwin,
    ) -> None:
        found = settings.load(file)
        assert found is not None
        self.settings, self.tree = found, found.tree
        self.twins = [
            twin(axis.kind, own, k)
            for k, ((_, axis), own) in enumerate(
                zip(found.machine.stages, found.machine.trees(found.tree), strict=True)
            )
        ]
        self.rig: Any = (
            Real(found.machine, found.tree, self.twins) if real else opening.simulate(found, 0)
        )
        self.pair: Any = opening.live(found, self.rig)
        offset = 0.0 if known else math.nan
        others = (offset,) * (len(self.twins) - 1)
        self.pair.begin(self.rig.read(), Restored(known, offset, "known", others))
        self.notices: list[Any] = []
        self.places: list[tuple[float, ...]] = []
        self.aims: list[tuple[float, ...]] = []
        self.run(2)
        assert self.ask(m.Enable()) == m.Accepted(0)
        self.run(2)

    def run(self, periods: int, *, to_end: bool = False) -> int:
        """So many periods, or to the end of the motion; how many it were."""
        for k in range(periods):
            if to_end and self.pair.view().motion == 0:
                return k
            seen = self.rig.read()
            self.notices += self.pair.step(seen, self.settings.period)[2]
            self.aims.append(tuple(course.aim.position for course in self.pair.courses))
            self.places.append(self.place)
            self.rig.drive(self.pair.courses)
            if self.rig.control.tripped:
                return k
        return periods

    @property
    def place(self) -> tuple[float, ...]:
        """By the encoders' counts, m."""
        return tuple(led.state.seen.position for led in self.pair._leds)

    @property
    def mode(self) -> str:
        return m.MODES[int(self.pair.view().mode)]

    def ask(self, request: Any) -> m.Reply:
        reply, notices = self.pair.accept(request)
        self.notices += notices
        return reply

    def done(self, request: Any, periods: int = 60000) -> m.Finished:
        """A motion, and how it ends."""
        reply = self.ask(request)
        assert isinstance(reply, m.Accepted), reply
        self.run(periods, to_end=True)
        ends = [n for n in self.notices if isinstance(n, m.Finished) and n.id == reply.id]
        assert len(ends) == 1, (ends, self.mode)
        return ends[0]
