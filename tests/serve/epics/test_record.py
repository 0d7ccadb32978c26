"""What the records do with a machine in the test's hand."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("caproto")
from caproto import AccessRights, ChannelType, Forbidden

sys.path.insert(0, str(Path(__file__).parents[1]))
from fake_station import FakeStation
from virtual_time import run

from macromicro.control.live import messages as m
from macromicro.serve._instrument import Instrument
from macromicro.serve.epics._channels import WRITER
from macromicro.serve.epics._machine import Channels
from macromicro.serve.epics._record import MoveError
from macromicro.serve.settings import load


async def until(true: Callable[[], Any]) -> None:
    async with asyncio.timeout(20.0):
        while not true():
            await asyncio.sleep(0.005)


LOOK: dict[int, Channels] = {}  # whose channels these are, by their identity


def channels(fake: FakeStation) -> dict[str, Any]:
    served = Channels(Instrument(fake))  # type: ignore[arg-type]
    found = served.named("P")
    LOOK[id(found)] = served
    return found


def value(found: dict[str, Any], name: str) -> Any:
    held = found[f"P:{name}"].value
    return held[0] if isinstance(held, list) else held


async def put(found: dict[str, Any], name: str, given: Any) -> None:
    await found[f"P:{name}"].write(given)


def test_a_record_waits_for_another_one_s_move() -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        first = asyncio.create_task(put(found, "whole", 50.0))
        await until(lambda: fake.motion == 1)
        second = asyncio.create_task(put(found, "micro", 0.5))
        await asyncio.sleep(0.1)
        assert fake.given == 1 and value(found, "micro.DMOV") == 0
        fake.end("done")
        await first
        await until(lambda: fake.motion == 2)
        assert fake.requests[-1] == m.MoveMicro(0.5e-3, "epics", True)
        fake.end("done")
        await second
        assert (value(found, "micro.DMOV"), value(found, "micro.LVIO")) == (1, 0)

    run(main())


@pytest.mark.parametrize("stop", ["whole.STOP", "micro.STOP", "stop", "emergency"])
def test_a_stop_leaves_nothing_that_waits_to_begin(stop: str) -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        first = asyncio.create_task(put(found, "whole", 50.0))
        await until(lambda: fake.motion == 1)
        second = asyncio.create_task(put(found, "micro", 0.5))
        await asyncio.sleep(0.1)
        await put(found, stop, 1)
        await asyncio.gather(first, second)
        assert fake.given == 1 and fake.motion == 0
        for name in ("whole", "micro"):
            assert [value(found, f"{name}.{f}") for f in ("DMOV", "LVIO", "STOP")] == [1, 1, 0]
            assert found[f"P:{name}"].alarm.severity == 2

    run(main())


MACHINES = Path(__file__).parents[3] / "examples" / "machines"


class Several(FakeStation):
    """Of several stages."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.settings: Any = load(MACHINES / f"{name}.toml")
        self.stages = self.settings.stages


def test_some_of_three_stages_that_are_set_together_move_at_once() -> None:
    async def main() -> None:
        fake = Several("xyz")
        found = channels(fake)
        assert value(found, "z.VMAX") < 0.1 * value(found, "x.VMAX")  # each as its stage can
        moves = [asyncio.create_task(put(found, axis, v)) for axis, v in (("z", 0.03), ("x", 20.0))]
        await until(lambda: fake.motion == 1)
        assert fake.requests == [m.MovePoint({"z": pytest.approx(30e-6), "x": 0.02}, "epics")]
        fake.end("done")
        await asyncio.gather(*moves)

    run(main())


