"""Random orders and faults for a machine of any kind, and what was found in each round."""

from __future__ import annotations

import csv
import math
import random
import time
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import faulty
from faultmatrix.bounds import bounds
from macromicro.errors import MacromicroError
from macromicro.serve import faults
from soak.judge import judge
from soak.victim import Client, Victim, until

_PATIENCE = 120.0  # s that a motion may last
_TRIES = 6  # beside those that this computer's load ended, of which there may be
_BUSY = 20
_SHOWN = 0.2  # s
_BAD = ("fault", "stalled", "refused", "none")  # without a fault
_AT_LIMIT = "at its soft limit"  # why a jog is refused
_LASTING = ("encoder-skipping",)  # what nothing shows; a homing, or its end, puts it right
# To one absolute sensor a reversed one is another gain, until the following error grows too large.
_ANOTHER_GAIN = "encoder-reversed"
# A reading that dies as the stage comes to rest shows nothing of what the stage still moves, which
# is less than it goes at its greatest speed in this time [s].
_DEAD, _UNSEEN = "encoder-frozen", 0.1
# Their time is the loop's and this computer's: the campaign of the two-stage machine tries them.
_ELSE = ("clock-ahead", "clock-back", "clock-stands", "clock-none", "slow", "unplugged", "hanging")


class Round(NamedTuple):
    """What came of one round. `name`: of the fault; `order` that it met; `code` that was raised, 0
    for none; `words` of it."""

    name: str
    order: str
    code: int
    words: str
    outcome: str


