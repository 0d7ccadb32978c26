"""What a run records each control period: one type, from which the recording's columns follow."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple, get_type_hints

from macromicro.recording_format import Column


class Quantity(NamedTuple):
    """Annotation of a field that is recorded: its unit ("1" if none), meaning and numpy dtype."""

    unit: str
    meaning: str
    dtype: str = "f8"


def columns(row: Any) -> tuple[Column, ...]:
    """The columns of a ``NamedTuple`` whose fields are annotated with `Quantity`, in order."""
    hints = get_type_hints(row, include_extras=True)
    found = []
    for name in row._fields:
        notes = [n for n in getattr(hints[name], "__metadata__", ()) if isinstance(n, Quantity)]
        found.append(Column(name, *notes[0]))
    return tuple(found)


class Row(NamedTuple):
    """One control period of a run, as it is recorded; `loop.noted` fills it."""

    t: Annotated[float, Quantity("s", "time since the start")]
    macro_reference: Annotated[float, Quantity("count", "set point of the macro-stage")]
    macro_position: Annotated[float, Quantity("count", "encoder reading")]
    motor: Annotated[float, Quantity("V", "motor output at the D/A")]
    macro_integral: Annotated[float, Quantity("V", "integral effort of the macro controller")]
    micro_reference: Annotated[float, Quantity("mm", "set point of the micro-stage")]
    hall_voltage: Annotated[float, Quantity("V", "Hall sensor at the A/D")]
    hall_position: Annotated[float, Quantity("mm", "contraction by the Hall calibration")]
    ctrl: Annotated[float, Quantity("V", "CTRL output at the D/A")]
    micro_integral: Annotated[float, Quantity("V", "integral effort of the micro controller")]
    laser: Annotated[float, Quantity("um", "stage position by the laser since its last reset")]
    temperature_estimate: Annotated[
        float, Quantity("degC", "wire temperature estimated from CTRL by the guard")
    ]
    phase: Annotated[
        float, Quantity("1", "0 waiting 1 macro 2 settling 3 micro 4 done 5 fault", "i1")
    ]
    move: Annotated[float, Quantity("1", "index of the present move, -1 before the first", "i4")]
    extend: Annotated[float, Quantity("1", "EXTEND signal of the actuator", "i1")]
    contract: Annotated[float, Quantity("1", "CONTRACT signal of the actuator", "i1")]
    fan: Annotated[float, Quantity("1", "fan output", "i1")]
    laser_reset: Annotated[float, Quantity("1", "laser reset output", "i1")]
    true_carriage: Annotated[float, Quantity("mm", "bench truth: carriage position")]
    true_speed: Annotated[float, Quantity("mm/s", "bench truth: carriage speed")]
    true_belt: Annotated[
        float, Quantity("um", "bench truth: belt oscillation as seen at the stage")
    ]
    true_micro: Annotated[float, Quantity("mm", "bench truth: contraction")]
    true_current: Annotated[float, Quantity("A", "bench truth: motor current")]
    true_wire: Annotated[float, Quantity("degC", "bench truth: wire temperature")]
    true_plates: Annotated[float, Quantity("degC", "bench truth: plate temperature")]
    true_body: Annotated[float, Quantity("degC", "bench truth: body temperature")]
    true_austenite: Annotated[float, Quantity("1", "bench truth: austenite fraction")]
    true_heat: Annotated[float, Quantity("W", "bench truth: heat into the wires")]


COLUMNS = columns(Row)


def named(*names: str) -> tuple[Column, ...]:
    """Those of `COLUMNS` with these names, in this order. Raises KeyError for another name."""
    known = {column.name: column for column in COLUMNS}
    return tuple(known[name] for name in names)
