"""Speed of tuning: a whole search in a warm process, imports and compiling left out."""

from __future__ import annotations

from typing import Any

from macromicro.tuning.tune import Request, check, search

EVALUATIONS = 300
ROWS = (
    ("tuning the macro loop", "", Request("macro")),
    ("the same on 16 benches at a time", "", Request("macro", robust=True)),
    ("tuning the micro loop", "", Request("micro")),
)


def lines(timed: Any, line: Any) -> list[Any]:
    """The figures as lines of the benchmark's table: `timed` and `line` as in bench.py."""
    found = []
    for name, target, request in ROWS:
        plan = check(request._replace(evaluations=EVALUATIONS))
        seconds = timed(lambda plan=plan: search(plan), 5)
        runs = search(plan).evaluations
        benches = 1 if plan.ensemble is None else len(plan.ensemble.draws)
        remark = f"{runs} evaluations" + (f" of {benches} benches" if benches > 1 else "")
        found.append(line(name, target, seconds, "s", remark))
    return found
