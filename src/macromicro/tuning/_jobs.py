"""The batch engine's jobs for tuning: the paths of gains, and those of the bench."""

from __future__ import annotations

from macromicro.control import settings as control_settings
from macromicro.settings import Settings
from macromicro.tuning._engine import Engine
from macromicro.tuning._ensemble import Ensemble
from macromicro.tuning._laws import Law

MODEL = "macro-model"
MODELLED = ("pd-initial", "pd-tuned")
MODELLED_WORDS = "the PD laws alone"
MODEL_GAINS = ("controller.now", "controller.before")
MODEL_PLANT = ("model.a", "model.b", "model.width")


def unit(name: str) -> int:
    """Number of variants that one pass of a job computes at the cost of one."""
    if name != MODEL:
        return 1
    from macromicro.batch.lanes import UNIT

    return UNIT


def engine(name: str, settings: Settings, law: Law, ensemble: Ensemble | None) -> Engine:
    """The engine of a job on the settings' bench, or on an ensemble.

    The thesis' model takes the dead-zone inverse and the limit of the settings' law, and its own
    parameters as printed.
    """
    from macromicro import batch
    from macromicro.batch.macro_model import MacroLoop

    if name != MODEL:
        job = batch.job(name, settings=settings)
        if ensemble is None:
            return Engine(job, law.paths)
        return Engine(job, law.paths, *ensemble.on_bench())
    chosen = control_settings.prepare(settings.controller).macro
    tree = MacroLoop()
    lifted = tree.controller._replace(dead_zone=chosen.dead_zone, limit=chosen.limit)
    job = batch.job(name, tree=tree._replace(controller=lifted))
    if ensemble is None:
        return Engine(job, MODEL_GAINS)
    members = ensemble.on_model(tree.model.a, tree.model.b, tree.model.width)
    return Engine(job, MODEL_GAINS, MODEL_PLANT, members)
