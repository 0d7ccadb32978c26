"""A served machine that turns: degrees wherever another one has millimetres."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from macromicro.control.live import messages as m
from macromicro.control.live import targets
from macromicro.control.live.messages import Refused
from macromicro.control.live.state import begin
from macromicro.machines import guarding
from macromicro.place import ANGLE, LENGTH
from macromicro.serve import faults, settings, shared
from macromicro.serve.requests import KINDS
from macromicro.serve.scpi._parameters import Number
from macromicro.serve.scpi._session import motion_error
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.tree import COMMANDS, tree
from macromicro.serve.stage import guide
from macromicro.serve.web import _orders, _reporting, bins

TEXT = 'machine = "rotary"\n[load]\ninertia = "0.012 kg*m^2"\n'
DEG = math.pi / 180.0


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = tmp_path_factory.mktemp("turning") / "table.toml"
    path.write_text(TEXT, encoding="utf-8")
    return settings.load(path)


def given(text: str) -> Any:
    from macromicro.serve.scpi._message import reading

    steps = reading(tree(ANGLE), text.encode())
    while True:
        try:
            next(steps)
        except StopIteration as end:
            message = end.value
            break
    if message.error is not None:
        raise message.error
    return message.units[0].values[0]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("MOVE:ABS 25 DEG", 25 * DEG),
        ("MOVE 2 TURN", 4.0 * math.pi),
        ("MOVE:REL -600 ARCMIN", -10 * DEG),
        ("MOVE:ABS 1.5 rad", 1.5),
        ("JOG:MACR 10 RPM", math.pi / 3.0),
        ("JOG:MACR 5 deg/s", 5 * DEG),
        ("LIM:ABS 0.5 rad,90 DEG", 0.5),
    ],
)
def test_scpi_takes_angles(text: str, value: float) -> None:
    assert given(text) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("text", ["MOVE:ABS 25 MM", "MOVE:ABS 25", "JOG:MACR 5 MM/S"])
def test_scpi_refuses_lengths_and_bare_numbers(text: str) -> None:
    with pytest.raises(ScpiError, match="DEG") as error:
        given(text)
    assert error.value.number == -131


def test_a_machine_that_slides_takes_no_angles() -> None:
    for command in COMMANDS:
        for each in command.parameters:
            assert not isinstance(each, Number) or "rad" not in each.unit
    assert tree(LENGTH) is not tree(ANGLE)
    answers = {c.header: c.answer for c in COMMANDS}
    assert answers["POSition[:ABSolute]?"].startswith("position mm")


def test_its_settings_lead_it_in_radians(found: Any) -> None:
    assert found.live.place is ANGLE
    assert found.live.limits.whole_high == pytest.approx(269.4 * DEG)
    parameters = guide.parameters(found.machine, found.tree)
    state = begin(parameters, 0.0, trusted=True)
    refused = targets.whole(parameters, state, 300 * DEG, "move to", True)
    assert isinstance(refused, Refused)
    assert refused.reason == "position 300 deg is beyond the soft limits"
    assert refused.remedy == "give one from 0 to 269.4 deg"
    no = targets.whole(parameters, state, "far", "move to", True)
    assert isinstance(no, Refused) and no.remedy == "give it in rad"


def test_words_are_in_degrees() -> None:
    assert KINDS["move to"].words((math.pi,), ANGLE) == "move to 180 deg"
    assert KINDS["move to"].words((0.012,)) == "move to 12 mm"
    end = m.Finished(3, m.STALLED, 0.5, 0.001, {})
    assert "at 28.648 deg" in str(motion_error(end, "move", ANGLE))
    assert "at 500.000 mm" in str(motion_error(end, "move"))
    fault = faults.describe(200.0 + guarding.LOST, 1.0, 0.5, 2.0, ANGLE)
    assert "57.3 deg, allowed 28.65 deg" in fault.evidence


def test_telemetry_is_shown_in_degrees() -> None:
    columns, scales, _ = shared.telemetry_of((ANGLE,))
    units = {c.name: c.unit for c in columns}
    assert (units["position"], units["uncertainty"], units["motor"]) == ("deg", "mdeg", "V")
    k = shared.INDEX["position"]
    assert scales[k, 0] == pytest.approx(1e-3 / DEG) and scales[shared.INDEX["t"], 0] == 1.0
    plain, ones, _ = shared.telemetry_of((LENGTH,))
    assert plain == shared.COLUMNS and np.all(ones == 1.0)


def test_the_page_draws_degrees(found: Any) -> None:
    block = np.zeros((len(shared.NAMES), 4))
    block[shared.INDEX["position"]] = 1e3 * np.array([0.1, 0.2, 0.3, 0.4])  # in mrad
    block[shared.INDEX["macro_reference"]] = 10.0
    made = bins.Plots(shared.NAMES, 1e-3, ANGLE).traces(block)
    assert made[7] == pytest.approx(np.array([0.1, 0.2, 0.3, 0.4]) / DEG)
    assert made[0] - made[1] == pytest.approx(0.01 / DEG)
    assert bins.Plots(shared.NAMES, 1e-3).traces(block)[7] == pytest.approx([100, 200, 300, 400])
    told = _reporting.limits(found)
    assert (told["unit"], told["base"]) == ("deg", "rad")
    assert told["units"] == {"deg": pytest.approx(DEG), "mdeg": pytest.approx(1e-3 * DEG)}
    head = bins.HEADER.unpack_from(
        bins.Plots(shared.NAMES, 1e-3, ANGLE).frame(bins.view(1, 2.0, 100), 3, block)
    )
    assert head[8] == pytest.approx(0.4 / DEG)


def test_the_page_orders_angles() -> None:
    value = {"value": 90, "unit": "deg"}
    assert _orders.length(value, ANGLE) == pytest.approx(math.pi / 2.0)
    assert _orders.length({"value": 5, "unit": "mm"}) == pytest.approx(5e-3)
    with pytest.raises(_orders.Refusal, match="not a unit of angle"):
        _orders.length({"value": 5, "unit": "mm"}, ANGLE)
    with pytest.raises(_orders.Refusal, match="not a unit of length"):
        _orders.length(cast("dict[str, Any]", value))


def test_its_position_file_is_its_own(found: Any, tmp_path: Path) -> None:
    assert found.model == "rotary table" and "rotary" in found.kept_as("twin")
