"""Captures over SCPI: settings, states, and the captured columns in every format."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.serve.shared import INDEX, NAMES, Shared

from .conftest import Bench


def write(bench: Bench, rows: int) -> None:
    shared = bench.station.loop.shared
    for _ in range(rows):
        n = int(shared.cells[0])
        row = [0.0] * len(NAMES)
        row[INDEX["t"]], row[INDEX["position"]], row[INDEX["motor"]] = n * 1e-3, 0.5 * n, n >= 40
        shared.put(row)
    bench.station.captures.look()


@pytest.fixture
def live(bench: Bench) -> Bench:
    bench.station.loop.shared = Shared.create(2000)
    return bench


def test_an_edge_is_captured_with_what_was_before(live: Bench) -> None:
    assert live.ask("CAPT:STAT?") == "STOP,0"
    live.send('CAPT:SIGN "position, motor";BEF 10 MS;AFT 0.005')
    live.send("TRIG:SOUR EDGE;SIGN motor;SLOP POS;LEV 0.5")
    asked = "CAPT:SIGN?;BEF?;AFT?;REP?;:TRIG:SOUR?;SIGN?;SLOP?;LEV?"
    assert live.ask(asked) == '"position,motor";0.01;0.005;0;EDGE;"motor";POS;0.5'
    live.send("CAPT:STAR")
    write(live, 30)
    assert live.ask("CAPT:STAT?") == "WAIT,0"
    live.ask("CAPT:DATA? t")
    assert live.errors() == [-221]
    write(live, 12)
    assert live.ask("CAPT:STAT?") == "TRIG,0"
    write(live, 30)
    assert live.ask("CAPT:STAT?;UNIT?;TIME?") == 'COMP,1;"s","mm","V";0.04'
    times = [float(x) for x in live.ask("CAPT:DATA? t").split(",")]
    assert times == pytest.approx(np.arange(-10, 6) * 1e-3)
    live.send("FORM REAL,64;:FORM:BORD SWAP")
    data = live.send("CAPT:DATA? position")
    assert np.frombuffer(data[2 + int(data[1:2]) :], "<f8").tolist() == [
        0.5 * n for n in range(30, 46)
    ]
    live.ask("CAPT:DATA? ctrl")
    assert live.errors() == [-224]
    live.send("CAPT:REP ON;STOP")
    assert live.ask("CAPT:STAT?;REP?") == "STOP,0;1"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ('CAPT:SIGN "velocity"', "position"),
        ('CAPT:SIGN "position";:TRIG:SOUR LEV;SIGN motor;SLOP EITH', "rising, falling"),
        ('CAPT:SIGN "position";AFT 300 S', "0 to 56 s"),
    ],
)
def test_a_start_tells_what_is_accepted(live: Bench, settings: str, said: str) -> None:
    live.send(settings)
    live.send("CAPT:STAR")
    entry = live.session.errors.get()
    assert entry.number == -224 and (said in entry.text or len(entry.text) == 255)
    assert live.ask("CAPT:STAT?") == "STOP,0"


def test_without_a_loop_nothing_is_captured(bench: Bench) -> None:
    bench.send('CAPT:SIGN "position";STAR')
    assert bench.errors() == [-224]


def test_set_points_are_streamed_while_a_motion_follows_them(bench: Bench) -> None:
    bench.station.acquire("test")
    bench.send("FOLL:POIN 1 MM")
    assert bench.errors() == [-221]
    bench.send("FOLL:MACR 100 MS;:FOLL:POIN 12 MM,5 MM/S;:FOLL:POIN 13 MM")
    assert bench.errors() == []
    assert [tuple(p) for p, _ in bench.station.points] == [(0.012, 0.005), (0.013, 0.0)]
    bench.send("FOLL:POIN:ALL 1 MM,2 MM,3 MM/S,4 MM/S")
    assert bench.station.points[-1][0].each == ((0.001, 0.003), (0.002, 0.004))
    bench.send("FOLL:POIN 12 MM,fast")
    assert bench.errors() == [-104]
    bench.send("FOLL:MACR 2 S")
    assert bench.errors() == [-222]
    bench.station.holder = ""
    bench.send("FOLL:POIN 1 MM")
    assert bench.errors() == [-203]
