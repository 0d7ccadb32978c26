"""What `--rig board` takes."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro.control.live.messages import Refused, SetGains
from macromicro.control.pd import PdTuned
from macromicro.control.settings import Control
from macromicro.errors import InputError
from macromicro.machines import on_rig
from macromicro.machines.machine import named as machine_of
from macromicro.rig.board import control, named, protocol
from macromicro.rig.board._link import BoardError
from macromicro.rig.board.rig import TICK, BoardRig
from macromicro.rig.limits import Limits
from macromicro.rig.opening import open_rig
from macromicro.serve._launching import LIVE, Spec
from macromicro.serve.loop_process import open_machine
from macromicro.serve.settings import LiveSettings
from macromicro.types import Command, Outputs


def test_options_and_name_are_the_same_board() -> None:
    name = named.board_name("board", "/dev/ttyUSB0", "host", Path("hall.csv"))
    assert name == "board:/dev/ttyUSB0,loop=host,calibration=hall.csv"
    assert named.parse(name) == named.Boarded("/dev/ttyUSB0", "host", Path("hall.csv"))
    assert named.board_name("board", "/dev/ttyUSB0", None, None) == "board:/dev/ttyUSB0"


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (("board", None, None, None), "--port: .*serial port is missing"),
        (("twin", "/dev/ttyUSB0", None, None), "needs --rig board"),
        (("twin", None, "host", None), "needs --rig board"),
        (("board", "/dev/ttyUSB0", "both", None), "--loop: 'both'.*board or host"),
    ],
)
def test_what_does_not_fit_is_refused(given: tuple[str, None, None, None], told: str) -> None:
    with pytest.raises(InputError, match=told):
        named.board_name(*given)


@pytest.mark.parametrize("name", ["board:", "board", "board:/dev/x,speed=9", "board:/dev/x,loop"])
def test_names_that_are_none(name: str) -> None:
    with pytest.raises(InputError):
        open_rig(name)


def test_without_a_calibration_there_is_a_macro_stage_alone() -> None:
    fixture = open_rig("board:/dev/none")
    assert fixture.channels == ("encoder", "limit_low", "limit_high")
    assert fixture.table is None


@pytest.mark.parametrize(
    ("more", "shown"),
    [(",stages=both", ("encoder", "hall")), (",stages=macro", ("encoder", "limit_low"))],
)
def test_a_name_says_which_stages_there_are(more: str, shown: tuple[str, ...]) -> None:
    name = f"board:/dev/none{more}"
    assert str(named.parse(name)) == name
    fixture = open_rig(name)
    assert fixture.channels[:2] == shown and fixture.channels[-1] == "limit_high"
    assert fixture.table is None


def test_stages_that_there_are_not() -> None:
    with pytest.raises(InputError, match="board:/dev/x, stages: 'micro'; accepted: macro or both"):
        named.parse("board:/dev/x,stages=micro")


def test_a_port_that_is_not_there_says_so() -> None:
    with pytest.raises(BoardError, match="/dev/none"), BoardRig("/dev/none"):
        pass


def test_parameters_have_names_and_the_table_comes_last() -> None:
    flat = control.flat(control.of(Limits(), None))
    names = list(flat)
    assert len(names) <= 255
    assert names[0] == "guard.limits.motor"
    assert names[-protocol.TABLE :] == [
        f"guard.calibration.position[{k}]" for k in range(protocol.TABLE)
    ]


def _order(**given: float) -> control.Order:
    quiet = control.Order(False, 0.0, 0.0, False, False, 0.0, 0.0, 0.0, False, False, False)
    return quiet._replace(**given)


def test_silence_lets_the_effort_fall_to_zero_and_latches() -> None:
    params, state, motors = control.of(Limits(), None), control.REST, []
    for k in range(720):
        order = _order(motor=4.0, ctrl=1.0, quiet=1e-3 * k)
        state, motor, ctrl = control.drive(params, state, 0.0, 0.0, order, 1e-3)
        assert ctrl == (1.0 if k <= 500 else 0.0)
        motors.append(motor)
    assert motors[:500] == [4.0] * 500
    assert motors[600] == pytest.approx(2.0, abs=0.05)
    assert motors[-1] == 0.0
    assert state.fault == protocol.SPEC["faults"]["host_silent"]
    _, motor, _ = control.drive(params, state, 0.0, 0.0, _order(motor=4.0), 1e-3)
    assert motor == 0.0


def test_the_boards_law_pushes_towards_its_set_point() -> None:
    params = control.of(Limits(), None)
    order = _order(holds=True, macro_reference=100.0, macro_active=True)
    for encoder, sign in ((0.0, 1.0), (200.0, -1.0), (100.0, 0.0)):
        _, motor, ctrl = control.drive(params, control.REST, encoder, 0.0, order, 1e-3)
        assert (motor > 0.0) - (motor < 0.0) == sign
        assert ctrl == 0.0


class Heard:
    """A link that keeps the names of what is told."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def tell(self, name: str, **_: float) -> None:
        self.names.append(name)


