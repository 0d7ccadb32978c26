"""Figures of a run of a machine of one stage: the run over time, and how its moves settle."""

from __future__ import annotations

from macromicro.drawing.page import PageFigure
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, RED, finish, line, new, single
from macromicro.report.run import CAPTIONS
from macromicro.runs.job import Ended


def response(ended: Ended) -> PageFigure:
    """Position with its set point, error and effort over the run."""
    r = ended.recording
    place = ended.job.setup.machine.kind.place
    t, band = r["t"], ended.job.settings.arrival.tolerance * place.fines
    figure, axes = new(7.4, 3, sharex=True)
    places, errors, efforts = axes[:, 0]
    line(places, t, r["target"], BLACK, "set point", linewidth=0.9, linestyle="--")
    line(places, t, r["position"], BLUE, "position")
    finish(places, "Position", "", f"[{place.unit}]", legend=True)
    line(errors, t, (r["target"] - r["position"]) * 1e3, RED, "error")
    for edge in (-band, band):
        errors.axhline(edge, color=GREEN, linewidth=0.8, linestyle=":")
    finish(errors, "Set point minus position; dotted: tolerance", "", f"[{place.fine}]")
    line(efforts, t, r["effort"], ORANGE, "effort")
    if "integral" in r:
        line(efforts, t, r["integral"], BLACK, "its integral part", linewidth=0.8)
    finish(efforts, "Effort at the D/A", y="[V]", legend=True)
    figure.subplots_adjust(hspace=0.28)
    return CAPTIONS["response of a stage"].page("response", figure)


def settling(ended: Ended) -> PageFigure:
    r = ended.recording
    place = ended.job.setup.machine.kind.place
    band = ended.job.settings.arrival.tolerance * place.fines
    figure, ax = single(3.6)
    error = (r["target"] - r["position"]) * 1e3
    colors = (BLUE, RED, GREEN, ORANGE)
    shown = ended.moves[:4]
    for m, color in zip(shown, colors, strict=False):
        since = r["t"] - m.start_s - m.profile_s
        rows = (r["move"] == m.move) & (since > -0.05) & (since < 0.25)
        line(ax, since[rows] * 1e3, error[rows], color, f"move {m.move + 1}")
    for edge in (-band, band):
        ax.axhline(edge, color=BLACK, linewidth=0.8, linestyle=":")
    finish(
        ax,
        "Error around the end of the profile; dotted: tolerance",
        "time since the profile's end [ms]",
        f"[{place.fine}]",
        legend=True,
    )
    which = "each move" if len(shown) == len(ended.moves) else "the first moves"
    return CAPTIONS["moves"].page("moves", figure, which=which)
