"""Claims judged one by one, so that what spoils one rule does not lose its neighbours."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from macromicro.errors import InputError, MacromicroError
from macromicro.experiments.claim import Claim
from macromicro.experiments.statements import lost
from macromicro.recording import Recording

Rule = Callable[[], Claim | Sequence[Claim]]


class NotMeasured(MacromicroError):
    """What a claim needs is not in the recordings; the message is the claim's reason."""


def judged(rules: Sequence[tuple[str | tuple[str, ...], Rule]]) -> list[Claim]:
    """The claims of all rules, in order. Each rule goes with the id or ids that it measures;
    where it raises, these are not measured, and the reason says why."""
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
