"""The experiments of `collect`: of the two-stage machine, and of the stages of any other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.commands.signals import Signals
from macromicro.commission import collecting as of_stages
from macromicro.machines import compositions, on_rig
from macromicro.recording import Recording
from macromicro.rig.opening import TWIN, open_rig
from macromicro.settings import Settings, choose
from macromicro.thesis import collecting as of_bench
from macromicro.thesis.procedure import Lab

_MOST = 40_000_000  # bytes of the recording of a stage


class Asked(NamedTuple):
    config: Path | None
    rig: str
    seed: int


class Experiment(NamedTuple):
    stage: str  # folder of its recordings within that of all; "" of an only stage
    where: str  # what it runs on
    size: int  # bytes of its recordings, at most
    collect: Callable[[Signals], dict[str, Recording]]  # by file name


class Chosen(NamedTuple):
    name: str
    then: str  # what to do with the recordings; {out} is their folder
    each: list[Experiment]


def list_experiments(config: Path | None) -> Iterator[str]:
    """The experiments of the machine of a settings file."""
    stages: list[Any] = []
    if config is not None and not compositions.is_two_stage(config):
        stages = compositions.each(config)
    stage = stages[0][0] if stages else ""
    for one in _all(stages):
        yield f"{one.name:16}{one.gives}"
        if needs := getattr(one, "needs", ""):
            yield f"{'':16}needs: {needs}"
        yield f"{'':16}then: {following(one.then, Path('results') / one.name / stage)}"
    if stage:
        yield f"{'':16}of each axis: {', '.join(name for name, _, _ in stages)}"


def following(then: str, out: Path) -> str:
    return then.replace("{out}", str(out))


def _all(stages: list[Any]) -> tuple[Any, ...]:
    if not stages:
        return of_bench.PROCEDURES
    return tuple(p for p in of_stages.PROCEDURES if stages[0][1].name in p.machines)


def find(experiment: str, asked: Asked) -> Chosen:
    """The experiment of a name on the machine of a settings file."""
    if compositions.is_two_stage(asked.config):
        return _on_bench(experiment, asked)
    return _on_stages(experiment, asked)


def _on_bench(experiment: str, asked: Asked) -> Chosen:
    procedure = of_bench.find(experiment)
    settings = choose(Settings(), asked.config, None)
    twin = asked.rig == TWIN
    rigs = () if twin else (open_rig(asked.rig, asked.seed, limits=settings.guard),)
    lab = Lab(settings, asked.seed, rigs)
    lab.check(procedure)

    def collect(signals: Signals) -> dict[str, Recording]:
        recordings = of_bench.check(procedure.collect(lab), procedure.name)
        signals.later()
        return recordings

    where = "the twin" if twin else asked.rig
    one = Experiment("", where, procedure.megabytes * 1_000_000, collect)
    return Chosen(procedure.name, procedure.then, [one])


def _on_stages(experiment: str, asked: Asked) -> Chosen:
    assert asked.config is not None  # which names the machine
    stages = compositions.each(asked.config)
    procedure = of_stages.find(experiment, stages[0][1])
    names = tuple(name for name, _, _ in stages)
    several = asked.rig != TWIN and names != ("",)
    rigs = on_rig.rig_names(asked.rig, names) if several else [asked.rig] * len(stages)

    def of(rig: str, stage: tuple[str, Any, Any]) -> Experiment:
        name, machine, tree = stage

        def collect(signals: Signals) -> dict[str, Recording]:
            signals.later()
            opened = None if rig == TWIN else on_rig.one(rig, tree, asked.seed).make(asked.seed)
            given = of_stages.Given(machine, tree, opened, asked.seed)
            recording = procedure.collect(given, lambda: bool(signals.received))
            return {procedure.name: recording}

        simulated = f"the simulated {machine.name}{f' {name}' if name else ''}"
        return Experiment(name, simulated if rig == TWIN else rig, _MOST, collect)

    return Chosen(procedure.name, procedure.then, list(map(of, rigs, stages)))
