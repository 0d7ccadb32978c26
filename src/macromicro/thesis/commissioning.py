"""The two-stage machine commissioned: directions, procedures, models, laws, verification.

The recordings and the model of a step stay in a folder of their own, so that an interrupted
commissioning continues there. Without a kiln the micro-stage gets the law without a wire model.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.conformance import perform
from macromicro.control.outside import FINE, SHIPPED
from macromicro.errors import MacromicroError, ProblemError
from macromicro.identify.kinds import from_files
from macromicro.identify.result import MODEL, RESULT
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.rig import contract
from macromicro.rig.opening import TWIN
from macromicro.rig.session import BENCH, KILN, Fixture
from macromicro.rig.twin import CompiledTwin
from macromicro.runs import folder, job
from macromicro.schema import config
from macromicro.schema.text import write_text
from macromicro.settings import Settings
from macromicro.thesis import collecting
from macromicro.thesis.procedure import Lab
from macromicro.types import Sample

STEPS, MACHINE, ASKED, DIRECTIONS = "steps", "machine.toml", "asked.json", "directions.json"
VERIFICATION, PROGRAMME = "verification", "fast"
MACRO_LAW, (MODELLED, PLAIN) = next(iter(SHIPPED)), tuple(FINE)
# Both stages at once, and no wait that nothing needs: the laws leave no swing to wait for.
SEQUENCE = {
    "controller.sequence.overlap": "1",
    "controller.sequence.dwell": "50 ms",
    "controller.sequence.wait": "0.1 s",
}
_EFFORTS, _HEAT = (3.5, 4.2, 5.0), 1.6  # V


class Part(NamedTuple):
    """A procedure and the model identified from it."""

    name: str  # of the procedure, and of its folder
    kind: str  # of the identification
    files: str  # those of its recordings that are taken, as a pattern
    options: Callable[[Path], dict[str, Any]]  # of the identification, from the folder of all parts


CARRIAGE = Part("carriage", "carriage", "*.h5", lambda parts: {})
OVEN = Part("kiln", "hysteresis", "cycles.h5", lambda parts: {"shape": "nonnegative"})
ACTUATOR = Part(
    "actuator", "actuator", "*.h5", lambda parts: {"table": parts / "kiln" / "model" / "table.h5"}
)


class Commissioned(NamedTuple):
    out: Path  # its folder
    found: dict[str, Mapping[str, Any]]  # each part's result.json
    toml: str  # the machine's file
    ended: job.Ended  # the verification
    doubts: list[str]  # what a person should look at

    @property
    def met(self) -> bool:
        """Whether every move of the verification arrived without a fault of the guard."""
        return not self.why

    @property
    def why(self) -> str:
        """Why the verification failed; "" if it did not."""
        if self.ended.fault is not None:
            return f"{self.ended.fault.message} {self.ended.fault.evidence}"
        if not self.ended.finished:
            return "the programme did not finish"
        late = [str(m.move + 1) for m in self.ended.moves if m.arrived_s is None]
        return f"move {', '.join(late)} did not arrive" if late else ""


def parts(lab: Lab) -> tuple[Part, ...]:
    """The procedures that the machines of a lab allow."""
    kiln = not lab.rigs or any(rig.kind == KILN for rig in lab.rigs)
    return (CARRIAGE, OVEN, ACTUATOR) if kiln else (CARRIAGE,)


def commission(
    lab: Lab,
    out: Path,
    ask: Callable[[str, str], None] = lambda title, intent: None,
    done: Callable[[str], None] = lambda title: None,
) -> Commissioned:
    wanted = parts(lab)
    for part in wanted:
        lab.check(collecting.find(part.name))
    _same(lab, out)
    if not (out / DIRECTIONS).exists():
        ask("directions", "both stages, a short distance; the voltage is increased until they move")
        said = _directions(_bench(lab))
        write_text(out / DIRECTIONS, json.dumps(said, indent=2) + "\n")
        done("directions")
    found = {part.name: _compute_once(lab, part, out / STEPS, ask, done) for part in wanted}
    tree = machine(lab.settings, [out / STEPS / p.name / "model" / MODEL for p in wanted])
    chosen = ("controller.macro_law", "controller.micro_law")
    head = "# The two-stage machine as commissioned: macromicro run --config machine.toml\n\n"
    toml = head + config.changed_toml(tree, Settings(), chosen)
    write_text(out / MACHINE, toml)
    ask(VERIFICATION, f"the programme {PROGRAMME}, by the laws {MACRO_LAW} and {_micro(tree)}")
    ended = _verify(lab, out)
    done(VERIFICATION)
    doubts = [f"{name}: {text}" for name, one in found.items() for text in one["warnings"]]
    if len(wanted) == 1:
        why = f"No kiln: the micro-stage uses the law {PLAIN} with the gains of the shipped bench."
        doubts.append(why)
    return Commissioned(out, found, toml, ended, doubts)


def machine(base: Settings, models: list[Path]) -> Settings:
    tree = base._replace(controller=base.controller.joined(PLAIN, MACHINE))
    for path in models:
        if path.parent.parent.name != OVEN.name:
            tree = config.load_overrides(path, tree)
    return config.overridden(tree, SEQUENCE, MACHINE)


def _micro(tree: Settings) -> str:
    return str(tree.controller.micro_law)


def _same(lab: Lab, out: Path) -> None:
    """Refuse to continue a commissioning of another machine or seed."""
    rigs = [rig.name for rig in lab.rigs] or [TWIN]
    asked = {
        "rigs": rigs,
        "seed": lab.seed,
        "settings": config.difference(lab.settings, Settings()),
    }
    place = out / ASKED
    out.mkdir(parents=True, exist_ok=True)
    if place.exists() and json.loads(place.read_text(encoding="utf-8")) != asked:
        raise ProblemError(
            f"--out {out}",
            "begun with another rig or seed",
            "Choose another folder or add --overwrite.",
        )
    write_text(place, json.dumps(asked, indent=2) + "\n")


def _bench(lab: Lab) -> Fixture:
    if lab.rigs:
        return lab.rig(BENCH)
    plant = bench.prepare(lab.settings.bench, lab.settings.sensors)
    return Fixture(TWIN, BENCH, lambda seed: CompiledTwin(plant, seed), Sample._fields[1:], PERIOD)


def _directions(rig: Fixture) -> list[str]:
    """The directions found; raises where a stage does not move, or the wrong way."""
    said = []
    for volts in _EFFORTS:
        with rig.open() as session:
            there = contract.stroke(rig, session, volts)
            back = contract.stroke(rig, session, -volts)
        ways = perform(contract.DIRECTION, rig, volts, there, back)
        found = next(ways)
        if found.passed or there.moved < 0.0 < back.moved:
            break
    for one in (found, *perform(contract.HEAT, rig, _HEAT)):
        if not one.passed:
            raise MacromicroError(f"{one.what}: {one.found}; {one.remedy}")
        said.append(f"{one.what}: {one.found}")
    return said


def _compute_once(
    lab: Lab, part: Part, every: Path, ask: Callable[[str, str], None], done: Callable[[str], None]
) -> Mapping[str, Any]:
    """A part's result, computed if it is not there yet."""
    place, procedure = every / part.name, collecting.find(part.name)
    if not list(place.glob(part.files)):
        ask(part.name, f"{procedure.gives}; {procedure.needs}")
        recordings = collecting.check(procedure.collect(lab), part.name)
        with folder.staging(place) as stage:
            for name, recording in recordings.items():
                recording.save(stage / f"{name}.h5")
    if not (place / "model" / RESULT).exists():
        result = from_files(part.kind, sorted(place.glob(part.files)), **part.options(every))
        with folder.staging(place / "model") as stage:
            result.save(stage)
        done(part.name)
    found: Mapping[str, Any] = json.loads((place / "model" / RESULT).read_text(encoding="utf-8"))
    return found


def _verify(lab: Lab, out: Path) -> job.Ended:
    rig = lab.rig(BENCH).name if lab.rigs else TWIN
    request = job.Request(
        PROGRAMME, out / VERIFICATION, out / MACHINE, seed=lab.seed, overwrite=True, rig=rig
    )
    checked = job.check(request)
    with folder.locked(checked.out, overwrite=True):
        return job.execute(checked)
