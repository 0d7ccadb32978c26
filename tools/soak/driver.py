"""A client in control: asks, gives orders, makes the machine ready again."""

from __future__ import annotations

import csv
import math
import random
import time

import faulty
from macromicro.errors import MacromicroError
from macromicro.serve import faults
from soak.victim import Client, Victim, until

_TRIES, _LATE = 20, f"{faults.LATE},"
_REFUSED = ("-203", "-221", "-222", "-1")


class Driver:
    """Holds control of a server that runs; `complaints` is what nothing explains."""

    def __init__(self, victim: Victim, seed: int) -> None:
        self.victim, self.rng = victim, random.Random(seed)
        self.complaints: list[str] = []
        self.homings = 0
        self._number = 0
        self._frame = math.nan  # true place [m] minus the position told, as of the last homing
        self._client = Client(victim.port)
        self._expected: list[int] = []  # faults told, to be found in the recording
        self._claimed = False  # is the present fault among them?
        self._suspect: tuple[tuple[int, ...], str] = ((), "no fault injected")
        self.busy = 0  # faults that this computer's load explains

    # Asking

    def _words(self, query: str) -> list[str]:
        return next(csv.reader([self._client.ask(query)]))

    def _fault(self) -> tuple[int, str]:
        code, _, message, *_ = self._words("FAUL?")
        return int(code), message

    def _take_control(self) -> None:
        until(lambda: self._client.ask("SYST:LOCK:REQ?") == "1")

    def _rests(self) -> bool:
        return self._client.ask("MOVE:NUMB?") == "0"

    def _prepare(self) -> None:
        """No fault, enabled, homed, at rest. What this computer's load ends is tried again."""
        faulty.inject(self.victim.cells, faulty.NONE)
        until(self._rests, 90.0)
        time.sleep(0.01)
        tries: list[str] = []
        while len(tries) < _TRIES and sum(not t.startswith(_LATE) for t in tries) < 5:
            if code := self._fault()[0]:
                if not self._claimed:  # it came after the trial was over
                    self._claim(code, *self._suspect)
                self._client.send("FAUL:CLE")
                self._claimed = False
            if self._client.ask("MODE?") == '"disabled"':
                self._client.send("ENAB")
            if self._words("POS:TRUS?")[0] == "1" and math.isfinite(self._frame):
                return
            self._begin("HOME")
            until(self._rests, 90.0)
            tries.append(self._client.ask("FAUL?"))
            if tries[-1].startswith(_LATE):
                time.sleep(1.0)
            if self._words("POS:TRUS?")[0] == "1":
                self.homings += 1
                self._frame = self._truth() - self._position()
        raise MacromicroError(
            f"not ready again after {self._suspect[1]}: {self._client.ask('SYST:ERR:ALL?')}; "
            f"after each homing: {tries}"
        )

    def _truth(self) -> float:
        return float(self.victim.cells[faulty.STAGE])

    def _position(self) -> float:
        return float(self._client.ask("POS?").split(",")[0]) * 1e-3

    def _begin(self, order: str) -> int:
        """The number of the motion, which the machine counts as we do; 0 where it was refused."""
        self._client.send("*CLS")
        self._client.send(order)
        error, number = self._client.ask("SYST:ERR?"), int(self._client.ask("MOVE:NUMB?"))
        if error.startswith(_REFUSED):
            self.complaints.append(f"{order} refused: {error}")
            return 0
        self._number += 1
        if number not in (0, self._number):
            self.complaints.append(f"motion {number} is under way, not {self._number}")
        return self._number

    def _outcome(self, number: int) -> str:
        return self._words(f"MOVE:OUTC? {number}")[0]

    def _ended(self, number: int) -> str:
        outcome = self._outcome(number)
        return "" if outcome == "unknown" else outcome

    def _claim(self, code: int, codes: tuple[int, ...], name: str) -> None:
        """A fault was seen: does this trial explain it, or this computer's load?"""
        self._expected.append(code)
        self._claimed = True
        if code in codes:
            return
        if code == faults.LATE:
            self.busy += 1
            return
        self.complaints.append(f"fault {code} ({self._words('FAUL?')[1]}) with {name}")
