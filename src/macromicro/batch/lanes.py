"""The macro-stage's model under its PD law, many variants at once: time outside, lanes inside.

The values of a block of variants lie in one array, a row of `WIDE` lanes a quantity. All its
rows have fixed places, so that the compiler knows that they do not overlap and puts
neighbouring lanes into one vector register. Each lane uses the step functions of a single
run (`models.macro.rollout`), so it gives the same bits.
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
    """An empty block at the start of a cache line."""
    raw = np.zeros(ROWS * WIDE + 8)
    skipped = -(raw.ctypes.data // 8) % 8
    return raw[skipped : skipped + ROWS * WIDE]


@kernel
def counted(x: float) -> float:
    """The whole counts of a position: `models.macro.whole`, as one vector instruction."""
    return float(np.floor(x))


@kernel
def _period(s: Array, j: int) -> tuple[float, float, float, float]:
    """Advance lane `j` by a period: its counts, error, requested effort and output.

    The new error is not stored yet: the course still needs the last one.
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
    """Run the first lanes of a block, with all of `Course`."""
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
    """`run` with only `far` and `sum` of `Course`, in two thirds of the time."""
    for _ in range(samples):
        for j in range(lanes):
            seen, error, _, _ = _period(s, j)
            s[ERROR + j] = error
            s[FAR + j] = course.farther(s[FAR + j], s[SIGN + j], seen)
            s[SUM + j] = course.gathered(s[SUM + j], error)


@kernel
def _load(s: Array, given: Array, first: int) -> int:
    """Load variants from `first` on into the lanes, at rest; returns their number.

    Lanes without a variant repeat the last one.
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
    for i in range(SHOWN):
        for j in range(count):
            seen[i, first + j] = s[WIDE * (ROWS - SHOWN + i) + j]


@kernel
def blocks(s: Array, given: Array, seen: Array, samples: int) -> None:
    """`run` on one block of variants after another."""
    for first in range(0, given.shape[1], WIDE):
        count = _load(s, given, first)
        run(s, -(-count // UNIT) * UNIT, samples)
        _show(s, seen, first, count)


@kernel
def blocks_errors(s: Array, given: Array, seen: Array, samples: int) -> None:
    """`run_errors` on one block of variants after another."""
    for first in range(0, given.shape[1], WIDE):
        count = _load(s, given, first)
        run_errors(s, -(-count // UNIT) * UNIT, samples)
        _show(s, seen, first, count)