def test_axes_that_are_set_together_move_at_once() -> None:
    """On one straight line, and both are done at its end; one that comes later waits."""

    async def main() -> None:
        fake = Several("xy-plotter")
        found = channels(fake)
        moves = [asyncio.create_task(put(found, axis, v)) for axis, v in (("y", 30.0), ("x", 20.0))]
        await until(lambda: fake.motion == 1)
        assert fake.requests == [m.MovePoint({"x": 0.02, "y": 0.03}, "epics")]
        late = asyncio.create_task(put(found, "x", 25.0))
        await asyncio.sleep(0.15)
        assert fake.given == 1 and value(found, "x.DMOV") == value(found, "y.DMOV") == 0
        fake.end("done")
        await moves[0]
        await until(lambda: fake.motion == 2)
        assert fake.requests[-1] == m.MoveAxis("x", 0.025, "epics")
        assert (value(found, "y.DMOV"), value(found, "x.DMOV")) == (1, 0)
        fake.end("done")
        await asyncio.gather(moves[1], late)
        assert [value(found, f"{axis}.LVIO") for axis in m.AXES] == [0, 0]

    run(main())


def test_both_have_failed_where_their_move_has() -> None:
    async def main() -> None:
        fake = Several("xy-plotter")
        found = channels(fake)
        moves = [asyncio.create_task(put(found, axis, 20.0)) for axis in m.AXES]
        await until(lambda: fake.motion)
        fake.end("stalled")
        await asyncio.gather(*moves)
        for axis in m.AXES:
            assert [value(found, f"{axis}.{f}") for f in ("DMOV", "LVIO")] == [1, 1]
            assert found[f"P:{axis}"].alarm.severity == 2

    run(main())


def test_a_stop_ends_what_is_being_gathered_and_nothing_that_follows() -> None:
    async def main() -> None:
        fake = Several("xy-plotter")
        found = channels(fake)
        stopped = asyncio.create_task(put(found, "x", 20.0))
        await until(lambda: value(found, "x.DMOV") == 0)
        await put(found, "stop", 1)
        after = asyncio.create_task(put(found, "y", 30.0))
        await stopped
        assert value(found, "x.LVIO") == 1
        await until(lambda: fake.motion == 1)
        assert fake.requests[-1] == m.MoveAxis("y", 0.03, "epics")
        fake.end("done")
        await after
        assert value(found, "y.LVIO") == 0

    run(main())


def test_the_next_move_clears_what_a_failed_one_left() -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        for outcome, left in (("stalled", 1), ("done", 0)):
            move = asyncio.create_task(put(found, "whole", 50.0))
            await until(lambda: fake.motion)
            assert value(found, "whole.LVIO") == value(found, "whole.DMOV") == 0
            assert found["P:whole"].alarm.severity == 0
            fake.end(outcome)
            await move
            assert value(found, "whole.LVIO") == value(found, "whole.MISS") == left
            assert found["P:whole"].alarm.severity == 2 * left
            assert value(found, "failure") == ("it ended as stalled" if left else "")

    run(main())


def test_a_refused_move_begins_and_ends_as_a_failed_one() -> None:
    async def main() -> None:
        fake = FakeStation()
        fake.acquire("another")
        found = channels(fake)
        await put(found, "whole", 50.0)
        assert (value(found, "whole.DMOV"), value(found, "whole.LVIO")) == (1, 1)
        assert "another holds control" in value(found, "failure") and not fake.requests

    run(main())


# The modes of SPMG, as the motor record's documentation has them.


class Jogged(FakeStation):
    """A jog ends by one of speed 0."""

    def request(self, client: str, request: Any, since: Any = None) -> m.Reply:
        if isinstance(request, m.Jog) and request.speed == 0.0 and self.motion:
            self.requests.append(request)
            self.end("stopped")
            return m.Accepted()
        return super().request(client, request, since)


def targets(fake: FakeStation) -> list[float]:
    return [r.position for r in fake.requests if isinstance(r, m.MoveTo)]


