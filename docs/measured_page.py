"""What scripts share that measure for a page: command line, results, a table between two marks."""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any


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


def main(
    about: str | None,
    results: Path,
    jobs: Callable[[argparse.Namespace], list[Any]],
    one: Callable[[Any], dict[str, Any]],
    write: Callable[[list[dict[str, Any]]], None],
) -> None:
    """Measure every job in processes, keep what was found after each, and write the page."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--benches", type=int, default=20, help="drawn ones, where any are")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--scratch", default="results/beyond")
    parser.add_argument("--page", action="store_true", help="only write the page anew")
    chosen = parser.parse_args()
    if chosen.page:
        write(json.loads(results.read_text()))
        return
    every = []
    with ProcessPoolExecutor(chosen.workers) as pool:
        for found in pool.map(one, jobs(chosen)):
            every.append(found)
            results.write_text(json.dumps(short(every)) + "\n")
    write(every)
