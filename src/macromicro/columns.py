"""The columns of a run's recording, in the order in which the loop writes them."""

from __future__ import annotations

from macromicro.recording import Column

COLUMNS = (
    Column("t", "s", "time since the start"),
    Column("macro_reference", "count", "set point of the macro-stage"),
    Column("macro_position", "count", "encoder reading"),
    Column("motor", "V", "motor output at the D/A"),
    Column("macro_integral", "V", "integral effort of the macro controller"),
    Column("micro_reference", "mm", "set point of the micro-stage"),
    Column("hall_voltage", "V", "Hall sensor at the A/D"),
    Column("hall_position", "mm", "contraction by the Hall calibration"),
    Column("ctrl", "V", "CTRL output at the D/A"),
    Column("micro_integral", "V", "integral effort of the micro controller"),
    Column("laser", "um", "stage position by the laser since its last reset"),
    Column("temperature_estimate", "degC", "wire temperature estimated from CTRL by the guard"),
    Column("phase", "1", "0 waiting 1 macro 2 settling 3 micro 4 done 5 fault", "i1"),
    Column("move", "1", "index of the present move, -1 before the first", "i4"),
    Column("extend", "1", "EXTEND signal of the actuator", "i1"),
    Column("contract", "1", "CONTRACT signal of the actuator", "i1"),
    Column("fan", "1", "fan output", "i1"),
    Column("laser_reset", "1", "laser reset output", "i1"),
    Column("true_carriage", "mm", "bench truth: carriage position"),
    Column("true_speed", "mm/s", "bench truth: carriage speed"),
    Column("true_belt", "um", "bench truth: belt oscillation as seen at the stage"),
    Column("true_micro", "mm", "bench truth: contraction"),
    Column("true_current", "A", "bench truth: motor current"),
    Column("true_wire", "degC", "bench truth: wire temperature"),
    Column("true_plates", "degC", "bench truth: plate temperature"),
    Column("true_body", "degC", "bench truth: body temperature"),
    Column("true_austenite", "1", "bench truth: austenite fraction"),
    Column("true_heat", "W", "bench truth: heat into the wires"),
)