@pytest.mark.parametrize(("loop", "name"), [("board", "targets"), ("host", "outputs")])
def test_set_points_go_to_the_board_only_in_its_own_loop(loop: str, name: str) -> None:
    heard, rig = Heard(), BoardRig("none", loop)
    rig.link, rig._driving = heard, True
    rig.aim(Command(100.0, 1.0, 0.0, 0.0, 0.0))
    rig.write(Outputs(1.0, 0.0, 0.0, 0.0))
    rig.write(Outputs(1.0, 0.0, 0.0, 0.0))
    assert heard.names == [name, "outputs"]


@pytest.mark.parametrize(("more", "refused"), [("", True), (",loop=host", False)])
def test_gains_that_the_board_would_not_use_are_refused(more: str, refused: bool) -> None:
    spec = Spec(f"board:/dev/none{more}", 0, LiveSettings(), "nothing kept", LIVE, 0)
    machine = open_machine(spec).machine
    request = SetGains((("pd_tuned.now", Control().pd_tuned.now),))
    reply, _ = machine.accept(request)
    assert isinstance(reply, Refused) == refused, reply
    if refused:
        assert isinstance(reply, Refused)
        assert "own gains" in reply.reason and "--loop host" in reply.remedy
        assert machine.refusal(request) == reply


def test_a_machine_of_one_stage_takes_a_board_whose_loop_is_not_named() -> None:
    tree = machine_of("axis", "test").settings
    at_board_period = tree._replace(timing=tree.timing._replace(period=TICK))
    with pytest.raises(InputError, match=r"guard\.effort: '10 V'; accepted: at most 5 V"):
        on_rig.one("board:/dev/none", at_board_period, 0)
    within = at_board_period._replace(guard=tree.guard._replace(effort=5.0))
    rig = on_rig.one("board:/dev/none", within, 0).make(0)
    assert rig.yielding  # a limit switch ends its way
    assert rig._params.guard.limits.motor == 5.0
    thesis = open_rig("board:/dev/none").make(0)
    assert not thesis.yielding
    assert thesis._params.guard.limits == control.of(Limits(), None).guard.limits


def test_a_board_is_given_the_gains_and_limits_of_the_settings() -> None:
    gains = Control()._replace(pd_tuned=PdTuned(0.02, -0.018), dead_zone=2.5)
    limits = Limits()._replace(motor=4.0)
    rig = open_rig("board:/dev/none", limits=limits, gains=gains).make(0)
    sent = control.flat(rig._params)
    assert (sent["macro.now"], sent["macro.before"]) == (0.02, -0.018)
    assert (sent["width"], sent["guard.limits.motor"]) == (2.5, 4.0)


@pytest.mark.parametrize(
    ("more", "key", "law"),
    [("", "macro_law", "pid"), (",stages=both", "micro_law", "inverse")],
)
def test_a_law_that_the_board_does_not_have_is_refused_in_its_loop(
    more: str, key: str, law: str
) -> None:
    gains = Control()._replace(**{key: law})
    with pytest.raises(InputError, match=rf"controller\.{key}: '{law}'.*board runs.*--loop host"):
        open_rig(f"board:/dev/none{more}", gains=gains)
    open_rig(f"board:/dev/none,loop=host{more}", gains=gains)


def test_the_law_of_a_stage_that_is_not_there_does_not_matter() -> None:
    open_rig("board:/dev/none,stages=macro", gains=Control()._replace(micro_law="inverse"))
