"""Turns a viewer's message into a request, checking units and types."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import cache
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Refused
from macromicro.control.settings import Control
from macromicro.errors import InputError
from macromicro.place import LENGTH, Place
from macromicro.schema.par import entries, finite
from macromicro.serve import telling
from macromicro.serve._instrument import Instrument
from macromicro.serve._programmes import Planned
from macromicro.serve.capturing import Trigger, Wanted
from macromicro.serve.requests import KINDS, STOPS, Field, RequestType, of_axes, stream_requests
from macromicro.units import size


def units(place: Place) -> dict[str, float]:
    """Position units in base units."""
    return {unit: size(unit) for unit in (place.base, place.unit, place.fine)}


_LONGEST = 200


class Refusal(Exception):
    """An invalid message: reason and remedy."""

    def __init__(self, reason: str, remedy: str = "") -> None:
        super().__init__(reason)
        self.reply = Refused(reason, remedy)


def read_object(message: str | bytes) -> dict[str, Any]:
    """Parse a JSON object with finite numbers."""
    if isinstance(message, bytes):
        raise Refusal("a message of bytes", "send JSON text")
    try:
        found = json.loads(message, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise Refusal("this is not JSON", "send a JSON object") from None
    if not isinstance(found, dict):
        raise Refusal("this is not a JSON object", 'send one such as {"do": "stop", "id": 1}')
    return found


def _no_constant(name: str) -> float:
    raise ValueError(name)


def number(order: dict[str, Any], key: str) -> float:
    """The finite number under `key`."""
    value = order.get(key)
    if not finite(value):
        raise Refusal(f"{key} {value!r:.60} is not a finite number", "give a number")
    return float(value)


def length(order: dict[str, Any], place: Place = LENGTH, key: str = "value") -> float:
    """The position under `key` in `unit`, in m or rad."""
    unit, known = order.get("unit"), units(place)
    if not isinstance(unit, str) or unit not in known:
        what = "angle" if place.turns else "length"
        raise Refusal(f"{unit!r:.20} is not a unit of {what} here", f"one of {', '.join(known)}")
    found = number(order, key) * known[unit]
    if not math.isfinite(found * 1e3):  # it is shown in mm
        raise Refusal("this is not a finite length", "give a shorter one")
    return found


def text(order: dict[str, Any], key: str) -> str:
    """The short text under `key`."""
    value = order.get(key)
    if not isinstance(value, str) or not 0 < len(value) <= _LONGEST:
        raise Refusal(f"{key} {value!r:.60} is not a name", "give a short text")
    return value


def _keys(kind: RequestType) -> tuple[str, ...]:
    """Keys of an order of this kind, beside its name and number."""
    units = ("unit",) if any(field.unit == "m" for field in kind.fields) else ()
    return (*(f.key for f in kind.fields), *units, *(("replace",) if kind.replaces else ()))


# Of every order that may be refused: a stop, an emergency stop and signs of life never are.
_OWN: dict[str, tuple[str, ...]] = {
    "gains": ("changes",),
    "limits": ("values",),
    "programme": ("name", "uploaded"),
    "download": ("name", "offset"),
    "upload": ("name", "offset", "text", "last"),
    "capture": ("signals", "trigger", "before", "after", "repeat"),
    "captured": ("seen",),
    "end capture": (),
    "record": (),
    "end recording": (),
    "settings": (),
    "take": (),
    "release": (),
    "login": ("token",),
    "state": (),
    "wait": ("motion",),
    "view": ("view", "span", "columns", "frames"),
}


@cache
def keys(axes: tuple[str, ...] = ()) -> dict[str, tuple[str, ...]]:
    """Keys of each order for a machine of these named stages."""
    kinds, points = of_axes(axes).items(), stream_requests(axes).items()
    found = {name: _keys(kind) for name, kind in kinds if kind.access != STOPS}
    return found | {name: (*_keys(kind), "time") for name, kind in points} | _OWN


def surplus(order: dict[str, Any], axes: tuple[str, ...] = ()) -> Refused | None:
    """The refusal of an order with unknown keys."""
    what, every = order.get("do"), keys(axes)
    if not isinstance(what, str) or what not in every:
        return None  # it is no order, which is said elsewhere
    known = every[what]
    unknown = [key for key in order if key not in ("do", "id", *known)]
    if not unknown:
        return None
    accepted = f"use {', '.join(known)}" if known else "send none"
    return Refused(f"{what}: unknown {', '.join(unknown):.200}", accepted)


class Orders:
    """Requests made of values alone, as in the table of requests."""

    def __init__(self, instrument: Instrument) -> None:
        self._instrument = instrument
        self._own: dict[str, Callable[[dict[str, Any]], m.Request]] = {
            "gains": lambda order: gains(order, instrument.control),
            "limits": self._limits,
            "programme": self._shipped,
        }

    def knows(self, what: object) -> bool:
        return isinstance(what, str) and what in KINDS

    def request(self, order: dict[str, Any]) -> m.Request:
        what = order["do"]
        if what in self._own:
            return self._own[what](order)
        return _read_request(of_axes(self._instrument.axes)[what], order, self._instrument.place)

    def point(self, order: dict[str, Any]) -> tuple[m.SetPoint | m.SetPoints, float]:
        """A streamed set point, and its time on the client's clock [s] or NaN."""
        kind, place = stream_requests(self._instrument.axes)[order["do"]], self._instrument.place
        values = [_value_of(field, order, place) for field in kind.fields]
        return kind.request(*values), number(order, "time") if "time" in order else math.nan

    def capture(self, order: dict[str, Any]) -> Wanted:
        """What is to be captured; its values are judged elsewhere."""
        signals, trigger = order.get("signals"), order.get("trigger", {})
        if not isinstance(signals, list) or not all(isinstance(name, str) for name in signals):
            raise Refusal("signals are not a list of names", "give the names of columns")
        known = ", ".join(Trigger._fields)
        if not isinstance(trigger, dict) or not set(trigger) <= set(Trigger._fields):
            raise Refusal(f"trigger {trigger!r:.60} is unknown", f"give {known}")
        words: dict[str, Any] = {key: text(trigger, key) for key in trigger if key != "threshold"}
        if "threshold" in trigger:
            words["threshold"] = number(trigger, "threshold")
        repeat = _flag(order, "repeat") if "repeat" in order else False
        before, after = (number({"before": 0.0, **order}, key) for key in ("before", "after"))
        return Wanted(tuple(signals), Trigger(**words), before, after, repeat)

    def _shipped(self, order: dict[str, Any]) -> m.Request:
        name, known = text(order, "name"), self._instrument.programmes()
        if name not in known:
            raise Refusal(f"there is no programme {name!r:.60}", f"one of {', '.join(known)}")
        return m.Programme(_plan(lambda: self._instrument.shipped(name)).plan)

    def _limits(self, order: dict[str, Any]) -> m.Request:
        """New soft limits by name, as in `telling.limits`; null for the machine's own."""
        settings = self._instrument.settings
        names = telling.limit_names(settings.facts.limited)
        values = order.get("values", ())
        if values is None:
            return m.SetLimits(None)
        if not isinstance(values, dict) or set(values) != set(names):
            own = "null for the machine's own"
            accepted = f'give all of {", ".join(names)} within "values", or {own}'
            raise Refusal("these are not soft limits", accepted)
        given, before = {n: number(values, n) for n in names}, self._instrument.limits
        return m.SetLimits(telling.soft_limits(given, before, settings.live.pitch))

    def programme(self, text: str, name: str) -> Planned:
        """The programme in a file `name`."""
        data = text.encode("utf-8")
        return _plan(lambda: self._instrument.programme_of(data, name))


