"""The summary of a run: the figures of the page, for programs."""

from __future__ import annotations

import json
from typing import Any

import macromicro
from macromicro.runs.job import Ended
from macromicro.schema.text import plain


def summary(ended: Ended, started: str) -> dict[str, Any]:
    job = ended.job
    fault = ended.fault
    return {
        "programme": job.programme.title,
        "source": job.programme.source,
        "cycles": job.request.cycles,
        "fan": job.request.fan,
        "seed": job.request.seed,
        "version": macromicro.__version__,
        "started": started,
        "overrides": job.overrides,
        "finished": ended.finished,
        "fault": fault and fault._asdict(),
        "moves_planned": len(job.programme.target),
        "simulated_s": ended.simulated,
        "wall_s": ended.wall,
        "speed": ended.simulated / ended.wall if ended.wall > 0.0 else None,
        "moves_begun": ended.begun,
        "tracking": [t._asdict() for t in ended.tracking],
        "profiles": [p._asdict() for p in ended.profiles],
        "moves": [m._asdict() for m in ended.moves],
        "vibration": [v._asdict() for v in ended.vibration],
        "extension": [c._asdict() for c in ended.cycles],
    }


def as_json(content: dict[str, Any]) -> str:
    """JSON with null for NaN and infinity."""
    return json.dumps(plain(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
