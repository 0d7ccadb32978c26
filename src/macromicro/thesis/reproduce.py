"""The thesis reproduced: procedures run in processes, and their results."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, NamedTuple

from macromicro.drawing.exhibit import Exhibit, label, render
from macromicro.extras import MissingPackageError
from macromicro.schema.text import plain
from macromicro.sweeps.processes import processes, submit
from macromicro.thesis.claims import Claim, in_order, unmeasured
from macromicro.thesis.procedure import Lab, Procedure

_SHOWN = ("of", "basis", "rule", "measured", "unit", "verdict", "reason", "kind")
INTERRUPTED = "interrupted"  # the failure of what had not ended when the work was


class Chosen(NamedTuple):
    """A procedure to run; `ids` and `figures` are the selected ones, or None for all."""

    procedure: Procedure
    ids: frozenset[str] | None = None
    figures: frozenset[str] | None = None


class Result(NamedTuple):
    name: str
    claims: list[Claim]
    exhibits: list[Exhibit]
    seconds: float
    failure: str = ""  # why there is none
    trace: str = ""  # of the failure or of the notes
    notes: tuple[str, ...] = ()  # exhibits that could not be drawn, and why


def run_one(procedure: Procedure, lab: Lab) -> Result:
    """Run one procedure. An exception becomes a `failure`; in the drawing, a note."""
    began = time.perf_counter()
    try:
        data = procedure.collect(lab)
        claims = procedure.claims(data)
    except Exception as error:
        return failure(procedure, _describe(error), traceback.format_exc(), began)
    exhibits, notes, traces = _draw(procedure, data, lab.figures)
    seconds = time.perf_counter() - began
    return Result(
        procedure.name, claims, exhibits, seconds, trace="\n".join(traces), notes=tuple(notes)
    )


def _draw(
    procedure: Procedure, data: Any, kinds: tuple[str, ...]
) -> tuple[list[Exhibit], list[str], list[str]]:
    """All exhibits of a procedure in the declared order; a note and a trace of each that fails."""
    from macromicro.thesis import diagrams

    exhibits, notes, traces = [], [], []
    for number in (*procedure.figures, *procedure.diagrams):
        try:
            draw = procedure.figures.get(number)
            drawn = diagrams.draw(number) if draw is None else draw(data)
            exhibits.append(render(number, drawn, kinds))
        except MissingPackageError:  # without matplotlib: tables and diagrams alone
            continue
        except Exception as error:
            notes.append(f"{label(number)} was not drawn: {_describe(error)}")
            traces.append("".join(traceback.format_exception(error)))
    return exhibits, notes, traces


def _describe(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".removesuffix(": ")


def failure(procedure: Procedure, why: str, trace: str = "", began: float | None = None) -> Result:
    """The result of a failed procedure: its claims, not measured, except arithmetic ones."""
    seconds = 0.0 if began is None else time.perf_counter() - began
    known = {} if procedure.arithmetic is None else {c.id: c for c in procedure.arithmetic()}
    reason = f"the procedure {procedure.name} failed: {why}"
    claims = [known.get(name) or unmeasured(name, reason) for name in procedure.ids]
    return Result(procedure.name, claims, [], seconds, why, trace)


def run(
    chosen: Sequence[Chosen],
    lab: Lab,
    jobs: int,
    progress: Callable[[Result, float], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> list[Result]:
    """Run all chosen procedures in `jobs` processes; results in their order.

    `progress` is called with the result and the expected seconds of each that ended. A procedure
    that fails, or whose process dies, loses only its own result. `stopped` ends the work early:
    unfinished procedures are reported as failed.
    """
    order = sorted(chosen, key=lambda c: -c.procedure.seconds)
    found = {}
    for result in _first(order, lab, jobs, stopped):
        found[result.name] = result
        if progress is not None:
            progress(result, _seconds(order, result.name))
    return [narrow(c, found[c.procedure.name]) for c in chosen]


def _seconds(chosen: Sequence[Chosen], name: str) -> float:
    return next(c.procedure.seconds for c in chosen if c.procedure.name == name)


def _first(
    order: Sequence[Chosen], lab: Lab, jobs: int, stopped: Callable[[], bool]
) -> Iterator[Result]:
    """Results as they come.

    A dying process breaks its whole pool: its work is tried again, one by one, so that only the
    guilty procedure is lost. On a real rig nothing is repeated: its state is not known.
    """
    alone: list[Procedure] = []
    for procedure, result in _run_pool([c.procedure for c in order], lab, jobs, stopped):
        if result is None:
            alone.append(procedure)
        else:
            yield result
    for procedure in alone:
        if lab.rigs:
            yield failure(procedure, "its process died")
            continue
        for _, result in _run_pool([procedure], lab, 1, stopped):
            yield result or failure(procedure, "its process died")


def _run_pool(
    procedures: Sequence[Procedure], lab: Lab, jobs: int, stopped: Callable[[], bool]
) -> Iterator[tuple[Procedure, Result | None]]:
    """Each procedure with its result, None where the pool broke before it ended."""
    with processes(min(jobs, len(procedures))) as pool:
        pending: dict[Future[Result], Procedure] = {}
        for procedure in procedures:
            try:
                pending[submit(pool, run_one, procedure, lab)] = procedure
            except BrokenProcessPool:  # an earlier one has already killed its process
                yield procedure, None
        while pending:
            done, _ = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
            if stopped():
                for procedure in pending.values():
                    yield procedure, failure(procedure, INTERRUPTED)
                return
            for future in done:
                yield pending.pop(future), _outcome(future)


def _outcome(future: Future[Result]) -> Result | None:
    try:
        return future.result()
    except BrokenProcessPool:
        return None


def narrow(chosen: Chosen, result: Result) -> Result:
    """Only the selection: a claim with its exhibits, or an exhibit with its claims."""
    if chosen.ids is None and chosen.figures is None:
        return result
    ids, figures = chosen.ids or frozenset(), chosen.figures or frozenset()
    exhibits = [e for e in result.exhibits if e.number in figures or ids & set(e.claims)]
    ids |= {name for e in exhibits if e.number in figures for name in e.claims}
    return result._replace(claims=[c for c in result.claims if c.id in ids], exhibits=exhibits)


def claims_of(results: Sequence[Result]) -> list[Claim]:
    """All claims in the order of the list: D1, D2 .. M1 .. A6."""
    return in_order(c for result in results for c in result.claims)


def as_rows(results: Sequence[Result]) -> list[dict[str, Any]]:
    """All claims in the order of their list, as plain data.

    Numbers that are not finite and open ends of a band are None.
    """
    return [
        {
            "id": c.id,
            "section": c.section,
            "claim": c.claim,
            "printed": plain(c.printed) if c.printed is not None else c.printed_text or None,
            "accept": plain([list(ends) for ends in c.accept]),
            **{name: plain(getattr(c, name)) for name in _SHOWN},
        }
        for c in claims_of(results)
    ]
