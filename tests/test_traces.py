"""Columns over time: what is in which panel, and whose line is whose."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import macromicro
from macromicro import traces
from macromicro.columns import Column
from macromicro.drawing.files import encode
from macromicro.errors import InputError
from macromicro.recording import Recording

UNITS = {
    "macro_reference": "count",
    "macro_position": "count",
    "laser": "um",
    "motor": "V",
    "ctrl": "V",
    "phase": "1",
}
ROWS = 400


def made(start: float = 0.0, rows: int = ROWS, seed: int = 3, **units: str) -> Recording:
    """A recording whose columns are lines of their own slopes."""
    all_units = {**UNITS, **units}
    columns = [Column("t", "s", "time"), *(Column(n, u, n) for n, u in all_units.items())]
    t = start + 1e-3 * np.arange(rows)
    arrays = [t, *(k * t for k in range(1, len(columns)))]
    return Recording.from_arrays(columns, arrays, 1e-3, {"programme": "Ramp", "seed": seed})


def panels(figure: Figure) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    """The lines of each panel, by the label of its y axis, legend entries aside."""
    return {
        ax.get_ylabel(): [
            (np.asarray(line.get_xdata()), np.asarray(line.get_ydata()))
            for line in ax.lines
            if len(line.get_xdata())
        ]
        for ax in figure.axes
    }


def legend(figure: Figure, panel: int = 0) -> list[str]:
    found = figure.axes[panel].get_legend()
    return [] if found is None else [text.get_text() for text in found.get_texts()]


def test_columns_of_one_unit_share_a_panel() -> None:
    """The main ones, where none are named; each with its unit."""
    run = made()
    figure = run.plot()
    shown = panels(figure)
    assert {unit: len(lines) for unit, lines in shown.items()} == {
        "[count]": 2, "[um]": 1, "[V]": 2,
    }  # fmt: skip
    assert legend(figure) == ["macro_reference", "macro_position"]
    assert figure.axes[1].get_title(loc="left") == "laser"
    assert figure.axes[-1].get_xlabel() == "time [s]"
    for x, y in shown["[um]"]:
        np.testing.assert_array_equal(x, run["t"])
        np.testing.assert_array_equal(y, run["laser"])


def test_named_columns_in_their_order() -> None:
    figure = made().plot("motor", "laser", "phase")
    assert list(panels(figure)) == ["[V]", "[um]", "[1]"]


def test_a_recording_without_the_main_columns_shows_its_own() -> None:
    run = Recording.from_arrays(
        [Column("t", "s", ""), Column("thermocouple", "degC", "")], [[0.0, 1.0], [20.0, 21.0]],
        1.0, {},
    )  # fmt: skip
    assert list(panels(run.plot())) == ["[degC]"]


def test_several_on_top_of_each_other() -> None:
    """Each with its own colour, named once."""
    one, two = made(), made(seed=4)
    figure = macromicro.overlay(one, two, columns=["macro_position", "laser"])
    assert {u: len(lines) for u, lines in panels(figure).items()} == {"[count]": 2, "[um]": 2}
    assert legend(figure) == ["Ramp, seed 3", "Ramp, seed 4"] and legend(figure, 1) == []
    colours = [line.get_color() for line in figure.axes[1].lines]
    assert len(set(colours)) == 2
    labelled = macromicro.overlay(one, two, columns="laser", labels=["before", "after"])
    assert legend(labelled) == ["before", "after"]


def test_no_two_lines_of_a_panel_look_the_same() -> None:
    """Of two recordings, two columns and their reference."""
    runs = [made(micro_reference="count", seed=k) for k in (1, 2)]
    names = ["macro_reference", "macro_position"]
    (ax,) = macromicro.overlay(*runs, columns=names).axes
    looks = [(m.get_color(), m.get_linestyle()) for m in ax.lines if len(m.get_xdata())]
    assert len(looks) == len(set(looks)) == 4


def test_recordings_that_begin_at_other_times_count_from_their_first_rows() -> None:
    """As those of the live machine, whose clock runs on."""
    figure = macromicro.overlay(made(), made(start=1000.0, seed=4), columns="laser")
    assert figure.axes[0].get_xlabel() == "time since its first row [s]"
    for x, _ in panels(figure)["[um]"]:
        assert x[0] == 0.0 and x[-1] == pytest.approx(0.399)


def test_words_for_recordings_are_all_different(tmp_path: Path) -> None:
    """The folder's name of recording.h5, the file's name else, and a number where they agree."""
    (tmp_path / "first").mkdir()
    for name in ("first/recording.h5", "first/drive.h5"):
        made().save(tmp_path / name)
    loaded = [Recording.load(tmp_path / n) for n in ("first/recording.h5", "first/drive.h5")]
    assert traces.distinct_labels([*loaded, loaded[0], made(), made()]) == [
        "first", "drive", "first (2)", "Ramp, seed 3", "Ramp, seed 3 (2)",
    ]  # fmt: skip
    found = traces.distinct_labels([loaded[0]] * 3)
    assert all(a != b for a, b in itertools.combinations(found, 2))


def test_no_rows_are_an_empty_panel() -> None:
    assert encode(made(rows=0).plot()).startswith(b"\x89PNG")
    assert encode(macromicro.overlay(made(rows=0), made())).startswith(b"\x89PNG")


def test_what_cannot_be_drawn() -> None:
    run = made()
    other = Recording.from_arrays([Column("t", "s", "")], [[0.0]], 1e-3, {})
    for words, draw in {
        "column: 'lasr'; accepted: t, macro_ref": lambda: run.plot("lasr"),
        "columns: 't'": lambda: run.plot("t"),
        "no recording": macromicro.overlay,
        "1 labels for 2 recordings": lambda: macromicro.overlay(run, run, labels=["a"]),
        "no shared column.*laser": lambda: macromicro.overlay(run, other),
        "column laser: the units differ: um and mm": lambda: macromicro.overlay(
            run, made(laser="mm"), columns=["laser"]
        ),
    }.items():
        with pytest.raises(InputError, match=words):
            draw()


def test_a_column_in_another_unit_is_not_shared() -> None:
    assert traces.common([made(), made(laser="mm")]) == [n for n in UNITS if n != "laser"]
