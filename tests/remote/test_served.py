"""The client before real servers: each kind of machine that `macromicro serve` knows."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

import pytest
from tests.serve.stage.test_served import example, served

from macromicro.errors import InputError
from macromicro.remote.failures import MotionFailed, RequestRefused
from macromicro.remote.machine import connect


# Machine, a place within its travel in base units, and how near "done" is.
@pytest.mark.parametrize(
    ("name", "place", "near"),
    [
        ("screw", 0.03, 1e-5),
        pytest.param("", 0.042123, 1e-5, marks=pytest.mark.slow),
        pytest.param("piezo-100um", 40e-6, 1e-6, marks=pytest.mark.slow),
        pytest.param("wire-150um", 1e-3, 2e-5, marks=pytest.mark.slow),
        pytest.param("disc", 0.5, 1.24e-2, marks=pytest.mark.slow),  # its tolerance, 4 counts
    ],
)
def test_a_machine_homes_and_moves(tmp_path: Path, name: str, place: float, near: float) -> None:
    with served(tmp_path, example(name) if name else "") as terminal:
        address = urlsplit(terminal.page)
        with connect(str(address.hostname), int(address.port or 0)) as stage:
            stage.enable()
            if not stage.state.trusted:  # an absolute sensor needs no homing
                stage.home()
            end = stage.move_to(place).wait()
            assert end["outcome"] == "done"
            assert abs(end["position"] - place) < near
            assert abs(stage.position - place) < 2 * near and stage.state.trusted
            high = stage.about["limits"]["whole_high"]
            with pytest.raises(RequestRefused) as refusal:
                stage.move_to(high + place)
            assert refusal.value.beyond and refusal.value.remedy


@pytest.mark.slow
def test_two_axes_move_to_points(tmp_path: Path) -> None:
    with served(tmp_path, example("xy-plotter")) as terminal:
        address = urlsplit(terminal.page)
        with connect(str(address.hostname), int(address.port or 0)) as stage:
            stage.enable()
            stage.home()
            stage.move_point("20 mm", 0.03)
            assert [axis.position_m for axis in stage.state.axes] == pytest.approx(
                [0.02, 0.03], abs=1e-4
            )
            motion = stage.move_axis("y", "60 mm", wait=False)
            stage.stop()
            with pytest.raises(MotionFailed, match="as stopped"):
                motion.wait()


@pytest.mark.slow
def test_two_axes_and_a_piezo_move_to_points_by_name(tmp_path: Path) -> None:
    with served(tmp_path, example("xyz")) as terminal:
        address = urlsplit(terminal.page)
        with connect(str(address.hostname), int(address.port or 0)) as stage:
            stage.enable()
            stage.home()
            stage.move_point("20 mm", 0.03, "40 um")
            stage.move_point(z="10 um", x="30 mm")
            stage.move_point_by(z="5 um")
            stage.move_axis("y", "25 mm")
            assert [axis.name for axis in stage.state.axes] == ["x", "y", "z"]
            places = [axis.position_m for axis in stage.state.axes]
            assert places == pytest.approx([0.03, 0.025, 15e-6], abs=3e-5)
            assert places[2] == pytest.approx(15e-6, abs=1e-7)
            for wrong in ({"w": 0.1}, {"x": 0.1, "y": 0.1, "z": 0.0, "w": 0.0}):
                with pytest.raises(InputError, match="x, y, z"):
                    stage.move_point(**wrong)
            with pytest.raises(InputError, match="x, y, z"):
                stage.move_point(0.1, 0.1)
            with pytest.raises(InputError, match="x, y, z"):
                stage.move_axis("w", 0.1)
            with pytest.raises(RequestRefused, match="z: position"):
                stage.move_axis("z", 0.1)
