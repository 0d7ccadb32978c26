"""The position file: what it says, when it may be trusted, and who may write it."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import pytest

from macromicro.errors import MacromicroError
from macromicro.schema.config import overridden
from macromicro.serve import persist
from macromicro.serve._background import call
from macromicro.serve.persist import Evident, Kept, Lock, PositionStore, Shown
from macromicro.serve.settings import LiveSettings

KEPT = Kept("twin", 1400.0, 3.0, True, "homed", False, 1.8e9, -0.0021)
COUNTED = Evident(counted=True)


def test_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "deeper" / "position.json"
    persist.save(path, KEPT)
    assert persist.load(path) == KEPT
    assert persist.restore(KEPT, "twin", 1401.0, COUNTED)[:3] == (
        True,
        3.0,
        persist.restore(KEPT, "twin", 1400, COUNTED)[2],
    )
    nan = KEPT._replace(offset=math.nan)
    persist.save(path, nan)
    assert math.isnan(persist.load(path).offset)  # type: ignore[union-attr]
    assert [p.name for p in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("kept", "count", "why"),
    [
        (KEPT._replace(moving=True), 1400.0, "interrupted"),
        (KEPT._replace(trusted=False, why="never homed"), 1400.0, "never homed"),
        (KEPT._replace(rig="mylab:bench"), 1400.0, "another rig, mylab:bench"),
        (KEPT, 0.0, "reads 0, was left at 1400"),
        (KEPT, math.nan, "encoder"),
        (KEPT._replace(offset=math.nan), 1400.0, "untrusted"),
        ("no position was saved", 1400.0, "no position was saved"),
    ],
)
def test_what_is_not_trusted(kept: Kept | str, count: float, why: str) -> None:
    restored = persist.restore(kept, "twin", count, COUNTED)
    assert not restored.trusted
    assert math.isnan(restored.offset)
    assert why in restored.why


@pytest.mark.parametrize(
    ("table", "same"),
    [
        ({"bench": {"carriage": {"stop_low": "-5 mm"}}}, False),
        ({"sensors": {"encoder": {"pitch": "70 um"}}}, False),
        ({"live": {"homing": {"back_off": "100 counts"}}}, False),
        ({"controller": {"pd_tuned": {"now": "0.01 V/count"}}}, True),
        ({"guard": {"silent": "0.3 s"}}, True),
    ],
)
def test_a_position_of_other_stops_pitch_or_homing_is_not_trusted(
    table: dict[str, Any], same: bool
) -> None:
    """Of the two-stage machine, whose encoder reads what it was left at."""
    left = KEPT._replace(rig=LiveSettings().kept_as("lab"))
    now = overridden(LiveSettings(), table, "other.toml").kept_as("lab")
    restored = persist.restore(left, now, 1400.0, COUNTED)
    assert restored.trusted == same and ("other settings" in restored.why) != same
    if not same:
        assert math.isnan(restored.offset)
    elsewhere = persist.restore(left, LiveSettings().kept_as("other"), 1400.0, COUNTED)
    assert "another rig, lab two_stage" in elsewhere.why


@pytest.mark.parametrize("older", persist._OLDER)
def test_a_position_of_an_older_version_is_not_trusted(tmp_path: Path, older: str) -> None:
    path = tmp_path / "position.json"
    persist.save(path, KEPT)
    path.write_text(path.read_text().replace(persist.FORMAT, older))
    assert "older version" in str(persist.load(path))


@pytest.mark.parametrize(
    ("kept", "laser", "trusted"),
    [
        (-0.0021, -0.0021, True),
        (-0.0021, -0.00206, True),
        (-0.0021, -0.00204, False),  # pushed by hand while the counter was off
        (-0.0021, math.nan, False),
        (math.nan, math.nan, False),
        (0.0002, 0.0002, False),  # as any laser that was just switched on
    ],
)
def test_a_counter_alone_confirms_no_place(kept: float, laser: float, trusted: bool) -> None:
    """It begins at 0 when it is switched on, wherever the carriage was pushed meanwhile."""
    left = KEPT._replace(encoder=0.0, offset=0.0, laser=kept)
    restored = persist.restore(left, "twin", 0.0, Evident(laser=laser))
    assert (restored.trusted, restored.offset) == (trusted, 0.0)
    assert trusted or "unconfirmed" in restored.why


@pytest.mark.parametrize(
    "text", ["", "{", "[" * 100_000, "[]", "{}", '{"format": "other"}', "\x00\xff"]
)
def test_a_damaged_file_is_no_position(text: str, tmp_path: Path) -> None:
    path = tmp_path / "position.json"
    path.write_text(text, "utf-8")
    assert str(path) in str(persist.load(path))


@pytest.mark.parametrize("value", [10**400, True, [1]], ids=["huge", "flag", "list"])
@pytest.mark.parametrize("field", ["encoder", "offset", "saved"])
def test_what_is_no_number_of_the_machines_is_no_position(
    field: str, value: object, tmp_path: Path
) -> None:
    path = tmp_path / "position.json"
    persist.save(path, KEPT._replace(**{field: value}))
    found = persist.load(path)
    assert isinstance(found, str)
    assert str(path) in found


@pytest.mark.parametrize("field", ["encoder", "trusted", "moving", "why"])
def test_a_field_of_another_type_is_no_position(field: str, tmp_path: Path) -> None:
    path = tmp_path / "position.json"
    persist.save(path, KEPT)
    written = json.loads(path.read_text())
    path.write_text(json.dumps({**written, field: [1]}))
    assert isinstance(persist.load(path), str)


def test_a_failed_write_leaves_the_old_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "position.json"
    persist.save(path, KEPT)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(persist.os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        persist.save(path, KEPT._replace(encoder=0.0))
    assert persist.load(path) == KEPT


def test_a_motion_waits_for_the_disk_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, synced, sync = tmp_path / "position.json", [], os.fsync
    persist.save(path, KEPT)

    def noted(number: int) -> None:
        synced.append(number)
        sync(number)

    monkeypatch.setattr(persist.os, "fsync", noted)
    persist.save(path, KEPT._replace(moving=True))
    assert len(synced) == 1
    assert persist.load(path) == KEPT._replace(moving=True)


def test_the_lock_names_who_has_it(tmp_path: Path) -> None:
    path = tmp_path / "position.json"
    one, two = Lock(path), Lock(path)
    one.take()
    with pytest.raises(MacromicroError, match=rf"process {os.getpid()}.*end that one first"):
        two.take()
    one.drop()
    two.take()  # a file that is left behind locks nothing
    inherited = os.dup(two.fd)
    two.drop()
    with pytest.raises(MacromicroError):
        one.take()  # the loop process lives on and keeps it
    os.close(inherited)
    one.take()
    one.drop()


def test_where_no_lock_can_be_made_the_message_says_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(MacromicroError, match="name another state file"):
        Lock(tmp_path / "file" / "position.json").take()


class Scene:
    """A store, the place that it is shown, and what it reported."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.place: Shown | None = None
        self.reports: list[str] = []
        self.store = PositionStore(path, "twin", lambda: self.place, self.reports.append)

    def show(
        self, row: int, count: float, moving: bool, trusted: bool = True, why: str = "homed"
    ) -> Kept | str:
        self.place = row, Kept("", count, 0.0, trusted, why, moving, 0.0, -0.0021)
        call(self.store.update())
        return persist.load(self.path)


