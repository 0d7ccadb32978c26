"""The guard's faults in words: event, evidence, remedy."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import NamedTuple, Protocol

from macromicro.recording_format import Attribute
from macromicro.rig import codes
from macromicro.rig.guard import Watch

SWITCHED_OFF = "all outputs were set to off (written to the rig, not read back)"


class Fault(NamedTuple):
    code: int  # one of `codes`
    name: str
    time_s: float  # when, in the run's time, s
    message: str
    evidence: str  # what was measured, and its limit
    remedy: str

    @property
    def text(self) -> str:
        """All of it in one line."""
        return f"{self.message} {self.evidence}. {self.remedy}"


class Said(Protocol):
    """A fault in words."""

    @property
    def message(self) -> str: ...

    @property
    def evidence(self) -> str: ...


def end_attributes(finished: bool, fault: Said | None) -> dict[str, Attribute]:
    """The end of a run for its recording."""
    words = {} if fault is None else {"fault": f"{fault.message} {fault.evidence}"}
    return {"finished": int(finished), **words}


class Text(NamedTuple):
    """A fault in words; evidence formats {value} and {limit} of `Watch`, times `scale`."""

    name: str
    message: str
    remedy: str
    evidence: str = ""
    scale: float = 1.0

    def seen(self, value: float, limit: float) -> str:
        """The evidence of these."""
        return self.evidence.format(value=self.scale * value, limit=self.scale * limit)


_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
TEXTS = {getattr(codes, name): Text(**row) for name, row in _TABLE.items()}


def describe(watch: Watch) -> Fault | None:
    if watch.fault == codes.OK:
        return None
    text = TEXTS[watch.fault]
    return Fault(
        watch.fault,
        text.name,
        round(watch.time, 9),
        text.message,
        f"{text.seen(watch.value, watch.limit)}, at {watch.time:.3f} s; {SWITCHED_OFF}",
        text.remedy,
    )
