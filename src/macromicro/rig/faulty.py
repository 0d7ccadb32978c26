"""The twin with faults that can be switched on while it runs, to try a set-up against them.

`twin` is a factory for ``--rig macromicro.rig.faulty:twin``. Which fault is on stands in a
small file that the rig and whoever injects have mapped (MACROMICRO_FAULTS names it), so
the loop opens nothing and waits for nobody:

    export MACROMICRO_FAULTS=/tmp/faults
    macromicro serve --rig macromicro.rig.faulty:twin
    python -m macromicro.rig.faulty encoder-frozen     # in another shell; "none" ends it

The same file shows the bench's truth and what was last written to the rig, to judge by. The bench
has its default parameters.
"""

from __future__ import annotations

import math
import mmap
import os
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.control import calibration
from macromicro.errors import InputError
from macromicro.plant import bench, carriage
from macromicro.rig.twin import Twin, VirtualClock
from macromicro.types import SAFE, Outputs, Sample

BOARD = "MACROMICRO_FAULTS"
NONE = "none"

# Cells of the board, float64, and who writes each.
(
    WANTED,  # whoever injects: number of the fault, 0 for none
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
    """One fault as data: nothing of it is left once it is switched off, but for counts lost.

    Attributes
    ----------
    words : str
        What is broken.
    step : float
        Multiplies each count of motion.
    jump : float
        Comes once, counts.
    silent : tuple[str, ...]
        Channels that give nothing.
    hall : float | str
        "stuck", a voltage that is read whatever the field is, or NaN for none.
    noise : float
        Noise added to the Hall voltage, V rms.
    later : float
        Added to the time of samples, s.
    clock : str
        "stands" at the onset's time, "none": no number.
    stall : float
        Time that every reading takes, s.
    cut : tuple[str, ...]
        Outputs that do not reach the bench.
    blocked : bool
        Whether the carriage cannot move.
    raises : str
        Reading fails with this message.
    hangs : bool
        Whether reading does not return.
    """

    words: str
    step: float = 1.0
    jump: float = 0.0
    silent: tuple[str, ...] = ()
    hall: float | str = math.nan
    noise: float = 0.0
    later: float = 0.0
    clock: str = ""
    stall: float = 0.0
    cut: tuple[str, ...] = ()
    blocked: bool = False
    raises: str = ""
    hangs: bool = False


FAULTS: dict[str, Fault] = {
    NONE: Fault("nothing is broken"),
    "encoder-frozen": Fault("the encoder's counter stands", step=0.0),
    "encoder-reversed": Fault("the encoder's two channels are swapped", step=-1.0),
    "encoder-skipping": Fault("one count of ten is lost", step=0.9),
    "encoder-jump": Fault("the counter jumps by 500 counts", jump=500.0),
    "encoder-silent": Fault("the counter board does not answer", silent=("encoder",)),
    "hall-stuck": Fault("the A/D board repeats one code", hall="stuck"),
    "hall-range": Fault("the Hall sensor's wire lies on its supply", hall=4.9988),
    "hall-low": Fault("the Hall sensor's wire lies on ground", hall=0.0),
    "hall-noisy": Fault("the Hall sensor's cable has lost its shield: 0.1 V rms", noise=0.1),
    "hall-silent": Fault("the A/D board does not answer", silent=("hall",)),
    "laser-lost": Fault("the laser's beam is interrupted", silent=("laser",)),
    "wire-broken": Fault("no current flows through the wires", cut=("ctrl",)),
    "motor-dead": Fault("the motor's amplifier is off", cut=("motor",)),
    "fan-lost": Fault("the fan does not turn", cut=("fan",)),
    "carriage-stuck": Fault("the carriage is jammed", blocked=True),
    "clock-ahead": Fault("the rig's clock jumps an hour ahead", later=3600.0),
    "clock-back": Fault("the rig's clock jumps 10 s back", later=-10.0),
    "clock-stands": Fault("the rig's clock stands", clock="stands"),
    "clock-none": Fault("the rig gives no time", clock="none"),
    "slow": Fault("every reading takes 5 ms", stall=5e-3),
    "unplugged": Fault("reading fails", raises="the A/D board was unplugged"),
    "hanging": Fault("reading does not return", hangs=True),
}
NAMES = tuple(FAULTS)
_FAULTS = tuple(FAULTS.values())


def board(path: str | os.PathLike[str] | None = None) -> NDArray[np.float64]:
    """The board, mapped from a file or in this process' memory alone.

    Parameters
    ----------
    path : str | os.PathLike[str] | None, optional
        The file, which is made where there is none; None for no file.

    Returns
    -------
    ndarray, shape (CELLS,)
        Indexed by the names above.
    """
    if path is None:
        return np.zeros(CELLS)
    size = 8 * CELLS
    fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        if os.fstat(fd).st_size != size:
            os.ftruncate(fd, size)
        return np.frombuffer(mmap.mmap(fd, size), np.float64)
    finally:
        os.close(fd)


def inject(cells: NDArray[np.float64], name: str) -> None:
    """Switch a fault on from the next sample, in place of the one before.

    Parameters
    ----------
    cells : ndarray, shape (CELLS,)
        The board.
    name : str
        One of `NAMES`; "none" ends it.

    Raises
    ------
    InputError
        There is no such fault.
    """
    if name not in FAULTS:
        raise InputError("fault", name, ", ".join(NAMES))
    cells[WANTED] = NAMES.index(name)


class Faulty(Twin):
    """The twin behind faults; without one it is the twin, bit for bit.

    It always begins where its encoder says.

    Parameters
    ----------
    *given : Any
        As for `Twin`.
    cells : ndarray, shape (CELLS,)
        The board.
    **more : Any
        As for `Twin`, by name.
    """

    counted = True

    def __init__(self, *given: Any, cells: NDArray[np.float64], **more: Any) -> None:
        super().__init__(*given, **more)
        self.calibration = calibration.shipped()  # of the default bench, which this is
        self.clock = VirtualClock(self)
        self.cells = cells
        self._number = 0
        self._fault = _FAULTS[0]
        self._true: float | None = None  # the encoder's last true reading
        self._count = 0.0  # and what it is said to be
        self._hall = 0.0
        self._stands = 0.0
        self._noise_of_fault = np.random.default_rng(0)
        self._wanted = SAFE
        cells[:] = 0.0
        cells[ONSET] = cells[SAFE_AT] = math.nan

    def read(self) -> Sample:
        """Measure all channels through the present fault.

        Returns
        -------
        Sample
            What the rig shows.

        Raises
        ------
        OSError
            The fault is one at which reading fails.
        """
        cells = self.cells
        number = int(cells[WANTED])
        fresh = number != self._number
        if fresh:
            self._number, self._fault = number, _FAULTS[number]
        fault = self._fault
        if fresh:
            cells[FROM], cells[ONSET_NS] = self.state.macro.x, time.monotonic_ns()
        if fault.raises:
            cells[ONSET] = self.tick * self.dt
            raise OSError(fault.raises)
        if fault.hangs:
            cells[ONSET] = self.tick * self.dt
            while int(cells[WANTED]) == number:
                time.sleep(0.01)
        if fault.stall:
            time.sleep(fault.stall)
        true = super().read()
        moved = 0.0 if self._true is None else true.encoder - self._true
        if self._true is None:
            self._count = true.encoder
        self._true = true.encoder
        self._count += moved * fault.step + (fault.jump if fresh else 0.0)
        if fresh:
            cells[ONSET] = true.t if number else math.nan
            self._hall = true.hall
            self._stands = true.t
        cells[TIME] = true.t
        return self._shown(true, fault)

    def _shown(self, true: Sample, fault: Fault) -> Sample:
        hall = true.hall
        if fault.hall == "stuck":
            hall = self._hall
        elif isinstance(fault.hall, float) and not math.isnan(fault.hall):
            hall = fault.hall
        if fault.noise:
            hall += fault.noise * float(self._noise_of_fault.standard_normal())
        # Half a count of slack: parts of a count that a fault leaves show as whole ones.
        count = math.floor(self._count + 1e-6)
        times = {"": true.t + fault.later, "stands": self._stands, "none": math.nan}
        t = times[fault.clock]
        sample = true._replace(t=t, encoder=float(count), hall=hall)
        return sample._replace(**dict.fromkeys(fault.silent, math.nan))

    def write(self, outputs: Outputs) -> None:
        """Set the outputs for the coming period; those that are cut do not get there.

        Parameters
        ----------
        outputs : Outputs
            In V; fan and laser reset 0 or 1.
        """
        self._note(outputs)
        super().write(outputs._replace(**dict.fromkeys(self._fault.cut, 0.0)))

    def advance(self) -> None:
        """Let one control period pass."""
        if self._fault.blocked:  # no motion, and none that the micro-stage could feel
            still = carriage.at_rest(self.state.macro.x)
            self.state = self.state._replace(macro=still, motor=0.0)
        super().advance()
        cells, state = self.cells, self.state
        cells[CARRIAGE] = state.macro.x
        cells[STAGE] = state.macro.x + state.micro.wire.x
        cells[WIRE] = state.micro.wire.temperature

    def stop(self) -> None:
        """Set every output to its safe value."""
        self._note(SAFE)
        super().stop()

    def _note(self, outputs: Outputs) -> None:
        """What was written to the rig, on the board."""
        cells = self.cells
        motor, ctrl, fan, _ = outputs
        if not (abs(motor) <= 5.0 and 0.0 <= ctrl <= 5.0 and fan in (0.0, 1.0)):
            cells[ILLEGAL] += 1
        cells[MOTOR], cells[CTRL], cells[FAN] = motor, ctrl, fan
        if motor == 0.0 and ctrl == 0.0 and fan == 0.0:
            if not cells[SAFE_AT] >= 0.0:
                cells[SAFE_AT], cells[SAFE_NS] = self.tick * self.dt, time.monotonic_ns()
        else:
            cells[SAFE_AT] = math.nan


def twin(seed: int) -> Faulty:
    """The default bench with its faults, compiled and called once.

    Parameters
    ----------
    seed : int
        Seed of the sensor noise.

    Returns
    -------
    Faulty
        Its board is the file that MACROMICRO_FAULTS names.
    """
    from macromicro.kernel import compiled
    from macromicro.plant.bench import Bench, Sensors

    plant = bench.prepare(Bench(), Sensors())
    measure, advance = compiled(bench.measure), compiled(bench.advance)
    first = Twin(plant, 0, measure=measure, advance=advance)
    for _ in range(3):
        first.read()
        first.advance()
    cells = board(os.environ.get(BOARD))
    return Faulty(plant, seed, measure=measure, advance=advance, cells=cells)


def main(arguments: list[str]) -> int:
    """Switch a fault on in a rig that runs.

    Parameters
    ----------
    arguments : list[str]
        The name of the fault.

    Returns
    -------
    int
        Exit status: 0, or 2 after a slip.
    """
    path = os.environ.get(BOARD)
    if len(arguments) != 1 or arguments[0] not in FAULTS or not path or not Path(path).exists():
        print(f"{BOARD}=FILE python -m macromicro.rig.faulty FAULT\n", file=sys.stderr)
        print(f"FILE: the one that the server was started with ({path or 'none is given'})")
        for name, fault in FAULTS.items():
            print(f"  {name:<18} {fault.words}")
        return 2
    inject(board(path), arguments[0])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
