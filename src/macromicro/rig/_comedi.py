"""Cards with a comedi driver, such as the thesis' MultiQ-3, through libcomedi."""

from __future__ import annotations

import ctypes
import ctypes.util
from collections.abc import Sequence
from typing import Any, NamedTuple

from macromicro.errors import InputError, ProblemError
from macromicro.rig.cards._rig import CardError
from macromicro.rig.cards._wiring import ANALOG, COUNTER, DIGITAL, Terminal
from macromicro.schema import keys

_PLACE = ("subdevice", "channel")
KEYS = {ANALOG: (*_PLACE, "range", "reference"), DIGITAL: _PLACE, COUNTER: _PLACE}

# enum comedi_subdevice_type, enum comedi_io_direction and AREF_* of comedi.h.
_AI, _AO, _DI, _DO, _DIO, _COUNTER = 1, 2, 3, 4, 5, 6
_NAMES = {_AI: "analog inputs", _AO: "analog outputs", _DI: "digital inputs"}
_NAMES |= {_DO: "digital outputs", _DIO: "digital lines", _COUNTER: "counters"}
_SUITS = {
    (ANALOG, True): (_AI,),
    (ANALOG, False): (_AO,),
    (DIGITAL, True): (_DI, _DIO),
    (DIGITAL, False): (_DO, _DIO),
    (COUNTER, True): (_COUNTER,),
}
_REFERENCES = {"ground": 0, "common": 1, "differential": 2, "other": 3}


class _Range(ctypes.Structure):
    """comedi_range."""

    _fields_ = (("min", ctypes.c_double), ("max", ctypes.c_double), ("unit", ctypes.c_uint))


_DEVICE, _UINT, _INT = ctypes.c_void_p, ctypes.c_uint, ctypes.c_int
_OF = (_DEVICE, _UINT, _UINT)  # device, subdevice, channel
_CALLS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "comedi_open": (_DEVICE, (ctypes.c_char_p,)),
    "comedi_close": (_INT, (_DEVICE,)),
    "comedi_errno": (_INT, ()),
    "comedi_strerror": (ctypes.c_char_p, (_INT,)),
    "comedi_get_n_subdevices": (_INT, (_DEVICE,)),
    "comedi_get_subdevice_type": (_INT, (_DEVICE, _UINT)),
    "comedi_get_n_channels": (_INT, (_DEVICE, _UINT)),
    "comedi_get_n_ranges": (_INT, _OF),
    "comedi_get_maxdata": (_UINT, _OF),
    "comedi_get_range": (ctypes.POINTER(_Range), (*_OF, _UINT)),
    "comedi_data_read": (_INT, (*_OF, _UINT, _UINT, ctypes.POINTER(_UINT))),
    "comedi_data_write": (_INT, (*_OF, _UINT, _UINT, _UINT)),
    "comedi_dio_config": (_INT, (*_OF, _UINT)),
    "comedi_dio_read": (_INT, (*_OF, ctypes.POINTER(_UINT))),
    "comedi_dio_write": (_INT, (*_OF, _UINT)),
    "comedi_to_phys": (ctypes.c_double, (_UINT, ctypes.POINTER(_Range), _UINT)),
    "comedi_from_phys": (_UINT, (ctypes.c_double, ctypes.POINTER(_Range), _UINT)),
}


class _Wired(NamedTuple):
    """A configured terminal."""

    terminal: Terminal
    subdevice: int
    channel: int
    range: int
    reference: int
    span: Any
    largest: int


def library() -> Any:
    """Libcomedi with typed calls."""
    name = ctypes.util.find_library("comedi")
    if name is None:
        raise CardError("libcomedi was not found: install it (Debian: apt-get install libcomedi0)")
    return set_types(ctypes.CDLL(name))


def set_types(loaded: Any) -> Any:
    """Give a library's calls the types of comedilib.h."""
    for name, (result, arguments) in _CALLS.items():
        call = getattr(loaded, name)
        call.restype, call.argtypes = result, arguments
    return loaded


