"""The errata: every entry proves itself, and its numbers follow from the thesis' own."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

from macromicro.design import costs, resolution
from macromicro.design.flexure_sheet import GRAM_FORCE, Beam, max_thickness
from macromicro.design.hall_sensors import TABLE_3_2, Needs, suitable
from macromicro.design.magnets import INCH, TABLE_3_1, largest_change
from macromicro.design.margins import (
    PdTaps,
    damping_margin,
    first_crossover,
    lowest_frequency,
    pd_by_margin,
    pd_by_time,
)
from macromicro.models import electrothermal
from macromicro.models.macro import Linear, Motor, discretise, jump, position_transfer, transfer
from macromicro.models.weighted_gain import Exponential, Weighted, exponential, weighted
from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import LEVELS, TIMES, micro_steps
from macromicro.settings import Settings
from macromicro.thesis.chapter4._design import trial
from macromicro.thesis.chapter5.micro_runs import error_after
from macromicro.thesis.errata import ERRATA, Erratum, evidence

BY_NUMBER = {e.number: e for e in ERRATA}

LINEAR, ONES = Linear(), Motor(*[1.0] * 7)
NUM, DEN = position_transfer(LINEAR)  # (4.4)
INITIAL = (0.00245865, 0.0000998447)  # (4.9)
TUNED = (0.0124593, 0.0112178)  # (4.10) as printed
STEP, DEAD_ZONE, A0, DELTA = 3000.0, 3.0, 0.364, 0.636  # counts, V, V, dimensionless
AMBIENT, FULL_CONTRACTION = 25.0, 107.5  # degC
HEATING_GAIN = electrothermal.N0 / electrothermal.D0
LOW = Weighted().low
SENSITIVITY, BIT, CALIBRATED = 3.125e-3, 1.22e-3, 0.8e-3  # V/G, V, m/V
BEST_MAGNET, OTHER_MAGNET = TABLE_3_1[0], TABLE_3_1[5]  # 103MG5, 101MG7
CYCLE_RISE, CYCLE_TRAVEL, CYCLE_FALL = 0.23, 0.18, 1.2  # s, of Appendix D


def state_space() -> list[float]:
    """(4.1) and its corrected form with every constant 1: the slower poles."""
    poles = [
        np.linalg.eigvals(np.array([[-1.0, sign], [1.0, -1.0]])).real.max() for sign in (1.0, -1.0)
    ]
    return [*poles, transfer(ONES)[1]]


def regression() -> list[float]:
    """The known system y_k = 0.9 y_(k-1) + 0.5 u_(k-1) in the printed regression."""
    u = np.array([1.0, 0.0, -1.0, 2.0, 0.5, -0.5, 1.5, 0.0])
    y = np.zeros(9)
    for k in range(8):
        y[k + 1] = 0.9 * y[k] + 0.5 * u[k]
    return list(np.linalg.lstsq(np.column_stack([y[:-1], u]), y[1:], rcond=None)[0])


def controllers() -> list[float]:
    """Crossovers and phase margins of (4.9) and of (4.10) with either sign."""

    def loop(now: float, before: float) -> list[float]:
        return list(first_crossover(np.polymul([now, before], NUM), [*DEN, 0.0], LINEAR.dt)[:2])

    plus, minus = loop(*TUNED), loop(TUNED[0], -TUNED[1])
    return [*loop(*INITIAL), plus[0], *minus, damping_margin(1.05)]


def first_effort(ratio: float) -> float:
    """First and largest effort [V] of a 3000-count step under the PD of a damping ratio.

    The crossover is the lowest that the ratio allows, where no derivative action is left.
    """
    margin = damping_margin(ratio)
    frequency = lowest_frequency(NUM, DEN, LINEAR.dt, margin)
    return pd_by_margin(NUM, DEN, LINEAR.dt, frequency, margin).now * STEP + DEAD_ZONE


def overshoots() -> list[float]:
    """Of the tuned model's step of 3000 counts without and with derivative time."""
    held = PdTaps(TUNED[0], -TUNED[1]).derivative_time(LINEAR.dt)
    cases = [(9.91, 0.0), (4.91, 0.0), (2.0, 0.0), (9.91, held), (4.91, held)]
    return [trial(pd_by_time(NUM, DEN, LINEAR.dt, *case)).overshoot for case in cases]


