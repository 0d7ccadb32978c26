"""A run whose law cannot be compiled: the same rows, and the same end, as the compiled one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from macromicro import simulate
from macromicro.control.macro import MacroLaw
from macromicro.runs.programmed import TwoStageSetup, load
from macromicro.settings import Settings


class Rows(list):
    def append(self, block: np.ndarray) -> None:
        super().append(block.copy())

    @property
    def all(self) -> np.ndarray:
        return np.concatenate(self, axis=1)


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every law is taken for one of plain Python."""
    monkeypatch.setattr(MacroLaw, "compiles", property(lambda self: False))


@pytest.fixture
def moves(tmp_path: Path) -> Path:
    """Both stages, with a parked carriage between them."""
    path = tmp_path / "moves.toml"
    path.write_text(
        '[[moves]]\nmacro = "30 mm"\nhold = "0.5 s"\n[[moves]]\nmicro = "1 mm"\nhold = "2 s"\n'
        '[[moves]]\nmacro = "10 mm"\nhold = "0.5 s"\n'
    )
    return path


def told(seconds: float, asked: list[tuple[float, int]]):
    def progress(t: float, move: int) -> None:
        asked.append((t, move))
        if t >= seconds:
            raise RuntimeError

    return progress


def test_rows_are_those_of_the_compiled_run(request: pytest.FixtureRequest, moves: Path) -> None:
    settings = Settings()
    what = load(moves, settings)
    first, second = Rows(), Rows()
    before = simulate.simulate(settings, what, first, seed=3)
    request.getfixturevalue("plain")
    TwoStageSetup(settings, what).compile()
    after = simulate.simulate(settings, what, second, seed=3)
    assert np.array_equal(first.all, second.all, equal_nan=True)
    assert (before.finished, before.simulated) == (after.finished, after.simulated)
    assert before.finished and repr(before.watch) == repr(after.watch)  # NaN among them


def test_one_that_is_ended_has_the_last_row_too(
    request: pytest.FixtureRequest, moves: Path
) -> None:
    settings = Settings()
    what = load(moves, settings)
    rows, heard = [Rows(), Rows()], [[], []]
    for k in range(2):
        if k:
            request.getfixturevalue("plain")
        with pytest.raises(RuntimeError):
            simulate.simulate(settings, what, rows[k], progress=told(5.0, heard[k]))
    assert heard[0] == heard[1] == [(5.0, heard[0][0][1])]
    assert np.array_equal(rows[0].all, rows[1].all, equal_nan=True)
    assert rows[0].all.shape[1] == 5001
