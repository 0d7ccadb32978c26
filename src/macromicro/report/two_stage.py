"""The report of a run of the two-stage machine."""

from __future__ import annotations

from typing import Any

from macromicro.design.profiles import ProfileResult
from macromicro.design.response import MoveResult
from macromicro.design.tracking import Tracking
from macromicro.programme import MACRO
from macromicro.report import run
from macromicro.report.run import Line, RunReport, amount
from macromicro.runs import arrivals
from macromicro.runs.arrivals import Rest
from macromicro.runs.job import Ended
from macromicro.schema import config

HEADINGS = (*run.MOVE, "band", run.REST, run.OVERSHOOT, "Hall error", run.TRUE)
_FEW = 10  # lines of profiles


def report(ended: Ended, started: str) -> RunReport:
    request = ended.job.request
    return RunReport(
        opening=f"{run.cycles(request.cycles)} on the virtual bench, "
        f"{'with' if request.fan else 'without'} fan, {run.origin(request.seed, started)}",
        headings=HEADINGS,
        table=table(ended),
        remarks=remarks(ended),
        verdict=verdict(ended),
        problems=problems(ended),
        footnote=run.footnote(HEADINGS),
        settings=config.as_toml(ended.job.settings),
        summary=summary(ended, started),
    )


def summary(ended: Ended, started: str) -> dict[str, Any]:
    return run.summary(ended, started, len(ended.job.programme.target)) | {
        "fan": ended.job.request.fan,
        "moves_begun": ended.begun,
        "tracking": [t._asdict() for t in ended.tracking],
        "profiles": [p._asdict() for p in ended.profiles],
        "moves": [m._asdict() for m in ended.moves],
        "vibration": [v._asdict() for v in ended.vibration],
        "extension": [c._asdict() for c in ended.cycles],
    }


def table(ended: Ended) -> list[Line]:
    numbers = ended.job.programme.numbers
    return [_line(m, int(numbers[m.move])) for m in ended.moves]


def _line(m: MoveResult, number: int) -> Line:
    errors = (m.final_error, m.overshoot, m.hall_error, m.true_error)
    cells = (amount(value, _digits(m.unit), m.unit) for value in errors)
    band, target = f"±{m.band:.2g} {m.unit}", f"{m.target:.6g} {m.unit}"
    return run.line(number, m.stage, target, m.settling_s, m.complete, (band, *cells))


def _rests(ended: Ended) -> list[Rest]:
    return arrivals.of_both(ended.moves, ended.job.programme.numbers)


def verdict(ended: Ended) -> str:
    programme, followed = ended.job.programme, {t.stage for t in ended.tracking}
    names = ["macro" if stage == MACRO else "micro" for stage in programme.stage]
    single = programme.moves if programme.mixed else [True] * len(names)
    planned = sum(
        bool(one) and name not in followed for one, name in zip(single, names, strict=True)
    )
    # A set point that the next one overtakes before its stage's turn is no move.
    planned = len(ended.moves) if ended.finished else planned
    errors = [
        way.peak_error * (1e-3 if way.unit == "mm" else 1e-6)
        for way in (*ended.tracking, *ended.profiles)
        if way.peak_error is not None
    ]
    return arrivals.verdict(_rests(ended), planned, followed=max(errors, default=None))


def remarks(ended: Ended) -> list[tuple[str, str]]:
    found = [(f"{t.stage}-stage", _tracking(t)) for t in ended.tracking]
    found += [(f"profile {p.profile + 1}", _profile(p)) for p in ended.profiles[:_FEW]]
    if len(ended.profiles) > _FEW:
        found.append(("profiles", f"{len(ended.profiles) - _FEW} more are in summary.json"))
    if ended.vibration:
        found.append(("vibration", _vibration(ended)))
    if any(c.extension_s is not None for c in ended.cycles):
        found.append(("extension", _extension(ended)))
    return [*found, *run.speed(ended)]


def _tracking(t: Tracking) -> str:
    text = f"follows {t.targets} targets from {t.start_s:.2f} to {t.end_s:.2f} s, {_error(t)}"
    if t.lag_s is None:
        return text
    left = amount(t.rms_without_lag, _digits(t.unit), t.unit)
    return f"{text}; the lag is {t.lag_s * 1e3:.0f} ms, without which {left} rms remain"


def _error(way: Tracking | ProfileResult) -> str:
    rms, peak = (amount(e, _digits(way.unit), way.unit) for e in (way.rms_error, way.peak_error))
    return f"error {rms} rms, {peak} at most (at {way.peak_s:.2f} s)"


def _digits(unit: str) -> int:
    return 3 if unit == "mm" else 1


def _profile(p: ProfileResult) -> str:
    text = (
        f"{p.stage} from {p.origin:.6g} to {p.target:.6g} {p.unit} in {p.end_s - p.start_s:.3f} s"
    )
    if p.rms_error is not None:
        text += f", {_error(p)}"
    if p.settled_s is not None:
        text += f"; within {p.band:.2g} {p.unit} {p.settled_s:.3f} s after its end"
    elif p.complete and p.final_error is not None:
        text += f"; not within {p.band:.2g} {p.unit} at the end of its hold"
    return text


def _vibration(ended: Ended) -> str:
    first = ended.vibration[0]
    decay = "does not decay" if first.decay_s is None else f"{first.decay_s:.2f} s down to 2 um"
    number = int(ended.job.programme.numbers[first.move])
    text = (
        f"{first.amplitude_um:.1f} um at {first.frequency_hz:.1f} Hz after move {number}, {decay}"
    )
    if len(ended.vibration) > 1:
        every = [v.amplitude_um for v in ended.vibration]
        cycle = sum(m.stage == "macro" and m.move < ended.job.setup.per_cycle for m in ended.moves)
        moves = f"the {cycle}" if len(every) == cycle else f"{len(every)} of the {cycle}"
        text += f"; {min(every):.1f} to {max(every):.1f} um after {moves} macro moves of a cycle"
    return text


def _extension(ended: Ended) -> str:
    known = [c for c in ended.cycles if c.extension_s is not None]
    first, last = known[0], known[-1]
    text = f"{first.extension_s:.2f} s to within 20 um of zero"
    if len(known) > 1:
        text += f" in cycle {first.cycle}, {last.extension_s:.2f} s in cycle {last.cycle}"
    if last.bias_um is not None:
        text += f"; mean laser error {last.bias_um:.1f} um"
        if last.true_bias_um is not None:
            text += f", true {round(last.true_bias_um, 1) + 0.0:.1f} um"
    return text


def problems(ended: Ended) -> list[str]:
    found = []
    numbers = ended.job.programme.numbers if ended.job.programme.mixed else None
    begun, planned = ended.begun, len(ended.job.programme.target)
    if numbers is not None:
        begun, planned = int(numbers[begun - 1]) if begun else 0, int(numbers[-1])
    found += run.stop_lines(ended, f"move {begun} of {planned}")
    late = [p for p in ended.profiles if p.late_s > 0.0]
    if late:
        p = late[0]
        which = f"profile {p.profile + 1}" + (f" and {len(late) - 1} more" if len(late) > 1 else "")
        found.append(
            f"{which} began late, its first {p.late_s:.2f} s left out: the carriage had not "
            "settled; lengthen the hold of the macro profile before it"
        )
    if lost := arrivals.describe_missed(_rests(ended)):
        found.append(f"{lost} within the band before the hold's end")
    return found
