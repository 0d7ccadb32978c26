"""The screen shows channels that there are."""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ET
from importlib.resources import files
from pathlib import Path

import pytest

pytest.importorskip("caproto")
sys.path.insert(0, str(Path(__file__).parents[1]))
from fake_station import FakeStation

from macromicro.errors import InputError
from macromicro.serve._instrument import Instrument
from macromicro.serve.epics._machine import Channels
from macromicro.serve.epics.server import EpicsServer, check_prefix
from macromicro.serve.hosts import Token


def test_every_channel_of_the_screen_is_served() -> None:
    text = (files("macromicro") / "serve/epics/positioner.bob").read_text(encoding="utf-8")
    ET.fromstring(text)
    shown = set(re.findall(r"\$\(P\):([\w:.]+)", text))
    named = Channels(Instrument(FakeStation())).named("P")  # type: ignore[arg-type]
    assert len(shown) > 12
    assert {f"P:{name}" for name in shown} <= set(named)


@pytest.mark.parametrize("prefix", ["", " ", "a b", "x" * 31, "$(P)", ".VAL"])
def test_a_prefix_that_cannot_be_is_refused(prefix: str) -> None:
    with pytest.raises(InputError, match="a prefix such as LAB:STAGE"):
        check_prefix(prefix)
    assert check_prefix("LAB:STAGE:") == "LAB:STAGE"


def test_without_caproto_nothing_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "caproto", None)
    with pytest.raises(InputError, match=r"caproto is not installed.*'macromicro\[epics\]'"):
        check_prefix("LAB:STAGE")


def test_others_need_a_token_to_reach_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EPICS_CAS_INTF_ADDR_LIST", "0.0.0.0")
    with pytest.raises(InputError, match="together with a token"):
        EpicsServer(FakeStation(), "P")  # type: ignore[arg-type]
    EpicsServer(FakeStation(), "P", Token("sesame"))  # type: ignore[arg-type]
