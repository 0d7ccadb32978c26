"""What makers of measured pages share: command line, results, a table between two marks."""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

Found = dict[str, Any]
T = TypeVar("T")
VALIDATION = Path(__file__).parent / "validation"
RAW = Path(__file__).parents[1] / "results" / "beyond"  # what was measured, bench by bench


class Study(NamedTuple):
    """What is measured for a page. A job is (kind, number of its bench, ...)."""

    page: Path
    results: Path
    jobs: Callable[[argparse.Namespace], list[Any]]
    one: Callable[[Any], Found]
    tables: Callable[[list[Found]], dict[str, str]]  # by their marks
    draw: Callable[[list[Found]], None] | None = None  # figures of the page


def few(every: tuple[T, ...]) -> tuple[T, ...]:
    """All of them, or the first alone in a quick run."""
    return every[:1] if "--quick" in sys.argv else every


def short(found: Any) -> Any:
    """The same with six digits."""
    if isinstance(found, float):
        return float(f"{found:.6g}")
    if isinstance(found, dict):
        return {name: short(each) for name, each in found.items()}
    return [short(each) for each in found] if isinstance(found, list | tuple) else found


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    first, *others = (f"| {' | '.join(cells)} |" for cells in (head, *rows))
    return "\n".join([first, "|---" * len(head) + "|", *others]) + "\n"


def put(page: Path, mark: str, text: str) -> None:
    """A text into a page, behind its mark and up to the next end."""
    whole = page.read_text(encoding="utf-8")
    marked = re.compile(rf"(<!-- {mark} -->\n).*?(<!-- end -->)", re.DOTALL)
    made, count = marked.subn(lambda m: m[1] + text + m[2], whole)
    if not count:
        raise SystemExit(f"{page}: no mark {mark}")
    page.write_text(made, encoding="utf-8")


def blocks(page: Path) -> dict[str, str]:
    """What stands between the marks of a page, by name."""
    text = page.read_text(encoding="utf-8")
    return dict(re.findall(r"<!-- ([\w ]+) -->\n(.*?)<!-- end -->", text, re.DOTALL))


def parsed(about: str | None, given: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--benches", type=int, help="drawn ones, where any are")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--scratch", default="results/beyond")
    parser.add_argument("--page", action="store_true", help="only write the page again")
    parser.add_argument(
        "--only", type=int, nargs="+", metavar="N", help="these benches alone, the others as kept"
    )
    parser.add_argument("--kind", help="of this kind alone: a stage, or a group")
    parser.add_argument(
        "--rest", action="store_true", help="those that have no results yet, the others as kept"
    )
    parser.add_argument(
        "--seed", type=int, help="draw other benches: tables are printed, no page is written"
    )
    parser.add_argument(
        "--quick", action="store_true", help="the last bench alone, shortly; nothing is written"
    )
    chosen = parser.parse_args(given)
    if chosen.quick:
        chosen.benches = 0
    return chosen


def count(chosen: argparse.Namespace, published: int) -> int:
    """Of the benches to draw."""
    return published if chosen.benches is None else int(chosen.benches)


def seed(chosen: argparse.Namespace, published: int) -> int:
    """Of the benches to draw."""
    return published if chosen.seed is None else int(chosen.seed)


def asked(jobs: list[Any], chosen: argparse.Namespace, kept: list[Found]) -> list[Any]:
    """Those of the kind and of the benches that the command line names."""
    done = {named(bench)[-2:] for bench in kept} if chosen.rest else set()
    return [
        job
        for job in jobs
        if (chosen.kind is None or job[0] == chosen.kind)
        and (chosen.only is None or job[1] in chosen.only)
        and job[:2] not in done
    ]


def named(bench: Found) -> tuple[Any, ...]:
    """What tells one bench's results from the others."""
    return bench["kind"], bench["bench"]


def merged(kept: list[Found], found: list[Found]) -> list[Found]:
    """What was kept, with benches measured anew in their places; new ones at the end."""
    renewed = {named(b): b for b in found}
    every = [renewed.pop(named(b), b) for b in kept]
    return [*every, *renewed.values()]


def read(results: Path) -> list[Found]:
    """What was measured before; the repository does not hold it."""
    if not results.exists():
        raise SystemExit(
            f"{results} does not exist: measure first, without --page, --only, --kind or --rest"
        )
    found: list[Found] = json.loads(results.read_text(encoding="utf-8"))
    return found


def main(about: str | None, study: Study, given: list[str] | None = None) -> None:
    """Measure every job in processes, keep what was found after each, and write the page."""
    chosen = parsed(about, given)
    results = study.results
    if chosen.seed is not None:
        results = Path(chosen.scratch) / f"{results.stem}-seed-{chosen.seed}.json"
    some = chosen.only is not None or chosen.kind is not None or chosen.rest
    kept = read(results) if not chosen.quick and (chosen.page or some) else []
    jobs = [] if chosen.page else asked(study.jobs(chosen), chosen, kept)
    if chosen.quick:
        print(json.dumps(short(study.one(jobs[-1]))))
        return
    results.parent.mkdir(parents=True, exist_ok=True)
    found: list[Found] = []
    with ProcessPoolExecutor(chosen.workers) as pool:
        for each in pool.map(study.one, jobs):
            found.append(short(each))
            results.write_text(json.dumps(merged(kept, found)) + "\n", encoding="utf-8")
    every = merged(kept, found)
    for mark, text in study.tables(every).items():
        if chosen.seed is None:
            put(study.page, mark, text)
        else:
            print(f"{mark}\n{text}")
    if chosen.seed is None and study.draw is not None:
        study.draw(every)
