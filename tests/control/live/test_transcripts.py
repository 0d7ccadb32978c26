"""The live machine period by period, one kind of work after the other, as it was agreed on.

Outputs, references, readings, modes, positions and how well they are known, and every notice with
its evidence: whoever changes one of them says so by renewing `tests/frozen/live-*.json`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from macromicro.control.live import machine
from macromicro.control.live import messages as m
from macromicro.control.live.transitions import TRANSITIONS
from macromicro.control.supervisor import Plan

from ...frozen.record import frozen
from .bench import PITCH
from .scripted import CONTROL, LIVE, NAN, Scripted


def ready(at: float = 0.4, **rest: Any) -> Scripted:
    f = Scripted(at, **{"coordinate": 0.0, "trusted": True, **rest})
    f.tick()
    f.ask(m.Enable("a"))
    return f


def known(at: float = 0.4, **rest: Any) -> Scripted:
    """Its laser has seen edges."""
    f = ready(at, **rest)
    f.ask(m.MoveMacro(40))
    f.end()
    f.ask(m.Jog("macro", -0.03))
    f.run(0.06)
    f.ask(m.Stop())
    f.end()
    assert f.s.survey.half < 0.5 * PITCH
    return f


def homing() -> Scripted:
    f = Scripted(-40.3)
    f.tick()
    f.ask(m.Enable())
    f.ask(m.Home())
    f.run(0.05)
    f.stuck = True  # for less than it takes to be a stop, then for longer
    f.run(0.012)
    f.stuck = False
    f.run(0.02)
    f.run(0.003, "e")
    f.end(2.0)
    f.run(0.01)
    return f


def homing_again() -> Scripted:
    """Where the frame has the stop not far from where it is."""
    f = ready(150.0, coordinate=153.0)
    f.ask(m.Home("a"))
    f.end(2.0)
    f.run(0.01)
    return f


def homing_that_fails() -> Scripted:
    f = ready(200.0, control=CONTROL._replace(macro_law="pid"))
    f.ask(m.Home())
    f.run(0.1)
    f.stuck = True
    f.run(0.035)  # held up under the push, then free: no stop
    f.stuck = False
    f.run(0.2)
    f.ask(m.Stop("b"))
    f.end()
    f.ask(m.Home())
    f.run(0.05)
    f.run(0.1, "e")
    f.end(2.0)
    return f


def macro_moves() -> Scripted:
    f = ready()
    f.ask(m.MoveMacro(120, "a"))
    f.run(0.03)
    f.run(0.004, "e")
    f.end()
    f.ask(m.MoveMacro(-80))
    f.until("settling")
    f.at -= 4.0  # it drifts
    f.end()
    f.ask(m.MoveMacro(60))
    f.until("settling")
    f.stuck, f.at = True, f.at - 10.0
    f.end()
    f.run(0.02)
    return f


def micro_moves() -> Scripted:
    f = ready(17.0, coordinate=5.0)
    f.ask(m.MoveMicro(1.2e-3, "a"))
    f.end()
    f.run(0.02)
    f.run(0.003, "h")
    f.ask(m.MoveMicro(0.7e-3))
    f.run(0.05)
    f.ask(m.Stop())
    f.run(0.03)
    f.ask(m.LinkLost("stop"))
    f.run(0.03)
    f.ask(m.MoveMicro(3.4e-3))
    f.run(0.02, "h")
    f.end()
    return f


def moves_of_both() -> Scripted:
    f = known()
    f.ask(m.MoveTo(0.0061))
    f.end()
    f.run(0.03)
    f.ask(m.MoveBy(0.0003))
    f.run(0.05)
    f.at += 1.0  # a count under the micro-stage
    f.end()
    f.ask(m.MoveBy(-0.0004))
    f.run(0.02, "l")
    f.end()
    f.ask(m.MoveTo(-0.001))
    f.run(0.03)
    f.ask(m.LinkLost("hold"))
    f.end()
    return f


def moves_that_give_up() -> Scripted:
    f = ready(control=CONTROL._replace(sequence=CONTROL.sequence._replace(park=0)))
    f.ask(m.MoveTo(0.004))
    f.until("moving-micro")
    f.run(0.02)
    f.at += 60.0
    f.end()
    f.ask(m.MoveTo(0.0005))
    f.until("moving-micro")
    f.run(0.02)
    f.ask(m.LinkLost("hold"))
    f.run(0.02)
    f.ask(m.MoveMacro(30))
    f.stuck = True
    f.end()
    return f


def replaced() -> Scripted:
    f = ready(live=LIVE._replace(supersede=1, gains_while_moving=1))
    f.ask(m.MoveMacro(100))
    f.run(0.03)
    f.ask(m.MoveTo(0.003))
    f.run(0.04)
    f.ask(m.SetGains((("sequence.wait", 0.02), ("pd_tuned.now", 0.012))))
    f.until("moving-micro")
    f.run(0.02)
    f.ask(m.SetGains((("pi_antiwindup.kp", 2500.0),)))
    f.run(0.01)
    f.ask(m.MoveMicro(1e-3))
    f.run(0.05)
    f.ask(m.MoveBy(0.01, replace=True))
    f.run(0.05)
    f.ask(m.Jog("macro", 0.02))
    f.run(0.05)
    f.ask(m.Disable("c"))
    f.run(0.01)
    return f


def macro_jogs() -> Scripted:
    f = ready(live=LIVE._replace(limits=LIVE.limits._replace(macro_low=-40.0, macro_high=45.0)))
    f.ask(m.Jog("macro", 0.05, client="a"))
    f.run(0.03)
    f.ask(m.Jog("macro", 0.02))
    f.run(0.03)
    f.run(0.003, "e")
    f.end()
    f.ask(m.Jog("macro", -0.04))
    f.run(0.03)
    f.ask(m.Jog("macro", 0.0))
    f.end()
    f.ask(m.Jog("macro", -0.04))
    f.end()
    f.ask(m.Jog("macro", 0.03))
    f.run(0.02)
    f.stuck = True
    f.end()
    return f


def micro_jogs() -> Scripted:
    limits = LIVE.limits._replace(micro_low=0.5e-3, micro_high=0.6e-3)
    jogging = LIVE.jogging._replace(micro=2e-3)
    f = ready(live=LIVE._replace(limits=limits, jogging=jogging))
    f.ask(m.MoveMicro(0.55e-3))
    f.end()
    f.ask(m.Jog("micro", 1e-3, client="a"))
    f.run(0.02)
    f.ask(m.Jog("micro", -5e-4))
    f.run(0.02)
    f.ask(m.Jog("micro", 0.0))
    f.run(0.02)
    f.ask(m.Jog("micro", 2e-3))
    f.run(0.003, "h")
    f.end()
    f.ask(m.LinkLost("stop"))
    f.run(0.03)
    f.ask(m.Jog("micro", 1e-3))
    f.run(0.3)
    f.out = f.out._replace(ctrl=0.0)
    f.end()
    f.ask(m.Jog("micro", -2e-3))
    f.end()
    return f


def programme() -> Scripted:
    f = ready(23.0, coordinate=20.0)
    plan = Plan(
        np.array([NAN, NAN, NAN, NAN]), np.array([0, 1, 0, 1]), np.array([60.0, 1e-3, 5.0, 0.6e-3]),
        np.array([0.0, 0.3, 0.01, 0.2]), NAN,
    )  # fmt: skip
    f.ask(m.Programme(plan, "a"))
    f.end(3.0)
    f.run(0.01)
    return f


def programme_by_time() -> Scripted:
    f = ready()
    plan = Plan(
        np.array([0.0, 0.02, 0.3, 0.31, 0.5]), np.array([0, 0, 1, 1, 0]),
        np.array([90.0, 30.0, 0.8e-3, 1e-3, 50.0]), np.array([0.0, 0.0, 0.01, 0.1, 0.05]), 0.9,
    )  # fmt: skip
    f.ask(m.Programme(plan))
    f.end(2.0)
    f.ask(m.Programme(plan._replace(end=NAN)))
    f.run(0.05)
    f.ask(m.Stop())
    f.end()
    f.ask(m.Programme(plan))
    f.run(0.03)
    f.stuck = True
    f.end(2.0)
    return f


def stops() -> Scripted:
    f = ready()
    for target, request in (
        (2000, m.Stop("b")), (-100, m.LinkLost("stop")), (2000, m.EmergencyStop("c"))
    ):  # fmt: skip
        f.ask(m.MoveMacro(target))
        f.run(0.04)
        f.ask(request)
        f.run(0.25)
    f.ask(m.Enable())
    f.ask(m.Jog("macro", 0.01))
    f.run(0.05)
    f.ask(m.Stop())
    f.run(0.003)
    f.ask(m.Disable())
    f.run(0.02)
    return f


def a_stop_that_takes_too_long() -> Scripted:
    f = ready()
    f.ask(m.MoveMacro(2985))
    for _ in range(40):
        f.at += 3.0
        f.tick()
    f.ask(m.Stop())
    for k in range(420):
        f.at += 0.5
        f.tick("e" if k % 10 == 3 else "")
    return f


def faults() -> Scripted:
    f = ready()
    f.ask(m.Fan(True, "a"))
    f.ask(m.MoveMacro(80))
    f.run(0.03)
    f.fault("stuck", pushed_s=0.3)
    f.run(0.01)
    f.ask(m.ClearFault())
    f.ask(m.ClearFault(gone=True, client="b"))
    f.ask(m.Enable())
    f.ask(m.Jog("macro", 0.01))
    f.run(0.03)
    f.lead = 7.0  # a leap of the samples' time
    f.run(0.02)
    f.run(0.003, "t")
    f.ask(m.Zero("d"))
    f.ask(m.Jog("macro", 0.0))
    f.end()
    f.ask(m.Zero("d"))
    f.ask(m.Fan(False))
    f.run(0.01)
    return f


def laser() -> Scripted:
    f = known()
    f.ask(m.Zero())
    f.run(0.02)
    f.s, notices = machine.doubt(f.p, f.s, "the Hall sensor is noisy")
    f.note(notices)
    f.run(0.01)
    f.s, notices = machine.doubt(f.p, f.s, "")
    f.note(notices)
    f.beam = False
    f.run(0.01)
    f.beam = True
    f.ask(m.MoveMacro(120))
    f.end()
    f.ask(m.MoveMicro(0.8e-3))
    f.end()
    f.ask(m.Jog("macro", 0.05))
    for _ in range(300):
        f.lost += 0.05  # the encoder loses counts
        f.tick()
        if f.mode == "fault":
            break
    f.run(0.01)
    return f


def gains_and_limits() -> Scripted:
    f = ready()
    f.ask(m.MoveMicro(1e-3))
    f.end()
    f.ask(m.SetGains((("pi_antiwindup.kp", 2000.0), ("sequence.park", 0))))
    f.run(0.03)
    f.ask(m.SetGains((("micro_law", "p"),)))
    f.run(0.03)
    f.ask(m.SetLimits(LIVE.limits._replace(macro_high=70.0, micro_low=0.4e-3)))
    f.ask(m.MoveTo(0.0049))
    f.end()
    f.ask(m.Jog("macro", 0.05))
    f.end()
    f.s, notices = machine.lose(f.s, "periods were missed")
    f.note(notices)
    f.ask(m.SetLimits())
    f.ask(m.Jog("macro", 0.01))
    f.run(0.05)
    return f


KINDS: tuple[Callable[[], Scripted], ...] = (
    homing, homing_again, homing_that_fails, macro_moves, micro_moves, moves_of_both,
    moves_that_give_up, replaced, macro_jogs, micro_jogs, programme, programme_by_time, stops,
    a_stop_that_takes_too_long, faults, laser, gains_and_limits,
)  # fmt: skip


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_transcript(kind: Callable[[], Scripted]) -> None:
    f = kind()
    assert f.rows and not math.isnan(f.s.time)
    table = {(m.MODES[a], m.MODES[b], cause) for a, b, cause in TRANSITIONS}
    assert {e[2:5] for e in f.events if e.kind == "mode"} <= table
    frozen(f"live-{kind.__name__.replace('_', '-')}", f.told(), rel=1e-9)
