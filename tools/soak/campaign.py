"""Rounds of random orders for a machine of any kind, most of them with a fault."""

from __future__ import annotations

import csv
import math
import random
import time
from collections import Counter
from typing import NamedTuple

import faulty
from faultmatrix.bounds import bounds
from macromicro.errors import MacromicroError
from macromicro.serve import faults
from soak import disturbing
from soak.judge import Verdict, judge
from soak.trials import NO_FAULT, Trial, trials
from soak.victim import Client, Load, Victim, safe_after, until

ROTATE_S = 45.0  # of a recording
_PATIENCE = 120.0  # s that a motion may last
_TRIES = 6  # of getting ready, beside those that this computer's load ended, of which there may be
_BUSY = 20
_SHOWN = 0.2  # s until the loop shows a motion
_BAD = ("fault", "stalled", "refused", "none")  # ends without a fault that need an explanation
_LASTING = "encoder-skipping"  # nothing shows lost counts but a homing or its end
# To one absolute sensor a reversed one is another gain, until the following error grows too large.
_ANOTHER_GAIN = "encoder-reversed"
# A reading that dies as the stage comes to rest shows nothing of what the stage still moves, which
# is less than it goes at its greatest speed in this time [s].
_DEAD, _UNSEEN = "encoder-frozen", 0.1
_DITHER = "encoder-dither"
_FAN = "fan-lost"
_FAR = 700.0  # counts: shortest move of the carriage that is to meet a fault


class Order(NamedTuple):
    text: str
    place: float = math.nan  # of the machine at its end, m
    # Of one stage of the two-stage machine: what reads its position, target and largest error.
    query: str = ""
    target: float = math.nan
    error: float = math.nan

    @property
    def verb(self) -> str:
        return self.text.partition(" ")[0]


class Round(NamedTuple):
    name: str  # of the fault or the disturbance
    order: str  # that it met
    code: int  # fault that was raised, 0 for none
    safe: float  # s from the fault to outputs that stay safe, NaN where they were not made safe
    words: str  # message of the fault, or what a client was told
    outcome: str


