"""What the soak has found, as a document's section."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterable, Sequence

import measured_page

from macromicro.rig import faults
from soak.campaign import Campaign, Round
from soak.trials import NO_FAULT
from soak.victim import Load

_MB = 1e6
_NAMES = {text.message: text.name for text in faults.TEXTS.values()}
# Memory may grow by what a server keeps of its events (10 000 of them at most).
MOST_MB, MOST_LOOP_MB, MOST_FILES = 8.0, 2.0, 3


def part(campaign: Campaign, rounds: Sequence[Round], complaints: list[str]) -> str:
    """A machine: the faults, then the checks, then what nothing explains."""
    lines = [f"**{campaign.victim.subject.name.capitalize()}**", "", _faults(rounds)]
    lines += [*_checks(campaign), f"- Unexplained: {len(complaints)}."]
    if complaints:
        lines += ["", *(f"- **unexplained**: {each}" for each in complaints)]
    return "\n".join([*lines, ""])


def _faults(rounds: Sequence[Round]) -> str:
    head = ("fault", "injected", "stopped", "safe after, median [ms]", "worst [ms]", "reported")
    rows = []
    for name in sorted({each.name for each in rounds} - {NO_FAULT.name}):
        mine = [each for each in rounds if each.name == name]
        times = sorted(1e3 * each.safe for each in mine if not math.isnan(each.safe))
        median = f"{statistics.median(times):.1f}" if times else "-"
        worst = f"{times[-1]:.1f}" if times else "-"
        stopped = sum(each.code != 0 for each in mine)
        most = Counter(each.words for each in mine if each.words).most_common(1)
        words = (most[0][0] if most else "nothing").replace("|", "/")[:110]
        words = _NAMES.get(words, words)
        rows.append((name, str(len(mine)), str(stopped), median, worst, words))
    return measured_page.table(head, rows)


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


def _checks(campaign: Campaign) -> Iterable[str]:
    verdicts, loads = campaign.verdicts, campaign.loads
    server, loop, files, loop_files = growth(loads)
    ends = ", ".join(f"{n} {outcome}" for outcome, n in campaign.outcomes.most_common())
    yield (
        f"- Orders: {sum(campaign.outcomes.values())} beside {campaign.homings} homings: {ends}. "
        f"{campaign.checked} trusted positions were compared with the truth."
    )
    if campaign.unseen:
        worst = max(campaign.unseen) * campaign.scale
        yield (
            "- An encoder that died as the stage came to rest, which one sensor cannot show: "
            f"{len(campaign.unseen)} times, at most {worst:.3g} {campaign.unit.lower()} off."
        )
    yield (
        f"- Recorded: {sum(v.rows for v in verdicts)} rows, {sum(v.gaps for v in verdicts)} of "
        f"them missing; outputs illegal in {sum(v.illegal for v in verdicts)}, not safe while a "
        f"fault was latched or the machine was off in {sum(v.unsafe for v in verdicts)}."
    )
    yield (
        f"- Control periods missed: {campaign.missed:.0f}; stops because this computer was too "
        f"busy, beside those with busy processes or a slow rig: {campaign.busy}."
    )
    if loads:
        last = loads[-1][1]
        yield (
            f"- Memory: server {last.memory / _MB:.1f} MB ({server:+.1f} MB since the warm-up), "
            f"loop {last.loop_memory / _MB:.1f} MB ({loop:+.1f} MB); descriptors: server "
            f"{last.files} ({files:+d}), loop {last.loop_files} ({loop_files:+d})."
        )
