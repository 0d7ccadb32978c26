"""The moves in a recording of a run or of the live machine, with their times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.columns import Column
from macromicro.control.live.messages import MODES
from macromicro.control.supervisor import DONE, SETTLING
from macromicro.control.supervisor import MACRO as MOVING
from macromicro.control.supervisor import MICRO as FINE
from macromicro.errors import ProblemError
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.recording import Recording

_PHASES = {"moving-macro": MOVING, "settling": SETTLING, "moving-micro": FINE, "holding": FINE}
_CUT = ("stopped", "fault", "disabled", "off")
_UNDER_WAY = ("moving-macro", "moving-micro", "settling")
_ADDED = (Column("move", "1", "index of the move", "i4"), Column("phase", "1", "its phase", "i1"))


class Served(NamedTuple):
    # only the rows in which moves are under way or held, with the columns `move` and `phase` of a
    # run
    recording: Recording
    programme: Programme  # those moves
    cut: NDArray[np.bool_]  # which of them came to no end


def is_live(recording: Recording) -> bool:
    return "mode" in recording and "motion" in recording and "move" not in recording


def served_moves(recording: Recording) -> Served:
    """Moves to a place, in order; a move of both stages counts as one of each.

    Homing and jogs, whose set point travels, do not count.
    """
    names = str(recording.attributes.get("modes", ", ".join(MODES))).split(", ")
    known = np.array([_PHASES.get(name, 0) for name in names])
    mode = np.clip(recording["mode"].astype(int), 0, len(names) - 1)
    phase = known[mode]
    coarse, fine = recording["macro_reference"], recording["micro_reference"]
    motion = recording["motion"]
    driven = np.where(phase == MOVING, MACRO, np.where(phase == FINE, MICRO, -1))
    target = np.where(driven == MACRO, coarse, np.where(driven == MICRO, fine * 1e-3, np.nan))
    number = np.where(mode == names.index("holding"), 0, motion)
    begins = _changes(driven) | _changes(np.nan_to_num(target)) | (_changes(number) & (number > 0))
    starts = np.flatnonzero(begins & (driven >= 0))
    ends = np.append(np.flatnonzero(begins), len(mode))
    keep, move = np.zeros(len(mode), bool), np.full(len(mode), -1)
    stages: list[int] = []
    begun: list[int] = []
    targets: list[float] = []
    cut: list[bool] = []
    for start in starts.tolist():
        end = int(ends[np.searchsorted(ends, start, "right")])
        if number[start] == 0 or end - start < 2:  # held on, or a set point that travels
            keep[start:end] |= bool(stages) and names[mode[start]] == "holding"
            move[start:end] = len(stages) - 1
            continue
        until = end
        while until < len(mode) and names[mode[until]] in ("settling", "ready"):
            until += 1
        move[start:until], keep[start:until] = len(stages), True
        stages.append(int(driven[start]))
        begun.append(start)
        targets.append(float(target[start]))
        behind = names[mode[min(end, len(mode) - 1)]]
        cut.append(behind in _CUT or (until == len(mode) and behind in _UNDER_WAY))
    none, stage = np.full(len(stages), np.nan), np.array(stages, np.int64)
    start = (recording["t"] - recording["t"][0])[begun]
    what = Programme("", start, stage, np.array(targets, float), none, float("nan"), "")
    rows = np.flatnonzero(keep)
    phase = phase[rows]
    if len(phase) and not cut[-1]:
        phase[-1] = DONE
    arrays = [*(recording[c.name][rows] for c in recording.columns), move[rows], phase]
    made = Recording.from_arrays(
        (*recording.columns, *_ADDED), arrays, recording.dt, recording.attributes
    )
    return Served(made, what, np.array(cut, bool))


def ran(recording: Recording) -> tuple[NDArray[np.bool_], Programme]:
    """Which of the recording's moves were begun, and their programme.

    A micro move that was due before the carriage had settled is counted, but never begun.
    """
    index, phase = recording["move"], recording["phase"]
    coarse, fine = recording["macro_reference"], recording["micro_reference"]
    count = int(index[-1]) + 1
    first = np.minimum(np.searchsorted(index, np.arange(count)), len(index) - 1)
    before = np.maximum(first - 1, 0)
    macro = phase[first] == MOVING
    fresh = (first == 0) | (phase[before] != MOVING) | (coarse[before] != coarse[first])
    micro = phase[first] == FINE
    stage = np.where(macro & fresh, MACRO, MICRO)
    target = np.where(macro, coarse[first], fine[first] * 1e-3)
    none = np.full(count, np.nan)
    start = recording["t"][first] - recording["t"][0]
    what = Programme("", start, stage.astype(np.int64), target, none, float("nan"), "")
    return (macro & fresh) | micro, what


def timetable(recording: Recording) -> Programme:
    """The moves that were begun, each at its own time from the first row on, to the last."""
    if is_live(recording):
        what = served_moves(recording).programme
    else:
        begun, what = ran(recording)
        what = what._replace(
            start=what.start[begun], stage=what.stage[begun], target=what.target[begun]
        )
    if not len(what.target):
        raise ProblemError("recording", "it shows no moves", "Give the programme as well.")
    end = float(recording["t"][-1] - recording["t"][0])
    hold = np.diff(np.append(what.start, end))
    return what._replace(title="moves of the recording", hold=hold, end=end)


def _changes(values: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Rows that differ from the one before; the first one does."""
    changes: NDArray[np.bool_] = np.append(True, values[1:] != values[:-1])
    return changes
