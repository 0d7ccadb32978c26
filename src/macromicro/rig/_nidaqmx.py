"""Cards of National Instruments through NI-DAQmx and its Python package `nidaqmx`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from macromicro.errors import InputError
from macromicro.extras import remedy
from macromicro.rig.cards._rig import CardError
from macromicro.rig.cards._wiring import ANALOG, COUNTER, DIGITAL, Terminal
from macromicro.schema.keys import show_value
from macromicro.schema.text import printable
from macromicro.units import quantity

KEYS = {ANALOG: ("line", "range", "reference"), DIGITAL: ("line",), COUNTER: ("line",)}
_BITS = 32  # of a counter
_WIDEST = "10 V"
_REFERENCES = {"default": "DEFAULT", "ground": "RSE", "common": "NRSE", "differential": "DIFF"}


class Card:
    """A `Port` of NI-DAQmx: one task for each kind of signal and direction."""

    def __init__(self) -> None:
        self._device = ""
        self._tasks: list[Any] = []
        self._inputs: Sequence[Terminal] = ()
        self._outputs: Sequence[Terminal] = ()
        self._read: dict[str, Any] = {}
        self._write: dict[str, Any] = {}
        self._spans: dict[str, float] = {}

    def open(self, device: str) -> None:
        """Check package, driver and device."""
        try:
            from nidaqmx.errors import Error
            from nidaqmx.system import System
        except ModuleNotFoundError as error:
            raise CardError(f"no package nidaqmx ({error}): {remedy('nidaqmx')}") from None
        try:
            known = System.local().devices.device_names
        except Error as error:
            raise CardError(f"NI-DAQmx: {error}") from error
        if device not in known:
            there = ", ".join(known) or "none"
            raise CardError(f"NI-DAQmx knows no device {printable(device)}; it knows: {there}")
        self._device = device

    def connect(self, inputs: Sequence[Terminal], outputs: Sequence[Terminal]) -> None:
        self._inputs, self._outputs = inputs, outputs
        self._spans = {t.name: _span(t) for t in (*inputs, *outputs) if t.signal == ANALOG}
        for terminals, into in ((inputs, True), (outputs, False)):
            for signal in (ANALOG, DIGITAL):
                of = [t for t in terminals if t.signal == signal]
                if of:
                    self._several(of, signal, into)
        for terminal in inputs:
            if terminal.signal == COUNTER:
                self._counter(terminal)

    def counts(self, terminal: Terminal) -> int:
        return 1 << _BITS

    def read(self) -> list[float]:
        from nidaqmx.errors import Error

        given: dict[str, list[float]] = {}
        try:
            for signal in (ANALOG, DIGITAL):
                if signal in self._read:
                    reader, into = self._read[signal]
                    reader(into)
                    given[signal] = list(map(float, into))
            values = []
            for terminal in self._inputs:
                if terminal.signal == COUNTER:
                    values.append(float(self._read[terminal.name]()))
                else:
                    value = given[terminal.signal].pop(0)
                    beyond = abs(value) >= self._spans.get(terminal.name, math.inf)
                    values.append(math.nan if beyond else value)
        except Error as error:
            raise CardError(f"NI-DAQmx, reading: {error}") from error
        return values

    def write(self, values: Sequence[float]) -> None:
        from nidaqmx.errors import Error

        refused: CardError | None = None
        for signal in self._write:
            of = [(t, v) for t, v in zip(self._outputs, values, strict=True) if t.signal == signal]
            try:
                if signal == ANALOG:
                    spans = np.array([self._spans[t.name] for t, _ in of])
                    self._write[signal](np.clip([v for _, v in of], -spans, spans))
                else:
                    self._write[signal](np.array([v >= 0.5 for _, v in of]))
            except Error as error:
                refused = refused or CardError(f"NI-DAQmx, {signal} outputs: {error}")
        if refused:
            raise refused

    def close(self) -> None:
        for task in self._tasks:
            task.close()
        self._tasks, self._read, self._write = [], {}, {}

    def _several(self, terminals: list[Terminal], signal: str, into: bool) -> None:
        import nidaqmx.stream_readers as readers
        import nidaqmx.stream_writers as writers

        task = self._task(terminals[0])
        for terminal in terminals:
            self._asked(terminal, _add_channel, task, terminal, self._physical(terminal), into)
        size = len(terminals)
        analog = signal == ANALOG
        self._asked(terminals[0], task.start)
        if into and analog:
            made = readers.AnalogMultiChannelReader(task.in_stream).read_one_sample
            self._read[signal] = made, np.empty(size)
        elif into:
            lines = readers.DigitalMultiChannelReader(task.in_stream).read_one_sample_one_line
            self._read[signal] = lines, np.empty(size, bool)
        elif analog:
            self._write[signal] = writers.AnalogMultiChannelWriter(
                task.out_stream, auto_start=False
            ).write_one_sample
        else:
            self._write[signal] = writers.DigitalMultiChannelWriter(
                task.out_stream, auto_start=False
            ).write_one_sample_one_line

    def _counter(self, terminal: Terminal) -> None:
        """A task that counts all four edges of a period."""
        from nidaqmx.constants import AngleUnits, EncoderType
        from nidaqmx.stream_readers import CounterReader

        task = self._task(terminal)
        self._asked(
            terminal,
            task.ci_channels.add_ci_ang_encoder_chan,
            self._physical(terminal),
            decoding_type=EncoderType.X_4,
            zidx_enable=False,
            units=AngleUnits.TICKS,
        )
        self._asked(terminal, task.start)
        self._read[terminal.name] = CounterReader(task.in_stream).read_one_sample_uint32

    def _task(self, terminal: Terminal) -> Any:
        import nidaqmx

        task = self._asked(terminal, nidaqmx.Task)
        self._tasks.append(task)
        return task

    def _asked(self, terminal: Terminal, call: Any, *values: Any, **named: Any) -> Any:
        """The driver's answer, or its error with the terminal's name."""
        from nidaqmx.errors import Error

        try:
            return call(*values, **named)
        except Error as error:
            raise CardError(f"{terminal.where}: {error}") from error

    def _physical(self, terminal: Terminal) -> str:
        line = terminal.at.get("line")
        if not isinstance(line, str) or not line:
            accepted = "the line's name in quotes, such as 'ai0', 'ao0', 'port0/line0' or 'ctr0'"
            raise InputError(f"{terminal.where}.line", show_value(line), accepted)
        return f"{self._device}/{line}"


def _add_channel(task: Any, terminal: Terminal, physical: str, into: bool) -> None:
    from nidaqmx.constants import LineGrouping, TerminalConfiguration

    if terminal.signal == DIGITAL:
        channels = task.di_channels if into else task.do_channels
        add = channels.add_di_chan if into else channels.add_do_chan
        add(physical, line_grouping=LineGrouping.CHAN_PER_LINE)
        return
    span = _span(terminal)
    reference = terminal.at.get("reference", "default")
    if reference not in _REFERENCES:
        accepted = f"one of {', '.join(_REFERENCES)}"
        raise InputError(f"{terminal.where}.reference", printable(reference), accepted)
    if not into:
        task.ao_channels.add_ao_voltage_chan(physical, min_val=-span, max_val=span)
        return
    task.ai_channels.add_ai_voltage_chan(
        physical,
        terminal_config=TerminalConfiguration[_REFERENCES[reference]],
        min_val=-span,
        max_val=span,
    )


def _span(terminal: Terminal) -> float:
    """Voltage range of an analog terminal, both signs."""
    raw, where = terminal.at.get("range", _WIDEST), f"{terminal.where}.range"
    if not isinstance(raw, str):
        raise InputError(where, printable(raw), "the largest voltage both ways, such as '10 V'")
    span = quantity(raw, "V", where)
    if span <= 0.0:
        raise InputError(where, raw, "a voltage above 0 V")
    return span
