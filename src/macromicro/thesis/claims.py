"""Claims: what the thesis states, what was measured, and the verdict.

Statements, printed values, acceptance bands and the words of the reasons are data, `claims.toml`;
`stated` adds the measurement.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.drawing.captions import worded
from macromicro.errors import InputError, MacromicroError
from macromicro.recording import Recording

REPRODUCED, DIFFERS, NOT_MEASURED = "reproduced", "differs", "not measured"
CALIBRATED, SET, COMPUTED, PREDICTED = "calibrated", "set", "computed", "predicted"
KINDS = (CALIBRATED, SET, COMPUTED, PREDICTED)
LIST = Path(__file__).with_name("claims.toml")

Number = float | list[float] | list[str] | None
Band = tuple[float, float]


class Statement(NamedTuple):
    """A statement of the thesis, without a measurement.

    `kind`: `calibrated` (a parameter of the bench or a gain was chosen for it, or it follows from
    such claims), `set` (a setting fixes it), `computed` (arithmetic) or `predicted` (all others).
    """

    id: str
    section: str
    procedure: str
    claim: str
    kind: str
    printed: Number = None
    printed_text: str = ""
    unit: str = ""
    accept: tuple[Band, ...] = ()  # bounds of each number; one band alone holds for all
    of: str = ""  # what else the bands apply to
    basis: str = ""  # reason of the bands
    rule: str = ""  # further conditions, in words
    # Why it differs or agrees, with placeholders; several wordings by name, where the rule chooses.
    reason: str | dict[str, str] = ""


class Claim(NamedTuple):
    """A statement with its measurement; `reason`: why it differs, or why it agrees."""

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
    accept: tuple[Band, ...] = ()
    of: str = ""
    basis: str = ""
    rule: str = ""


class NotMeasured(MacromicroError):
    """A claim's data is missing in the recordings; the message is the claim's reason."""


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
    value = STATEMENTS[name].printed
    assert isinstance(value, float), name
    return value


def printed_list(name: str) -> list[Any]:
    value = STATEMENTS[name].printed
    assert isinstance(value, list), name
    return value


def band(name: str, k: int = 0) -> Band:
    """Lower and upper bound of the k-th number of a claim."""
    return STATEMENTS[name].accept[k]


def accepts(name: str, *values: float) -> bool:
    """Whether all `values` are within the claim's bands; NaN is in none."""
    bands = STATEMENTS[name].accept
    bands = bands * len(values) if len(bands) == 1 else bands
    return all(low <= v <= high for v, (low, high) in zip(values, bands, strict=True))


def within(name: str, *values: float) -> str:
    """The verdict for values within the claim's bands; NaN counts as not measured."""
    if any(math.isnan(v) for v in values):
        return NOT_MEASURED
    return _holds(accepts(name, *values))


def reached(name: str, value: float) -> str:
    """As `within`, for a time until an event; NaN in a complete run means never, and differs."""
    return DIFFERS if math.isnan(value) else within(name, value)


def _holds(good: bool) -> str:
    return REPRODUCED if good else DIFFERS


def stated(
    name: str,
    measured: Number,
    verdict: str | bool | None = None,
    /,
    *,
    wording: str = "",
    **values: object,
) -> Claim:
    """The claim `name` with its measurement; KeyError for an unknown one.

    Without a verdict the bands decide; a truth value says whether the claim's rule is met.
    `values` fill the placeholders of its reason in the list; `wording` names one of several.
    """
    if verdict is None:
        verdict = within(name, *(measured if isinstance(measured, list) else [measured]))
    elif not isinstance(verdict, str):
        verdict = _holds(verdict)
    reason = STATEMENTS[name].reason
    text = reason if isinstance(reason, str) else reason[wording]
    return _claim(STATEMENTS[name], measured, verdict, worded(text, **values))


def _claim(s: Statement, measured: Number, verdict: str, reason: str) -> Claim:
    shared = {name: getattr(s, name) for name in Claim._fields if name in Statement._fields}
    return Claim(**{**shared, "measured": measured, "verdict": verdict, "reason": reason})


def lost(name: str, reason: str) -> Claim:
    """The claim `name`, not measured; an unknown one has no words and no kind."""
    if name in STATEMENTS:
        return _claim(STATEMENTS[name], None, NOT_MEASURED, reason)
    return Claim(name, "", "Not measured", None, None, "", NOT_MEASURED, reason, kind="")


def in_order(claims: Iterable[Claim]) -> list[Claim]:
    """The claims in the order of the list; unknown ones last."""
    return sorted(claims, key=lambda c: _PLACE.get(c.id, len(_PLACE)))


Rule = Callable[[], Claim | Sequence[Claim]]


def judged(rules: Sequence[tuple[str | tuple[str, ...], Rule]]) -> list[Claim]:
    """The claims of all rules, in order.

    A rule that raises loses only its own claims, with the exception as the reason.
    """
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
    if isinstance(error, InputError):
        return f"not in the recordings: {error}"
    if isinstance(error, NotMeasured):
        return str(error)
    return f"its rule could not be evaluated: {type(error).__name__}: {error}"


def whole(what: str, *recordings: Recording) -> None:
    """NotMeasured unless each of `recordings` came to its programme's end."""
    for recording in recordings:
        if not recording.attributes.get("finished", 1):
            fault = recording.attributes.get("fault", "its last move did not arrive")
            after = len(recording) * recording.dt
            raise NotMeasured(f"{what} ended after {after:.1f} s: {fault}")
