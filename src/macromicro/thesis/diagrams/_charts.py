"""Flow charts: modified least squares (Figure 4.2), the smoothing function (Figure 5.4)."""

from __future__ import annotations

import inspect

from macromicro.drawing.flow import Flow, ask, do, end, start
from macromicro.identify.linear import MAX_ITERATIONS
from macromicro.identify.smoothing import without_spikes
from macromicro.thesis.diagrams._described import Described, number

_DEFAULTS = {k: p.default for k, p in inspect.signature(without_spikes).parameters.items()}
_STEEPEST, _WINDOW, _LONGEST = (number(_DEFAULTS[k]) for k in ("steepest", "window", "longest"))

CHARTS: dict[str, Described] = {
    "4.2": Described(
        Flow(
            "Modified least squares",
            (
                start("records u, y; orders of A and B"),
                do("least squares: first A, B"),
                do("unstable roots of A: reflect into the unit circle", name="again"),
                do("filter u and y by 1/A"),
                do("least squares on the filtered u, y: new A, B"),
                ask("each parameter moved by ≤ 1/10000 of its standard error?", yes="fit"),
                ask(f"{MAX_ITERATIONS} iterations done?", no="again"),
                do("warn: not converged"),
                do(
                    "residuals y~-~(B/A)~u, covariance, fit",
                    name="fit",
                ),
                end("A, B"),
            ),
        ),
        "As the code runs it, in the form of Steiglitz and McBride: the loop turns the error of "
        "the equation into that of the output, whose white noise then no longer biases A and B.",
    ),
    "5.4": Described(
        Flow(
            "Smoothing function",
            (
                start("record: times t, temperatures T"),
                do(f"jumps: steps steeper than {_STEEPEST}~degC/s"),
                ask("a jump left?", name="next", no="check"),
                ask(
                    f"a later jump within {_LONGEST}~s after which T is within half the "
                    "spike of its level before?",
                    no="single",
                ),
                do(
                    f"window: from {_WINDOW}~s before the jump to {_WINDOW}~s after that later one",
                    then="mark",
                ),
                do(
                    f"window: {_WINDOW}~s to either side of the jump",
                    name="single",
                    aside=True,
                ),
                do("mark the window; on to the jump after it", name="mark", then="next"),
                ask("more than half marked?", name="check", yes="error"),
                end("error: too many spikes", name="error", aside=True),
                do(
                    "each marked stretch: straight line between the means of the 3 good "
                    "samples on its two sides"
                ),
                end("smoothed T, marks, number of stretches"),
            ),
        ),
        "As the code runs it, once the record has passed its checks. At an end of the record a "
        "stretch becomes the mean of its one good side; overlapping windows become one stretch.",
    ),
}
