"""A reproduction in the terminal: a bar while it runs, then the claims and what is amiss."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from macromicro.drawing.bar import progress_bar
from macromicro.drawing.exhibit import TABLE
from macromicro.thesis.claims import DIFFERS, REPRODUCED
from macromicro.thesis.page import claim_text, counting
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import INTERRUPTED, Result, claims_of

if TYPE_CHECKING:
    from rich.console import Console

Report = Callable[[Result, float], None]
_PIPED, _LEAST = 120, 80
_STYLES = {REPRODUCED: "green", DIFFERS: "bold red"}
_OTHER_STYLE = "yellow"
# Shares of what id, verdict, kind and the gaps leave of a line.
_SHARES = {"claim": 0.46, "printed": 0.2, "measured": 0.2, "unit": 0.14}


@contextmanager
def progress(procedures: Sequence[Procedure]) -> Iterator[Report]:
    """A bar on stderr by the procedures' expected seconds, and the names still at work; a
    line for each that ended where stderr is no terminal. Yields what `reproduce.run` calls
    of each procedure that ended.
    """
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
    """How a procedure ended, in a word; what was not drawn is listed at the end."""
    if not result.failure:
        return "done"
    return INTERRUPTED if result.failure == INTERRUPTED else "failed"


def _at_work(left: Sequence[str]) -> str:
    few = ", ".join(left[:2])
    return f"{few} and {len(left) - 2} more" if len(left) > 2 else few


def show(results: Sequence[Result]) -> None:
    """The table of claims; reasons of those that were not reproduced; counts. On stdout."""
    from rich.text import Text

    console = _console()
    claims = [c for r in results for c in r.claims]
    if claims:
        _table(console, results)
        console.print()
    for line in (*amiss(results), *summary(results)):
        console.print(Text(line), soft_wrap=True)


def amiss(results: Sequence[Result]) -> list[str]:
    """Why claims differ or were not measured, a line each; one for a procedure that failed
    and for an exhibit that was not drawn."""
    lines = []
    for result in results:
        lines += [f"{result.name}: {note}" for note in result.notes]
        if result.failure:
            lost = ", ".join(c.id for c in result.claims) or "no claim"
            lines.append(f"{result.name} failed: {result.failure} (not measured: {lost})")
            continue
        for claim in result.claims:
            if claim.verdict != REPRODUCED:
                reason = claim.reason or "no reason is known"
                lines.append(f"{claim.id} {claim.verdict}: {reason}")
    return lines


def summary(results: Sequence[Result]) -> list[str]:
    """Counts in words: all claims, each kind, figures and tables."""
    whole = counting.counts([c for r in results for c in r.claims])
    lines = [_counted(_several(whole.total, "claim"), whole)]
    lines += [
        f"  {_counted(f'{found.total} {kind}', found)}"
        for kind, _, found in counting.by_kind(results)
        if found.total
    ]
    exhibits = [e for r in results for e in r.exhibits]
    tables = sum(e.kind == TABLE for e in exhibits)
    drawn = _several(len(exhibits) - tables, "figure")
    return [*lines, f"{drawn} and {_several(tables, 'table')}"]


def _several(count: int, what: str) -> str:
    """ "1 claim", "2 claims"."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def _counted(what: str, found: counting.Counts) -> str:
    return (
        f"{what}: {found.reproduced} reproduced, {found.differs} "
        f"{'differs' if found.differs == 1 else 'differ'}, {found.not_measured} not measured"
    )


def _console() -> Console:
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=False)
    if not console.is_terminal:
        return Console(highlight=False, width=_PIPED)
    return console if console.width >= _LEAST else Console(highlight=False, width=_LEAST)


def _table(console: Console, results: Sequence[Result]) -> None:
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
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    for name in ("id", "claim", "printed", "measured", "unit", "verdict", "kind"):
        table.add_column(name, width=widths[name], no_wrap=True)
    for claim in claims:
        texts = {
            "claim": claim.claim,
            "printed": claim_text.printed(claim),
            "measured": claim_text.numbers(claim.measured),
            "unit": claim.unit,
        }
        cut = [Text(_cut(text, widths[name])) for name, text in texts.items()]
        verdict = Text(claim.verdict, style=_STYLES.get(claim.verdict, _OTHER_STYLE))
        table.add_row(Text(claim.id), *cut, verdict, Text(claim.kind))
    console.print(table)


def _cut(text: str, width: int) -> str:
    """`text` on one line, shortened to `width`."""
    text = " ".join(text.split())
    return text if len(text) <= width else f"{text[: width - 2].rstrip()}.."