class Campaign:
    """Holds control of a server that runs; `complaints` is what nothing explains."""

    def __init__(self, victim: Victim, seed: int) -> None:
        self.victim, self.rng = victim, random.Random(seed)
        self.complaints: list[str] = []
        self.rounds: list[Round] = []
        self.verdicts: list[Verdict] = []
        self.loads: list[tuple[float, Load]] = []
        self.outcomes: Counter[str] = Counter()
        self.checked = self.homings = 0
        self.busy = 0  # faults that this computer's load explains
        self.missed = 0.0  # control periods
        # How far it was off behind a reading that died as it came to rest, m.
        self.unseen: list[float] = []
        settings = victim.subject.settings
        self.unit = "DEG" if settings.live.turns else "MM"
        self.scale = math.degrees(1.0) if settings.live.turns else 1e3
        self._client = Client(victim.port)
        self._bounds = bounds(settings)
        self._plane = bool(settings.axes)
        self._trials = trials(victim.subject)
        self._deck: list[Trial] = []
        self._trial = NO_FAULT
        self._expected: list[int] = []  # faults that were seen, to be found in the recording
        self._claimed = False  # whether the present fault is among them
        self._error = ""  # of the last order
        self._last = 0  # number of the last motion
        self._start = math.nan  # where the last order found the machine, m
        self._there = math.nan  # where it truly was when its motion ended, m
        self._stopped = math.nan  # and where it reported to be, m
        self._frame = math.nan  # true place minus the position reported, m, as last known
        self._searches = self._words("POS:TRUS?")[0] == "0"  # an absolute sensor needs no homing
        self._file = 0
        self._rotated = 0.0

    def run(self, seconds: float) -> None:
        """Rounds until the time is over; every row of their recordings is judged."""
        self._take_control()
        self._begin_recording()
        began = time.monotonic()
        while time.monotonic() - began < seconds:
            self.loads.append((time.monotonic() - began, self.victim.load()))
            self._prepare()
            if time.monotonic() - self._rotated > ROTATE_S:
                self._end_recording()
                self._begin_recording()
            self._round(self._next())
        self._prepare()
        self._end_recording()
        self.missed = float(self._words("DIAG:PACE?")[1])
        self._client.close()

    # Asking

    def _words(self, query: str) -> list[str]:
        return next(csv.reader([self._client.ask(query)]))

    def _take_control(self) -> None:
        until(lambda: self._client.ask("SYST:LOCK:REQ?") == "1")

    def _position(self) -> tuple[float, float, bool]:
        """Position and half width, m, and whether they are trusted."""
        place, half, trusted = map(float, self._words("POS?"))
        return place / self.scale, half / self.scale, bool(trusted)

    def _truth(self) -> float:
        return float(self.victim.cells[faulty.STAGE])

    def _latched(self) -> tuple[int, str]:
        """Code (0 for none) and message of a fault, which the present trial has to explain."""
        number, _, message, *_ = self._words("FAUL?")
        code, trial = int(number), self._trial
        if code and not self._claimed:
            self._claimed = True
            self._expected.append(code)
            if code == faults.LATE and code not in (trial.codes or ()):
                self.busy += 1
            elif trial.codes is not None and code not in trial.codes:
                self.complaints.append(f"fault {code} ({message}) with {trial.name}")
        return code, message

    def _ended(self, number: int) -> str:
        outcome, *place = self._words(f"MOVE:OUTC? {number}")
        if outcome == "unknown":
            return ""
        self._stopped = float(place[0]) / self.scale
        return outcome

    def _begun(self, order: str) -> int:
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

    def _end(self, number: int, what: str) -> str:
        try:
            outcome = str(until(lambda: self._ended(number), _PATIENCE))
        except MacromicroError:
            self.complaints.append(f"{what}: no end in {_PATIENCE:g} s")
            self._client.send("ABOR")
            return "none"
        if math.isnan(self._there):
            self._there = self._truth()
        return outcome

    # A round

    def _prepare(self) -> None:
        """No fault, enabled, its place known, at rest; what the load ends is tried again."""
        faulty.inject(self.victim.cells, faulty.NONE)
        tries: list[str] = []
        late = 0
        while len(tries) < _TRIES and late < _BUSY:
            until(lambda: self._client.ask("MOVE:NUMB?") == "0", _PATIENCE)
            time.sleep(0.05)
            self._latched()
            self._client.send("*CLS;FAUL:CLE")
            if self._client.ask("SYST:ERR?").startswith("0,"):
                self._claimed = False
            self._client.send("ENAB")
            time.sleep(0.05)
            if self._latched()[0]:
                tries.append(self._client.ask("FAUL?"))
                continue
            if self._position()[2] and math.isfinite(self._frame):
                return
            if self._searches:
                number = self._begun("HOME")
                outcome = self._end(number, "HOME") if number else "refused"
                self.homings += 1
                code, message = self._latched()
                if code == faults.LATE:
                    late += 1
                    time.sleep(1.0)
                else:
                    tries.append(f"homing: {outcome} {message if code else ''}".rstrip())
            time.sleep(0.3)
            if self._position()[2]:
                self._frame = self._truth() - self._position()[0]
        errors = self._client.ask("SYST:ERR:ALL?")
        raise MacromicroError(
            f"not ready again after {self._trial.name}: {errors}; {tries}, {late} ended by load"
        )

    def _next(self) -> Trial:
        if not self._deck:
            self._deck = list(self._trials)
            self.rng.shuffle(self._deck)
        return self._deck.pop() if self.rng.random() < 0.75 else NO_FAULT

    def _order(self, stage: str) -> Order:
        """A random order, of a stage of the two-stage machine or of any kind."""
        if stage == "micro":
            low, high = self.rng.choice(((0.4, 1.4), (2.0, 3.3)))
            target = round(self.rng.uniform(low, high), 3)
            return Order(f"MOVE:MICR {target} MM", math.nan, "STAG2:POS?", target, 0.05)
        if stage == "macro":
            target = float(self.rng.randrange(50, 2900))
            while self._left(target) < _FAR:
                target = float(self.rng.randrange(50, 2900))
            return Order(f"MOVE:MACR {target:.0f}", math.nan, "STAG1:POS?", target, 6.0)
        low, high = (float(end) for end in self._words("LIM:ABS?"))
        target = self.rng.uniform(low + 0.05 * (high - low), high - 0.05 * (high - low))
        kind = self.rng.choice(("move", "move", "move", "jog", "programme", "home"))
        if kind == "jog":
            middle = 0.5 * (low + high) - self._position()[0] * self.scale
            speed = math.copysign(0.05 * (high - low), middle)
            return Order(f"JOG:{'X' if self._plane else 'MACR'} {speed:.6g} {self.unit}/S")
        if kind == "programme":
            name = self._words("PROG:CAT?")[0]
            return Order(f'PROG:LOAD "{name}";:PROG:RUN')
        if kind == "home" and self._searches:
            return Order("HOME")
        verb = "MOVE:X" if self._plane else "MOVE"
        return Order(f"{verb} {target:.6f} {self.unit}", target / self.scale)

    def _left(self, target: float) -> float:
        """Counts from the carriage to a target."""
        return abs(target - float(self._words("STAG1:POS?")[0]))

    def _round(self, trial: Trial) -> None:
        """An order, most often with a fault on its way, and perhaps an end of it."""
        self._trial = trial
        order = self._order(trial.stage)
        if trial.name == _FAN:
            self._client.send("FAN ON")
        self._start = self._truth() - self._frame
        number = self._begun(order.text)
        time.sleep(self.rng.uniform(0.01, 0.3))
        self._there = self._truth() if number and self._ended(number) else math.nan
        # At rest or nearly there, nothing shows a fault of encoder or motor.
        meets = number > 0 and math.isnan(self._there)
        meets = meets and (trial.stage != "macro" or self._left(order.target) > 0.25 * _FAR)
        began, words = 0, ""
        if trial.around:
            began, words = self._disturbed(trial.name)
        elif trial != NO_FAULT:
            faulty.inject(self.victim.cells, trial.name)
        end = "" if trial.sure else self._interrupted(order)
        outcome = self._end(number, f"{order.text} with {trial.name}") if number else "refused"
        self.outcomes[outcome] += 1
        code, message = self._latched()
        safe = math.nan
        if code or (trial.around and outcome == "lost"):
            until(lambda: self.victim.cells[faulty.SAFE_AT] >= 0.0)
            safe = safe_after(self.victim, began)
        elif trial.sure and meets:
            what = f"{order.text} ended as {outcome}"
            self.complaints.append(f"{trial.name} was not found; {what}")
        self.rounds.append(
            Round(trial.name, order.verb, code, safe, message if code else words, outcome)
        )
        time.sleep(0.3)
        self._look(order, outcome, alone=not end)
        if trial.name == _FAN:
            self._client.send("FAN OFF")

    def _interrupted(self, order: Order) -> str:
        """What ends the motion by hand, or "" for nothing."""
        end = self.rng.choice(("", "", "STOP", "ABOR", "DIS"))
        if order.verb.startswith(("JOG", "PROG")):
            end = end or "STOP"
        if end:
            time.sleep(self.rng.uniform(0.0, 1.0))
            self._client.send(end)
        return end

    def _disturbed(self, name: str) -> tuple[int, str]:
        """When something around the machine was disturbed, ns, and what its client was told."""
        began, words = time.monotonic_ns(), ""
        if name == disturbing.KILLED:
            disturbing.reset(self._client)
            self._client = Client(self.victim.port)
            self._take_control()
            words = "event: client lost; the motion ends as lost"
        elif name == disturbing.HALF_OPEN:
            self._client.send("SYST:LOCK:WATC 0.3")
            began = time.monotonic_ns()
            time.sleep(1.0)
            words = self._client.ask("SYST:ERR?")
            self._client.send("SYST:LOCK:WATC 0")
            self._take_control()
        elif name in (disturbing.FLOODS, disturbing.GARBAGE):
            if not disturbing.pester(self.victim, self.rng, 1.0, name == disturbing.GARBAGE):
                self.complaints.append(f"{name}: nothing was taken")
            words = "nothing; no other client waits"
        elif name == disturbing.FULL_DISK:
            with disturbing.full_disk(self.victim):
                words = str(until(lambda: self._words("REC?")[3]))
            words = words.replace(f"{self.victim.recordings}/", "")
            self._judge(int(self._words("REC?")[1]), whole=False)
            self._begin_recording()
        elif name == disturbing.BUSY:
            with disturbing.busy():
                time.sleep(2.0)
        return began, words

    def _look(self, order: Order, outcome: str, *, alone: bool) -> None:
        """Is all explained, the position right, and are outputs safe?"""
        (code, message), name = self._latched(), self._trial.name
        what = f"{order.text} with {name}, {outcome}"
        mode = self._words("MODE?")[0]
        if mode in ("disabled", "fault") and self.victim.cells[faulty.MOTOR] != 0.0:
            self.complaints.append(f"{what}: outputs are on, {mode}")
        sound = self._trial == NO_FAULT and code != faults.LATE
        if sound and (code or outcome in _BAD):
            start, end = self._start * self.scale, self._stopped * self.scale
            at = f"from {start:.6g} to {end:.6g} {self.unit}"
            self.complaints.append(f"{what}, {at}: {message if code else self._error}")
        if order.text == "HOME" and outcome == "done":
            self.homings += 1
        if name == _LASTING or (name == _ANOTHER_GAIN and not code and not self._searches):
            self._frame = math.nan
            return
        done = alone and outcome == "done"
        if done and order.query and name != _DEAD:
            shown = float(self._words(order.query)[0])
            if abs(shown - order.target) > order.error:
                self.complaints.append(f"{what}: done at {shown}, not at {order.target}")
        self._right(what, order.place if done else math.nan, dead=name == _DEAD and not code)

    def _right(self, what: str, target: float, *, dead: bool) -> None:
        """A position that is trusted at rest is the true one; and where it was to be, that too."""
        before = self._truth()
        place, half, trusted = self._position()
        time.sleep(0.05)
        moved = abs(self._truth() - before)
        if not trusted:
            self._frame = math.nan
            return
        limits = self._bounds
        allowed = half + limits.resolution * (2.0 if self._trial.name == _DITHER else 1.0)
        allowed += limits.repeat * self._searches
        off = abs(before - self._frame - place)
        if dead and allowed + moved < off < _UNSEEN * limits.fastest:
            self.unseen.append(off)
            self._frame = math.nan
        elif off > allowed + moved:
            self.complaints.append(f"{what}: trusted, and {off * self.scale:.4g} {self.unit} off")
            self._frame = math.nan
        elif abs(self._there - self._frame - target) > allowed + moved + limits.arrival:
            self.complaints.append(f"{what}: done, and not there")
        self.checked += 1

    # Recordings

    def _begin_recording(self) -> None:
        self._file += 1
        self._client.send(f'REC ON,"soak-{self._file}"')
        until(lambda: self._client.ask("REC?").startswith("1"))
        self._rotated = time.monotonic()

    def _end_recording(self) -> None:
        self._client.send("REC OFF")
        until(lambda: self._client.ask("REC?").startswith("0"))
        _, rows, lost, error = self._words("REC?")
        if (lost, error) != ("0", ""):
            self.complaints.append(f"recording: {lost} rows lost, {error or 'no error'}")
        self._judge(int(rows), whole=True)

    def _judge(self, rows: int, *, whole: bool) -> None:
        path = self.victim.recordings / self._words("REC:NAME?")[0]
        subject = self.victim.subject
        found = judge(path, most=self._bounds.effort, led=subject.led)
        path.unlink()
        self.verdicts.append(found)
        if found.rows != rows or found.gaps or found.illegal or found.unsafe or not found.rows:
            self.complaints.append(f"recording of {rows} rows: {found}")
        if found.torn:
            self.complaints.append(f"{found.torn} motions came twice")
        recorded, expected = Counter(found.faults), Counter(self._expected)
        if whole and recorded != expected:
            self.complaints.append(f"recorded faults {dict(recorded)}, seen {dict(expected)}")
        self._expected.clear()