class Rounds:
    """Holds control of a server that runs; `complaints` is what nothing explains."""

    def __init__(self, victim: Victim, seed: int) -> None:
        self.victim, self.rng = victim, random.Random(seed)
        self.complaints: list[str] = []
        self.rounds: list[Round] = []
        self.outcomes: Counter[str] = Counter()
        self.checked = self.homings = self.busy = self.rows = 0
        self.unseen: list[
            float
        ] = []  # how far it was off behind a reading that died as it came to rest, m
        self._client = Client(victim.port)
        self._names = tuple(n for n in victim.subject.faults() if n not in _ELSE)
        self._deck: list[str] = []
        self._bounds = bounds(victim.subject.settings)
        self._axes = "POS:POIN?" if victim.subject.name == "two-axes" else ""
        self._turns = bool(victim.subject.settings.live.turns)
        self.unit = "DEG" if self._turns else "MM"
        self.scale = math.degrees(1.0) if self._turns else 1e3
        self._error = ""  # of the last order
        self._there = math.nan  # where the last motion truly ended, m
        self._stopped = math.nan  # where it ended as reported, m
        self._start = math.nan  # where the last order found the stage, m
        self._last = 0  # number of the last motion
        self._frame = math.nan  # true place minus the position reported, m, as last known
        self._searches = self._homes()

    def run(self, seconds: float) -> None:
        """Rounds until the time is over, then the recording of all of them."""
        until(lambda: self._client.ask("SYST:LOCK:REQ?") == "1")
        self._client.send('REC ON,"soak"')
        began = time.monotonic()
        while time.monotonic() - began < seconds:
            self._prepare()
            self._round()
        faulty.inject(self.victim.cells, faulty.NONE)
        self._client.send("ABOR")
        until(lambda: self._client.ask("MOVE:NUMB?") == "0")
        self._recorded()
        self._client.close()

    # Asking

    def _words(self, query: str) -> list[str]:
        return next(csv.reader([self._client.ask(query)]))

    def _position(self) -> tuple[float, float, bool]:
        """Position and half width, m, and whether they are trusted."""
        told, half, trusted = map(float, self._words("POS?"))
        return told / self.scale, half / self.scale, bool(trusted)

    def _truth(self) -> float:
        return float(self.victim.cells[faulty.STAGE])

    def _homes(self) -> bool:
        """Does it find its place by homing? An absolute sensor needs none."""
        return self._words("POS:TRUS?")[0] == "0"

    def _code(self) -> tuple[int, str]:
        code, _, message, *_ = self._words("FAUL?")
        return int(code), message

    def _ended(self, number: int) -> str:
        outcome, *place = self._words(f"MOVE:OUTC? {number}")
        if outcome == "unknown":
            return ""
        self._stopped = float(place[0]) / self.scale
        return outcome

    def _order(self, order: str) -> int:
        """The number of the motion that an order began, which may have ended; 0 for none."""
        self._client.send("*CLS")
        self._client.send(order)
        self._error = self._client.ask("SYST:ERR?")
        deadline = time.monotonic() + _SHOWN
        while True:  # the loop shows a motion a period behind its reply
            number = int(self._client.ask("MOVE:NUMB?"))
            if number or self._ended(self._last + 1):
                self._last = number or self._last + 1
                return self._last
            if not self._error.startswith("0,") or time.monotonic() > deadline:
                return 0

    # A round

    def _prepare(self) -> None:
        """No fault, enabled, its place known, at rest. What this computer's load ends is tried
        again."""
        faulty.inject(self.victim.cells, faulty.NONE)
        tries: list[str] = []
        late = 0
        while len(tries) < _TRIES and late < _BUSY:
            until(lambda: self._client.ask("MOVE:NUMB?") == "0", _PATIENCE)
            time.sleep(0.05)
            self._client.send("FAUL:CLE")
            self._client.send("ENAB")
            time.sleep(0.05)
            if self._code()[0]:
                tries.append(self._client.ask("FAUL?"))
                continue
            if self._position()[2] and math.isfinite(self._frame):
                return
            if self._searches:
                number = self._order("HOME")
                outcome = until(lambda: self._ended(number), _PATIENCE) if number else "refused"  # noqa: B023
                self.homings += 1
                code, words = self._code()
                if code == faults.LATE:
                    late += 1
                    self.busy += 1
                    time.sleep(1.0)
                else:
                    tries.append(f"homing: {outcome} {words if code else ''}".rstrip())
            time.sleep(0.3)
            if self._position()[2]:
                self._frame = self._truth() - self._position()[0]
        errors = self._client.ask("SYST:ERR:ALL?")
        raise MacromicroError(f"not ready again: {errors}; {tries}, {late} ended by load")

    def _random(self) -> tuple[str, float]:
        """A random order, and its target [m], NaN for none."""
        low, high = (float(end) for end in self._words("LIM:ABS?"))
        target = self.rng.uniform(low + 0.05 * (high - low), high - 0.05 * (high - low))
        kind = self.rng.choice(["move", "move", "move", "jog", "programme", "home"])
        if kind == "jog":
            speed = self.rng.choice([-1.0, 1.0]) * 0.05 * (high - low)
            stage = "X" if self._axes else "MACR"
            return f"JOG:{stage} {speed:.6g} {self.unit}/S", math.nan
        if kind == "programme":
            name = self._words("PROG:CAT?")[0]
            return f'PROG:LOAD "{name}";:PROG:RUN', math.nan
        if kind == "home" and self._searches:
            return "HOME", math.nan
        if self._axes:
            return f"MOVE:X {target:.6f} {self.unit}", target / self.scale
        return f"MOVE {target:.6f} {self.unit}", target / self.scale

    def _round(self) -> None:
        """An order, most often with a fault on its way, and perhaps an end of it."""
        if not self._deck:
            self._deck = list(self._names)
            self.rng.shuffle(self._deck)
        name = self._deck.pop() if self.rng.random() < 0.75 else faulty.NONE
        order, target = self._random()
        cells = self.victim.cells
        self._start = self._truth() - self._frame
        number = self._order(order)
        time.sleep(self.rng.uniform(0.01, 0.3))
        self._there = self._truth() if number and self._ended(number) else math.nan
        if name != faulty.NONE:
            faulty.inject(cells, name)
        end = self.rng.choice(["", "", "STOP", "ABOR", "DIS"])
        if order.startswith(("JOG", "PROG")):
            end = end or "STOP"
        if end:
            time.sleep(self.rng.uniform(0.0, 1.0))
            self._client.send(end)
        outcome = self._end(number, f"{order} with {name}") if number else "refused"
        self.outcomes[outcome] += 1
        time.sleep(0.3)
        self._look(name, order, outcome, "" if end else order, target)

    def _end(self, number: int, what: str) -> str:
        try:
            outcome = str(until(lambda: self._ended(number), _PATIENCE))
            if math.isnan(self._there):
                self._there = self._truth()
            return outcome
        except MacromicroError:
            self.complaints.append(f"{what}: no end in {_PATIENCE:g} s")
            self._client.send("ABOR")
            return "none"

    def _look(self, name: str, order: str, outcome: str, alone: str, target: float) -> None:
        """Is all explained, the position right, and are outputs safe?"""
        code, message = self._code()
        words, what = message if code else "", f"{order} with {name}, {outcome}"
        mode = self._words("MODE?")[0]
        if mode in ("disabled", "fault") and self.victim.cells[faulty.MOTOR] != 0.0:
            self.complaints.append(f"{what}: outputs are on, {mode}")
        if code == faults.LATE:
            self.busy += 1
        elif name == faulty.NONE and (code or outcome in _BAD) and _AT_LIMIT not in self._error:
            start, end = self._start * self.scale, self._stopped * self.scale
            at = f"from {start:.6g} to {end:.6g} {self.unit}"
            self.complaints.append(f"{what}, {at}: {words or self._error}")
        if order == "HOME" and outcome == "done":
            self.homings += 1
        self.rounds.append(Round(name, order.partition(" ")[0], code, words, outcome))
        if name in _LASTING:
            self._frame = math.nan
            if self._searches:  # it needs homing, and does not know
                self._client.send("DIS")
                self._client.send("ENAB")
                faulty.inject(self.victim.cells, faulty.NONE)
                self._order("HOME")
            return
        if name == _ANOTHER_GAIN and not code and not self._searches:
            self._frame = math.nan
            return
        dead = name == _DEAD and not code
        self._right(name, what, target if alone and outcome == "done" else math.nan, dead)

    def _right(self, name: str, what: str, target: float, dead: bool) -> None:
        """A position that is trusted at rest is the true one; and where it was to be, that too."""
        before = self._truth()
        told, half, trusted = self._position()
        time.sleep(0.05)
        moved = abs(self._truth() - before)
        if not trusted:
            self._frame = math.nan
            return
        allowed = half + self._bounds.resolution * (2.0 if name == "encoder-dither" else 1.0)
        allowed += self._bounds.repeat * self._searches
        off = abs(before - self._frame - told)
        if dead and allowed + moved < off < _UNSEEN * self._bounds.fastest:
            self.unseen.append(off)
            self._frame = math.nan
        elif off > allowed + moved:
            self.complaints.append(f"{what}: trusted, and {off * self.scale:.4g} {self.unit} off")
            self._frame = math.nan
        elif abs(self._there - self._frame - target) > allowed + moved + self._bounds.arrival:
            self.complaints.append(f"{what}: done, and not there")
        self.checked += 1

    def _recorded(self) -> None:
        """Every row of the recording."""
        self._client.send("REC OFF")
        until(lambda: self._client.ask("REC?").startswith("0"))
        path: Path = self.victim.recordings / self._words("REC:NAME?")[0]
        found = judge(path, most=self._bounds.effort, led=True)
        self.rows = found.rows
        if found.gaps or found.illegal or found.unsafe or not found.rows:
            self.complaints.append(f"recording: {found}")
