"""Shared libraries of exported C: for this system by cc, for any system by the package ziglang."""

from __future__ import annotations

import platform
import shutil
import struct
import subprocess
import sys
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from macromicro.errors import InputError, MacromicroError, ProblemError
from macromicro.extras import remedy
from macromicro.schema.text import printable

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-shared")
_PAGE = 14  # of Apple's processors, as a power of two


class System(NamedTuple):
    folder: str  # of the library in an FMU
    suffix: str
    targets: tuple[str, ...]  # as Zig names them; several become one universal library
    machine: tuple[str, str]  # a computer of that kind, as Python's `platform` names it
    flags: tuple[str, ...] = ("-fPIC",)


SYSTEMS = {
    "linux": System("linux64", ".so", ("x86_64-linux-gnu.2.17",), ("Linux", "x86_64")),
    "linux-arm": System("aarch64-linux", ".so", ("aarch64-linux-gnu.2.17",), ("Linux", "aarch64")),
    "windows": System("win64", ".dll", ("x86_64-windows-gnu",), ("Windows", "AMD64"), ()),
    "macos": System("darwin64", ".dylib", ("x86_64-macos", "aarch64-macos"), ("Darwin", "arm64")),
}
UNNAMED = ("linux-arm",)  # FMI 2.0 has no name for them; the folder is that of FMI 3.0


def systems(text: str | None) -> tuple[str, ...]:
    """The systems of the option `--for`; none without it."""
    names = tuple(dict.fromkeys(word.strip() for word in (text or "").split(",") if text))
    for name in names:
        if name not in SYSTEMS:
            raise InputError("--for", printable(name), f"one or more of {','.join(SYSTEMS)}")
    return names


def libraries(
    name: str, texts: Mapping[str, str], wanted: Sequence[str] = (), hidden: bool = False
) -> dict[str, bytes]:
    """Libraries of C files, by path; without `wanted` that of this system.

    `hidden` hides the functions that are not marked as exported.
    """
    _require(wanted)
    visible = ("-fvisibility=hidden",) if hidden else ()
    sources = [file for file in texts if file.endswith(".c")]
    made = {}
    with TemporaryDirectory() as folder:
        for file, text in texts.items():
            (Path(folder) / file).write_text(text, encoding="utf-8")
        for each in [SYSTEMS[key] for key in wanted or _here()]:
            library = f"{name}{each.suffix}"
            options = [*FLAGS, *visible, *each.flags, *sources, "-o", library, "-lm"]
            parts = [
                _build(Path(folder), [*command, *options], library)
                for command in ([["cc"]] if not wanted and _own_compiler() else _zig(each))
            ]
            made[f"{each.folder}/{library}"] = parts[0] if len(parts) == 1 else _universal(parts)
    return made


def _require(wanted: Sequence[str]) -> None:
    """A compiler for these systems, or an error with the remedy."""
    if find_spec("ziglang") is not None or (not wanted and _own_compiler()):
        return
    if wanted:
        raise ProblemError("--for", "ziglang is not installed", f"Install it: {remedy('cross')}")
    raise MacromicroError(
        "an FMU needs a C compiler: cc on Linux x86_64 (Debian, Ubuntu: apt-get install gcc "
        f"libc6-dev), or {remedy('cross')}"
    )


def _own_compiler() -> bool:
    """Whether cc compiles for this system as for the `linux` of the table."""
    here = (platform.system(), platform.machine())
    return here == SYSTEMS["linux"].machine and shutil.which("cc") is not None


def _here() -> list[str]:
    kernel, processor = platform.system(), platform.machine()
    for name, each in SYSTEMS.items():
        if each.machine == (kernel, processor) or (name == "macos" and kernel == "Darwin"):
            return [name]
    problem = f"no library can be built for {kernel} on {processor} itself"
    raise ProblemError("--for", problem, f"Name one or more of {','.join(SYSTEMS)}.")


def _zig(system: System) -> list[list[str]]:
    """Commands of the compiler, one a processor."""
    start = [sys.executable, "-m", "ziglang", "cc", "-s", "-target"]
    return [[*start, target] for target in system.targets]


def _build(folder: Path, command: Sequence[str], library: str) -> bytes:
    done = subprocess.run(
        command, cwd=folder, capture_output=True, encoding="utf-8", errors="replace", check=False
    )
    if done.returncode:
        reason = next(iter(done.stderr.strip().splitlines()), f"status {done.returncode}")
        raise MacromicroError(f"the C compiler failed to compile {library}: {reason}")
    return (folder / library).read_bytes()


def _universal(parts: Sequence[bytes]) -> bytes:
    """One Mach-O file of those for several processors."""
    header, body = struct.pack(">2I", 0xCAFEBABE, len(parts)), b""
    page = 1 << _PAGE
    for part in parts:
        body += b"\0" * (-len(body) % page)
        processor, kind = struct.unpack_from("<2I", part, 4)
        header += struct.pack(">5I", processor, kind, page + len(body), len(part), _PAGE)
        body += part
    return header.ljust(page, b"\0") + body
