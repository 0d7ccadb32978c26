"""A reproduction in the terminal: a bar while it runs, then the claims and the problems."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from macromicro.drawing.console import progress_bar, terminal
from macromicro.drawing.exhibit import TABLE
from macromicro.thesis.claims import DIFFERS, REPRODUCED
from macromicro.thesis.page import _counting, claim_text
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import INTERRUPTED, Result, claims_of

if TYPE_CHECKING:
    from rich.console import Console

Report = Callable[[Result, float], None]
_STYLES = {REPRODUCED: "green", DIFFERS: "bold red"}
_OTHER_STYLE = "yellow"
_COLUMNS = ("id", "printed", "accepted", "measured", "unit", "verdict", "kind")
# Shares of what id, verdict, kind and the gaps leave of a line.
_SHARES = {"printed": 0.26, "accepted": 0.32, "measured": 0.24, "unit": 0.18}


@contextmanager
def progress(procedures: Sequence[Procedure]) -> Iterator[Report]:
    """A bar on stderr by the procedures' expected seconds, or a line for each that ended."""
    left = [p.name for p in procedures]
    if not sys.stderr.isatty():

        def progress(result: Result, seconds: float) -> None:
            left.remove(result.name)
            ended = f"({len(procedures) - len(left)} of {len(procedures)})"
            print(f"{result.name}: {_ending(result)} {ended}", file=sys.stderr, flush=True)

        yield progress
        return
    with progress_bar() as bar:
        total = sum(p.seconds for p in procedures)
        task = bar.add_task(_at_work(left), total=total)

        def report(result: Result, seconds: float) -> None:
            left.remove(result.name)
            bar.update(task, advance=seconds, description=_at_work(left))

        yield report


def _ending(result: Result) -> str:
    """The end of a procedure in a word."""
    if not result.failure:
        return "done"
    return INTERRUPTED if result.failure == INTERRUPTED else "failed"


def _at_work(left: Sequence[str]) -> str:
    few = ", ".join(left[:2])
    return f"{few} and {len(left) - 2} more" if len(left) > 2 else few


def show(results: Sequence[Result]) -> None:
    from rich.text import Text

    console = terminal()
    claims = [c for r in results for c in r.claims]
    if claims:
        _table(console, results)
        console.print()
    for line in (*amiss(results), *summary(results)):
        console.print(Text(line), soft_wrap=True)


def amiss(results: Sequence[Result]) -> list[str]:
    """Why claims differ or were not measured, and failed procedures and exhibits, a line each."""
    lines = []
    for result in results:
        lines += [f"{result.name}: {note}" for note in result.notes]
        if result.failure:
            lost = ", ".join(c.id for c in result.claims) or "no claim"
            lines.append(f"{result.name} failed: {result.failure} (not measured: {lost})")
            continue
        for claim in result.claims:
            if claim.verdict != REPRODUCED:
                reason = claim.reason or "reason unknown"
                lines.append(f"{claim.id} {claim.verdict}: {reason}")
    return lines


def summary(results: Sequence[Result]) -> list[str]:
    whole = _counting.counts([c for r in results for c in r.claims])
    lines = [_count(_several(whole.total, "claim"), whole)]
    lines += [
        f"  {_count(f'{found.total} {kind}', found)}"
        for kind, _, found in _counting.by_kind(results)
        if found.total
    ]
    exhibits = [e for r in results for e in r.exhibits]
    tables = sum(e.kind == TABLE for e in exhibits)
    drawn = _several(len(exhibits) - tables, "figure")
    return [*lines, f"{drawn} and {_several(tables, 'table')}"]


def _several(count: int, what: str) -> str:
    """ "1 claim", "2 claims"."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def _count(what: str, found: _counting.Counts) -> str:
    return (
        f"{what}: {found.reproduced} reproduced, {found.differs} "
        f"{'differs' if found.differs == 1 else 'differ'}, {found.not_measured} not measured"
    )


def _table(console: Console, results: Sequence[Result]) -> None:
    """A line of numbers for each claim; below it its words and those of its band."""
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    claims = claims_of(results)
    fixed = {
        "id": max(len(c.id) for c in claims),
        "verdict": max(len(c.verdict) for c in claims),
        "kind": max(4, *(len(c.kind) for c in claims)),
    }
    room = console.width - sum(fixed.values()) - 7
    widths = {**fixed, **{name: int(room * share) for name, share in _SHARES.items()}}

    def row(cells: Sequence[Text]) -> None:
        table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, show_header=False)
        for name in _COLUMNS:
            table.add_column(width=widths[name], overflow="fold")
        table.add_row(*cells)
        console.print(table)

    row([Text(name, style="bold") for name in _COLUMNS])
    for claim in claims:
        numbers = (
            claim_text.printed_text(claim),
            claim_text.accepted_text(claim),
            claim_text.numbers(claim.measured),
            claim.unit,
        )
        verdict = Text(claim.verdict, style=_STYLES.get(claim.verdict, _OTHER_STYLE))
        row([Text(claim.id), *map(Text, numbers), verdict, Text(claim.kind)])
        told = [" ".join(claim.claim.split())]
        told += [f"{name}: {words}" for name, words in claim_text.notes(claim)]
        for line in told:
            console.print(Padding(Text(line), (0, 0, 0, fixed["id"] + 1)))
