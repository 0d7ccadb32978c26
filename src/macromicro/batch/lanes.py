"""The macro-stage's model under its PD law, many variants in step: time outside, lanes inside.

The values of a block of variants lie in one array, a row of `WIDE` lanes a quantity. All its
rows have fixed places, so that the compiler knows that they do not overlap and puts
neighbouring lanes into one vector register. Each lane goes through the very step functions
of a single run (`models.macro.rollout`), so it gives the same bits.
"""

from __future__ import annotations

import math

import numpy as np

from macromicro.arrays import Array
from macromicro.batch import course
from macromicro.batch.course import Course, Task
from macromicro.control import macro as control
from macromicro.control import pd
from macromicro.kernel import kernel
from macromicro.models import macro
from macromicro.models.macro import TUNED, Linear, MacroModel, MacroModelState

WIDE = 64  # places of a row
UNIT = 8  # lanes come in multiples of this: the doubles of the widest register

# What is given, by row, then state and course.
GIVEN = (
    *("now", "before", "dead_zone", "limit", "a", "b", "width", "a0", "delta", "rail"),
    *("target", "dt", "sign", "band", "risen"),
)
NOW, BEFORE, ZONE, LIMIT, A, B, WIDTH, A0, DELTA, RAIL, TARGET, DT, SIGN, BAND, RISEN = (
    WIDE * i for i in range(len(GIVEN))
)
_STATE = WIDE * len(GIVEN)
X, V, ERROR = (_STATE + WIDE * i for i in range(3))
OUTSIDE, EARLY, FAR, SUM, PEAK, SATURATED, TURNS, MOVE = (_STATE + WIDE * (3 + i) for i in range(8))
ROWS = len(GIVEN) + 3 + 8
TASK = GIVEN.index("sign")  # first row of what the course is judged by
SHOWN = 1 + 8  # last rows: error, course


def place() -> Array:
    """Make an empty block at the start of a cache line.

    Returns
    -------
    ndarray, shape (ROWS * WIDE,)
        For `run`.
    """
    raw = np.zeros(ROWS * WIDE + 8)
    skipped = -(raw.ctypes.data // 8) % 8
    return raw[skipped : skipped + ROWS * WIDE]


@kernel
def counted(x: float) -> float:
    """Give the whole counts of a position: `models.macro.whole`, for vectors one instruction.

    Parameters
    ----------
    x : float
        Counts.

    Returns
    -------
    float
        Whole counts, not above.
    """
    return float(np.floor(x))


@kernel
def _period(s: Array, j: int) -> tuple[float, float, float, float]:
    """Lane `j` one period on: its counts, its error, the effort asked for and the one sent.

    The new error is not put down yet: the course still needs the last one.
    """
    linear = Linear(s[A + j], s[B + j], s[DT + j])
    model = MacroModel(linear, TUNED, s[WIDTH + j], s[A0 + j], s[DELTA + j], s[RAIL + j])
    state = MacroModelState(s[X + j], s[V + j])
    seen = counted(state.x)
    error = s[TARGET + j] - seen
    effort = pd.effort(s[NOW + j], s[BEFORE + j], error, s[ERROR + j])
    sent = control.sent(effort, s[ZONE + j], s[LIMIT + j])
    asked = control.sent(effort, s[ZONE + j], math.inf)
    state = macro.step(model, state, sent)
    s[X + j] = state.x
    s[V + j] = state.v
    return seen, error, asked, sent


@kernel
def run(s: Array, lanes: int, samples: int) -> None:
    """Run the first lanes of a block, all of `Course` gathered.

    Parameters
    ----------
    s : ndarray, shape (ROWS * WIDE,)
        The block; changed.
    lanes : int
        How many.
    samples : int
        Periods.
    """
    for k in range(samples):
        number = k + 1.0
        for j in range(lanes):
            seen, error, asked, sent = _period(s, j)
            judged = Task(s[SIGN + j], s[BAND + j], s[RISEN + j])
            so_far = Course(
                s[OUTSIDE + j], s[EARLY + j], s[FAR + j], s[SUM + j],
                s[PEAK + j], s[SATURATED + j], s[TURNS + j], s[MOVE + j],
            )  # fmt: skip
            now = course.follow(judged, so_far, number, seen, error, s[ERROR + j], asked, sent)
            s[ERROR + j] = error
            s[OUTSIDE + j], s[EARLY + j] = now.outside, now.early
            s[FAR + j], s[SUM + j] = now.far, now.sum
            s[PEAK + j], s[SATURATED + j] = now.peak, now.saturated
            s[TURNS + j], s[MOVE + j] = now.turns, now.move
        if k == 0:  # as `course.first`
            for j in range(lanes):
                s[PEAK + j] = s[SATURATED + j] = s[TURNS + j] = s[MOVE + j] = 0.0


@kernel
def run_errors(s: Array, lanes: int, samples: int) -> None:
    """Run as `run`, gathering `far` and `sum` of `Course` alone, which takes two thirds of the
    time.

    Parameters
    ----------
    s : ndarray, shape (ROWS * WIDE,)
        The block; changed.
    lanes : int
        How many.
    samples : int
        Periods.
    """
    for _ in range(samples):
        for j in range(lanes):
            seen, error, _, _ = _period(s, j)
            s[ERROR + j] = error
            s[FAR + j] = course.farther(s[FAR + j], s[SIGN + j], seen)
            s[SUM + j] = course.gathered(s[SUM + j], error)


@kernel
def _load(s: Array, given: Array, first: int) -> int:
    """Variants from `first` on into the lanes, state and course at rest; how many there are.

    Lanes without a variant go along with the last one.
    """
    count: int = min(WIDE, given.shape[1] - first)
    for i in range(given.shape[0]):
        for j in range(WIDE):
            s[WIDE * i + j] = given[i, first + min(j, count - 1)]
    for j in range(_STATE, s.shape[0]):
        s[j] = 0.0
    return count


@kernel
def _show(s: Array, seen: Array, first: int, count: int) -> None:
    """The last rows of a block into those of its variants."""
    for i in range(SHOWN):
        for j in range(count):
            seen[i, first + j] = s[WIDE * (ROWS - SHOWN + i) + j]


@kernel
def blocks(s: Array, given: Array, seen: Array, samples: int) -> None:
    """Do `run` on one block of variants after another.

    Parameters
    ----------
    s : ndarray, shape (ROWS * WIDE,)
        The place of a block.
    given : ndarray, shape (GIVEN, n)
        A row for each name of `GIVEN`.
    seen : ndarray, shape (SHOWN, n)
        Filled: error and course at the end.
    samples : int
        Periods.
    """
    for first in range(0, given.shape[1], WIDE):
        count = _load(s, given, first)
        run(s, -(-count // UNIT) * UNIT, samples)
        _show(s, seen, first, count)


@kernel
def blocks_errors(s: Array, given: Array, seen: Array, samples: int) -> None:
    """Do `blocks` by `run_errors`.

    Parameters
    ----------
    s : ndarray, shape (ROWS * WIDE,)
        The place of a block.
    given : ndarray, shape (GIVEN, n)
        A row for each name of `GIVEN`.
    seen : ndarray, shape (SHOWN, n)
        Filled: error and course at the end.
    samples : int
        Periods.
    """
    for first in range(0, given.shape[1], WIDE):
        count = _load(s, given, first)
        run_errors(s, -(-count // UNIT) * UNIT, samples)
        _show(s, seen, first, count)
