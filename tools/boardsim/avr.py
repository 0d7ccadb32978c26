"""The very binary of the ATmega328P in simavr: its clock, pins, converter and UART."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp

from macromicro.rig.board.protocol import table

SHIM = Path(__file__).with_name("shim.c")
CLOCK = 16_000_000  # Hz
PERIOD = 16_000  # cycles of a control period
_HALF = 0.5 * 5.0 / 1024  # V; half a step of the converter
_WRITING = 1_000  # cycles that interrupts are held up, at most
_DEAD = 5  # cpu_Done and beyond
_DDR = {"B": 0x24, "C": 0x27, "D": 0x2A}  # data sheet, register summary; PORT is behind it
_TCCR0A, _OCR0A, _OCR0B = 0x44, 0x47, 0x48
_TCCR1A, _ICR1, _OCR1A, _OCR1B = 0x80, 0x86, 0x88, 0x8A
PINS = {name: pin["port"][1:] for name, pin in table("pins").items() if name != "board"}


def missing() -> str:
    """What the simulator lacks on this machine.

    Returns
    -------
    str
        "" if nothing.
    """
    for tool in ("avr-gcc", "cc", "make"):
        if shutil.which(tool) is None:
            return f"no {tool} here: make avr"
    if not Path("/usr/include/simavr/sim_avr.h").exists():
        return "no libsimavr here: make avr"
    return ""


def _library() -> ctypes.CDLL:
    """The shim, compiled anew each time: it takes a second, and the library keeps one AVR."""
    folder = Path(mkdtemp(prefix="boardsim"))
    made = folder / "shim.so"
    command = [
        *("cc", "-O2", "-shared", "-fPIC", "-I/usr/include/simavr"),
        *("-o", str(made), str(SHIM), "-lsimavr", "-lelf"),
    ]
    subprocess.run(command, check=True, capture_output=True)
    library = ctypes.CDLL(str(made))
    shutil.rmtree(folder)
    library.sim_cycle.restype = ctypes.c_uint64
    library.sim_run.argtypes = [ctypes.c_uint64]
    library.sim_later.argtypes = [ctypes.c_uint64, ctypes.c_char, ctypes.c_int, ctypes.c_int]
    library.sim_pin.argtypes = [ctypes.c_char, ctypes.c_int, ctypes.c_int]
    library.sim_mend.argtypes = [ctypes.c_int, ctypes.c_uint16]
    return library


class Died(Exception):
    """The simulated processor stopped."""


class Avr:
    """An ATmega328P with a program in it.

    Parameters
    ----------
    elf : Path
        The program.
    """

    def __init__(self, elf: Path) -> None:
        self._library = _library()
        failed = self._library.sim_open(str(elf).encode())
        if failed:
            raise Died(f"{elf}: simavr does not take it ({failed})")

    @property
    def cycle(self) -> int:
        """Cycles since it was switched on."""
        return int(self._library.sim_cycle())

    def run(self, until: int) -> None:
        """Let time pass.

        Parameters
        ----------
        until : int
            Cycle.

        Raises
        ------
        Died
            The processor stopped.
        """
        if self._library.sim_run(until) >= _DEAD:
            raise Died(f"the processor stopped at cycle {self.cycle}")

    def reset(self) -> None:
        """Pull the reset pin."""
        self._library.sim_reset()

    def hang(self) -> Callable[[], None]:
        """Let the main loop stand still, interrupts go on; what mends it again."""
        was = ctypes.c_uint16()
        place = self._library.sim_hang(ctypes.byref(was))
        return lambda: self._library.sim_mend(place, was)

    def pin(self, name: str, level: int, when: int | None = None) -> None:
        """Set an input.

        Parameters
        ----------
        name : str
            Of pins.toml.
        level : int
            0 or 1.
        when : int | None, optional
            Cycle; None for now.
        """
        port, bit = PINS[name][0].encode(), int(PINS[name][1])
        if when is None:
            self._library.sim_pin(port, bit, level)
        elif self._library.sim_later(when, port, bit, level):
            raise Died("more edges than the simulator has room for")

    def hall(self, volts: float) -> None:
        """Voltage at the Hall sensor's pin.

        Parameters
        ----------
        volts : float
            V. simavr takes whole mV, and cuts off where the converter rounds: by its data sheet
            the first code ends at half a step.
        """
        level = min(max(volts + _HALF, 0.0), 5.0)
        self._library.sim_volts(int(PINS["hall"][1]), round(1e3 * level))

    def put(self, data: bytes) -> None:
        """Bytes to its UART, one after the other at 1 Mbaud.

        Parameters
        ----------
        data : bytes
            Any.
        """
        self._library.sim_put(data, len(data))

    def take(self) -> bytes:
        """What its UART has sent since the last call.

        Returns
        -------
        bytes
            All of it.
        """
        room = ctypes.create_string_buffer(65536)
        size = self._library.sim_take(room, 65536)
        return room.raw[:size]

    def _byte(self, address: int) -> int:
        return int(self._library.sim_register(address))

    def _word(self, address: int) -> int:
        return self._byte(address) | self._byte(address + 1) << 8

    def level(self, name: str) -> int:
        """State of an output pin that no timer drives.

        Parameters
        ----------
        name : str
            Of pins.toml.

        Returns
        -------
        int
            1 if it is driven high; an input is 0, as its resistor to ground says.
        """
        ddr, bit = _DDR[PINS[name][0]], int(PINS[name][1])
        return (self._byte(ddr) & self._byte(ddr + 1)) >> bit & 1

    def duties(self) -> tuple[float, float]:
        """What the pins put out on average; time passes until no duty is half written.

        Returns
        -------
        motor : float
            -1 to 1; 0 while the bridge is not enabled.
        wire : float
            0 to 1.

        Raises
        ------
        Died
            The processor stopped.
        """
        if self._library.sim_settle(_WRITING) >= _DEAD:
            raise Died(f"the processor stopped at cycle {self.cycle}")
        control1, top = self._byte(_TCCR1A), self._word(_ICR1) + 1
        forward = self._duty("motor_forward", control1 & 0x80, (self._word(_OCR1A) + 1) / top)
        back = self._duty("motor_back", control1 & 0x20, (self._word(_OCR1B) + 1) / top)
        wire = self._duty(
            "wire", self._byte(_TCCR0A) & 0x20, (self._byte(_OCR0B) + 1) / (self._byte(_OCR0A) + 1)
        )
        return (forward - back if self.level("enable") else 0.0), wire

    def _duty(self, name: str, connected: int, duty: float) -> float:
        """Of a pin: its timer's, or what its port register says."""
        if not connected:
            return float(self.level(name))
        ddr, bit = _DDR[PINS[name][0]], int(PINS[name][1])
        return duty if self._byte(ddr) >> bit & 1 else 0.0
