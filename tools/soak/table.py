"""What the soak has found, as a document's section."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from faultmatrix.table import replaced
from faulty import FAULTS
from macromicro.rig import faults
from soak.campaign import Campaign, Round
from soak.rounds import Rounds
from soak.victim import Load

BEGIN, END = "<!-- soak: begin -->", "<!-- soak: end -->"
_MB = 1e6
_NAMES = {text.message: text.name for text in faults.TEXTS.values()}
# Memory may grow by what a server keeps of its events (10 000 of them at most).
MOST_MB, MOST_LOOP_MB, MOST_FILES = 8.0, 2.0, 3


def section(head: str, parts: Iterable[str]) -> str:
    """Markdown: what was found of each kind."""
    return "\n".join([BEGIN, head, "", *parts]).rstrip() + "\n" + END + "\n"


def two_stage(campaign: Campaign, rounds: list[Round], complaints: list[str]) -> str:
    """The two-stage machine: the faults, then the checks, then what nothing explains."""
    lines = ["**Two-stage**", "", *_faults(rounds), "", *_checks(campaign, complaints)]
    return "\n".join([*lines, *_unexplained(complaints), ""])


def of_kind(rounds: Rounds, complaints: list[str]) -> str:
    """A machine of another kind: the faults, then the checks, then what nothing explains."""
    lines = [f"**{rounds.victim.subject.name.capitalize()}**", ""]
    lines += [
        "| fault | injected | stopped as a fault | outcomes | reported |",
        "|---|---|---|---|---|",
    ]
    for name in sorted({each.name for each in rounds.rounds}):
        mine = [each for each in rounds.rounds if each.name == name]
        ends = Counter(each.outcome for each in mine).most_common()
        told = Counter(each.words for each in mine if each.words).most_common(1)
        stopped = sum(each.code != 0 for each in mine)
        outcomes = ", ".join(f"{n} {outcome}" for outcome, n in ends)
        words = (told[0][0] if told else "nothing").replace("|", "/")[:110]
        lines.append(
            f"| {name}: {FAULTS[name].words} | {len(mine)} | {stopped} | {outcomes} | {words} |"
        )
    every = ", ".join(f"{n} {outcome}" for outcome, n in rounds.outcomes.most_common())
    lines += [
        "",
        f"- Orders: {len(rounds.rounds)} beside {rounds.homings} homings: {every}. "
        f"{rounds.checked} trusted positions were compared with the truth.",
        *_unseen(rounds),
        f"- Recorded: {rounds.rows} rows, outputs looked at in each. Stops because this computer "
        f"was too busy: {rounds.busy}.",
        f"- Unexplained: {len(complaints)}.",
    ]
    return "\n".join([*lines, *_unexplained(complaints), ""])


def _unseen(rounds: Rounds) -> list[str]:
    if not rounds.unseen:
        return []
    worst = max(rounds.unseen) * rounds.scale
    return [
        f"- An encoder that died as the stage came to rest, which one sensor cannot show: "
        f"{len(rounds.unseen)} times, at most {worst:.3g} {rounds.unit.lower()} off."
    ]


def _unexplained(complaints: list[str]) -> list[str]:
    return ["", *(f"- **unexplained**: {c}" for c in complaints)] if complaints else []


def write(path: Path, text: str) -> None:
    """Into the document, in place of the section of the run before; or as a file of its own."""
    replaced(path, text, BEGIN, END)


def _faults(rounds: list[Round]) -> Iterable[str]:
    yield "| fault | injected | stopped | safe after, median [ms] | worst [ms] | reported |"
    yield "|---|---|---|---|---|---|"
    for name in dict.fromkeys(r.name for r in rounds):
        mine = [r for r in rounds if r.name == name]
        times = sorted(1e3 * r.safe for r in mine if not math.isnan(r.safe))
        median = f"{statistics.median(times):.1f}" if times else "-"
        worst = f"{times[-1]:.1f}" if times else "-"
        stopped = sum(r.code != 0 for r in mine)
        told = Counter(r.told for r in mine if r.told).most_common(1)
        words = (told[0][0] if told else "nothing").replace("|", "/")[:110]
        words = _NAMES.get(words, words)
        yield f"| {name} | {len(mine)} | {stopped} | {median} | {worst} | {words} |"


def growth(loads: list[tuple[float, Load]]) -> tuple[float, float, int, int]:
    """Growth after the first quarter (warm-up): medians of the last quarter minus those of the
    second [MB] of server and loop; and the most descriptors more than at the warm-up's end."""
    n = len(loads)
    if n < 8:
        return math.nan, math.nan, 0, 0
    early, late = loads[n // 4 : n // 2], loads[-(n // 4) :]

    def median(part: list[tuple[float, Load]], name: str) -> float:
        return float(statistics.median(getattr(load, name) for _, load in part))

    most = [
        max(getattr(load, name) for _, load in loads[n // 4 :])
        - max(getattr(load, name) for _, load in loads[: n // 4])
        for name in ("files", "loop_files")
    ]
    server = (median(late, "memory") - median(early, "memory")) / _MB
    loop = (median(late, "loop_memory") - median(early, "loop_memory")) / _MB
    return server, loop, most[0], most[1]


def leaks(loads: list[tuple[float, Load]]) -> list[str]:
    """What grows that should not."""
    server, loop, files, loop_files = growth(loads)
    found = []
    if server > MOST_MB or loop > MOST_LOOP_MB:
        found.append(f"memory grew by {server:.1f} MB, that of the loop by {loop:.1f} MB")
    if files > MOST_FILES or loop_files > 0:
        found.append(f"descriptors: {files} more, in the loop {loop_files} more")
    return found


def _checks(campaign: Campaign, complaints: list[str]) -> Iterable[str]:
    verdicts, loads = campaign.verdicts, campaign.loads
    server, loop, files, loop_files = growth(loads)
    rows = sum(v.rows for v in verdicts)
    ends = ", ".join(f"{n} {outcome}" for outcome, n in campaign.outcomes.most_common())
    last = loads[-1][1]
    yield (
        f"- Motions: {sum(campaign.outcomes.values())} beside {campaign.homings} homings, each "
        f"with one end: {ends}. {campaign.checked} that were done were compared with the bench's "
        "truth."
    )
    yield (
        f"- Recorded: {rows} rows, {sum(v.gaps for v in verdicts)} of them missing; outputs "
        f"illegal in {sum(v.illegal for v in verdicts)}, not safe while a fault was latched or "
        f"the machine was off in {sum(v.unsafe for v in verdicts)}."
    )
    yield (
        f"- Control periods missed: {campaign.missed:.0f}; stops because this computer was too "
        f"busy, beside those with busy processes or a slow rig: {campaign.busy}."
    )
    yield (
        f"- Memory: server {last.memory / _MB:.1f} MB ({server:+.1f} MB since the warm-up), loop "
        f"{last.loop_memory / _MB:.1f} MB ({loop:+.1f} MB); descriptors: server {last.files} "
        f"({files:+d}), loop {last.loop_files} ({loop_files:+d})."
    )
    yield f"- Unexplained: {len(complaints)}."
