"""One cell of the matrix: a kind, a fault, a mode; what came of it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import faulty
from faultmatrix.bed import Bed, Home, Period
from faultmatrix.bounds import Bounds, bounds, leading
from faultmatrix.judge import Judge
from faultmatrix.reasons import ABSOLUTE, REASONS
from faultmatrix.subjects import Made
from macromicro.control.live import messages as m

MODES = ("disabled", "holding", "homing", "jogging", "moving", "programme")
SAFE_, HARMLESS, UNSEEN, UNSAFE, FALSE = (
    "safe",
    "harmless",
    "not visible",
    "UNSAFE",
    "FALSELY TRUSTED",
)
BAD = (UNSAFE, FALSE)
# s that a motion with a fault may last beyond one and a half times its time without one
LONGEST, HOMING = 10.0, 20.0
_AFTER, _CALM = 2.5, 0.3  # s that are looked at behind a motion, with a push and without
_CLEAR = 5.0  # s behind the fault that are looked at where the verdict is clear
_HEALING = 60.0  # s that a homing without the fault may last
_REST = {"disabled": 1.0, "holding": 2.5}
MICRO = ("hall", "laser", "wire", "fan")  # what faults of the stage on the carriage begin with


class Cell(NamedTuple):
    """`verdict`: one of the above; `what` stopped it, or why; `seconds`: outputs off for good, NaN
    while on; `share`: greatest true speed by that of its moves; `effort` at the end, V."""

    kind: str
    fault: str
    mode: str
    verdict: str
    what: str
    seconds: float = math.nan
    share: float = 0.0
    effort: float = 0.0
    trusted: bool = False

    @property
    def words(self) -> str:
        """For the table."""
        if self.verdict == HARMLESS:
            return HARMLESS
        after = "" if math.isnan(self.seconds) else f" in {self.seconds:.3g} s"
        return f"{self.verdict}: {self.what}{after}"


class Plan(NamedTuple):
    """How a kind is moved and judged. `low`, `high` [m]: ends of its moves; `jog` [m/s]; `axis`:
    stage of a jog; `seconds`: of a move, homing and programme without a fault."""

    made: Made
    home: Home
    low: float
    high: float
    jog: float
    stage: str
    bounds: Bounds
    programme: Any
    absolute: bool
    faults: tuple[str, ...]
    show: tuple[float, str]  # what a distance is multiplied with, and its unit

    def move(self, share: float) -> Any:
        """To a share of its travel."""
        place = self.low + share * (self.high - self.low)
        if self.made.settings.axes:
            return m.MoveAxis("x", place)
        return m.MoveTo(place)


def planned(made: Made, home: Home) -> Plan:
    """A kind's moves and bounds, from its settings."""
    settings, programmes = made.settings, made.settings.programmes
    programme = programmes.named(programmes.names()[0], settings.live.limits).plan
    bed = Bed(made, home)
    bed.close()
    found, jogging = leading(settings), settings.live.jogging.macro
    stage, show = "macro", (1e3, "mm")
    if found is None:
        low, high, jog = 0.02, 0.18, jogging * settings.live.pitch
    else:
        travel = found[1].travel
        span = travel.high - travel.low
        low, high, jog = travel.low + 0.05 * span, travel.high - 0.05 * span, 0.1 * span
        jog = min(jogging, jog)
        if span < 1e-3:
            show = (1e6, "um")
    if settings.live.turns:
        show = (math.degrees(1.0), "deg")
    if settings.axes:
        stage = "x"
    judged = bounds(settings)
    return Plan(
        made, home, low, high, jog, stage, judged, programme, not bed.searches, made.faults(), show
    )


