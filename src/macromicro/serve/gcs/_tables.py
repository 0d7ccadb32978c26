"""Traces of the last motion for the GCS data recorder (GCS array)."""

from __future__ import annotations

from collections.abc import Sequence

from macromicro.arrays import Array
from macromicro.serve.gcs._errors import NO_TABLE, OUT_OF_RANGE, GcsError
from macromicro.serve.gcs._session import MOST, Session
from macromicro.serve.web import bins


def names(session: Session) -> tuple[str, ...]:
    """Names of the tables 1, 2, ... with their units."""
    place = session.instrument.place
    units = {"motor": "V", "CTRL": "V", "temperature": "degC"}
    shown = bins.channels(session.instrument.settings.axes)
    return tuple(f"{name} [{units.get(name.split()[-1], place.unit)}]" for name in shown)


def rows(session: Session) -> Array:
    """All tables since the last motion began: float64[tables, values]."""
    settings = session.instrument.settings
    _, block, columns = session.station.telemetry(session.began)
    shown = block[:, :: session.rate][:, :MOST]
    place = session.instrument.place
    return bins.traces(shown, columns, settings.live.pitch, place, settings.axes)


def array(session: Session, first: int, count: int, tables: Sequence[int]) -> str:
    """Values `first` (counted from 1) to `first + count - 1` of these tables, with their header."""
    called = names(session)
    tables = tables or range(1, len(called) + 1)
    if not all(1 <= table <= len(called) for table in tables):
        raise GcsError(NO_TABLE)
    values = rows(session)
    if first < 1 or count < 1 or first + count - 1 > values.shape[1]:
        raise GcsError(OUT_OF_RANGE, f"{values.shape[1]} values so far")
    shown = values[[table - 1 for table in tables], first - 1 : first - 1 + count]
    head = {
        "VERSION": "1",
        "TYPE": "1",
        "SEPARATOR": "32",
        "DIM": str(len(tables)),
        "SAMPLE_TIME": f"{session.rate * session.instrument.period:.6g}",
        "NDATA": str(count),
    }
    head |= {f"NAME{k}": called[table - 1] for k, table in enumerate(tables)}
    lines = ["# REM macromicro", "#", *(f"# {key} = {text}" for key, text in head.items())]
    lines += ["#", "# END_HEADER"]
    lines += [" ".join(f"{x:.9g}" for x in row) for row in shown.T.tolist()]
    return " \n".join(lines)
