"""`macromicro learn`: its files, what it prints, and what is refused."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from macromicro import cli
from macromicro.commands.learn import following
from macromicro.programme import load
from tests.test_programme import LIMITS


def run(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", ["macromicro", "learn", *words])
    return cli.main()


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    t = np.arange(0.0, 2.5, 2e-3)
    x = 200.0 * (1.0 - np.cos(2.0 * np.pi * t))
    rows = [f"{u:.3f},{v:.3f}" for u, v in zip(t, x, strict=True)]
    path = tmp_path / "wave.csv"
    path.write_text("t_s,micro_um\n" + "\n".join([*rows, f"2.5,{x[-1]:.3f}"]) + "\n")
    return path


@pytest.mark.slow
def test_a_wave_is_learned_and_goes_on_being_learned(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    wave: Path,
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    assert run(monkeypatch, str(wave), "--repeats", "3", "--out", str(out)) == 0
    said = capsys.readouterr().out.splitlines()
    rms = [float(line.split()[1]) for line in said[1:4]]
    assert rms[2] < rms[0]
    assert said[-1] == f"next: macromicro run {out / 'learned.csv'}"
    assert (out / "learning.png").read_bytes().startswith(b"\x89PNG")
    learned = load(out / "learned.csv", LIMITS)
    assert np.abs(learned.correction).max() > 1e-6
    again = (str(out / "learned.csv"), "--repeats", "2", "--out", str(tmp_path / "more"))
    assert run(monkeypatch, *again) == 0
    first = float(capsys.readouterr().out.splitlines()[1].split()[1])
    assert first < rms[0], "it goes on from what the file has learned"


def test_the_next_command_names_machine_law_and_rig_for_a_shell() -> None:
    found = following(Path("my results"), Path("a b.toml"), "pd-tuned,inverse", "mylab:bench")
    assert found == (
        "macromicro run 'my results/learned.csv' --config 'a b.toml' --law pd-tuned,inverse "
        "--rig mylab:bench"
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--repeats", "1"), "--repeats: 1; accepted: a whole number from 2 to 1000"),
        (("--lag", "1 mm"), "--lag: '1 mm'"),
        (("--lag", "1 s"), "--lag: '1 s'; accepted: 0 s to 0.1 s"),
        (("--rig", "replay:x.h5"), "x.h5"),
    ],
)
def test_what_is_not_accepted(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    wave: Path,
    tmp_path: Path,
    words: tuple[str, ...],
    message: str,
) -> None:
    assert run(monkeypatch, str(wave), "--out", str(tmp_path / "out"), *words) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_programme_of_moves_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    moves = tmp_path / "moves.toml"
    moves.write_text('[[moves]]\nmicro = ["1 mm"]\n')
    assert run(monkeypatch, str(moves)) == 2
    assert "a programme by time" in capsys.readouterr().err