@pytest.mark.parametrize("mode", ["Stop", "Pause"])
@pytest.mark.parametrize("field", [".VAL", ".DVAL", ".RVAL", ".RLV", ".TWF"])
def test_a_value_put_while_stopped_or_paused_waits_for_go(mode: str, field: str) -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        step = value(found, "whole.MRES")
        given = {".RVAL": round(20.0 / step), ".TWF": 1}.get(field, 20.0)
        await put(found, "whole.SPMG", mode)
        await put(found, f"whole{field}", given)
        target = {".RVAL": given * step, ".TWF": value(found, "whole.TWV")}.get(field, 20.0)
        for name in ("VAL", "DVAL"):
            assert value(found, f"whole.{name}") == pytest.approx(target)
        assert value(found, "whole.RVAL") == round(target / step)
        assert targets(fake) == [] and value(found, "whole.DMOV") == 1
        goes = asyncio.create_task(put(found, "whole.SPMG", "Go"))
        await until(lambda: fake.motion == 1)
        assert targets(fake) == [pytest.approx(1e-3 * target)]
        assert value(found, "whole.SPMG") == "Go"
        fake.end("done")
        await goes
        assert value(found, "whole.VAL") == pytest.approx(target)

    run(main())


@pytest.mark.parametrize("mode", ["Stop", "Pause"])
def test_stop_ends_a_move_and_pause_lets_go_resume_it(mode: str) -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        move = asyncio.create_task(put(found, "whole", 50.0))
        await until(lambda: fake.motion == 1)
        looks = asyncio.create_task(looking(found))
        await put(found, "whole.SPMG", mode)
        await move
        assert fake.ended[1].outcome == "stopped" and value(found, "whole.DMOV") == 1
        place = value(found, "whole.RBV")
        assert value(found, "whole") == pytest.approx(place if mode == "Stop" else 50.0)
        goes = asyncio.create_task(put(found, "whole.SPMG", "Go"))
        if mode == "Pause":
            await until(lambda: fake.motion == 2)
            fake.end("done")
        await goes
        looks.cancel()
        assert targets(fake) == [0.05] * (1 if mode == "Stop" else 2)

    run(main())


async def looking(found: dict[str, Any]) -> None:
    """The server's looks at the machine."""
    while True:
        await LOOK[id(found)].look()
        await asyncio.sleep(0.02)


def test_move_is_one_move_and_pauses_again() -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        await put(found, "whole.SPMG", "Pause")
        await put(found, "whole", 20.0)
        moves = asyncio.create_task(put(found, "whole.SPMG", "Move"))
        await until(lambda: fake.motion == 1)
        assert value(found, "whole.SPMG") == "Move"
        fake.end("done")
        await moves
        assert value(found, "whole.SPMG") == "Pause"
        await put(found, "whole", 30.0)
        assert targets(fake) == [0.02]
        moves = asyncio.create_task(put(found, "whole.SPMG", "Move"))
        await until(lambda: fake.motion == 2)
        fake.end("done")
        await moves

    run(main())


@pytest.mark.parametrize("stop", ["whole.STOP", "stop", "emergency"])
def test_what_was_paused_is_forgotten_by_a_stop(stop: str) -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        await put(found, "whole.SPMG", "Pause")
        await put(found, "whole", 20.0)
        await put(found, stop, 1)
        await put(found, "whole.SPMG", "Go")
        assert targets(fake) == []

    run(main())


@pytest.mark.parametrize("mode", ["Stop", "Pause"])
@pytest.mark.parametrize("field", ["HOMF", "HOMR", "JOGF", "JOGR"])
def test_nothing_homes_or_jogs_while_stopped_or_paused(mode: str, field: str) -> None:
    async def main() -> None:
        fake = Jogged()
        found = channels(fake)
        await put(found, "whole.SPMG", mode)
        await put(found, f"whole.{field}", 1)
        await put(found, "whole.SPMG", "Go")
        assert not [r for r in fake.requests if isinstance(r, m.Home | m.Jog)]
        assert value(found, f"whole.{field}") == 0

    run(main())


