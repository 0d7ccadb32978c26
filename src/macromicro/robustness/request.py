"""What a user asks to study: any machine with a programme, as the command and Python say it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.batch import cores
from macromicro.machines import setups
from macromicro.robustness import subject as subjects
from macromicro.robustness.requirements import load
from macromicro.robustness.study import Request
from macromicro.robustness.subject import Subject
from macromicro.runs.setup import Setup
from macromicro.schema import keys
from macromicro.uncertainty.machines import check_count

MAX_WORKERS = 256


class Ready(NamedTuple):
    setup: Setup
    subject: Subject
    programme: str  # as it was named; "" for the machine's usual moves
    place: str  # end of the folder's name
    fan: bool = False

    def request(self, samples: int, seed: int, limits: Path | None) -> Request:
        check_count(samples)
        keys.seed(seed, "--seed")
        needed = self.subject.required
        if limits is not None:
            needed = load(limits, self.subject.metrics[:-1], needed)
        return Request(self.setup.settings, needed, samples, seed)


def ready(
    path: Path | None,
    programme: str | None,
    law: str | None,
    workers: int | None,
    *,
    settings: Any = None,
    fan: bool = False,
    variants: bool = False,
) -> Ready:
    """A study of the machine of a settings file; `settings` replace the file's."""
    setup = setups.of(path, programme, law=law, settings=settings, fan=fan)
    threads = cores() if workers is None else keys.whole(workers, 1, MAX_WORKERS, "--workers")
    subject = subjects.of(setup, threads, variants=variants)
    named = programme or setup.usual
    place = Path(named if setup.usual or path is None else path)
    return Ready(setup, subject, named, place.stem, fan)
