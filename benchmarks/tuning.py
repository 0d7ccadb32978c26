"""Speed of tuning: a whole search in a warm process, imports and compiling left out."""

from __future__ import annotations

from figures import Line, some, timed

from macromicro.tuning.request import Request, ready

EVALUATIONS = 300
ROWS = (
    ("tuning the macro loop", "", Request(stage="macro")),
    ("the same on 16 benches at a time", "", Request(stage="macro", robust=True, fresh=2)),
    ("tuning the micro loop", "", Request(stage="micro")),
)


def lines() -> list[Line]:
    """The figures as lines of the benchmark's table."""
    found = []
    for name, target, request in ROWS:
        asked = ready(request._replace(evaluations=some(EVALUATIONS)))
        seconds = timed(asked.search, 5)
        runs, benches = asked.search().evaluations, asked.budget.machines
        remark = f"{runs} evaluations" + (f" of {benches} benches" if benches > 1 else "")
        found.append(Line(name, target, seconds, "s", remark))
    return found