def _plan(load: Callable[[], Planned]) -> Planned:
    try:
        return load()
    except InputError as error:
        raise Refusal(str(error), "correct it, or change the soft limits") from None


def _replace(order: dict[str, Any]) -> bool:
    given = order.get("replace", False)
    if not isinstance(given, bool):
        raise Refusal(f"{given!r:.20} does not say whether to replace", "true or false")
    return given


def _flag(order: dict[str, Any], key: str) -> bool:
    given = order.get(key)
    if not isinstance(given, bool):
        raise Refusal(f"{given!r:.20} is neither on nor off", "true or false")
    return given


def _read_request(kind: RequestType, order: dict[str, Any], place: Place) -> m.Request:
    """A request made of the values of its fields."""
    named = {field.key for field in kind.fields} & set(order)
    values = [
        None
        if kind.is_point and named and field.key not in order
        else _value_of(field, order, place)
        for field in kind.fields
    ]
    given = {"replace": _replace(order)} if kind.replaces else {}
    request: m.Request = kind.request(*values, **given)
    return request


def _value_of(field: Field, order: dict[str, Any], place: Place) -> float | bool | str:
    if field.default is not None and field.key not in order:
        return field.default
    if field.choices:
        return text(order, field.key)
    if field.unit == "m":
        return length(order, place, field.key)
    return number(order, field.key) if field.unit else _flag(order, field.key)


def _value(path: str, new: object) -> float | int | str:
    """A setting's new value: a short word or a finite number."""
    if isinstance(new, str) and len(new) <= _LONGEST:
        return new
    if not finite(new):
        raise Refusal(f"{path:.60}: {new!r:.40} is not a value", "a finite number or a word")
    return new


def gains(order: dict[str, Any], control: Control) -> m.Request:
    """New gains; refused where a value has changed since the viewer saw it."""
    pars = {e.path: e.par for e in entries(control)}
    now = {e.path: e.par.given(e.value) for e in entries(control)}
    pairs: list[tuple[str, float | int | str]] = []
    changes = order.get("changes")
    for change in changes if isinstance(changes, list) and changes else (None,):
        if not isinstance(change, list) or len(change) != 3 or not isinstance(change[0], str):
            raise Refusal("these are not changes", "give [path, old value, new value] of each")
        path, old, new = change
        if path in now and now[path] != old:
            raise Refusal(f"{path} is {now[path]!r} by now, not {old!r:.40}", "look again")
        value = _value(path, new)
        pairs.append((path, pars[path].taken(value) if path in pars else value))
    return m.SetGains(tuple(pairs))
