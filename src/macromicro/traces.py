"""Plots of columns over time, of one or several recordings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, finish, line, new
from macromicro.errors import InputError, ProblemError
from macromicro.recording_format import TIME
from macromicro.schema.keys import nearest
from macromicro.schema.par import NO_UNIT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.recording import Recording

# What is drawn where nothing is named: what the stages should do and did, and the efforts.
MAIN = (
    "macro_reference",
    "macro_position",
    "micro_reference",
    "hall_position",
    "laser",
    "motor",
    "ctrl",
)
_FEW = 6  # columns of a recording that has none of these
_COLOURS = (BLUE, RED, GREEN, PURPLE, BLACK, ORANGE)
_STYLES = ("-", ":", "-.")
_MOST = 6  # columns of a panel, of a recording alone
_REFERENCE = "_reference"


def overlay(
    *recordings: Recording,
    columns: Sequence[str] = (),
    labels: Sequence[str] = (),
) -> Figure:
    """Draw columns of several recordings on top of each other, over time.

    Columns of one unit share a panel, as many as can be told apart. Where the recordings do not
    begin at the same time, each counts from its own first row.

    Parameters
    ----------
    *recordings : Recording
        One or more.
    columns : Sequence[str], optional
        Names; by default references, positions, laser and efforts that all recordings have.
    labels : Sequence[str], optional
        A word for each recording; by default its folder or file, or programme and seed.

    Returns
    -------
    Figure
        Of matplotlib, in no window: ``figure.savefig("both.png")``.

    Raises
    ------
    InputError
        A column that one of the recordings lacks.
    ProblemError
        No recording, no shared column, different units, or another number of labels.

    Examples
    --------
    >>> from macromicro import Recording, overlay
    >>> from macromicro.recording import Column
    >>> columns = [Column("t", "s", "time"), Column("motor", "V", "voltage of the motor")]
    >>> runs = [Recording.from_arrays(columns, [[0.0, 0.1], [u, 0.0]], 0.1, {}) for u in (1.0, 2.0)]
    >>> figure = overlay(*runs, columns=["motor"], labels=["1 V", "2 V"])
    >>> figure.axes[0].get_ylabel()
    '[V]'
    """
    names = [columns] if isinstance(columns, str) else list(columns)
    if not recordings:
        raise ProblemError("overlay", "no recording", "Give one or more.")
    names = names or default_columns(recordings)
    words = list(labels) or distinct_labels(recordings)
    if len(words) != len(recordings):
        problem = f"{len(words)} labels for {len(recordings)} recordings"
        raise ProblemError("overlay, labels", problem)
    shown = panels(recordings, names)
    figure, axes = new(0.95 + 1.45 * len(shown), len(shown), sharex=True)
    apart = begin_apart(recordings)
    for ax, (unit, inside) in zip(axes[:, 0], shown, strict=True):
        _draw(ax, recordings, words, inside, own=apart, named=ax is axes[0, 0])
        last = ax is axes[-1, 0]
        below = "time since its first row [s]" if apart else "time [s]"
        title = inside[0] if len(inside) == 1 else ""
        told = bool(ax.get_legend_handles_labels()[1])
        finish(ax, title, below if last else "", f"[{unit}]", legend=told)
    figure.align_ylabels(list(axes[:, 0]))
    figure.subplots_adjust(hspace=0.32, left=0.105)
    return figure


def begin_apart(recordings: Sequence[Recording]) -> bool:
    """Whether recordings begin at different times, so that each counts from its first row."""
    starts = [float(r[TIME][0]) for r in recordings if len(r)]
    return len(starts) > 1 and max(starts) - min(starts) > recordings[0].dt


def default_columns(recordings: Sequence[Recording]) -> list[str]:
    """Default columns."""
    shared = common(recordings)
    found = [name for name in MAIN if name in shared] or shared[:_FEW]
    if not found:
        has = ", ".join(c.name for c in recordings[0].columns if c.name != TIME)
        remedy = f"Use recordings that share one of {has}."
        raise ProblemError("overlay", "no shared column", remedy)
    return found


def common(recordings: Sequence[Recording]) -> list[str]:
    """Columns that all recordings have in the same unit."""
    first, *others = recordings
    return [
        c.name
        for c in first.columns
        if c.name != TIME and all(c.name in r and r.unit(c.name) == c.unit for r in others)
    ]


def distinct_labels(recordings: Sequence[Recording]) -> list[str]:
    """A distinct label for each recording."""
    found: list[str] = []
    for recording in recordings:
        word = recording.label
        alike = sum(w == word or w.startswith(f"{word} (") for w in found)
        found.append(f"{word} ({alike + 1})" if alike else word)
    return found


def panels(recordings: Sequence[Recording], names: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Columns of one unit, as many per panel as can be told apart."""
    found: list[tuple[str, list[str]]] = []
    most = _MOST if len(recordings) == 1 else len(_STYLES)
    for name in dict.fromkeys(names):
        unit = recordings[0].unit(name)
        if name == TIME:
            accepted = nearest(name, [c.name for c in recordings[0].columns if c.name != TIME])
            raise InputError("columns", name, accepted)
        for other in recordings[1:]:
            if other.unit(name) != unit:
                units = f"{unit} and {other.unit(name)}"
                problem = f"the units differ: {units}"
                raise ProblemError(f"overlay, column {name}", problem)
        beside = [
            inside
            for its, inside in found
            if its == unit and its not in NO_UNIT and len(_plain([*inside, name])) <= most
        ]
        if beside:
            beside[0].append(name)
        else:
            found.append((unit, [name]))
    return found


def _plain(names: Sequence[str]) -> list[str]:
    """Columns that are no references."""
    return [name for name in names if not name.endswith(_REFERENCE)]


def _draw(
    ax: Any,
    recordings: Sequence[Recording],
    words: Sequence[str],
    inside: Sequence[str],
    *,
    own: bool,
    named: bool,
) -> None:
    """One panel, with the recordings' names in its legend if `named`."""
    alone = len(recordings) == 1
    plain = _plain(inside)
    for k, recording in enumerate(recordings):
        t = _times(recording, own=own)
        for name in inside:
            line(ax, t, recording[name], label="", **_look(name, plain, k, alone=alone))
    if named and not alone:
        for k, word in enumerate(words):
            ax.plot([], [], color=_COLOURS[k % len(_COLOURS)], label=word)
    for name in inside if len(inside) > 1 else ():
        look = _look(name, plain, 1, alone=alone) | ({} if alone else {"color": "0.4"})
        ax.plot([], [], label=name, **look)


def _look(name: str, plain: Sequence[str], k: int, *, alone: bool) -> dict[str, Any]:
    """Line style of a column of recording `k`; the first of several is broad and pale."""
    reference = name not in plain
    place = 0 if reference else plain.index(name)
    if alone:
        colour = ORANGE if reference else _COLOURS[place % len(_COLOURS)]
        return {"color": colour, "linestyle": "--" if reference else "-", "linewidth": 1.1}
    style = "--" if reference else _STYLES[place % len(_STYLES)]
    width = (2.4 if k == 0 else 1.0) * (0.7 if reference else 1.0)
    look = {"color": _COLOURS[k % len(_COLOURS)], "linestyle": style, "linewidth": width}
    return look | ({"alpha": 0.6} if k == 0 else {})


def _times(recording: Recording, *, own: bool) -> Array:
    t: Array = np.asarray(recording[TIME], float)
    return t - t[0] if own and len(t) else t