@pytest.mark.parametrize(("field", "sign"), [("JOGF", 1.0), ("JOGR", -1.0)])
def test_a_jog_goes_on_as_long_as_its_field_is_1(field: str, sign: float) -> None:
    async def main() -> None:
        fake = Jogged()
        found = channels(fake)
        await put(found, "whole.JVEL", 5.0)
        jog = asyncio.create_task(put(found, f"whole.{field}", 1))
        await until(lambda: fake.motion)
        assert fake.requests[-1] == m.Jog("macro", sign * 0.005, client="epics")
        assert (value(found, f"whole.{field}"), value(found, "whole.DMOV")) == (1, 0)
        await put(found, f"whole.{field}", 0)
        await jog
        assert fake.requests[-1] == m.Jog("macro", 0.0, client="epics") and not fake.motion
        for name, wanted in ((field, 0), ("DMOV", 1), ("LVIO", 0)):
            assert value(found, f"whole.{name}") == wanted
        assert value(found, "whole.TDIR") == int(sign > 0.0)

    run(main())


def test_a_jog_that_is_let_go_before_it_has_begun_ends() -> None:
    async def main() -> None:
        fake = Jogged()
        found = channels(fake)
        jog = asyncio.create_task(put(found, "whole.JOGF", 1))
        await asyncio.sleep(0.0)
        await put(found, "whole.JOGF", 0)
        await jog
        assert not fake.motion

    run(main())


@pytest.mark.parametrize("field", ["RBV", "DRBV", "DMOV", "MOVN", "MSTA", "HLS", "TDIR", "VELO"])
def test_fields_that_only_tell_are_not_written(field: str) -> None:
    found = channels(FakeStation())
    made = found[f"P:whole.{field}"]
    assert made.check_access("host", "user") == AccessRights.READ
    with pytest.raises(Forbidden):  # nor by one that does not look at its rights
        run(made.auth_write("host", "user", [7], ChannelType.LONG, None))


@pytest.mark.parametrize("given", [0.0, -1.0, float("nan")])
@pytest.mark.parametrize("field", ["TWV", "JVEL"])
def test_steps_and_speeds_are_above_0(field: str, given: float) -> None:
    found = channels(FakeStation())
    with pytest.raises(MoveError, match="above 0"):
        run(put(found, f"whole.{field}", given))


def test_msta_says_what_the_machine_does() -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        await LOOK[id(found)].look()
        done, moving, homed = 1 << 1, 1 << 10, 1 << 14
        status = value(found, "whole.MSTA")
        assert status & done and not status & moving and status & homed
        fake.motion, fake.trusted = 7, False
        await LOOK[id(found)].look()
        status = value(found, "whole.MSTA")
        assert not status & done and status & moving and not status & homed

    run(main())


# Circuits that close.

ONE, OTHER = ("192.0.2.1", 5000), ("192.0.2.2", 5000)


async def by(circuit: tuple[str, int], found: dict[str, Any], name: str, given: Any) -> None:
    WRITER.set(circuit)
    await put(found, name, given)


def test_a_client_that_is_gone_loses_control_and_its_motion() -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        served = LOOK[id(found)]
        move = asyncio.create_task(by(ONE, found, "whole", 50.0))
        await until(lambda: fake.motion == 1)
        await served.left(OTHER)  # it has only looked
        assert fake.holder == "epics" and fake.motion
        await served.left(ONE)
        await move
        assert fake.holder == "" and fake.ended[1].outcome == "lost"
        assert "epics" in fake.connected  # and may order again
        await asyncio.create_task(by(OTHER, found, "disable", 1))
        assert fake.holder == "epics"

    run(main())


def test_whose_motion_it_is_not_takes_nothing_from_others_by_going() -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        served = LOOK[id(found)]
        await asyncio.create_task(by(OTHER, found, "clear", 1))
        move = asyncio.create_task(by(ONE, found, "whole", 50.0))
        await until(lambda: fake.motion == 1)
        await served.left(OTHER)
        assert fake.holder == "epics" and fake.motion == 1
        fake.end("done")
        await move
        await served.left(ONE)  # the last one that ordered anything
        assert fake.holder == ""

    run(main())


def test_the_motion_of_one_that_is_gone_ends_though_another_one_is_there() -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        await asyncio.create_task(by(OTHER, found, "clear", 1))
        move = asyncio.create_task(by(ONE, found, "whole", 50.0))
        await until(lambda: fake.motion == 1)
        await LOOK[id(found)].left(ONE)
        await move
        assert fake.ended[1].outcome == "lost"

    run(main())
