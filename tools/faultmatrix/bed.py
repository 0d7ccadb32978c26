"""A live machine under its real guard, in virtual time: the loop's period without its process."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import faulty
from faultmatrix.subjects import Made
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Finished
from macromicro.rig.session import Session
from macromicro.serve.persist import Restored
from macromicro.types import SAFE


class Home(NamedTuple):
    """Where a machine without a fault finds its place. `offset`, `others`: counts at coordinate 0;
    `zero`: true place there, m; `seconds` that it took."""

    offset: float = math.nan
    others: tuple[float, ...] = ()
    zero: float = 0.0
    seconds: float = 0.0


class Period(NamedTuple):
    """What one period has shown. Places in m of the homed frame; `outputs` at its end, V."""

    t: float
    true: float
    told: float
    half: float
    trusted: bool
    outputs: tuple[float, ...]


class Bed:
    """A machine that runs as fast as the computer can."""

    def __init__(self, made: Made, home: Home | None = None) -> None:
        self.cells = faulty.board(made.board)
        opened = made.open()
        self.machine = opened.machine
        self.dt = made.settings.period
        self.led = opened.guarded(Session(opened.rig, self.dt))
        self.led.__enter__()
        self.home = home or Home()
        known = Restored(True, self.home.offset, "known", self.home.others)
        restored = known if home is not None else Restored(False, math.nan, "not known")
        first = self.led.read()
        self.machine.begin(first, restored)
        self.searches = bool(getattr(self.machine, "searches", True))
        self.fault = ""
        self.died = ""
        self.ends: list[Finished] = []
        self.tick = 0
        if home is None and not self.searches:  # its sensor says where it is, wherever 0 is
            self.home = Home(zero=0.0)
        for _ in self.run(3 * self.dt):
            pass

    @property
    def now(self) -> float:
        """Time since the start, s."""
        return float(self.tick * self.dt)

    def ask(self, request: Any) -> Any:
        """A request, as the loop answers it."""
        if self.died:
            return m.Refused(self.died, "")
        if isinstance(request, m.ClearFault):
            self.led.renew()
            self.fault = ""
            request = request._replace(gone=True)
        reply, notices = self.machine.accept(request)
        self._note(notices)
        return reply

    def run(self, seconds: float) -> Iterator[Period]:
        """Periods, one after the other."""
        for _ in range(round(seconds / self.dt)):
            yield self._period()

    def until_end(self, seconds: float) -> Iterator[Period]:
        """Periods until the motion under way has ended."""
        for _ in range(round(seconds / self.dt)):
            if self.died or not self.machine.view().motion:
                return
            yield self._period()

    def inject(self, name: str) -> None:
        """A fault from the next period on."""
        faulty.inject(self.cells, name)

    def close(self) -> None:
        """Let go of the rig."""
        self.led.__exit__(None, None, None)

    def _period(self) -> Period:
        self.tick += 1
        true = math.nan
        if not self.died:
            try:
                true = self._worked()
            except Exception as error:  # the loop's process ends and makes the rig safe
                self.died = f"{type(error).__name__}: {error}"
                self.led.stop()
        view = self.machine.view()
        outputs = tuple(self.cells[[faulty.MOTOR, faulty.CTRL]].tolist())
        trusted = bool(view.trusted) and not self.died
        return Period(self.now, true, view.position, view.uncertainty, trusted, outputs)

    def _worked(self) -> float:
        led: Any = self.led
        machine = self.machine
        sample = led.read()
        true: float = float(self.cells[faulty.STAGE]) - self.home.zero
        command, outputs, notices = machine.step(sample, self.dt)
        driving = hasattr(led, "drive")
        if not driving:
            led.expect(command)
            led.write(SAFE if self.fault else outputs)
        if machine.found() is not None and not self.fault:
            self.fault = "lost counts"
        if led.tripped and not self.fault:
            trouble, blind = led.fault()
            self.fault = trouble.name
            notices += machine.fail(trouble.name, {}, blind)
        notices += machine.doubt(led.doubt)
        if self.fault and (why := led.overlooked()):
            notices += machine.lose(why)
        self._note(notices)
        if driving:
            led.drive(machine.courses)
        else:
            led.clock.wait(self.dt)
        return true

    def _note(self, notices: Any) -> None:
        self.ends += [each for each in notices if isinstance(each, Finished)]


def homed(made: Made) -> Home:
    """Where a machine without a fault finds its place, by homing where it homes."""
    bed = Bed(made)
    last = None
    bed.ask(m.Enable())
    if bed.searches:
        reply = bed.ask(m.Home())
        assert isinstance(reply, Accepted), reply
        last = [*bed.until_end(300.0)][-1]
        assert bed.ends[-1].outcome == m.DONE, bed.ends[-1]
    else:
        last = [*bed.run(0.1)][-1]
    views = getattr(bed.machine, "views", tuple)
    offset = bed.machine.view().offset
    others = tuple(each.offset for each in views()[1:])
    bed.close()
    return Home(offset, others, last.true - last.told if bed.searches else 0.0, last.t)
