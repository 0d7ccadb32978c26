"""A twin as a device of Bluesky, without EPICS: Bluesky and ophyd unmodified."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from macromicro.errors import InputError

bluesky = pytest.importorskip("bluesky")
ophyd = pytest.importorskip("ophyd")

EXAMPLES = Path(__file__).parents[1] / "examples" / "machines"


@pytest.fixture(scope="module")
def made() -> Iterator[tuple[Any, Any]]:
    """The device, and the machine's state as it was made."""
    from macromicro.ophyd import Positioner

    device = Positioner(config=str(EXAMPLES / "screw.toml"), name="stage")
    yield device, device.machine.state
    device.close()


@pytest.fixture(scope="module")
def stage(made: tuple[Any, Any]) -> Any:
    device, _ = made
    device.ready()
    # At full speed a move ends within 0.2 s: before a busy computer has stopped or replaced it.
    device.machine.set_speed("macro", "20 mm/s")
    return device


def begun(stage: Any) -> None:
    """Once it moves."""
    end = time.monotonic() + 20.0
    while not stage.moving:
        assert time.monotonic() < end, stage.machine.state
        time.sleep(0.01)


def test_making_one_moves_nothing_and_ready_may_be_called_again(made: tuple[Any, Any]) -> None:
    device, first = made
    assert (first.mode, first.trusted, first.motion) == ("disabled", False, 0)
    assert device.stage() == [device]
    ready = device.machine.state
    assert ready.trusted and ready.mode == "ready"
    number = device.machine.move_to(0.001).number
    device.ready()
    assert device.machine.move_to(0.002).number == number + 1  # it has not homed again
    assert device.unstage() == [device] and device.machine.state.mode == "ready"


def test_a_stage_that_the_machine_has_not_is_refused(made: tuple[Any, Any]) -> None:
    from macromicro.ophyd import Positioner

    with pytest.raises(InputError, match="axis: 'x'; accepted: none"):
        Positioner(machine=made[0].machine, axis="x")
    assert made[0].machine.state.running  # a shared client stays connected


def test_it_is_enabled_and_homed_and_moves(stage: Any) -> None:
    assert stage.machine.state.trusted and stage.egu == "mm"
    status = stage.set(12.5)
    assert not status.done
    status.wait(60.0)
    assert status.success and stage.position == pytest.approx(12.5, abs=0.01)
    found = stage.read()
    assert found["stage"]["value"] == pytest.approx(12.5, abs=0.01)
    assert set(found) == set(stage.describe())
    assert set(stage.read_configuration()) == set(stage.describe_configuration())
    assert stage.describe()["stage"]["units"] == "mm"


def test_a_place_is_mm_or_a_text_with_a_unit(stage: Any) -> None:
    """As of the other client, whose numbers are m."""
    stage.set("13 mm").wait(60.0)
    assert stage.position == pytest.approx(13.0, abs=0.01)
    stage.set("0.0135 m").wait(60.0)
    assert stage.position == pytest.approx(13.5, abs=0.01)
    with pytest.raises(InputError, match=r"stage: '13'; accepted: .*mm"):
        stage.set("13")
    with pytest.raises(ophyd.utils.LimitError, match="is not within"):
        stage.set("13 m")


def test_what_is_beyond_is_refused_before(stage: Any) -> None:
    low, high = stage.limits
    for place in (low - 1.0, high + 1.0):
        with pytest.raises(ophyd.utils.LimitError, match="is not within"):
            stage.set(place)


def test_a_stopped_move_has_failed(stage: Any) -> None:
    away = 70.0 if stage.position < 40.0 else 5.0
    status = stage.set(away)
    begun(stage)
    stage.stop()
    with pytest.raises(Exception, match="ended as stopped") as failure:
        status.wait(20.0)
    assert failure.value.outcome == "stopped" and not status.success
    assert abs(stage.position - away) > 0.1


def test_a_stop_leaves_nothing_to_begin(stage: Any) -> None:
    """Also where the move has only been asked for."""
    before = stage.position
    status = stage.set(60.0 if before < 30.0 else 10.0)
    stage.stop()
    with pytest.raises(Exception, match="ended as stopped"):
        status.wait(20.0)
    assert not stage.moving or stage.machine.state.mode != "moving-macro"


def test_a_refused_move_has_failed_with_its_reason(stage: Any) -> None:
    stage.machine.disable()
    with pytest.raises(Exception, match="disabled; enable it first"):
        stage.set(10.0).wait(20.0)
    stage.machine.enable()  # at once: a move that was refused has nothing to stop
    stage.set(10.0).wait(60.0)


def test_a_later_move_replaces_the_one_under_way(stage: Any) -> None:
    first = stage.set(60.0)
    begun(stage)
    second = stage.set(20.0)
    second.wait(60.0)
    with pytest.raises(Exception, match="superseded"):
        first.wait(20.0)
    assert stage.position == pytest.approx(20.0, abs=0.01)


def test_bluesky_scans_it(stage: Any) -> None:
    from bluesky.plans import scan
    from ophyd.sim import det

    engine = bluesky.RunEngine({})
    places: list[float] = []
    engine.subscribe(lambda _, document: places.append(document["data"]["stage"]), "event")
    engine(scan([det], stage, 10.0, 12.0, 3))
    assert places == pytest.approx([10.0, 11.0, 12.0], abs=0.01)


@pytest.mark.slow
def test_two_axes_share_a_machine() -> None:
    from bluesky.plans import grid_scan
    from ophyd.sim import det

    from macromicro.ophyd import Positioner

    x = Positioner(config=str(EXAMPLES / "xy-plotter.toml"), name="x", axis="x")
    try:
        y = Positioner(machine=x.machine, name="y", axis="y")
        engine = bluesky.RunEngine({})
        rows: list[Any] = []
        engine.subscribe(lambda _, document: rows.append(document["data"]), "event")
        engine(grid_scan([det], x, 20.0, 22.0, 2, y, 30.0, 34.0, 2))
        assert [(row["x"], row["y"]) for row in rows] == [
            pytest.approx((a, b), abs=0.1) for a in (20.0, 22.0) for b in (30.0, 34.0)
        ]
        # Set together they are one motion of the machine.
        before = x.machine.move_axis("x", 0.021).number
        for status in (x.set(40.0), y.set(50.0)):
            status.wait(60.0)
        assert (x.position, y.position) == pytest.approx((40.0, 50.0), abs=0.1)
        assert x.machine.move_axis("x", 0.041).number == before + 2
    finally:
        x.close()
