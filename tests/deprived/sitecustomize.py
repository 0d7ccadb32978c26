"""Takes away from this package what other systems lack; its dependencies keep it.

A process with this folder on PYTHONPATH runs so, and every process that it starts. DEPRIVED names
other packages, with commas between.
"""

from __future__ import annotations

import builtins
import os
import signal
import socket
import sys
import types
from typing import Any

MODULES = ("fcntl", "resource", "termios", "tty", "pty", "pwd", "grp")
NAMES = {
    "os": (
        "fork", "forkpty", "getuid", "geteuid", "getpgid", "killpg", "memfd_create", "mkfifo",
        "posix_fallocate", "pread", "pwrite", "sched_getaffinity", "sched_param",
        "sched_setaffinity", "sched_setscheduler", "setsid", "sysconf", "uname", "O_CLOEXEC",
        "O_DIRECTORY",
    ),
    "signal": (
        "SIGALRM", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2", "ITIMER_REAL", "alarm",
        "pthread_sigmask", "setitimer",
    ),
    "socket": ("AF_UNIX", "MSG_DONTWAIT", "SOCK_SEQPACKET", "SO_PEERCRED"),
}  # fmt: skip
FILES = ("/proc/", "/sys/")


def loopback_pair() -> tuple[socket.socket, socket.socket]:
    """As `socket.socketpair` makes one on Windows."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        ours = socket.create_connection(server.getsockname())
        theirs, _ = server.accept()
    return ours, theirs


def without(module: types.ModuleType, names: tuple[str, ...]) -> types.ModuleType:
    """The module without some names."""
    made = types.ModuleType(module.__name__)
    made.__dict__.update({k: v for k, v in vars(module).items() if k not in names})
    return made


PROXIES = {name: without(sys.modules[name], NAMES[name]) for name in NAMES}
PROXIES["socket"].socketpair = loopback_pair  # type: ignore[attr-defined]
_import = builtins.__import__


def _ours(name: str) -> bool:
    return name.partition(".")[0] in os.environ.get("DEPRIVED", "macromicro").split(",")


def _deprived(name: str, *rest: Any, **named: Any) -> Any:
    importer = (rest[0] if rest else named.get("globals")) or {}
    if _ours(importer.get("__name__") or ""):
        if name in MODULES:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        if name in PROXIES:
            return PROXIES[name]
    return _import(name, *rest, **named)


def _audited(event: str, arguments: tuple[Any, ...]) -> None:
    if event != "open" or not str(arguments[0]).startswith(FILES):
        return
    frame = sys._getframe(1)
    while frame is not None and frame.f_globals.get("__name__") in ("io", "pathlib"):
        frame = frame.f_back
    if frame is not None and _ours(frame.f_globals.get("__name__", "")):
        raise FileNotFoundError(2, "No such file or directory", str(arguments[0]))


builtins.__import__ = _deprived
sys.addaudithook(_audited)
assert os.fork and signal.SIGHUP  # the modules themselves are as before
