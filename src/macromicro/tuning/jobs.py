"""The batch engine's jobs, as a tuning uses them: which paths carry gains, which a bench."""

from __future__ import annotations

from macromicro.settings import Settings
from macromicro.tuning.engine import Engine
from macromicro.tuning.ensemble import Ensemble
from macromicro.tuning.laws import Law

MODELLED = ("pd-initial", "pd-tuned")
MODELLED_WORDS = "the PD laws alone"
MODEL_GAINS = ("controller.now", "controller.before")
MODEL_PLANT = ("model.a", "model.b", "model.width")


def block(name: str) -> int:
    """Variants that the job computes together."""
    from macromicro import batch

    return int(batch.job(name).block)


def engine(name: str, settings: Settings, law: Law, ensemble: Ensemble | None) -> Engine:
    """The engine of a job on the settings' bench, or on an ensemble of such benches."""
    from macromicro import batch

    if name == "macro-model":
        job = batch.job(name)
        if ensemble is None:
            return Engine(job, MODEL_GAINS)
        model = job.base().model
        members = ensemble.on_model(model.a, model.b, model.width)
        return Engine(job, MODEL_GAINS, MODEL_PLANT, members)
    job = batch.job(name, settings=settings)
    if ensemble is None:
        return Engine(job, law.paths)
    return Engine(job, law.paths, *ensemble.on_bench(settings))
