"""Channels of the rig and their way into a recording (Appendix C)."""

from __future__ import annotations

from macromicro.recorded import COLUMNS
from macromicro.settings import Settings
from macromicro.thesis.appendix_c import channels
from macromicro.types import Outputs, Sample


def test_every_channel_is_there_once_and_recorded_once() -> None:
    made = channels.channels(Settings())
    assert [c.name for c in made if c.direction == "in"] == list(Sample._fields[1:])
    assert [c.name for c in made if c.direction == "out"] == list(Outputs._fields)
    assert all(len(c.ways) == 1 for c in made)


def test_ways_have_the_recordings_units() -> None:
    ways = {w.column.name: w for w in channels.ways()}
    assert (ways["laser"].field, round(ways["laser"].factor)) == ("laser", 1_000_000)
    assert (ways["laser"].unit, ways["true_speed"].unit) == ("m", "m/s")
    assert (ways["macro_position"].field, ways["macro_position"].unit) == ("encoder", "count")


def test_no_column_is_forgotten() -> None:
    traced = channels.ways()
    reached = {w.column.name for w in traced}
    rest = {c.name for c in COLUMNS} - reached
    assert reached <= {c.name for c in COLUMNS}
    assert not any(name.startswith("true_") for name in rest)
    assert {"phase", "move", "temperature_estimate"} <= rest


def test_converters_follow_the_settings() -> None:
    settings = Settings()
    sensors = settings.sensors
    finer = settings._replace(
        sensors=sensors._replace(converter=sensors.converter._replace(bits=14.0)),
        guard=settings.guard._replace(ctrl=2.5),
    )
    first, other = ({c.name: c for c in channels.channels(s)} for s in (settings, finer))
    assert (first["hall"].step, other["hall"].step) == ("1.2207 mV", "0.3052 mV")
    assert (first["ctrl"].range, other["ctrl"].range) == ("0 to 5 V", "0 to 2.5 V")
    assert other["motor"] == first["motor"]
