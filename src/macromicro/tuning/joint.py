"""A machine of several stages on one clock: each by itself, then all together, for the path.

The distance from the path is the difference of the axes' errors, so equal lag of both axes stays
on a straight line. So both position gains at the lower of the two are tried as well.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from macromicro import place as places
from macromicro.machines import planning as single
from macromicro.machines import results
from macromicro.machines.composite import Composite, names
from macromicro.machines.joint import contour
from macromicro.machines.planning import Schedule
from macromicro.recording import Recording
from macromicro.schema.par import changed, value_at
from macromicro.tuning.stage import ROUGH, Planned, Stage
from macromicro.tuning.subject import Bode, Figures, Margin, Objective, Panel, Penalty

MATCHED = "matched"
POSITION = "controller.position"


class Joint(Planned):
    kind: Composite
    parts: tuple[tuple[str, Stage], ...]

    def __init__(self, machine: Composite, settings: Any, plan: Schedule) -> None:
        super().__init__(machine, settings, plan)
        trees = zip(machine.stages, machine.trees(settings), strict=True)
        self.parts = tuple(
            (name, Stage(own, tree, single.plan(single.usual(tree), tree)))
            for (name, own), tree in trees
        )
        self.law = ", ".join(dict.fromkeys(part.law for _, part in self.parts))
        self.paths = tuple(f"{name}.{path}" for name, part in self.parts for path in part.paths)
        self.objectives = (self._cost(),)

    def objective(self, name: str) -> Objective:
        """The path's, or that of all errors; the name is for each stage alone."""
        for _, part in self.parts:
            part.objective(name)
        return self.objectives[0]

    def _cost(self) -> Objective:
        own = dict(zip(names(self.kind), self.kind.trees(self.start), strict=True))
        tolerances = {
            name: float(tree.arrival.tolerance * places.of(tree).fines)
            for name, tree in own.items()
        }

        def errors(found: Figures) -> float:
            return max(
                found[f"peak_error_{name}"] / tolerance for name, tolerance in tolerances.items()
            )

        def contour_error(found: Figures) -> float:
            return found["rms_contour"]

        plane = self.kind.has_plane
        value = contour_error if plane else errors

        def rough(found: Figures, _: Figures) -> float:
            each = [
                100.0 * found[f"rough_{name}"] / tree.guard.effort for name, tree in own.items()
            ]
            return value(found) * float(np.mean(each))

        words = "rms change of the effort, %, mean of the stages"
        penalties = (Penalty("rough", ROUGH, "x the objective", words, rough),)
        if plane:
            return Objective("contour", "um", "rms distance from the path", value, penalties)
        words = "largest distance from the set point in tolerances, of the worst stage"
        return Objective("errors", "", words, value, penalties)

    def further(self, settings: Any) -> list[tuple[str, Any]]:
        """All axes with the lowest of their position gains, of a machine with a plane."""
        trees = self.kind.trees(settings)
        if not self.kind.has_plane or any(own.law != own._field_defaults["law"] for own in trees):
            return []
        lower = min(value_at(own, POSITION) for own in trees)
        gains = {f"{name}.{POSITION}": lower for name in names(self.kind)}
        return [(MATCHED, changed(settings, gains))]

    def _parts(self, settings: Any) -> Iterator[tuple[str, Stage, Any]]:
        for (name, part), own in zip(self.parts, self.kind.trees(settings), strict=True):
            yield name, part, own

    def bodes(self, settings: Any) -> tuple[Bode, ...]:
        return tuple(
            bode._replace(title=f"{name}: {bode.title}")
            for name, part, own in self._parts(settings)
            for bode in part.bodes(own)
        )

    def margins(self, settings: Any) -> tuple[Margin, ...]:
        return tuple(
            margin._replace(name=f"{name}.{margin.name}", meaning=f"{name}: {margin.meaning}")
            for name, part, own in self._parts(settings)
            for margin in part.margins(own)
        )

    def doubts(self, settings: Any, found: Figures) -> tuple[str, ...]:
        return tuple(
            f"{name}: {text}"
            for name, part, own in self._parts(settings)
            for text in part.doubts(own, found)
        )

    def panels(self, settings: Any, seed: int) -> list[Panel]:
        r = self.recorded(settings, seed)
        if self.kind.has_plane:
            title = "Distance from the path; dotted: tolerance"
            off = self._distance(r)
            return [Panel(title, "um", r["t"], off, 1e6 * settings.path.tolerance)]
        found = []
        for name, own in zip(names(self.kind), self.kind.trees(settings), strict=True):
            fine, error = places.of(own), 1e3 * (r[f"{name}_target"] - r[f"{name}_position"])
            band = own.arrival.tolerance * fine.fines
            title = f"{name}: set point minus position; dotted: tolerance"
            found.append(Panel(title, fine.fine, r["t"], error, band))
        return found

    def _distance(self, r: Recording) -> Any:
        """Distance from the path, um; NaN where there is none."""
        found = np.full(len(r), np.nan)
        for k, trace in enumerate(self.plan.traces):
            part = results.under_way(r, self.plan, k)
            if trace.pieces and part.stop > part.start:
                x, y = (1e-3 * results.fill_gaps(r[f"{n}_position"][part]) for n in "xy")
                found[part] = 1e6 * contour.contour_error(trace, x, y).distance
        return found