def test_moving_is_in_the_file_before_anything_moves(tmp_path: Path) -> None:
    scene = Scene(tmp_path / "position.json")
    assert scene.show(10, 5.0, False) == KEPT._replace(
        encoder=5.0,
        offset=0.0,
        saved=persist.load(scene.path).saved,  # type: ignore[union-attr]
    )
    call(scene.store.begin_motion())
    assert persist.load(scene.path).moving  # type: ignore[union-attr]
    # The loop has not answered, and then rows of before the motion still show rest.
    assert scene.show(11, 5.0, False).moving  # type: ignore[union-attr]
    scene.store.answered(12)
    assert scene.show(12, 5.0, False).moving  # type: ignore[union-attr]
    assert scene.show(13, 400.0, True).moving  # type: ignore[union-attr]
    ended = scene.show(900, 800.0, False)
    assert (ended.moving, ended.encoder) == (False, 800.0)  # type: ignore[union-attr]


def test_trust_is_written_at_once_and_flicker_is_not(tmp_path: Path) -> None:
    scene = Scene(tmp_path / "position.json")
    first = scene.show(1, 5.0, False)
    assert scene.show(2, 6.0, False) == first
    assert scene.show(3, 5.0, False, trusted=False).trusted is False  # type: ignore[union-attr]
    assert scene.show(4, 9.0, False).encoder == 9.0  # type: ignore[union-attr]


def test_where_nothing_can_be_written_the_file_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Scene(tmp_path / "position.json")
    scene.show(1, 5.0, False)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(persist, "RETRY_S", 0.0)
    monkeypatch.setattr(persist.os, "fsync", full)
    call(scene.store.begin_motion())
    assert persist.load(scene.path) == "no position was saved"
    assert "No space left" in scene.reports[0]

    def locked(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    scene.store.answered(1)
    scene.show(5, 5.0, False)
    monkeypatch.setattr(Path, "unlink", locked)
    with pytest.raises(MacromicroError, match="and this file cannot be removed"):
        call(scene.store.begin_motion())


def test_once_there_is_room_again_the_file_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Scene(tmp_path / "position.json")
    monkeypatch.setattr(persist, "RETRY_S", 0.0)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as without_room:
        without_room.setattr(persist.os, "fsync", full)
        for row in range(3):
            assert scene.show(row, 5.0, False) == "no position was saved"
    assert len(scene.reports) == 1  # told once
    assert scene.show(4, 5.0, False).encoder == 5.0  # type: ignore[union-attr]


def test_a_full_disk_is_not_tried_all_the_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Scene(tmp_path / "position.json")
    monkeypatch.setattr(persist, "RETRY_S", math.inf)
    tries = []

    def full(_: int) -> None:
        tries.append(1)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(persist.os, "fsync", full)
    for row in range(3):
        scene.show(row, 5.0, False)
    assert len(tries) == 1


def test_the_file_follows_why_the_place_is_not_known(tmp_path: Path) -> None:
    scene = Scene(tmp_path / "position.json")
    scene.show(1, 5.0, False, trusted=False)  # the row comes before the words
    found = scene.show(2, 5.0, False, trusted=False, why="emergency stop on the way")
    assert found.why == "emergency stop on the way"  # type: ignore[union-attr]


def test_every_stage_must_stand_where_it_was_left(tmp_path: Path) -> None:
    three = KEPT._replace(others=((-700.0, 11.0), (5.0, -2.0)))
    path = tmp_path / "position.json"
    persist.save(path, three)
    assert persist.load(path) == three
    found = persist.restore(three, "twin", 1400.0, COUNTED, (-701.0, 6.0))
    assert found.trusted and found.offset == 3.0 and found.others == (11.0, -2.0)
    for others in ((-690.0, 5.0), (-700.0, math.nan)):
        found = persist.restore(three, "twin", 1400.0, COUNTED, others)
        assert not found.trusted and math.isnan(found.offset) and "moved" in found.why
    # What was kept of one stage says nothing of three.
    assert not persist.restore(KEPT, "twin", 1400.0, COUNTED, (5.0, 5.0)).trusted
