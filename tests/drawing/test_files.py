"""Figures as files: each format, the same bytes each time, one sentence for a slip."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from macromicro.drawing import files
from macromicro.drawing.style import BLUE, finish, line, new
from macromicro.errors import InputError, ProblemError

HEADS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}

DRAWN = """
import hashlib
import numpy as np
from macromicro.drawing import files
from macromicro.drawing.style import BLUE, finish, line, new
figure, axes = new(3.0, 1, 2)
t = np.linspace(0.0, 1.0, 5000)
line(axes[0, 0], t, np.sin(9.0 * t), BLUE, "sine")
axes[0, 1].fill_between(t, np.cos(t), hatch="/")
finish(axes[0, 0], "a sine [mm]", legend=True)
print(*(hashlib.sha256(files.encode(figure, kind)).hexdigest() for kind in files.FORMATS))
"""


def figure() -> Figure:
    made, axes = new(3.0, 1)
    t = np.linspace(0.0, 1.0, 5000)
    line(axes[0, 0], t, np.sin(9.0 * t), BLUE, "sine")
    finish(axes[0, 0], "a sine [mm]", legend=True)
    return made


@pytest.mark.parametrize("kind", files.FORMATS)
def test_a_figure_is_a_file_without_dates(kind: str) -> None:
    data = files.encode(figure(), kind)
    assert data.startswith(HEADS[kind])
    assert b"CreationDate" not in data and b"dc:date" not in data


@pytest.mark.slow
def test_processes_write_the_same_bytes() -> None:
    """Neither the clock nor the seed of Python's hashes is in them."""
    said = [
        subprocess.run(
            [sys.executable, "-c", DRAWN],
            env={"PYTHONHASHSEED": seed, "SOURCE_DATE_EPOCH": epoch},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed, epoch in (("1", "0"), ("2", "1000000000"))
    ]
    assert said[0] == said[1] and len(said[0].split()) == 3


def test_saved_are_the_formats_asked_for(tmp_path: Path) -> None:
    """What comes back is a PNG for a page, in any case."""
    shown = files.save(figure(), tmp_path, "sine", ("svg", "pdf"))
    assert shown.startswith(HEADS["png"])
    assert {p.name for p in tmp_path.iterdir()} == {"sine.svg", "sine.pdf"}
    assert {p.name for p in tmp_path.iterdir()} < set(files.names(["sine"]))
    assert files.save(figure(), tmp_path, "sine") == (tmp_path / "sine.png").read_bytes()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("svg", ("svg",)),
        ("svg,pdf", ("svg", "pdf")),
        (" PNG, .svg,png", ("png", "svg")),
        (("pdf",), ("pdf",)),
        ("none", ()),
    ],
)
def test_formats_are_read(text: str, found: tuple[str, ...]) -> None:
    assert files.formats(text) == found


@pytest.mark.parametrize("text", ["jpg", "", "svg,", "svg pdf"])
def test_other_formats_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"--figures.*accepted: png, svg, pdf"):
        files.formats(text)


def test_without_matplotlib_there_are_no_figures(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert files.formats("png,svg") == ()
    assert "pip install 'macromicro[figures]'" in capsys.readouterr().err
    with pytest.raises(ProblemError, match=r"macromicro\[figures\]"):
        new(3.0, 1)