def logarithm() -> list[float]:
    p = Exponential()
    slope = math.log(1.0 - (exponential(p, 1.55) - p.y0) / p.b) / 0.05
    return [slope, -slope, 1.0 - (84.0 - p.y0) / p.b]


def first_order() -> list[float]:
    """Samples 3 and 4 of the step response of 1/(z+1), and the time to 63 % of 1/(s+1)."""
    y = [0.0]
    for _ in range(3):
        y.append(1.0 - y[-1])
    return [*y[2:], -math.log(1.0 - 0.63)]


def thicknesses() -> list[float]:
    cases = [(70e9, 35.0, 2e-3), (70e9, 17.5, 2e-3), (70e9, 35.0, 4e-3), (71e9, 35.0, 4e-3)]
    return [1e3 * max_thickness(Beam(e), gf * GRAM_FORCE, d) for e, gf, d in cases]


def magnets() -> list[float]:
    other = OTHER_MAGNET
    inner = (other.flux[2] - other.flux[3]) / (other.distance[3] - other.distance[2]) * 1e-3
    return [
        largest_change(other, 1e-3).flux,
        largest_change(other, 0.04 * INCH).flux,
        inner,
        largest_change(BEST_MAGNET, 0.04 * INCH).flux,
        largest_change(BEST_MAGNET, 1e-3).flux,
        0.5 * 5.0 / SENSITIVITY,
        1300.0 * SENSITIVITY,
        4.0 / (1300.0 * SENSITIVITY),
    ]


def volumes() -> list[float]:
    bought = math.pi / 4.0 * 3.0**2 * 2.5
    wanted = math.pi / 4.0 * (0.078 * 25.4) ** 2 * (0.040 * 25.4)
    return [bought, wanted, bought / wanted]


def cycle_pid() -> list[float]:
    """The PID of Appendix D on a cycle of the paper's own times, errors as triangles."""
    speed = 150.0 / CYCLE_TRAVEL
    area = 0.5 * 150.0 * (CYCLE_RISE - CYCLE_FALL)
    return [0.5 * area, 0.1 * speed, 0.1 * speed * 0.01, 2.0 / 0.01]


def saturating() -> list[float]:
    rise = exponential(Exponential(), 1.6)
    below = exponential(Exponential(), 1.575)
    return [rise + AMBIENT, HEATING_GAIN * rise + AMBIENT, HEATING_GAIN * below + AMBIENT]


def predicted() -> list[float]:
    """The calibrated sensor against the budget, and the flux slope that it implies."""
    calibrated = resolution.calibrated(BIT, CALIBRATED)
    budget = 5e-6 * resolution.field(BIT, SENSITIVITY)
    implied = 1.0 / (CALIBRATED * SENSITIVITY)  # G/m
    return [
        1e6 * calibrated,
        1e6 * budget,
        budget / calibrated,
        1e6 * resolution.metres_per_gauss(implied),
        implied * INCH,
    ]


def fields() -> list[float]:
    volts = resolution.converter(5.0, 12)
    return [resolution.field(volts, SENSITIVITY), resolution.field(volts, 2.0 * SENSITIVITY)]


