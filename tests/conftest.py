"""What all tests share."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import settings

from macromicro import interpreting, kernel, threads
from tests import warm

threads.one_for_blas()  # as the command does, before a test imports numpy

interpreting.FEW = 10_000  # the tests come back to each machine: compiled soon, it costs less

# A kernel's first call compiles it, which takes seconds: no example has a deadline.
settings.register_profile("macromicro", deadline=None, max_examples=25)
settings.load_profile("macromicro")


_SHARING = ("tests/report/", "tests/serve/web/test_page", "tests/thesis/")
_APART = ("tests/test_blocks.py",)  # each page by itself
# Live machines, which wait for part of their time.
_LIVE = ("tests/serve/", "tests/remote/", "tests/firmware/", "tests/frozen/test_scpi")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What shares most comes first, then what waits: at the end all processes are busy."""
    items.sort(
        key=lambda item: (not item.nodeid.startswith(_SHARING), not item.nodeid.startswith(_LIVE))
    )


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """One process runs all tests that share what a fixture makes: those of a file, or a folder."""
    if config.getoption("dist") != "load":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class Files(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = nodeid.partition("::")[0]
            if file in _APART:
                return nodeid
            return next((f for f in _SHARING if file.startswith(f)), file)

    return Files(config, log)


@pytest.fixture(scope="module", autouse=True)
def _warm_processes() -> Iterator[None]:
    """Loops and workers are forked from a process that is warm; see `tests.warm`."""
    warm.workers_are_forked()
    if "macromicro.serve._launching" in sys.modules:
        warm.loops_are_forked()
    yield
    warm.end()


@pytest.fixture(scope="module", autouse=True)
def _admitted_by_one_file() -> Iterator[None]:
    """Kernels that a test file has admitted are gone after it.

    Each that is admitted begins another cache of compiled kernels, an empty one: all files that
    follow would compile theirs once more, and no other process would share them.
    """
    before = dict(kernel._joined)
    yield
    gone = kernel._joined.keys() - before.keys()
    if not gone:
        return
    from macromicro import joining
    from macromicro.control import outside

    kernel._joined.clear()
    kernel._joined.update(before)
    if kernel._register is not None:
        kernel._point(kernel._numba())
    # Whoever uses them again admits them again.
    joining._modules.difference_update(gone)
    for name in gone:
        outside._laws.pop(name, None)
    for gains in [g for g, name in outside._by_gains.items() if name in gone]:
        del outside._by_gains[gains]
    for name, module in list(sys.modules.items()):
        if name.startswith("macromicro.machines"):
            for made in list(vars(module).values()):
                if hasattr(made, "cache_clear"):
                    made.cache_clear()


@pytest.hookimpl(tryfirst=True)
def pytest_collection() -> None:
    """Thousands of tests stay until the end: the garbage collector leaves them alone."""
    gc.disable()


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.enable()


class _Names:
    """The names of tests that fail, at once: a run that is cut off has told them."""

    def __init__(self, reporter: pytest.TerminalReporter) -> None:
        self._reporter = reporter

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self._reporter.write_line(f"\nfailed ({report.when}): {report.nodeid}")


@pytest.hookimpl(trylast=True)
def pytest_configure(config: pytest.Config) -> None:
    """Also of those that other processes run for this one."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    if reporter is not None:
        config.pluginmanager.register(_Names(reporter))
