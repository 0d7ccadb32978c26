"""The connection to a dask cluster whose workers have the same code."""

from __future__ import annotations

import asyncio
import logging
import re
from typing import TYPE_CHECKING

from macromicro.errors import ProblemError
from macromicro.extras import require
from macromicro.schema.text import printable
from macromicro.sweeps._provenance import Provenance, running

if TYPE_CHECKING:
    from distributed import Client

_ADDRESS = r"([a-z]+://)?[^\s/@]+:\d{1,5}"
_ACCEPTED = "Give the address of a running dask scheduler, such as tcp://HOST:8786."
_CONNECT = 5.0  # s
_WORKERS = 20.0  # s to wait for a first worker


def connect(address: str, ours: Provenance) -> Client:
    require("--scheduler", "distributed", "cluster")
    from distributed import Client

    where = f"--scheduler {printable(address, 200)}"
    if not re.fullmatch(_ADDRESS, address):
        raise ProblemError(where, "not an address", _ACCEPTED)
    for name in logging.root.manager.loggerDict:  # their tracebacks; our errors are one sentence
        if name.startswith("distributed"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        # A client that finds no scheduler complains when it is deleted.
        asyncio.run(_identity(address))
        client = Client(address, timeout=_CONNECT, set_as_default=False)
    except Exception as error:  # whatever answers there
        raise ProblemError(where, printable(error, 200) or "no answer", _ACCEPTED) from None
    try:
        _check_workers(client, where, ours)
    except BaseException:
        client.close()
        raise
    return client


async def _identity(address: str) -> None:
    from distributed import rpc

    async with rpc(address, timeout=_CONNECT) as scheduler:
        await scheduler.identity()


def _check_workers(client: Client, where: str, ours: Provenance) -> None:
    try:
        client.wait_for_workers(1, timeout=_WORKERS)
        found = client.run(running)
    except TimeoutError:
        none = "the scheduler has no workers"
        raise ProblemError(where, none, "Start at least one.") from None
    except Exception as error:  # no macromicro on a worker, or an old one
        words = f"{type(error).__name__}: {printable(error, 200)}"
        raise ProblemError(where, words, f"Install macromicro {ours} on every worker.") from None
    for worker, theirs in found.items():
        if theirs != ours:
            has, install = f"it has macromicro {theirs}", f"Install {ours} on every worker."
            raise ProblemError(f"{where}, worker {worker}", has, install)
