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

from macromicro.rig import faulty
from soak import table
from soak.campaign import Campaign, Round
from soak.finale import finale
from soak.victim import Victim


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m soak", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0, help="how long, beside the finale")
    parser.add_argument("--seed", type=int, default=1, help="of commands, faults and noise")
    parser.add_argument("--out", type=Path, default=Path("results/soak.md"), help="the table")
    given = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))  # and clean up
    with tempfile.TemporaryDirectory(prefix="macromicro-soak-") as folder:
        victim = Victim(Path(folder), given.seed)
        try:
            return _soak(victim, given)
        finally:
            victim.end()


def _soak(victim: Victim, given: argparse.Namespace) -> int:
    victim.start()
    campaign = Campaign(victim, given.seed)
    rounds: list[Round] = []
    complaints: list[str] = []
    load = os.getloadavg()
    try:
        campaign.run(60.0 * given.minutes)
        campaign.finish()
        rounds, complaints = finale(victim, given.seed)
    except Exception:  # the table is worth most when something went wrong
        traceback.print_exc()
        complaints = [f"the soak ended with an error: {traceback.format_exc(limit=1).strip()}"]
        complaints += [f"the server said: {victim.said()}"] if victim.said() else []
    complaints = [*campaign.complaints, *table.leaks(campaign.loads), *complaints]
    if victim.cells[faulty.ILLEGAL]:
        complaints.append(f"{victim.cells[faulty.ILLEGAL]:.0f} illegal outputs were written")
    after = os.getloadavg()
    head = (
        f"{given.minutes:g} minutes, seed {given.seed}, on {os.cpu_count()} cores "
        f"({platform.machine()}, {platform.system()} {platform.release()}), load "
        f"{load[0]:.1f} before and {after[0]:.1f} after; no real-time priority unless the loop "
        "may have it."
    )
    text = table.section(head, campaign, [*campaign.rounds, *rounds], complaints)
    table.write(given.out, text)
    print(text)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
