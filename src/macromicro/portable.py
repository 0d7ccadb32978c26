"""What the operating systems call by different names."""

from __future__ import annotations

import os
from pathlib import Path

# Windows would translate line ends.
BINARY = getattr(os, "O_BINARY", 0)
READ_WRITE = os.O_RDWR | os.O_CREAT | BINARY
_LOCKED_BYTE = 1 << 30  # Windows locks bytes; this one is in no file


def lock(fd: int) -> None:
    """Lock an open file until it is closed; BlockingIOError if another process has locked it."""
    try:
        import fcntl
    except ImportError:
        _lock_byte(fd)
    else:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _lock_byte(fd: int) -> None:
    try:
        import msvcrt
    except ImportError:  # a system without locks
        return
    os.lseek(fd, _LOCKED_BYTE, os.SEEK_SET)
    try:
        msvcrt.locking(fd, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    except OSError as error:
        raise BlockingIOError(error.errno, error.strerror) from None


def read_at(fd: int, size: int, offset: int) -> bytes:
    if hasattr(os, "pread"):
        return os.pread(fd, size, offset)
    os.lseek(fd, offset, os.SEEK_SET)
    return os.read(fd, size)


def write_at(fd: int, data: memoryview | bytes, offset: int) -> int:
    """Write data, of which the system may take a part; the number of bytes taken."""
    if hasattr(os, "pwrite"):
        return os.pwrite(fd, data, offset)
    os.lseek(fd, offset, os.SEEK_SET)
    return os.write(fd, data)


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def replace_open(part: Path, path: Path, fd: int, old: int) -> int:
    """Replace an open file, or none (-1), by another open one; the new one's descriptor."""
    if os.name != "nt":
        os.replace(part, path)
        if old >= 0:
            os.close(old)
        return fd
    for each in (fd, old):  # Windows moves no open file
        if each >= 0:
            os.close(each)
    os.replace(part, path)
    return os.open(path, READ_WRITE)
