"""Errata of Chapters 1, 2, 6, 7 and Appendix D: costs, the whole system, cycle tests."""

from __future__ import annotations

from macromicro.design import costs
from macromicro.report.errata.entry import Erratum, Figure, Quote


def _ultrasonic() -> tuple[Figure, ...]:
    first, last = costs.TABLE_2_1[1], costs.TABLE_6_2[1]
    return (
        Figure("Table 2.1, ultrasonic drive", first.cost[1], "USD"),
        Figure("Table 6.2, ultrasonic drive", last.cost[1], "USD"),
    )


def _motor() -> tuple[Figure, ...]:
    first, last = costs.TABLE_2_1[0], costs.TABLE_6_2[0]
    return (
        Figure("Table 2.1, DC motor, dearest", first.cost[1], "USD"),
        Figure("Table 6.2, DC motor", last.cost[1], "USD"),
    )


def _cycle_pid() -> tuple[Figure, ...]:
    """The PID of Appendix D on a cycle with the paper's own times, errors as triangles."""
    kd, ki, dt, counts = 0.1, 0.5, 0.01, 150.0
    rise, travel, fall = 0.23, 0.18, 1.2
    area = 0.5 * counts * (rise - fall)
    speed = counts / travel
    return (
        Figure("integral gained in a cycle, as printed", ki * area, "V"),
        Figure("derivative during the rise, per second", kd * speed, "V"),
        Figure("derivative during the rise, per sample", kd * speed * dt, "V"),
        Figure("samples in a 2 s hold at 0.01 s", 2.0 / dt, "", 1000),
    )  # fmt: skip


def _cycle_time() -> tuple[Figure, ...]:
    contraction, extension = 0.5, 1.0
    cycle = contraction + extension
    return (
        Figure("contraction and extension of 5.3.2 together", cycle, "s", 2.0),
        Figure("bandwidth from that", 1.0 / cycle, "Hz", 0.5),
    )


def _budget() -> tuple[Figure, ...]:
    return (Figure("Table 6.1, micro-stage alone", costs.total(costs.MICRO_STAGE), "USD"),)


ENTRIES = (
    Erratum(
        16, "Tables 2.1 and 6.2", "3000 and 4000 USD for the ultrasonic drive",
        "two prices for one thing", "Table 6.2 in the comparison, both shown", _ultrasonic,
    ),
    Erratum(
        26, "Appendix D", "PID 0.5 / 0.1 / 0.5, sample time 0.01 s, windows of 1000 points",
        "without anti-windup the slow return empties the integral by several times the range of "
        "the output each cycle; a derivative per second exceeds the whole output at the speeds "
        "reported, and slows the rise (A1 measures it); 1000 points do not fit into a hold",
        "integration only while the output is not saturated, derivative per sample, 1 ms logging",
        _cycle_pid,
        (
            Quote("Appendix D", "analyzed with a sample-time of 0.01s"),
            Quote("Appendix D", "the percentage of 1000 sample points"),
        ),
    ),
    Erratum(
        27, "Sections 5.1, 5.2.2, Appendix D, Figure 5.25", "ambient, bias, labels",
        "ambient 25 or 23 degC; bias by a spring beside the flexure or by the flexure alone; "
        "Figure 5.25 has two parts (b)",
        "25 degC on the stage, 23 degC in the cycle tests; flexure and spring; (a), (b), (c)", None,
        (
            Quote("5.2.2", "the ambient temperature is assumed to be 25"),
            Quote("Appendix D", "an ambient temperature of approximately 23"),
            Quote("5", "in series with a linear flexure guide and a bias spring"),
            Quote("Appendix D", "to create linear motion as well as a bias force"),
            Quote("Figure 5.25", "(b) Integral Effort, and (b) Position Response"),
        ),
    ),
    Erratum(
        36, "Tables 2.1 and 6.2", "1500-5000 and 1500 USD for the DC motor",
        "the comparison takes the lowest price of the range", "the range, where it is shown",
        _motor,
    ),
    Erratum(
        37, "Section 2.2.1, Table 2.1", "ultrasonic drive: range unlimited",
        "the text limits it to the track", "unlimited by the drive, limited by its track", None,
        (
            Quote("Table 2.1", "unlimited"),
            Quote("2.2.1", "strokes limited to the length of the track"),
        ),
    ),
    Erratum(
        38, "Sections 6.1 and 6.3", "when the laser is reset",
        "after each macro move in one section, after each cycle of moves in another; a bias "
        "within a cycle needs the first",
        "after every macro move", None,
        (
            Quote("6.1", "the laser is reset after the macro-stage reaches its setpoint"),
            Quote("6.3", "the laser measurement system is reset after every cycle"),
        ),
    ),
    Erratum(
        39, "Section 6.4.1, Chapter 7", "the 2 um of the laser",
        "noise of a system at rest in one place, an oscillation under operation in the other",
        "noise at rest (I5), and its effect under laser feedback (I7)", None,
        (
            Quote("6.4.1", "If the system is placed at rest and laser measurement is used"),
            Quote("7", "Under operation, it was found that"),
        ),
    ),
    Erratum(
        40, "Sections 1.2 and 6.4.3", "a low-cost system below 500 USD",
        "only the micro-stage is ever summed; carriage, converter board and laser are not",
        "Table 6.1 is the cost of the micro-stage, the objective stays unproved", _budget,
        (
            Quote("1.2", "low-cost (<$500) linear macro-micro positioning system"),
            Quote("Table 6.1", "Cost Breakdown of Micro-Stage"),
        ),
    ),
    Erratum(
        41, "Sections 5.3.2 and 6.4.2", "a cycle of 2 s",
        "the settling times of one contraction and one extension add up to less, and which steps "
        "the cycle counts is not said",
        "a cycle's time together with the steps it counts (I6)", _cycle_time,
        (
            Quote("5.3.2", "approximately 0.5 seconds in contraction and 1 second for extension"),
            Quote("6.4.2", "a cycle time of approximately 2 seconds is achieved"),
        ),
    ),
)  # fmt: skip