class Trial:
    """One fault in one mode, at one moment."""

    def __init__(self, plan: Plan, fault: str, mode: str, share: float, whole: float) -> None:
        self.plan, self.fault, self.mode = plan, fault, mode
        self.share, self.whole = share, whole
        self.longest = (HOMING if mode == "homing" else LONGEST) + 1.5 * whole
        self.bed = Bed(plan.made, None if mode == "homing" and not plan.absolute else plan.home)
        self.bed.home = plan.home

    def run(self) -> Cell:
        """The cell."""
        bed, mode = self.bed, self.mode
        self._begin()
        self._skip(self.share * self.whole)
        bed.inject(self.fault)
        allowed = self.plan.bounds
        if mode == "homing":
            allowed = allowed._replace(resolution=allowed.resolution + allowed.repeat)
        if faulty.FAULTS[self.fault].dither:  # the sensor itself is a count off
            allowed = allowed._replace(resolution=2.0 * allowed.resolution)
        self.judge = judge = Judge(allowed, bed.now)
        ends = len(bed.ends)
        if mode in _REST:
            self._see(bed.run(_REST[mode]))
        elif mode == "jogging":
            self._see(bed.until_end(3.0))
        else:
            self._see(bed.until_end(self.longest))
        if not self._decided and not bed.died and bed.machine.view().motion:
            if mode != "jogging":
                judge.unsafe.append(f"no end in {self.longest:.0f} s")
            bed.ask(m.Stop())
            self._see(bed.until_end(10.0))
        self._after()
        what = self._what(ends)
        off = math.nan if mode == "disabled" else judge.off
        reason = self._reason()
        if reason is not None and reason.drifts and mode in reason.modes:
            judge.forget()
        effort, trusted = judge.effort, bool(bed.machine.view().trusted)
        later = "" if self._decided or bed.died or not trusted else self._again()
        healed = self._decided or self._healed()
        bed.close()
        verdict, what = self._verdict(what, later, healed)
        if verdict != SAFE_:
            off = math.nan
        share = judge.fastest / self.plan.bounds.fastest
        return Cell(
            self.plan.made.name, self.fault, mode, verdict, what, off, share, effort, trusted
        )

    def _begin(self) -> None:
        """Into the mode, without a fault."""
        bed, plan, mode = self.bed, self.plan, self.mode
        if mode == "homing":
            bed.ask(m.Enable())
            bed.ask(m.Home())
            return
        bed.ask(m.Enable())
        self._skip(0.05)
        bed.ask(plan.move(0.3))
        for _ in bed.until_end(self.longest):
            pass
        self._skip(0.1)
        if mode == "disabled":
            bed.ask(m.Disable())
            self._skip(0.3)
        elif mode == "jogging":
            bed.ask(m.Jog(plan.stage, plan.jog))
        elif mode == "moving":
            bed.ask(plan.move(0.8))
        elif mode == "programme":
            bed.ask(m.Programme(plan.programme))

    def _skip(self, seconds: float) -> None:
        for _ in self.bed.run(seconds):
            pass

    def _see(self, periods: Iterable[Period]) -> None:
        for each in periods:
            self.judge.see(each)
            if self._decided and (not self.judge.effort or each.t > self.judge.onset + _CLEAR):
                return

    def _after(self) -> None:
        """What is to be seen behind a motion: as long as it pushes, or shortly."""
        self._see(self.bed.run(_CALM))
        for _ in range(round(_AFTER / _CALM)):
            if not self._decided and self.judge.pushes:
                self._see(self.bed.run(_CALM))

    @property
    def _decided(self) -> bool:
        """Is the verdict clear, whatever comes?"""
        judge = self.judge
        return bool(judge.unsafe or (judge.false and self.fault != "encoder-skipping"))

    def _what(self, ends: int) -> str:
        """What has stopped it; "" for nothing."""
        bed = self.bed
        if bed.died:
            return f"the loop ends ({bed.died[:40]})"
        if bed.fault:
            return bed.fault
        for end in bed.ends[ends:]:
            if end.outcome not in (m.DONE, m.STOPPED_BY_REQUEST):
                reason = dict(end.evidence).get("reason", "")
                return f"{end.outcome}{f', {reason}' if reason else ''}"
        if self.mode != "homing" and not bed.machine.view().trusted:
            return "position not trusted"
        return ""

    def _again(self) -> str:
        """The next move, where the position is trusted: what stops it, "" where it is done."""
        bed = self.bed
        ends = len(bed.ends)
        if bed.fault:
            bed.ask(m.ClearFault())
            self._see(bed.run(0.05))
        bed.ask(m.Enable())
        self._see(bed.run(0.05))
        if what := self._what(ends):
            return what
        reply = bed.ask(self.plan.move(0.5))
        if isinstance(reply, m.Refused):
            return f"refused, {reply.reason}"
        self._see(bed.until_end(self.longest))
        self._after()
        return self._what(ends)

    def _healed(self) -> bool:
        """Is the position right behind a homing without the fault?"""
        reason = self._reason()
        if reason is None or reason.check != "homed" or self.plan.absolute or not self.judge.false:
            return True
        bed = self.bed
        bed.inject(faulty.NONE)
        bed.ask(m.ClearFault())
        self._skip(0.05)
        bed.ask(m.Enable())
        self._skip(0.05)
        bed.ask(m.Home())
        for _ in bed.until_end(_HEALING):
            pass
        last = next(iter(bed.run(bed.dt)))
        return (
            last.trusted
            and abs(last.told - last.true)
            <= last.half + self.plan.bounds.resolution + self.plan.bounds.repeat
        )

    def _reason(self) -> Any:
        if self.fault in ("encoder-skipping", "encoder-reversed") and self.plan.absolute:
            return ABSOLUTE
        found = REASONS.get(self.fault)
        if found is not None and "holding" in found.modes and self._waits:
            return found._replace(modes=(*found.modes, "homing"))
        return found

    @property
    def _waits(self) -> bool:
        """Does the axis with the fault rest while the other one still homes?"""
        return bool(self.plan.made.settings.axes)

    def _verdict(self, what: str, later: str, healed: bool) -> tuple[str, str]:
        judge, reason = self.judge, self._reason()
        unseen = reason is not None and self.mode in reason.modes
        found = (HARMLESS, "")
        if judge.unsafe:
            found = UNSAFE, "; ".join([*judge.unsafe, *([what] if what else [])])
        elif judge.false and unseen and reason.check != "moved" and healed:
            found = UNSEEN, reason.words
        elif judge.false:
            scale, unit = self.plan.show
            seen = f" ({what or later})" if what or later else ""
            found = FALSE, f"{judge.false * scale:.3g} {unit} off{seen}"
        elif what:
            found = SAFE_, what
        elif later and unseen:
            found = UNSEEN, f"{reason.words}, then {later}"
        elif later and self.mode == "disabled":  # outputs are off, the position right until then
            found = SAFE_, f"{later}, when next moved"
        elif later:
            found = UNSAFE, f"not seen before the next move: {later}"
        return found


RANK = (UNSAFE, FALSE, UNSEEN, SAFE_, HARMLESS)


def worst(cells: Iterable[Cell]) -> Cell:
    """The one that matters of the same fault and mode at several moments."""
    return min(cells, key=lambda cell: (RANK.index(cell.verdict), -(cell.seconds or 0.0)))


def healthy(plan: Plan, mode: str) -> float:
    """How long a motion of this mode takes without a fault, s; it must end well."""
    if mode in _REST or (mode == "homing" and plan.absolute):
        return 0.0
    if mode == "homing":
        return plan.home.seconds
    if mode == "jogging":
        return 1.0
    trial = Trial(plan, faulty.NONE, mode, 0.0, 0.0)
    trial._begin()
    began = trial.bed.now
    for _ in trial.bed.until_end(300.0):
        pass
    seconds = trial.bed.now - began
    ended = trial.bed.ends[-1].outcome if trial.bed.ends else "no end"
    trial.bed.close()
    assert ended == m.DONE, (plan.made.name, mode, ended)
    return seconds
