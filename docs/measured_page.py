"""What scripts share that measure for a page: command line, results, a table between two marks."""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

Found = dict[str, Any]
T = TypeVar("T")
RAW = Path(__file__).parents[1] / "results" / "beyond"  # what was measured, bench by bench


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


def put(page: Path, mark: str, table: str) -> None:
    """A table into a page, behind its mark and up to the next end."""
    text = page.read_text(encoding="utf-8")
    marked = re.compile(rf"(<!-- {mark} -->\n).*?(<!-- end -->)", re.DOTALL)
    page.write_text(marked.sub(lambda m: m[1] + table + m[2], text), encoding="utf-8")


def parsed(about: str | None, given: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--benches", type=int, default=20, help="drawn ones, where any are")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--scratch", default="results/beyond")
    parser.add_argument("--page", action="store_true", help="only write the page anew")
    parser.add_argument(
        "--only", type=int, nargs="+", metavar="N", help="these benches alone, the others as kept"
    )
    parser.add_argument("--kind", help="of this kind alone: a stage, or a group")
    parser.add_argument(
        "--seed", type=int, help="draw other benches: tables are printed, no page is written"
    )
    parser.add_argument(
        "--quick", action="store_true", help="the last bench alone, shortly; nothing is written"
    )
    return parser.parse_args(given)


def seed(chosen: argparse.Namespace, published: int) -> int:
    """Of the benches to draw."""
    return published if chosen.seed is None else int(chosen.seed)


def asked(jobs: list[Any], chosen: argparse.Namespace) -> list[Any]:
    """Those of the kind and of the benches that the command line names."""
    return [
        job
        for job in jobs
        if (chosen.kind is None or job[0] == chosen.kind)
        and (chosen.only is None or job[1] in chosen.only)
    ]


def named(bench: Found) -> tuple[Any, ...]:
    """What tells one bench's results from the others."""
    return bench.get("stage"), bench["kind"], bench["bench"]


def merged(kept: list[Found], found: list[Found]) -> list[Found]:
    """What was kept, with benches measured anew in their places; new ones at the end."""
    renewed = {named(b): b for b in found}
    every = [renewed.pop(named(b), b) for b in kept]
    return [*every, *renewed.values()]


def read(results: Path) -> list[Found]:
    """What was measured before; the repository does not hold it."""
    if not results.exists():
        raise SystemExit(
            f"{results} does not exist: measure first, without --page, --only or --kind"
        )
    found: list[Found] = json.loads(results.read_text(encoding="utf-8"))
    return found


def main(
    about: str | None,
    results: Path,
    jobs: Callable[[argparse.Namespace], list[Any]],
    one: Callable[[Any], Found],
    write: Callable[[list[Found]], None],
    tables: Callable[[list[Found]], dict[str, str]],
    given: list[str] | None = None,
) -> None:
    """Measure every job in processes, keep what was found after each, and write the page.

    A job is (kind, number of its bench, ...). `tables` gives each mark's table.
    """
    chosen = parsed(about, given)
    if chosen.quick:
        chosen.benches = 0
        print(json.dumps(short(one(asked(jobs(chosen), chosen)[-1]))))
        return
    if chosen.seed is not None:
        results = Path(chosen.scratch) / f"{results.stem}-seed-{chosen.seed}.json"
    results.parent.mkdir(parents=True, exist_ok=True)
    kept: list[Found] = []
    some = chosen.only is not None or chosen.kind is not None
    if chosen.page or some:
        kept = read(results)
    found: list[Found] = []
    if not chosen.page:
        with ProcessPoolExecutor(chosen.workers) as pool:
            for each in pool.map(one, asked(jobs(chosen), chosen)):
                found.append(short(each))
                results.write_text(json.dumps(merged(kept, found)) + "\n", encoding="utf-8")
    every = merged(kept, found)
    if chosen.seed is None:
        write(every)
        return
    for mark, table in tables(every).items():
        print(f"{mark}\n{table}")
