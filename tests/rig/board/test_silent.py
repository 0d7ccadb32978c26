"""A board that falls silent holds a control loop up for less than the loop's own time limit."""

from __future__ import annotations

import time

import pytest

from macromicro.rig.board._link import NEXT_SAMPLE, BoardError, Link
from macromicro.rig.board.framing import Stream
from macromicro.rig.board.rig import BoardRig
from macromicro.serve.settings import ServeSettings


class Silent:
    """A serial port whose other end takes everything and says nothing."""

    timeout: float | None = None
    in_waiting = 0

    def __init__(self) -> None:
        self.taken = b""
        self.waited = 0.0

    def read(self, size: int = 1) -> bytes:
        assert self.timeout is not None
        self.waited += self.timeout
        time.sleep(self.timeout)
        return b""

    def write(self, data: bytes) -> int:
        self.taken += data
        return len(data)

    def close(self) -> None: ...


@pytest.fixture
def port() -> Silent:
    return Silent()


@pytest.fixture
def rig(port: Silent) -> BoardRig:
    rig = BoardRig("the port")
    rig.link = Link(port, "the port")
    return rig


def test_a_stop_is_repeated_and_given_up_in_time(rig: BoardRig, port: Silent) -> None:
    with pytest.raises(BoardError, match=r"no answer to stop within 0.4 s"):
        rig.stop()
    requests = list(Stream().take(port.taken))
    assert len(requests) == 8 and len({body[0] for body in requests}) == 1
    assert port.waited <= ServeSettings().loop_timeout


def test_a_missing_sample_is_given_up_in_time(port: Silent) -> None:
    with pytest.raises(BoardError, match=r"no sample for 0.4 s"):
        Link(port, "the port").sample(NEXT_SAMPLE)
    assert port.waited <= ServeSettings().loop_timeout
