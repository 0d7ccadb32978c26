"""Rounds of random commands, most of them with a fault, and what was found in each."""

from __future__ import annotations

import contextlib
import math
import time
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import faulty
from macromicro.serve import faults
from soak.driver import Driver
from soak.faults import (
    AROUND,
    BENCH,
    Trial,
    busy,
    full_disk,
    pester,
    reset,
)
from soak.judge import Verdict, judge
from soak.victim import Client, Load, Victim, safe_after, until

ROTATE_S = 45.0
# A count and a half, where both the reading and the place at homing are whole counts; and
# what the Hall calibration and the band of "on target" leave.
_TRUE_M = 1.5 * 0.2 / 2800.0 + 20e-6
_AIM_MM = 0.05
_FAR = 700.0  # counts: shortest macro move


class Round(NamedTuple):
    """What came of one trial. `code`: fault raised, 0 for none; `safe` [s]: from the fault to
    outputs safe, NaN where they were not made safe; `told`: message, or error."""

    name: str
    code: int
    safe: float
    told: str
    outcome: str


class Campaign(Driver):
    """Drives a server that runs, and keeps what came of it."""

    def __init__(self, victim: Victim, seed: int) -> None:
        super().__init__(victim, seed)
        self.rounds: list[Round] = []
        self.verdicts: list[Verdict] = []
        self.loads: list[tuple[float, Load]] = []
        self.outcomes: Counter[str] = Counter()
        self.checked = 0
        self.missed = 0.0
        self._deck: list[Trial] = []
        self._began = self._rotated = time.monotonic()
        self._file = 0

    # The campaign

    def run(self, seconds: float) -> None:
        """Rounds until the time is over."""
        self._take_control()
        while time.monotonic() - self._began < seconds:
            self.loads.append((time.monotonic() - self._began, self.victim.load()))
            self._prepare()
            if time.monotonic() - self._rotated > ROTATE_S:
                self._rotate()
            if not self._deck:
                self._deck = [*BENCH, *AROUND]
                self.rng.shuffle(self._deck)
            if self.rng.random() < 0.25:
                self._command_only()
            else:
                self._trial(self._deck.pop())
        self._prepare()
        self._rotate()
        self.missed = float(self._client.ask("DIAG:PACE?").split(",")[1])

    def finish(self) -> None:
        """Let go of the server."""
        with contextlib.suppress(OSError):
            self._client.close()

    # A command

    def _order(self, stage: str) -> tuple[str, float, str]:
        """A random order of a stage: itself, its target, and what reads that."""
        if stage == "micro":
            target = round(
                self.rng.choice([self.rng.uniform(0.4, 1.4), self.rng.uniform(2, 3.3)]), 3
            )
            return f"MOVE:MICR {target} mm", target, "STAG2:POS?"
        if stage == "whole":
            target = round(self.rng.uniform(2.0, 205.0), 3)
            return f"MOVE {target} mm", target, "POS?"
        target = float(self.rng.randrange(50, 2900))
        while self._left(target) < _FAR:
            target = float(self.rng.randrange(50, 2900))
        return f"MOVE:MACR {target:.0f}", target, "STAG1:POS?"

    def _left(self, target: float) -> float:
        return abs(target - float(self._client.ask("STAG1:POS?")))

    def _check_done(self, target: float, query: str) -> None:
        """A motion that says "done" is where it says, and that is where it was to be."""
        shown = float(self._client.ask(query).split(",")[0])
        allowed = 6.0 if query.startswith("STAG1") else _AIM_MM
        if abs(shown - target) > allowed:
            self.complaints.append(f"done at {shown}, not at {target} ({query})")
        off = self._truth() - self._frame - self._position()
        if abs(off) > _TRUE_M:
            self.complaints.append(f"done, and {off * 1e3:.3f} mm from where it says ({query})")
        self.checked += 1

    def _command_only(self) -> None:
        """A random command without a fault, and perhaps a stop."""
        self._suspect = ((), "no fault injected")
        order, target, query = self._order(self.rng.choice(["macro", "micro", "whole"]))
        number = self._begin(order)
        end = self.rng.choice(["wait", "wait", "STOP", "ABOR", "DIS"])
        if end != "wait":
            time.sleep(self.rng.uniform(0.0, 1.0))
            self._client.send(end)
        if not number:
            return
        outcome = until(lambda: self._ended(number), 60.0)
        self.outcomes[outcome] += 1
        allowed = {"wait": ("done",), "STOP": ("stopped",), "ABOR": ("emergency",)}
        code = self._fault()[0]
        late = outcome == "fault" and code == faults.LATE
        if not late and outcome not in (*allowed.get(end, ("stopped",)), "done"):
            self.complaints.append(f"{order}, {end}: ended as {outcome}")
        if outcome == "done" and end == "wait":
            self._check_done(target, query)
        if code:
            self._claim(code, *self._suspect)

    # A trial

    def _trial(self, trial: Trial) -> None:
        self._suspect = (trial.codes, trial.name)
        order, target, query = self._order(trial.stage)
        if trial in AROUND:
            self._around(trial, order)
            return
        if trial.name == "fan-lost":
            self._client.send("FAN ON")
        number = self._begin(order)
        time.sleep(self.rng.uniform(0.03, 0.25))
        cells = self.victim.cells
        # At rest or nearly there, nothing tells of an encoder or a motor.
        under_way = self._client.ask("MOVE:NUMB?") == str(number)
        under_way &= trial.stage == "micro" or self._left(target) > 0.25 * _FAR
        faulty.inject(cells, trial.name)
        outcome = until(lambda: self._ended(number), 60.0)
        self.outcomes[outcome] += 1
        code, told = self._fault()
        safe = math.nan
        if code:
            until(lambda: cells[faulty.SAFE_AT] >= 0.0)
            safe = safe_after(self.victim)
            self._claim(code, *self._suspect)
        elif trial.sure and under_way:
            self.complaints.append(f"{trial.name} was not found; {order} ended as {outcome}")
        elif outcome == "done" and trial.name not in ("encoder-skipping", "encoder-frozen"):
            self._check_done(target, query)
        self._client.send("FAN OFF")
        if trial.name == "encoder-skipping":
            self._frame = math.nan  # it needs homing, and does not know
            told = told if code else "nothing; the next homing tells the counts lost"
        if trial.name == "laser-lost":
            told = "event: laser lost"
        self.rounds.append(Round(trial.name, code, safe, told, outcome))

    def _around(self, trial: Trial, order: str) -> None:
        """A fault beside the machine. Times are from what was done to outputs safe."""
        cells = self.victim.cells
        number = self._begin(order)
        time.sleep(self.rng.uniform(0.03, 0.15))
        began, told = self._disturb(trial.name)
        outcome = until(lambda: self._ended(number), 60.0)
        self.outcomes[outcome] += 1
        code, message = self._fault()
        safe = math.nan
        if code:
            self._claim(code, *self._suspect)
        elif trial.sure:
            self.complaints.append(f"{trial.name} was not found; {order} ended as {outcome}")
        if outcome == "lost":
            until(lambda: cells[faulty.SAFE_AT] >= 0.0)
            safe = max(float(cells[faulty.SAFE_NS] - began) * 1e-9, 0.0)
        if trial.name == "disk full":
            self._record_anew()
        self.rounds.append(Round(trial.name, code, safe, message if code else told, outcome))

    def _disturb(self, name: str) -> tuple[int, str]:
        """Do it; when it was done [ns], and what was told."""
        began, told = time.monotonic_ns(), ""
        if name == "client killed":
            reset(self._client)
            self._client = Client(self.victim.port)
            self._take_control()
            told = "event: client lost; the motion ends as lost"
        elif name == "client half-open":
            self._client.send("SYST:LOCK:WATC 0.3")
            began = time.monotonic_ns()
            time.sleep(1.0)
            told = self._client.ask("SYST:ERR?")
            self._client.send("SYST:LOCK:WATC 0")
            self._take_control()
        elif name in ("client floods", "client sends garbage"):
            if not pester(self.victim, self.rng, 1.0, name == "client sends garbage"):
                self.complaints.append(f"{name}: nothing was taken")
            told = "nothing; no other client waits"
        elif name == "disk full":
            with full_disk(self.victim):
                told = str(until(lambda: self._words("REC?")[3]))
            told = told.replace(f"{self.victim.recordings}/", "")
        elif name == "two busy processes":
            with busy():
                time.sleep(2.0)
        return began, told

    # Recordings

    def _name(self) -> Path:
        return self.victim.recordings / self._words("REC:NAME?")[0]

    def _rotate(self) -> None:
        """End the recording, judge it, begin the next."""
        if self._client.ask("REC?").startswith("1"):
            self._client.send("REC OFF")
        active, rows, lost, error = self._words("REC?")
        if (active, lost, error) != ("0", "0", ""):
            self.complaints.append(f"recording: {lost} rows lost, {error or 'no error'}")
        self._judge(int(rows))
        self._begin_recording()

    def _record_anew(self) -> None:
        """After a full disk: what was recorded before is there."""
        self._judge(int(self._words("REC?")[1]), whole=False)
        self._begin_recording()

    def _begin_recording(self) -> None:
        self._file += 1
        self._client.send(f'REC ON,"soak-{self._file}"')
        until(lambda: self._client.ask("REC?").startswith("1"))
        self._rotated = time.monotonic()

    def _judge(self, rows: int, *, whole: bool = True) -> None:
        path = self._name()
        verdict = judge(path)
        path.unlink()
        self.verdicts.append(verdict)
        if verdict.rows != rows or verdict.gaps or verdict.illegal or verdict.unsafe:
            self.complaints.append(f"recording of {rows} rows: {verdict}")
        if verdict.torn:
            self.complaints.append(f"{verdict.torn} motions came twice")
        seen, told = Counter(verdict.faults), Counter(self._expected)
        if whole and seen != told:
            self.complaints.append(f"recorded faults {dict(seen)}, told {dict(told)}")
        self._expected.clear()
