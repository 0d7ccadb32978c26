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

from macromicro.drawing.captions import fill_words
from macromicro.errors import InputError, MacromicroError
from macromicro.recording import Recording

REPRODUCED, DIFFERS, NOT_MEASURED = "reproduced", "differs", "not measured"
CALIBRATED, SET, COMPUTED, PREDICTED = "calibrated", "set", "computed", "predicted"
KINDS = (CALIBRATED, SET, COMPUTED, PREDICTED)
LIST = Path(__file__).with_name("claims.toml")

Number = float | list[float] | list[str] | None
Band = tuple[float, float]


class Claim(NamedTuple):
    """A statement of the thesis, with its measurement once there is one.

    `kind`: `calibrated` (a parameter of the bench or a gain was chosen for it, or it follows from
    such claims), `set` (a setting fixes it), `computed` (arithmetic) or `predicted` (all others).
    """

    id: str
    section: str
    claim: str
    printed: Number = None
    measured: Number = None
    unit: str = ""
    verdict: str = NOT_MEASURED
    reason: str = ""  # why it differs, or why it agrees
    kind: str = PREDICTED
    printed_text: str = ""
    accept: tuple[Band, ...] = ()  # bounds of each number; one band alone holds for all
    of: str = ""  # what else the bands apply to
    basis: str = ""  # reason of the bands
    rule: str = ""  # further conditions, in words
    procedure: str = ""  # that measures it


class NotMeasured(MacromicroError):
    """A claim's data is missing in the recordings; the message is the claim's reason."""


def _statement(row: dict[str, Any]) -> Claim:
    """A claim of the list, not measured and without its reason."""
    given = {name: value for name, value in row.items() if name != "reason"}
    return Claim(**given | {"accept": tuple((low, high) for low, high in row.get("accept", ()))})


_ROWS = tomllib.loads(LIST.read_text(encoding="utf-8"))["claim"]
STATEMENTS = {row["id"]: _statement(row) for row in _ROWS}
# With placeholders; several wordings by name, where the rule chooses.
REASONS: dict[str, str | dict[str, str]] = {row["id"]: row.get("reason", "") for row in _ROWS}
_PLACE = {name: k for k, name in enumerate(STATEMENTS)}


def measured_by(procedure: str) -> tuple[str, ...]:
    """Ids of the claims that a procedure measures, in the order of the list."""
    return tuple(s.id for s in STATEMENTS.values() if s.procedure == procedure)


def printed_value(name: str) -> float:
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


def judge_time(name: str, value: float) -> str:
    """As `within`, for a time until an event; NaN in a complete run means never, and differs."""
    return DIFFERS if math.isnan(value) else within(name, value)


def _holds(good: bool) -> str:
    return REPRODUCED if good else DIFFERS


def state(
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
    reason = REASONS[name]
    text = fill_words(reason if isinstance(reason, str) else reason[wording], **values)
    return STATEMENTS[name]._replace(measured=measured, verdict=verdict, reason=text)


def unmeasured(name: str, reason: str) -> Claim:
    """The claim `name`, not measured; an unknown one has no words and no kind."""
    unknown = Claim(name, "", "Not measured", kind="")
    return STATEMENTS.get(name, unknown)._replace(reason=reason)


def in_order(claims: Iterable[Claim]) -> list[Claim]:
    """The claims in the order of the list; unknown ones last."""
    return sorted(claims, key=lambda c: _PLACE.get(c.id, len(_PLACE)))


Rule = Callable[[], Claim | Sequence[Claim]]


def judge(rules: Sequence[tuple[str | tuple[str, ...], Rule]]) -> list[Claim]:
    """The claims of all rules, in order.

    A rule that raises loses only its own claims, with the exception as the reason.
    """
    found: list[Claim] = []
    for ids, rule in rules:
        names = (ids,) if isinstance(ids, str) else ids
        try:
            made = rule()
        except Exception as error:
            found += [unmeasured(name, why(error)) for name in names]
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