RECOMPUTED: dict[int, Callable[[], list[float]]] = {
    1: state_space,
    2: lambda: [
        LINEAR.a,
        -LINEAR.a,
        -math.log(-LINEAR.a) / LINEAR.dt,
        -discretise(*transfer(ONES), 1.0).a,
    ],
    3: regression,
    4: lambda: [-(A0 - DELTA), jump(A0, DELTA, -1.0)],
    5: lambda: [(A0 + part * DELTA) * LINEAR.b / (1.0 + LINEAR.a) for part in (0.1, 1.0)],
    6: controllers,
    7: lambda: [TUNED[0] * STEP, (TUNED[0] - TUNED[1]) * STEP + DEAD_ZONE],
    8: logarithm,
    9: lambda: [HEATING_GAIN],
    11: lambda: [
        weighted(Weighted(), 1.8),
        weighted(Weighted(), 1.9),
        LOW.x0 - math.log(1.0 + LOW.y0 / LOW.b) / LOW.a,
    ],
    12: first_order,
    13: lambda: [-3.98, 0.0],
    14: thicknesses,
    15: magnets,
    16: lambda: [costs.TABLE_2_1[1].cost[1], costs.TABLE_6_2[1].cost[1]],
    17: lambda: [83.0 - 57.66],
    18: lambda: [200e3 / 2800.0, 3000.0 * 200.0 / 2800.0],
    19: lambda: [2.0 + DEAD_ZONE],
    22: lambda: [3.0 / 30.0, 1.0 / 30.0],
    25: volumes,
    26: cycle_pid,
    29: saturating,
    30: lambda: [FULL_CONTRACTION - AMBIENT, 83.0 + AMBIENT],
    31: lambda: [exponential(LOW, 1.6), weighted(Weighted(join=-1.0), 1.6)],
    33: lambda: [-FULL_CONTRACTION, AMBIENT],
    34: lambda: [len(suitable(TABLE_3_2, needs)) for needs in (Needs(), Needs(cost=100.0))],
    35: lambda: [1e6 * resolution.budget(5.0, 12, SENSITIVITY, 5000.0 / INCH).position],
    36: lambda: [costs.TABLE_2_1[0].cost[1], costs.TABLE_6_2[0].cost[1]],
    40: lambda: [costs.total(costs.MICRO_STAGE)],
    41: lambda: [0.5 + 1.0, 1.0 / (0.5 + 1.0)],
    42: lambda: [first_effort(1.05), brentq(lambda r: first_effort(r) - 5.0, 1.0, 4.0, xtol=1e-6)],
    43: overshoots,
    44: predicted,
    45: fields,
    # At rest K_i e = K_aw (K_p e + i - 1.9 V), with an error of 2 mm and K_p = 3 V/mm.
    46: lambda: [3.0 * 2.0, 2.0 + 1.9 - 3.0 * 2.0, 1.0 / 2.25, 1.0 / 30.0],
}


def test_numbered_without_a_gap() -> None:
    assert [e.number for e in ERRATA] == list(range(1, len(ERRATA) + 1))
    assert len(ERRATA) >= 46


@pytest.mark.parametrize("entry", ERRATA, ids=lambda e: str(e.number))
def test_entry_proves_itself(entry: Erratum) -> None:
    """A recomputed number, or both places that contradict each other, quoted briefly."""
    assert all((entry.place, entry.printed, entry.fault, entry.reading))
    assert entry.figures or len(entry.quotes) >= 2
    assert all(0 < len(q.words) <= 90 and q.place for q in entry.quotes)


@pytest.mark.parametrize("entry", ERRATA, ids=lambda e: str(e.number))
def test_figures_follow_from_the_thesis(entry: Erratum) -> None:
    recomputed = RECOMPUTED[entry.number]() if entry.number in RECOMPUTED else []
    assert [f.value for f in entry.figures] == pytest.approx(recomputed, rel=1e-5, abs=1e-12)


def test_evidence_in_words() -> None:
    lines = evidence(BY_NUMBER[17])
    assert lines == ["83 - 57.66: 25.34 K (printed: 25.5 K)"]
    assert evidence(BY_NUMBER[10])[0].startswith("5.2.2: “the weighted nonlinear gain")


def test_formulas_are_no_quotations() -> None:
    """A formula is written down anew, so it stands in no quotation marks."""
    for entry in ERRATA:
        lines = evidence(entry)
        for quote, line in zip(entry.quotes, lines, strict=False):
            assert ("“" in line) == (not quote.formula)
    formulas = [q for e in ERRATA for q in e.quotes if q.formula]
    assert len(formulas) >= 8


def test_equal_gains_of_2_25_are_slower_than_none() -> None:
    """Erratum 46, on the bench: a second after each step more is left than under PI alone."""
    settings = Settings()

    def left(law: str, **gains: float) -> list[float]:
        field = law.replace("-", "_")
        changed = getattr(settings.controller, field)._replace(**gains)
        controller = settings.controller._replace(micro_law=law, **{field: changed})
        job = settings._replace(controller=controller)
        seen = on_twin(micro_steps(LEVELS, 2.0, TIMES), job, 0, False)
        return [abs(error_after(seen, time)) for time in TIMES]

    plain, held = left("pi", ki=2250.0), left("pi-antiwindup", ki=2250.0, kaw=2.25)
    assert all(h > 1.5 * p for h, p in zip(held, plain, strict=True))
