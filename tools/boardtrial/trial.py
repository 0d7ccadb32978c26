"""Rounds of random orders and injuries before a simulated board, and what is made of its faults."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from boardsim.bench import SWITCHES, Bench
from boardtrial.judge import DEEPEST, TOLD, Judge
from boardtrial.line import Host, Line
from macromicro.control import calibration
from macromicro.rig import codes
from macromicro.rig.board import control, framing
from macromicro.rig.board.protocol import SPEC
from macromicro.rig.limits import Limits

FAULTS = SPEC["faults"]
# Less than the full scale, so that there is something beyond.
LIMITS = Limits()._replace(motor=4.5, ctrl=2.5)
_TRUSTED = 1 << SPEC["state"]["trusted"]
_DRIVING = 1 << SPEC["state"]["driving"]

NAMES = {number: name.lower() for name, number in vars(codes).items() if name.isupper()} | {
    number: name for name, number in FAULTS.items()
}
# What may have led to a fault: an injury, or what has happened since the board began to drive.
CAUSES: dict[int, set[str]] = {
    codes.ILLEGAL: {"illegal", "targets"},
    codes.MACRO_LOST: {"encoder", "stood", "targets"},
    codes.MICRO_LOST: {"hall", "targets"},
    codes.HALL_SILENT: {"hall"},
    codes.HALL_FROZEN: {"hall"},
    codes.HALL_RANGE: {"hall"},
    codes.HALL_NOISY: {"hall"},
    codes.STUCK: {"encoder", "stood"},
    codes.TOO_HOT: {"heated"},
    codes.NO_MOTION: {"hall", "heated"},
    codes.ENCODER_JUMP: {"encoder"},
    codes.ENCODER_AGAINST: {"encoder", "braked"},
    FAULTS["limit_switch"]: {"limit_low", "limit_high"},
    FAULTS["bridge"]: {"bridge_fault"},
    FAULTS["host_silent"]: {"silence"},
    FAULTS["late"]: {"flood"},
}


class Trial:
    """A host, a board, a bench, and chance.

    Parameters
    ----------
    elf : Path
        The firmware.
    seed : int
        Of orders, injuries and noise.
    """

    def __init__(self, elf: Path, seed: int) -> None:
        self.random = random.Random(seed)
        bench = Bench(elf, seed)
        self.params = control.of(LIMITS, calibration.default_calibration())
        crc = framing.crc16(control.words(self.params))
        self.judge = Judge(bench, self.params, crc)
        bench.switches = SWITCHES
        self.line = Line(self.judge)
        self.line.look = self._look
        self.host = Host(self.line)
        self.hurt: set[str] = set()
        self.unexplained: list[str] = []  # the first ones
        self.count = 0  # of all
        self.faults: Counter[str] = Counter()
        self.injuries: Counter[str] = Counter()
        self.rounds = self.worst_cycles = 0
        self.least_free, self.deepest = 2048, 0
        self.missed = self._missed = self._floods = 0  # periods: in all, of this run of the board
        self.given: list[str] = []  # orders and injuries of this round
        self._stood = self._against = 0
        self._place = bench.state.macro.x

    # What the host says

    def outputs(self, motor: float, ctrl: float) -> None:
        """One period with these efforts."""
        self.host.tell("outputs", sample=0, motor=motor, ctrl=ctrl)

    def targets(self, macro: float, micro: float, active: int) -> None:
        """One period with these set points."""
        self.host.tell(
            "targets", sample=0, macro_reference=macro, micro_reference=micro, active=active
        )

    # What is seen

    def _look(self) -> None:
        """After each period: what explains a fault by what the machine really does."""
        bench = self.line.bench
        moved = bench.state.macro.x - self._place
        self._place = bench.state.macro.x
        self._stood = self._stood + 1 if abs(moved) < 1e-6 and abs(bench.motor) > 2.0 else 0
        if self._stood > 0.2e3:
            self.judge.since_begin.add("stood")
        self._against = self._against + 1 if moved * bench.motor < 0.0 else 0
        if self._against > 20:
            self.judge.since_begin.add("braked")
        if bench.ctrl > 1.2:
            self.judge.since_begin.add("heated")

    def say(self, what: str) -> None:
        """Note what nothing explains."""
        self.count += 1
        if len(self.unexplained) < TOLD:
            self.unexplained.append(
                f"period {self.line.bench.tick}, {', '.join(self.given)}: {what}"
            )

    def status(self) -> dict[str, Any]:
        """How the board is; {} if it does not answer."""
        told = self.host.ask("ask", "status")
        if told is None:
            self.say("no answer to ask")
            return {}
        self.worst_cycles = max(self.worst_cycles, told["cycles"])
        self.least_free = min(self.least_free, told["free"])
        self.deepest = max(self.deepest, told["stack"])
        self._late(told["missed"])
        if told["free"] < DEEPEST:
            self.say(f"{told['free']} bytes of the stack are left")
        return told

    def _late(self, missed: int) -> None:
        """Periods without a control interrupt: one at most for each that a flood filled."""
        before = self._missed if missed >= self._missed else 0  # it was reset
        more, floods = missed - before, self.judge.floods - self._floods
        self.missed += more
        if more > floods:
            self.say(f"{more} periods missed, with {floods} full of bytes")
        self._missed, self._floods = missed, self.judge.floods

    # A round

    def recover(self) -> None:
        """A sound machine at rest, a board that is configured and knows where it stands."""
        bench = self.line.bench
        bench.cut, bench.shorted, bench.hall, bench.forced = "", False, None, {}
        self.line.flips, self.line.connected = 0.0, True
        self.hurt.clear()
        self.line.put(b"\0")
        if self.host.ask("stop", "done") is None:
            self.say("no answer to stop")
        for _ in range(3000):
            if abs(bench.state.macro.v) < 1e-4:
                break
            self.host.tell("keep", sample=0)
        bench._channels(bench._place, None)
        if self.host.ask("stream", "done", on=1) is None:
            self.say("no answer to stream")
        if not self.judge.configured:
            self.configure()
        if self.host.ask("place", "done", count=bench._place) is None:
            self.say("no answer to place")

    def configure(self) -> None:
        """Write all parameters and read them back."""
        for index, value in enumerate(control.flat(self.params).values()):
            told = self.host.ask("set", "parameter", index=index, value=value)
            if told is None or told["value"] != control.single(value):
                self.say(f"parameter {index} was written as {value}, answered by {told}")
        self.judge.configured = True

    def begin(self) -> bool:
        """Let the board drive."""
        told = self.host.ask("begin", "done", parameters=self.judge.crc)
        if told is None or told["refused"]:
            self.say(f"begin was answered by {told}")
            return False
        return True

    def round(self, orders: tuple[Callable[[Trial], None], ...],
              injuries: tuple[Callable[[Trial], None], ...]) -> None:  # fmt: skip
        """Recover, give some orders, mostly with an injury among them, and judge."""
        self.rounds += 1
        self.given = []
        self.recover()
        if not self.begin():
            return
        count = self.random.randint(1, 5)
        when = self.random.randrange(2 * count)
        for k in range(count):
            order = self.random.choice(orders)
            self.given.append(order.__name__)
            order(self)
            if k == when:
                injury = self.random.choice(injuries)
                self.injuries[injury.__name__] += 1
                self.given.append(injury.__name__.upper())
                injury(self)
        self.line.put(b"\0")
        told = self.status()
        if told:
            self.explain(told)

    def explain(self, told: dict[str, Any]) -> None:
        """A fault by its causes, the count by where the carriage is."""
        code = int(told["fault"])
        if code != codes.OK:
            self.faults[NAMES[code]] += 1
            known = self.judge.since_begin | self.hurt
            if not CAUSES.get(code, set()) & known:
                seen = f"{NAMES[code]} ({told['value']:.4g}, {told['limit']:.4g})"
                self.say(f"{seen}, but there was only {sorted(known)}")
        driving = bool(int(told["state"]) & _DRIVING)
        if driving and code != codes.OK:
            self.say(f"it drives with {NAMES[code]}")
        if not int(told["state"]) & _TRUSTED or "encoder" in self.hurt:
            return
        off = abs(self.host.sample.get("encoder", 0) - self.line.bench._place)
        if off > 20:  # counts in a period or two at speed
            self.say(f"the board counts {off} off and trusts it")
