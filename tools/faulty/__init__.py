"""Rigs with faults that can be switched on while they run.

A small mapped file (MACROMICRO_FAULTS) selects the fault and shows the bench's true state:

    export MACROMICRO_FAULTS=/tmp/faults PYTHONPATH=tools
    macromicro serve --rig faulty.bench:twin
    python -m faulty encoder-frozen     # in another shell; "none" ends it
"""

from __future__ import annotations

import math
import mmap
import os
import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro import portable
from macromicro.errors import InputError

BOARD = "MACROMICRO_FAULTS"
NONE = "none"

# Cells of the board, float64, and who writes each.
(
    WANTED,  # by the injector: number of the fault, 0 for none
    ONSET,  # rig: time [s] of the first sample with the present fault, NaN without one
    SAFE_AT,  # rig: time [s] since which all outputs have been safe, NaN while they are not
    SAFE_NS,  # rig: the same on the monotonic clock [ns]
    ILLEGAL,  # rig: number of writes so far that no converter could have taken
    MOTOR,  # rig: last outputs [V], [V], 0 or 1
    CTRL,
    FAN,
    CARRIAGE,  # rig: bench truth: carriage [m], whole stage [m], wires [degC]
    STAGE,
    WIRE,
    TIME,  # rig: time [s] of the newest sample
    FROM,  # rig: bench truth: where the carriage was at the onset [m]
    ONSET_NS,  # rig: the onset on the monotonic clock [ns]
) = range(14)
CELLS = 16


class Fault(NamedTuple):
    """One fault as data; only lost counts outlast it."""

    words: str
    needs: tuple[str, ...] = ()  # channels and outputs without which a rig cannot have it
    step: float = 1.0  # multiplies each count of motion
    jump: float = 0.0  # comes once, counts; of an absolute sensor 500 are a quarter of its travel
    dither: float = 0.0  # share of the readings that show the next count
    rough: float = 0.0  # noise of the counts, rms; of an absolute sensor scaled as `jump`
    silent: tuple[str, ...] = ()  # channels that give nothing
    hall: float | str = math.nan  # "stuck", or a voltage that is read whatever the field is
    noise: float = 0.0  # noise added to the Hall voltage, V rms
    later: float = 0.0  # added to the time of samples, s
    clock: str = ""  # "stands" at the onset's time, "none": no number
    stall: float = 0.0  # time that every reading takes, s
    cut: tuple[str, ...] = ()  # outputs that do not reach the machine
    reversed: tuple[str, ...] = ()  # outputs that reach it with the other sign
    blocked: bool = False  # the stage cannot move
    lines: tuple[tuple[str, str], ...] = ()  # switches: "on", "off", or "cut" as a wire
    swapped: bool = False  # each limit switch is wired in place of the other
    brief: bool = False  # `lines` holds for 1 ms alone
    raises: str = ""  # reading fails with this message
    hangs: bool = False  # reading does not return


_POSITION, _MOTOR = ("encoder",), ("motor",)
_LOW, _LIMITS, _HOME = ("limit_low",), ("limit_low", "limit_high"), ("home",)
_HALL, _LASER = ("hall",), ("laser",)

FAULTS: dict[str, Fault] = {
    NONE: Fault("nothing is broken"),
    "encoder-frozen": Fault("the encoder's counter stops", _POSITION, step=0.0),
    "encoder-reversed": Fault("the encoder's two channels are swapped", _POSITION, step=-1.0),
    "encoder-skipping": Fault("one count of ten is lost", _POSITION, step=0.9),
    "encoder-jump": Fault("the counter jumps by 500 counts", _POSITION, jump=500.0),
    "encoder-silent": Fault("the counter board does not answer", _POSITION, silent=("encoder",)),
    "encoder-dither": Fault("one reading in ten is one count off", _POSITION, dither=0.1),
    "encoder-noisy": Fault("the position is noisy: 100 counts rms", _POSITION, rough=100.0),
    "hall-stuck": Fault("the A/D board repeats one code", _HALL, hall="stuck"),
    "hall-range": Fault("the Hall sensor's wire lies on its supply", _HALL, hall=4.9988),
    "hall-low": Fault("the Hall sensor's wire lies on ground", _HALL, hall=0.0),
    "hall-noisy": Fault("the Hall sensor's cable has lost its shield: 0.1 V rms", _HALL, noise=0.1),
    "hall-silent": Fault("the A/D board does not answer", _HALL, silent=("hall",)),
    "laser-lost": Fault("the laser's beam is interrupted", _LASER, silent=("laser",)),
    "wire-broken": Fault("no current flows through the wires", ("ctrl",), cut=("ctrl",)),
    "motor-dead": Fault("the motor's amplifier is off", _MOTOR, cut=("motor",)),
    "motor-reversed": Fault("the motor's two wires are swapped", _MOTOR, reversed=("motor",)),
    "fan-lost": Fault("the fan does not turn", ("fan",), cut=("fan",)),
    "carriage-stuck": Fault("the carriage is jammed", _MOTOR, blocked=True),
    "limit-on": Fault("the low limit switch is stuck on", _LOW, lines=(("limit_low", "on"),)),
    "limits-off": Fault(
        "both limit switches are stuck off",
        _LIMITS,
        lines=(("limit_low", "off"), ("limit_high", "off")),
    ),
    "limits-swapped": Fault("the limit switches are swapped", _LIMITS, swapped=True),
    "limit-glitch": Fault(
        "the low limit switch is on for 1 ms", _LOW, lines=(("limit_low", "on"),), brief=True
    ),
    "limit-cut": Fault("the low limit switch's wire is cut", _LOW, lines=(("limit_low", "cut"),)),
    "home-on": Fault("the home switch is stuck on", _HOME, lines=(("home", "on"),)),
    "home-off": Fault("the home switch is stuck off", _HOME, lines=(("home", "off"),)),
    "home-glitch": Fault(
        "the home switch is on for 1 ms", _HOME, lines=(("home", "on"),), brief=True
    ),
    "clock-ahead": Fault("the rig's clock jumps an hour ahead", later=3600.0),
    "clock-back": Fault("the rig's clock jumps 10 s back", later=-10.0),
    "clock-stands": Fault("the rig's clock stops", clock="stands"),
    "clock-none": Fault("the rig gives no time", clock="none"),
    "slow": Fault("every reading takes 5 ms", stall=5e-3),
    "unplugged": Fault("reading fails", raises="the A/D board was unplugged"),
    "hanging": Fault("reading does not return", hangs=True),
}
NAMES = tuple(FAULTS)
_FAULTS = tuple(FAULTS.values())


