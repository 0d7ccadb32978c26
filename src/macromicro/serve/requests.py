"""The table of requests behind all protocols."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Refused
from macromicro.place import LENGTH, Place

EVERYONE = "all"  # any connected client
TOKEN = "token"  # clients that gave the token, if one is required
CONTROL = "control"  # the holder of control
STOPS = "all, at once"  # any connected client, past every queue

MOVES, WAKES, ENDS = "moves", "wakes", "ends"
_POINTS = (m.MovePoint, m.MovePointBy)


class Field(NamedTuple):
    """One value of a request, as the message has it."""

    name: str
    unit: str = ""  # "" for a flag
    lo: float = 0.0
    hi: float = 0.0
    key: str = "value"  # name in JSON
    ends: str = ""  # soft limits that may be given by name: "whole", "macro", "micro"
    choices: tuple[str, ...] = ()
    default: float | None = None  # what is meant where it is left out; None: it is needed


class RequestType(NamedTuple):
    """One kind of request."""

    name: str  # in JSON
    message: Any
    header: str  # in SCPI; {stage} stands for a choice of the first field
    text: str
    fields: tuple[Field, ...] = ()
    access: str = CONTROL
    effect: str = ""  # MOVES, WAKES, ENDS or ""; what begins a `motion` moves
    motion: str = ""  # name of the motion that it begins, before its target

    @property
    def replaces(self) -> bool:
        """Whether it may replace a motion under way."""
        return "replace" in self.message._fields

    @property
    def is_point(self) -> bool:
        """Whether its fields are coordinates, some of which may be left out."""
        return self.message in _POINTS

    def request(self, *values: Any, **given: Any) -> Any:
        """The message of some values, one for each field; None: not of this stage of a point."""
        if self.is_point:
            each = zip(self.fields, values, strict=True)
            values = ({field.name: value for field, value in each if value is not None},)
        elif self.message is m.SetPoints:
            half = len(values) // 2
            values = (tuple(zip(values[:half], values[half:], strict=True)),)
        return self.message(*values, **given)

    def words(self, values: tuple[Any, ...], place: Place = LENGTH) -> str:
        """A motion with its target: "move to 12 mm"."""
        shown = [
            _with_unit(f.unit, v, place)
            for f, v in zip(self.fields, values, strict=False)
            if f.unit and v is not None
        ]
        return " ".join((self.motion, *shown))


def _with_unit(unit: str, value: float, place: Place) -> str:
    if unit == "m":
        return f"{value * place.per:.6g} {place.unit}"
    return f"{value:.0f} counts" if unit == "counts" else f"{value:.6g} {unit}"


def _read(table: dict[str, dict[str, Any]]) -> tuple[RequestType, ...]:
    made = []
    for name, row in table.items():
        message = getattr(m, row.pop("message"))
        fields = tuple(_field(**field) for field in row.pop("fields", ()))
        made.append(RequestType(name, message, fields=fields, **row))
    return tuple(made)


def _field(choices: Sequence[str] = (), **rest: Any) -> Field:
    """A field, where a name in capitals is one of the messages'."""
    given = {
        key: getattr(m, value) if isinstance(value, str) and value.isupper() else value
        for key, value in rest.items()
    }
    named = [getattr(m, choice) for choice in choices]
    several = ((each,) if isinstance(each, str) else each for each in named)
    return Field(choices=tuple(chain.from_iterable(several)), **given)


_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
REQUESTS = _read(_TABLE["requests"])
# Set points: they cost no reply, no queue and no file. The machine follows the newest one.
STREAMED = _read(_TABLE["points"])


def of_axes(axes: tuple[str, ...]) -> dict[str, RequestType]:
    """The requests of a machine of these stages; of one without named stages those of `AXES`."""
    return _of(REQUESTS, axes or m.AXES)


def stream_requests(axes: tuple[str, ...]) -> dict[str, RequestType]:
    """The set points of a machine of these stages."""
    return _of(STREAMED, axes or m.AXES)


@cache
def _of(kinds: tuple[RequestType, ...], axes: tuple[str, ...]) -> dict[str, RequestType]:
    return {each.name: _with_axes(each, axes) for each in kinds}


def _with_axes(kind: RequestType, axes: tuple[str, ...]) -> RequestType:
    if kind.is_point:
        like = kind.fields[0]
        each = ((axis, axis if like.ends else "") for axis in axes)
        fields = tuple(like._replace(name=axis, key=axis, ends=ends) for axis, ends in each)
        return kind._replace(fields=fields)
    if kind.message is m.SetPoints:
        place, speed = kind.fields[0], kind.fields[-1]
        places = tuple(place._replace(name=axis, key=axis) for axis in axes)
        speeds = (speed._replace(name=f"{a} velocity", key=f"{a}_velocity") for a in axes)
        return kind._replace(fields=(*places, *speeds))
    fields = tuple(
        field._replace(choices=_choices_for(field.choices, axes))
        if set(m.AXES) <= set(field.choices)
        else field
        for field in kind.fields
    )
    return kind._replace(fields=fields)


def _choices_for(choices: tuple[str, ...], axes: tuple[str, ...]) -> tuple[str, ...]:
    """Choices among stages, with these instead of `AXES`."""
    others = tuple(choice for choice in choices if choice not in (*m.AXES, m.ALL))
    return (*others, *axes, *((m.ALL,) if m.ALL in choices else ()))


KINDS = of_axes(m.AXES)
POINTS = stream_requests(m.AXES)
_EFFECTS = {each.message: each.effect or (MOVES if each.motion else "") for each in REQUESTS}
_EFFECTS[m.LinkLost] = ENDS


def ends(request: Any) -> bool:
    """Whether it only ends a motion; such a request never expires."""
    if isinstance(request, m.Jog):
        return isinstance(request.speed, int | float) and request.speed == 0.0
    return _EFFECTS.get(type(request)) == ENDS


def moves(request: Any) -> bool:
    return _EFFECTS.get(type(request)) == MOVES and not ends(request)


def begins(request: Any) -> bool:
    """Whether something moves, or could from then on."""
    return moves(request) or _EFFECTS.get(type(request)) == WAKES


def place(point: m.SetPoint | m.SetPoints) -> tuple[tuple[float, float], ...]:
    """Position and velocity of each stage at a set point."""
    return point.each if isinstance(point, m.SetPoints) else ((point.position, point.velocity),)


_AGAIN = "ask again if still needed"
OVERTAKEN = Refused("a stop came before it began", _AGAIN)
TOO_LATE = Refused("it came too late: the loop was delayed", _AGAIN)


class Order(NamedTuple):
    """A request with its time and expiry on the monotonic clock."""

    serial: int
    request: Any
    asked: int  # ns
    until: int  # ns
    trial: bool = False  # only check whether it would be refused


def void(order: Order, emergency: int, now: int) -> Refused | None:
    """Why an order is late, or older than an emergency stop; else None (times in ns)."""
    if ends(order.request):
        return None
    if order.asked <= emergency:
        return OVERTAKEN
    return TOO_LATE if now > order.until else None