class Card:
    """A `Port` of libcomedi; one driver call for each value."""

    def __init__(self) -> None:
        self._lib: Any = None
        self._device: Any = None
        self._inputs: list[_Wired] = []
        self._outputs: list[_Wired] = []

    def open(self, device: str) -> None:
        self._lib = library()
        self._device = self._lib.comedi_open(device.encode())
        if not self._device:
            raise CardError(
                f"{device}: {self._why()}; is the driver configured (comedi_config), and may you "
                "open the device?"
            )

    def connect(self, inputs: Sequence[Terminal], outputs: Sequence[Terminal]) -> None:
        """Look every terminal up, and set the direction of digital lines."""
        self._inputs = [self._looked_up(t, True) for t in inputs]
        self._outputs = [self._looked_up(t, False) for t in outputs]

    def counts(self, terminal: Terminal) -> int:
        return next(w.largest for w in self._inputs if w.terminal is terminal) + 1

    def read(self) -> list[float]:
        return [self._read(wired) for wired in self._inputs]

    def write(self, values: Sequence[float]) -> None:
        refused: CardError | None = None
        for wired, value in zip(self._outputs, values, strict=False):
            try:
                self._write(wired, value)
            except CardError as error:
                refused = refused or error
        if refused:
            raise refused

    def close(self) -> None:
        if self._device:
            self._lib.comedi_close(self._device)
        self._device, self._inputs, self._outputs = None, [], []

    def _read(self, wired: _Wired) -> float:
        data, at = _UINT(), (self._device, wired.subdevice, wired.channel)
        if wired.terminal.signal == DIGITAL:
            done = self._lib.comedi_dio_read(*at, ctypes.byref(data))
        else:
            ways = (wired.range, wired.reference)
            done = self._lib.comedi_data_read(*at, *ways, ctypes.byref(data))
        if done < 0:
            raise CardError(f"{wired.terminal.where}: {self._why()}")
        if wired.terminal.signal == ANALOG:
            return float(self._lib.comedi_to_phys(data.value, wired.span, wired.largest))
        return float(data.value)

    def _write(self, wired: _Wired, value: float) -> None:
        at = (self._device, wired.subdevice, wired.channel)
        if wired.terminal.signal == DIGITAL:
            done = self._lib.comedi_dio_write(*at, int(value >= 0.5))
        else:
            data = self._lib.comedi_from_phys(value, wired.span, wired.largest)
            done = self._lib.comedi_data_write(*at, wired.range, wired.reference, data)
        if done < 0:
            raise CardError(f"{wired.terminal.where}: {self._why()}")

    def _looked_up(self, terminal: Terminal, into: bool) -> _Wired:
        lib, device, at, where = self._lib, self._device, terminal.at, terminal.where
        last = lib.comedi_get_n_subdevices(device) - 1
        subdevice = keys.whole(at.get("subdevice"), 0, last, f"{where}.subdevice")
        kind, suits = (
            lib.comedi_get_subdevice_type(device, subdevice),
            _SUITS[terminal.signal, into],
        )
        if kind not in suits:
            problem = f"{subdevice} has {_NAMES.get(kind, 'nothing of use here')}"
            remedy = f"Choose a subdevice with {' or '.join(_NAMES[k] for k in suits)}."
            raise ProblemError(f"{where}.subdevice", problem, remedy)
        last = lib.comedi_get_n_channels(device, subdevice) - 1
        channel = keys.whole(at.get("channel"), 0, last, f"{where}.channel")
        place, span, range_ = (device, subdevice, channel), None, 0
        if terminal.signal == ANALOG:
            last = lib.comedi_get_n_ranges(*place) - 1
            range_ = keys.whole(at.get("range", 0), 0, last, f"{where}.range")
            span = lib.comedi_get_range(*place, range_)
        reference = at.get("reference", "ground")
        if reference not in _REFERENCES:
            raise InputError(f"{where}.reference", reference, f"one of {', '.join(_REFERENCES)}")
        if kind == _DIO and lib.comedi_dio_config(*place, int(not into)) < 0:
            raise CardError(f"{where}: {self._why()}")
        largest = lib.comedi_get_maxdata(*place)
        aref = _REFERENCES[reference]
        return _Wired(terminal, subdevice, channel, range_, aref, span, largest)

    def _why(self) -> str:
        return str(self._lib.comedi_strerror(self._lib.comedi_errno()).decode(errors="replace"))