def board(path: str | os.PathLike[str] | None = None) -> NDArray[np.float64]:
    """The control file, mapped, or private memory."""
    if path is None:
        return np.zeros(CELLS)
    size = 8 * CELLS
    fd = os.open(path, portable.READ_WRITE, 0o600)
    try:
        if os.fstat(fd).st_size != size:
            os.ftruncate(fd, size)
        return np.frombuffer(mmap.mmap(fd, size), np.float64)
    finally:
        os.close(fd)


def inject(cells: NDArray[np.float64], name: str) -> None:
    """Switch to another fault from the next sample on."""
    if name not in FAULTS:
        raise InputError("fault", name, ", ".join(NAMES))
    cells[WANTED] = NAMES.index(name)


def possible(rig: Any) -> tuple[str, ...]:
    """The faults that a rig can have."""
    there = {*rig.channels, *getattr(rig, "outputs", ("motor", "ctrl", "fan"))}
    return tuple(name for name, fault in FAULTS.items() if name != NONE and there >= {*fault.needs})


class Injection:
    """Effect of the selected fault on counts, times and outputs."""

    def __init__(
        self,
        cells: NDArray[np.float64],
        grain: float = 1.0,
        leap: float = 1.0,
        *,
        absolute: bool = False,
    ) -> None:
        self.cells = cells
        self.fault, self.fresh = _FAULTS[0], False
        self._number = 0
        self._grain, self._leap, self._absolute = grain, leap, absolute
        self._true: float | None = None  # the encoder's last true reading
        self._count = 0.0  # and what it is said to be
        self._stands = 0.0
        self.random = np.random.default_rng(0)
        cells[:] = 0.0
        cells[ONSET] = cells[SAFE_AT] = math.nan

    def look(self, now: float, place: float) -> None:
        """Read the selected fault before a reading."""
        cells = self.cells
        number = int(cells[WANTED])
        self.fresh = number != self._number
        if self.fresh:
            self._number, self.fault, self._stands = number, _FAULTS[number], now
            cells[FROM], cells[ONSET_NS] = place, time.monotonic_ns()
            cells[ONSET] = now if number else math.nan
        cells[TIME] = now
        if self.fault.raises:
            raise OSError(self.fault.raises)
        while self.fault.hangs and int(cells[WANTED]) == number:
            time.sleep(0.01)
        if self.fault.stall:
            time.sleep(self.fault.stall)

    def count(self, true: float) -> float:
        """What the position sensor shows (`true` in counts)."""
        fault = self.fault
        if "encoder" in fault.silent or math.isnan(true):
            return math.nan
        if self._true is None or (self._absolute and self.fresh and not self._number):
            self._true = self._count = true
        moved, self._true = true - self._true, true
        self._count += moved * fault.step + (fault.jump * self._leap if self.fresh else 0.0)
        shown = self._count
        if fault.dither and self.random.random() < fault.dither:
            shown += self._grain
        if fault.rough:
            shown += fault.rough * self._leap * float(self.random.standard_normal())
        # Half a count of slack: parts of a count that a fault leaves show as whole ones.
        return float(math.floor(shown + 1e-6))

    def time(self, true: float) -> float:
        """What the rig's clock shows."""
        fault = self.fault
        return {"": true + fault.later, "stands": self._stands, "none": math.nan}[fault.clock]

    def passed(self, outputs: dict[str, float]) -> dict[str, float]:
        """The outputs that reach the machine."""
        gone = dict.fromkeys(self.fault.cut, 0.0)
        return gone | {name: -outputs[name] for name in self.fault.reversed}

    def written(self, now: float, legal: bool, *outputs: float) -> None:
        cells = self.cells
        if not legal:
            cells[ILLEGAL] += 1
        cells[MOTOR : MOTOR + len(outputs)] = outputs
        if any(outputs):
            cells[SAFE_AT] = math.nan
        elif not cells[SAFE_AT] >= 0.0:
            cells[SAFE_AT], cells[SAFE_NS] = now, time.monotonic_ns()
