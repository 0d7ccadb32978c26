"""A machine of one stage: the gains of its law on its moves.

Beside any objective there are two penalties: a share of it for each tolerance of overshoot, and
for each percent of the effort's limit that the effort changes by, rms, from period to period.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from macromicro import place as places
from macromicro.errors import ProblemError
from macromicro.machines import loops
from macromicro.machines.composite import AnyMachine
from macromicro.machines.loops import Complex
from macromicro.machines.machine import KEY, Machine
from macromicro.machines.runs import StageSetup
from macromicro.machines.tree import gains_set
from macromicro.recording import Recording
from macromicro.schema import config
from macromicro.schema.par import changed, entries, value_at
from macromicro.tuning.subject import (
    Bode,
    Figures,
    Knob,
    Margin,
    Objective,
    Panel,
    Penalty,
    Subject,
)
from macromicro.uncertainty import stages
from macromicro.uncertainty.table import Uncertain

# Gains that are searched, by law.
KNOBS = {
    "cascade": (
        "controller.position",
        "controller.velocity",
        "controller.integral",
        "controller.observer",
    ),
    "integral": ("controller.integral", "controller.drift", "controller.ahead_velocity"),
    "pi": ("controller.kp", "controller.ki", "controller.ahead_velocity"),
}
LINEAR: dict[str, Callable[..., Complex]] = {
    "cascade": loops.law,
    "pi": loops.pi,
}  # laws with a linear model
WIDE = 4.0  # a gain is searched from a fourth of its value to four times as much
DIGITS = 4  # of a gain, as it is tried, shown and written
OVERSHOOT, ROUGH = 0.5, 0.2  # weights
_SLOWEST = 1e-4  # of the highest frequency of a Bode plot


def objectives(settings: Any, place: places.Place) -> tuple[Objective, ...]:
    tolerance = float(settings.arrival.tolerance * place.fines)
    effort = float(settings.guard.effort)

    def objective(
        name: str, unit: str, meaning: str, value: Callable[[Figures], float]
    ) -> Objective:
        def over(found: Figures, _: Figures) -> float:
            return value(found) * found["overshoot"] / tolerance

        def rough(found: Figures, _: Figures) -> float:
            return value(found) * 100.0 * found["rough"] / effort

        penalties = (
            Penalty("overshoot", OVERSHOOT, "x the objective", "overshoot in tolerances", over),
            Penalty("rough", ROUGH, "x the objective", "rms change of the effort, %", rough),
        )
        return Objective(name, unit, meaning, value, penalties)

    return (
        objective(
            "settling",
            "s",
            "mean time from the end of a profile to the arrival, and 1 ms for each tolerance of "
            "rms error on the way",
            lambda t: t["mean_settling"] + 1e-3 * t["rms_error"] / tolerance,
        ),
        objective(
            "error",
            place.fine,
            "rms distance from the set point on the way",
            lambda t: t["rms_error"],
        ),
        objective("rest", place.fine, "largest true error at rest", lambda t: t["true_error"]),
    )


def searched_gains(machine: Machine, settings: Any) -> tuple[str, ...]:
    """Paths of the gains that are searched."""
    if machine.law.name in KNOBS:
        return KNOBS[machine.law.name]
    which = gains_set(settings)
    found = tuple(
        e.path
        for e in entries(value_at(settings, which), f"{which}.")
        if isinstance(e.value, float) and e.value > 0.0
    )
    if not found:
        raise ProblemError(which, f"{machine.law.name} has no gain above zero to search")
    return found


class Planned(Subject):
    """A machine of one stage or of several with the moves that it is judged by."""

    def __init__(self, machine: AnyMachine, settings: Any, plan: Any) -> None:
        self.kind, self.start, self.plan = machine, settings, plan
        self.setup = StageSetup(machine, settings, plan)
        self.name = self.machine = machine.name
        self.default, self.metrics = machine.settings, self.setup.metrics

    def knobs(self, settings: Any) -> tuple[Knob, ...]:
        units = {e.path: e.par.unit for e in entries(settings)}
        values = [(path, float(value_at(settings, path))) for path in self.paths]
        return tuple(Knob(p, units[p], v / WIDE, v * WIDE, v) for p, v in values)

    def applied(self, settings: Any, values: Sequence[float]) -> Any:
        gains = [float(f"{value:.{DIGITS}g}") for value in values]
        return changed(settings, dict(zip(self.paths, gains, strict=True)))

    def prepare(self) -> None:
        self.setup.compile()

    def run(self, settings: Any, seed: int) -> Figures:
        values = self.setup.with_settings(settings).trial(seed)
        return dict(zip((metric.name for metric in self.metrics), values, strict=True))

    def recorded(self, settings: Any, seed: int) -> Recording:
        return self.setup.with_settings(settings).simulate(seed)[0]

    @property
    def uncertain(self) -> tuple[Uncertain, ...]:
        return self.setup.uncertain()

    def under(self, settings: Any, other: Any) -> Any:
        return stages.keep_settings(self.kind, settings, other)

    def allowed(self, settings: Any) -> bool:
        return not any(own.together() for own in self.kind.trees(settings))

    def as_toml(self, settings: Any) -> str:
        body = config.changed_toml(settings, self.default, self.paths)
        return f"{KEY} = {self.kind.written}\n{body}"


class Stage(Planned):
    """`check` refuses gains before they are tried, beside the rules of the settings."""

    kind: Machine

    def __init__(
        self,
        machine: Machine,
        settings: Any,
        plan: Any,
        check: Callable[[Any], bool] = lambda settings: True,
    ) -> None:
        super().__init__(machine, settings, plan)
        self.check, self.law, self.place = check, machine.law.name, machine.kind.place
        self.paths = searched_gains(machine, settings)
        self.objectives = objectives(settings, self.place)

    def allowed(self, settings: Any) -> bool:
        return super().allowed(settings) and self.check(settings)

    def panels(self, settings: Any, seed: int) -> list[Panel]:
        r = self.recorded(settings, seed)
        error = (r["target"] - r["position"]) * 1e3
        band = self.start.arrival.tolerance * self.place.fines
        return [
            Panel(
                "Set point minus position; dotted: tolerance", self.place.fine, r["t"], error, band
            ),
            Panel("Effort at the D/A", "V", r["t"], r["effort"]),
        ]

    def bodes(self, settings: Any) -> tuple[Bode, ...]:
        law = LINEAR.get(self.law)
        if law is None or self.kind.model is None:
            return ()
        dt = settings.timing.period
        frequency = loops.grid(dt, _SLOWEST * 0.5 / dt)
        loop = self.kind.model(settings, frequency) * law(settings.controller, frequency, dt)
        return (Bode(frequency, loop, "Open loop, linear model"),)

    def margins(self, settings: Any) -> tuple[Margin, ...]:
        bodes = self.bodes(settings)
        if not bodes:
            return ()
        found = loops.margins(bodes[0].frequency, bodes[0].loop)
        return (
            Margin("crossover", "crossover", found.crossover, "Hz"),
            Margin("phase", "phase margin", found.phase, "deg"),
            Margin("gain", "gain margin (factor)", found.gain, ""),
            Margin("modulus", "modulus margin", found.modulus, ""),
        )

    def doubts(self, settings: Any, found: Figures) -> tuple[str, ...]:
        modulus = [m.value for m in self.margins(settings) if m.name == "modulus"]
        if not modulus or modulus[0] >= loops.MODULUS:
            return ()
        return (
            f"The modulus margin {modulus[0]:.2g} is below {loops.MODULUS:g}: a machine that "
            "differs a little may oscillate. --robust searches on machines that differ.",
        )
