"""What a trial has found, as a section of docs/validation/reliability.md."""

from __future__ import annotations

import measured_page

from boardtrial.trial import Trial


def _clock(seconds: float) -> str:
    minutes = round(seconds / 60.0)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"


def section(trial: Trial, seed: int, wall: float) -> str:
    """The section's text.

    Parameters
    ----------
    trial : Trial
        After its last round.
    seed : int
        Of it.
    wall : float
        How long it took, s.

    Returns
    -------
    str
        Markdown.
    """
    bench = trial.line.bench
    injuries = ", ".join(f"{n} {name}" for name, n in trial.injuries.most_common())
    faults = ", ".join(f"{n} {name}" for name, n in trial.faults.most_common())
    judge = trial.judge
    rows = [
        ("the board's time", f"{_clock(1e-3 * bench.tick)}, in {_clock(wall)}, seed {seed}"),
        ("frames of the host", f"{trial.host.orders}, in {trial.rounds} rounds"),
        ("injuries", injuries),
        ("stops of the board", faults),
        ("unsafe outputs", str(judge.count)),
        ("unexplained", str(trial.count)),
        ("control interrupt in time, at worst", f"{trial.worst_cycles} of 16000 cycles"),
        ("periods missed", f"{trial.missed}, of {judge.floods} in floods of bytes"),
        ("stack", f"greatest depth {trial.deepest} bytes, {trial.least_free} never used"),
        ("the wire, at most", f"{judge.hottest:.0f} degC"),
        ("the carriage, at most", f"{1e3 * judge.fastest:.0f} mm/s"),
    ]
    lines = [measured_page.table(("", ""), rows).rstrip()]
    lines += [f"\nUnsafe: {each}" for each in judge.unsafe]
    lines += [f"\nUnexplained: {each}" for each in trial.unexplained]
    return "\n".join(lines)
