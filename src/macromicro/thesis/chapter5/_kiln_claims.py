"""The kiln's recordings evaluated (Section 5.2.1): claims S1, S2 and S6."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.hysteresis.table import FodTable
from macromicro.identify import kiln as kiln_fit
from macromicro.identify.kiln import Prediction
from macromicro.identify.smoothing import without_spikes
from macromicro.recording import Recording
from macromicro.thesis.chapter5.actuator_fits import full_contraction
from macromicro.thesis.chapter5.kiln_runs import KilnData
from macromicro.thesis.claims import NOT_MEASURED, Claim, judged, stated, within

TRUTH = "true_thermocouple"
ENCODER_MM = 0.014  # a count of the kiln's encoder, Section 5.2.1


class KilnRuns(NamedTuple):
    heated: KilnData  # as recorded
    table: FodTable  # of Figure 5.8, from the heating cycles
    predictions: list[Prediction]  # by (5.1), one for each new profile


def identified(heated: KilnData) -> KilnRuns:
    table = kiln_fit.fod_table([heated.curves])
    return KilnRuns(heated, table, [kiln_fit.predicted(table, r) for r in heated.tests])


class Spikes(NamedTuple):
    """Effect of the smoothing; errors against the true temperature [K], NaN if unknown."""

    spikes: int
    changed: float  # share of the samples
    largest: float  # change [K]
    raw_max: float = np.nan
    raw_rms: float = np.nan
    smooth_rms: float = np.nan


def spikes(recording: Recording) -> Spikes:
    """Smoothing of Figure 5.4; its errors are NaN where the true temperature is not known."""
    shown = recording["thermocouple"]
    smooth = without_spikes(recording["t"], shown)
    seen = Spikes(
        smooth.spikes,
        float(smooth.replaced.mean()),
        float(np.abs(smooth.values - shown).max()),
    )
    if TRUTH not in recording:
        return seen
    raw, left = shown - recording[TRUTH], smooth.values - recording[TRUTH]
    return seen._replace(
        raw_max=float(np.abs(raw).max()),
        raw_rms=float(np.sqrt(np.mean(raw**2))),
        smooth_rms=float(np.sqrt(np.mean(left**2))),
    )


def claims(runs: KilnRuns) -> list[Claim]:
    return judged(
        [
            ("S1", lambda: _spikes(spikes(runs.heated.curves))),
            ("S2", lambda: _preisach(runs)),
            ("S6", lambda: _full(runs.table)),
        ]
    )


def _spikes(s: Spikes) -> Claim:
    share = 100.0 * s.changed
    if not np.isfinite(s.smooth_rms):
        return stated("S1", None, NOT_MEASURED, "unknown", seen=s, share=share)
    verdict = within("S1", s.raw_max, s.smooth_rms)
    return stated("S1", [s.raw_max, s.smooth_rms], verdict, "compared", seen=s, share=share)


def _preisach(runs: KilnRuns) -> Claim:
    worst = 100.0 * max(p.share for p in runs.predictions)
    return stated("S2", worst, within("S2", worst), profiles=len(runs.predictions))


def _full(table: FodTable) -> Claim:
    full = full_contraction(table, ENCODER_MM / table.span)
    return stated(
        "S6",
        full,
        within("S6", full),
        count=1e3 * ENCODER_MM,
        share=100.0 * ENCODER_MM / table.span,
        early=full_contraction(table),
    )
