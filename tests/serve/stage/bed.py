"""A served machine of one stage, without a server: the loop's own parts."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Finished
from macromicro.machines.rig import Twin
from macromicro.rig.session import Session
from macromicro.serve import settings
from macromicro.serve.persist import Restored
from macromicro.serve.shared import LINES
from macromicro.serve.stage import opening
from macromicro.serve.stage import rig as stage_rig


class Bed:
    """The loop's own parts, without its process; real: the stage is a rig of a user's."""

    def __init__(self, file: Path, seed: int = 0, *, real: bool = False) -> None:
        found = settings.load(file)
        assert found is not None
        self.tree, self.pitch, self.period = found.tree, found.live.pitch, found.period
        self.twin = Twin(found.machine.kind, found.tree, seed)
        self.rig: Any = opening.simulate(found, seed)
        if real:
            self.rig = stage_rig.Real(found.machine, found.tree, (self.twin,))
        self.machine: Any = opening.live(found, self.rig)
        self.led = stage_rig.Guarded(Session(self.rig, self.period), self.rig)
        self.led.__enter__()
        self.machine.begin(self.led.read(), Restored(False, math.nan, "no"))
        self.notices: list[Any] = []
        self.fault: Any = None
        self.rows: list[tuple[float, ...]] = []
        self.run(2)

    def run(self, periods: int) -> None:
        for _ in range(periods):
            sample = self.led.read()
            self.rows.append(self.led.lines())
            notices = self.machine.step(sample, self.period)[2]
            self.notices += notices
            if self.led.tripped and self.fault is None:
                self.fault, blind = self.led.fault()
                words = {"evidence": self.fault.evidence}
                self.notices += self.machine.fail(self.fault.name, words, blind)
            self.led.drive(self.machine.courses)

    def ask(self, request: Any) -> Any:
        reply, notices = self.machine.accept(request)
        self.notices += notices
        return reply

    def end(self, request: Any) -> Finished:
        reply = self.ask(request)
        assert isinstance(reply, Accepted), reply
        for _ in range(60_000):
            self.run(1)
            ends = [n for n in self.notices if isinstance(n, Finished) and n.id == reply.id]
            if ends:
                return ends[0]
        raise AssertionError(reply)

    def clear(self) -> None:
        self.led.renew()
        self.fault = None
        assert isinstance(self.ask(m.ClearFault(gone=True)), Accepted)

    def line(self, name: str) -> float:
        return self.led.lines()[LINES.index(name)]

    @property
    def place(self) -> float:
        return float(self.rig._states[0].axis.x)
