"""Errata of Chapters 1, 2, 6, 7 and Appendix D: costs, the whole system, cycle tests."""

from __future__ import annotations

from macromicro.design import costs
from macromicro.thesis.errata.entry import Figure


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


EVIDENCE = {
    16: _ultrasonic,
    26: _cycle_pid,
    36: _motor,
    40: _budget,
    41: _cycle_time,
}
