"""Runs the soak and writes its table; exit status 1 where something is not explained."""

from __future__ import annotations

import argparse
import os
import platform
import signal
import sys
import tempfile
import traceback
from pathlib import Path

import faulty
import sections
from faultmatrix.subjects import SUBJECTS
from soak import table
from soak.campaign import Campaign, Round
from soak.finale import finale
from soak.victim import Victim

KINDS, EACH = tuple(SUBJECTS), "each"


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0, help="how long, beside the finale")
    parser.add_argument("--seed", type=int, default=1, help="of commands, faults and noise")
    parser.add_argument("--out", type=Path, default=Path("results/soak.md"), help="the table")
    parser.add_argument(
        "--kind",
        choices=(*KINDS, EACH),
        default="two-stage",
        help='of machine; "each": all in turn, which share the minutes',
    )
    given = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))  # and clean up
    kinds = KINDS if given.kind == EACH else (given.kind,)
    seconds = 60.0 * given.minutes / len(kinds)
    load = os.getloadavg()
    parts, complaints = [], 0
    for kind in kinds:
        with tempfile.TemporaryDirectory(prefix="macromicro-soak-") as folder:
            victim = Victim(Path(folder), given.seed, kind=kind)
            try:
                part, found = soaked(victim, given.seed, seconds)
            finally:
                victim.end()
        parts.append(part)
        complaints += len(found)
    after = os.getloadavg()
    head = (
        f"{given.minutes:g} minutes, seed {given.seed}, on {os.cpu_count()} cores "
        f"({platform.machine()}, {platform.system()} {platform.release()}), load "
        f"{load[0]:.1f} before and {after[0]:.1f} after; no real-time priority unless the loop "
        "may have it."
    )
    text = "\n".join([head, "", *parts])
    sections.write(given.out, "soak", text)
    print(text)
    return 1 if complaints else 0


def soaked(victim: Victim, seed: int, seconds: float) -> tuple[str, list[str]]:
    """A machine's part of the table, and what nothing explains."""
    victim.start()
    campaign = Campaign(victim, seed)
    rounds: list[Round] = []
    complaints: list[str] = []
    try:
        campaign.run(seconds)
        if not victim.subject.led:
            rounds, complaints = finale(victim, seed)
    except Exception:  # the table is worth most when something went wrong
        traceback.print_exc()
        error = traceback.format_exc(limit=1).strip()
        complaints.append(f"the soak ended with an error: {error}")
        if words := victim.said():
            complaints.append(f"the server said: {words}")
    complaints = [*campaign.complaints, *table.leaks(campaign.loads), *complaints]
    if illegal := victim.cells[faulty.ILLEGAL]:
        complaints.append(f"{illegal:.0f} illegal outputs were written")
    return table.part(campaign, [*campaign.rounds, *rounds], complaints), complaints


if __name__ == "__main__":
    sys.exit(main())
