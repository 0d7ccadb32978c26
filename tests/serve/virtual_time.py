"""An event loop whose clock goes on only while it would wait: what takes seconds takes none."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any


class VirtualLoop(asyncio.SelectorEventLoop):
    """Calls of threads are made at once, as nothing else could go on meanwhile."""

    def __init__(self) -> None:
        super().__init__()
        self._passed = 0.0
        ready = self._selector.select  # type: ignore[attr-defined]

        def select(timeout: float | None) -> Any:
            self._passed += timeout or 0.0
            return ready(None if timeout is None else 0.0)

        self._selector.select = select  # type: ignore[attr-defined]

    def time(self) -> float:
        """Seconds that have passed."""
        return self._passed

    def run_in_executor(self, executor: Any, func: Callable[..., Any], *args: Any) -> Any:
        """Call it now; the future has its result."""
        future = self.create_future()
        try:
            future.set_result(func(*args))
        except Exception as error:
            future.set_exception(error)
        return future


def run(main: Coroutine[Any, Any, Any]) -> Any:
    """As `asyncio.run`, in virtual time."""
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        return runner.run(main)
