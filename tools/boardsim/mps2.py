"""The firmware's core on a Cortex-M4F, Arm's MPS2 as QEMU has it; its pins are a serial line."""

from __future__ import annotations

import contextlib
import math
import shutil
import socket
import struct
import subprocess
from pathlib import Path
from tempfile import mkdtemp

from boardsim.avr import PERIOD, Died
from macromicro.rig.board.protocol import SPEC

_MOTOR, _WIRE = 800, 250  # steps of a whole duty, as board.h has them
_ANSWER = struct.Struct("<hhBH")
_CONVERSIONS = 16
_PATIENCE = 60.0  # s


def missing() -> str:
    """What is lacking on this machine; "" if nothing."""
    for tool in ("arm-none-eabi-gcc", "qemu-system-arm", "make"):
        if shutil.which(tool) is None:
            return f"no {tool} here: make arm"
    return ""


class Mps2:
    """A board with a program in it, with the methods of `boardsim.avr.Avr`.

    Parameters
    ----------
    elf : Path
        The program.
    """

    def __init__(self, elf: Path) -> None:
        self._folder = Path(mkdtemp(prefix="mps2"))
        names = ("host", "pins", "monitor")
        command = ["qemu-system-arm", "-M", "mps2-an386", "-kernel", str(elf), "-display", "none"]
        command += ["-icount", "shift=5,sleep=off"]
        for name in names:
            place = f"path={self._folder / name},server=on,wait=on"
            command += ["-chardev", f"socket,id={name},{place}"]
        command += ["-serial", "chardev:host", "-serial", "chardev:pins", "-monitor"]
        # It says there that it waits for its lines.
        self._process = subprocess.Popen([*command, "chardev:monitor"], stderr=subprocess.DEVNULL)
        self._host, self._pins, self._monitor = (self._connected(name) for name in names)
        self._levels = dict.fromkeys(("encoder_a", "encoder_b"), 0)
        self._lines: dict[str, int] = {}
        self._edges = bytearray()
        self._hall: list[int] = []
        self._given = self._taken = 0  # bytes of the host line since the reset
        self._told = (0, 0, 0, 0)
        self._due = 0

    def _connected(self, name: str) -> socket.socket:
        line = socket.socket(socket.AF_UNIX)
        line.settimeout(_PATIENCE)
        while True:
            with contextlib.suppress(FileNotFoundError, ConnectionRefusedError):
                line.connect(str(self._folder / name))
                return line
            if self._process.poll() is not None:
                raise Died("qemu-system-arm ended as it began")

    def close(self) -> None:
        """End the simulator."""
        self._process.kill()
        self._process.wait()
        for line in (self._host, self._pins, self._monitor):
            line.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _read(self, line: socket.socket, size: int) -> bytes:
        found = b""
        while len(found) < size:
            try:
                part = line.recv(size - len(found))
            except TimeoutError:
                raise Died("the processor does not answer any more") from None
            if not part:
                raise Died("the simulator has ended")
            found += part
        return found

    def run(self, until: int) -> None:
        """Let time pass; the inputs until a period's end are seen at the next one's begin."""
        if until <= self._due:
            return
        self._due += PERIOD
        codes = self._hall[-_CONVERSIONS:]
        hall = 0xFFFF if len(codes) < _CONVERSIONS else sum(codes) // (_CONVERSIONS // 4)
        lines = 0
        for name, bit in SPEC["lines"].items():
            active = self._lines.get(name, 0) == 1
            lines |= (active ^ (name == "bridge_fault")) << bit
        head = struct.pack("<HHBB", self._given & 0xFFFF, hall, lines, len(self._edges))
        self._pins.sendall(head + bytes(self._edges))
        self._edges.clear()
        self._hall = codes
        self._told = _ANSWER.unpack(self._read(self._pins, _ANSWER.size))

    def reset(self) -> None:
        """Pull the reset pin: the RAM stays, what the host has sent is gone."""
        self._monitor.sendall(b"system_reset\n")
        self._monitor.sendall(b"info registers\n")  # answered behind the reset
        seen = b""
        while b"R15=" not in seen:
            seen += self._monitor.recv(65536)
        self._host.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while self._host.recv(65536):
                pass
        self._host.settimeout(_PATIENCE)
        self._given = self._taken = 0
        self._told = (0, 0, 0, 0)
        self._hall.clear()

    def pin(self, name: str, level: int, when: int | None = None) -> None:
        """Set an input; edges of the encoder in their order."""
        if name in self._levels:
            self._levels[name] = level
            self._edges.append(self._levels["encoder_a"] | self._levels["encoder_b"] << 1)
        else:
            self._lines[name] = level

    def hall(self, volts: float) -> None:
        """A conversion of 10 bits of the Hall sensor's voltage."""
        self._hall.append(min(max(math.floor(volts / 5.0 * 1024 + 0.5), 0), 1023))

    def put(self, data: bytes) -> None:
        """Bytes of the host."""
        self._host.sendall(data)
        self._given += len(data)

    def take(self) -> bytes:
        """What the board has sent to the host since the last call."""
        size = (self._told[3] - self._taken) & 0xFFFF
        self._taken += size
        return self._read(self._host, size)

    def level(self, name: str) -> int:
        """Whether the bridge is enabled."""
        return int(self._told[2]) if name == "enable" else 0

    def duties(self) -> tuple[float, float]:
        """What is put out on average: motor, wire."""
        motor, wire, enabled, _ = self._told
        return (motor / _MOTOR if enabled else 0.0), wire / _WIRE
