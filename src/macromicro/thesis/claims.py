"""Claims: what the thesis states, what was measured here, and the verdict.

Statements, printed values and what counts as reproduced are data, `claims.toml`; what was measured
is put beside them by `stated`, and each claim is judged by itself.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.errors import InputError, MacromicroError
from macromicro.recording import Recording

REPRODUCED, DIFFERS, NOT_MEASURED = "reproduced", "differs", "not measured"
CALIBRATED, SET, COMPUTED, PREDICTED = "calibrated", "set", "computed", "predicted"
KINDS = (CALIBRATED, SET, COMPUTED, PREDICTED)
# What the history says of M9, M14 and A4, for which no parameter is named.
MET = (
    "the bench was made to meet it from its first sketch on; which parameter was turned for it "
    "is not recorded"
)
LIST = Path(__file__).with_name("claims.toml")

Number = float | list[float] | list[str] | None
Band = tuple[float, float]


class Statement(NamedTuple):
    """What the thesis states, apart from what was measured.

    `printed`: number, list of numbers or names, or None where there is none; `printed_text`: what
    the thesis prints in words. `kind`: `calibrated` (a parameter of the bench or a gain was chosen
    with it in view, the bench was made to meet it, or it follows from claims for which that was
    so), `set` (a setting fixes it, and the measurement gives the setting back), `computed`
    (arithmetic) or `predicted` (none of these). `procedure`: which measures it. `accept`: from and
    to, of each number measured, one alone of every one; `of`: what else these are for; `rule`: what
    more must hold, in words.
    """

    id: str
    section: str
    procedure: str
    claim: str
    kind: str
    printed: Number = None
    printed_text: str = ""
    unit: str = ""
    accept: tuple[Band, ...] = ()
    of: str = ""
    rule: str = ""


class Claim(NamedTuple):
    """A statement with what was measured: fields as in `Statement`; `reason` says why it differs,
    or what the agreement rests on."""

    id: str
    section: str
    claim: str
    printed: Number
    measured: Number
    unit: str
    verdict: str
    reason: str = ""
    kind: str = PREDICTED
    printed_text: str = ""


class NotMeasured(MacromicroError):
    """What a claim needs is not in the recordings; the message is the claim's reason."""


def _read() -> dict[str, Statement]:
    rows = tomllib.loads(LIST.read_text(encoding="utf-8"))["claim"]
    found = [
        Statement(**{**row, "accept": tuple((low, high) for low, high in row.get("accept", ()))})
        for row in rows
    ]
    return {s.id: s for s in found}


STATEMENTS = _read()
_PLACE = {name: k for k, name in enumerate(STATEMENTS)}


def measured_by(procedure: str) -> tuple[str, ...]:
    """Ids of the claims that a procedure measures, in the order of the list."""
    return tuple(s.id for s in STATEMENTS.values() if s.procedure == procedure)


def printed(name: str) -> float:
    """The number that the thesis prints for a claim."""
    value = STATEMENTS[name].printed
    assert isinstance(value, float), name
    return value


def printed_list(name: str) -> list[Any]:
    """The numbers or names that the thesis prints for a claim."""
    value = STATEMENTS[name].printed
    assert isinstance(value, list), name
    return value


def band(name: str, k: int = 0) -> Band:
    """From and to of the k-th number of a claim."""
    return STATEMENTS[name].accept[k]


def accepts(name: str, *values: float) -> bool:
    """Are all `values` within the claim's bands? One band alone is for all; NaN is in none."""
    bands = STATEMENTS[name].accept
    bands = bands * len(values) if len(bands) == 1 else bands
    return all(low <= v <= high for v, (low, high) in zip(values, bands, strict=True))


def within(name: str, *values: float) -> str:
    """The verdict for what must lie within the claim's bands; NaN counts as not measured."""
    if any(math.isnan(v) for v in values):
        return NOT_MEASURED
    return holds(accepts(name, *values))


def reached(name: str, value: float) -> str:
    """As `within`, for a time until something happens: NaN says that it never did in a run
    that was whole, and differs."""
    return DIFFERS if math.isnan(value) else within(name, value)


def holds(good: bool) -> str:
    """The verdict for a claim that holds or does not."""
    return REPRODUCED if good else DIFFERS


def stated(name: str, measured: Number, verdict: str, reason: str = "") -> Claim:
    """The claim `name` with what was measured. Raises KeyError for one that is not listed."""
    s = STATEMENTS[name]
    return Claim(
        s.id,
        s.section,
        s.claim,
        s.printed,
        measured,
        s.unit,
        verdict,
        reason,
        s.kind,
        s.printed_text,
    )


def lost(name: str, reason: str) -> Claim:
    """The claim `name`, not measured. One that is not listed has no words and no kind."""
    if name in STATEMENTS:
        return stated(name, None, NOT_MEASURED, reason)
    return Claim(name, "", "Not measured", None, None, "", NOT_MEASURED, reason, kind="")


def in_order(claims: Iterable[Claim]) -> list[Claim]:
    """The claims as the list has them; those that it lacks last, in the order they came."""
    return sorted(claims, key=lambda c: _PLACE.get(c.id, len(_PLACE)))


Rule = Callable[[], Claim | Sequence[Claim]]


def judged(rules: Sequence[tuple[str | tuple[str, ...], Rule]]) -> list[Claim]:
    """The claims of all rules, in order. Each rule goes with the id or ids that it measures;
    where it raises, these are not measured, and the reason says why: what spoils one rule does not
    lose its neighbours."""
    found: list[Claim] = []
    for ids, rule in rules:
        names = (ids,) if isinstance(ids, str) else ids
        try:
            made = rule()
        except Exception as error:
            found += [lost(name, why(error)) for name in names]
        else:
            found += [made] if isinstance(made, Claim) else made
    return found


def why(error: Exception) -> str:
    """An exception as a reason."""
    if isinstance(error, InputError):
        return f"the recordings do not give it: {error}"
    if isinstance(error, NotMeasured):
        return str(error)
    return f"its rule could not be worked out: {type(error).__name__}: {error}"


def whole(what: str, *recordings: Recording) -> None:
    """NotMeasured unless each of `recordings`, named by `what`, came to its programme's end."""
    for recording in recordings:
        if not recording.attributes.get("finished", 1):
            fault = recording.attributes.get("fault", "its last move did not arrive")
            after = len(recording) * recording.dt
            raise NotMeasured(f"{what} was cut short after {after:.1f} s: {fault}")
