"""A recording as xarray, pandas or MAT file; excerpts and summaries."""

from __future__ import annotations

import os
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.errors import ProblemError
from macromicro.extras import require
from macromicro.recording_format import FORMAT, TIME

if TYPE_CHECKING:
    import pandas
    import xarray

    from macromicro.recording import Recording

_WIDTH = 96  # characters of a line
_MAT_NAME = 63  # characters of a name in MATLAB (namelengthmax)
_MAT_BYTES = 2**31 - 2**16  # of a variable in a MAT file of version 5
_MAT_OWN = ("units", "meanings", "recording")


def as_xarray(recording: Recording) -> xarray.Dataset:
    """A recording as a Dataset with the coordinate `t`, units as attributes."""
    require("to_xarray", "xarray", "xarray")
    import xarray

    variables = {
        c.name: (TIME, recording[c.name], {"units": c.unit, "long_name": c.meaning})
        for c in recording.columns
    }
    time = {TIME: variables.pop(TIME)}
    attributes = {**recording.attributes, "format": FORMAT, "sample_time_s": recording.dt}
    return xarray.Dataset(variables, coords=time, attrs=attributes)


def as_dataframe(recording: Recording) -> pandas.DataFrame:
    """A recording as a DataFrame with the index `t`, in s; units in ``attrs["units"]``."""
    require("to_dataframe", "pandas", "pandas")
    import pandas

    columns = {c.name: recording[c.name] for c in recording.columns if c.name != TIME}
    index = pandas.Index(recording[TIME], name=TIME)
    frame = pandas.DataFrame(columns, index=index)
    frame.attrs = {
        **recording.attributes,
        "sample_time_s": recording.dt,
        "units": {c.name: c.unit for c in recording.columns},
        "meanings": {c.name: c.meaning for c in recording.columns},
    }
    return frame


def as_mat(recording: Recording, path: str | os.PathLike[str]) -> None:
    """Write a recording as a MAT file of version 5, a vector of shape (rows, 1) per column.

    Names that MATLAB cannot have are cut to 63 characters and begin with `x` instead of `_`.
    """
    from scipy.io import savemat

    names = {c.name: mat_name(c.name) for c in recording.columns}
    taken = [*_MAT_OWN, *names.values()]
    for column, name in names.items():
        if taken.count(name) > 1:
            problem = f"its name in MATLAB, {name}, is taken"
            raise ProblemError(f"{path}, column {column}", problem, "Rename the column.")
        if recording[column].nbytes > _MAT_BYTES:
            problem = (
                f"{recording[column].nbytes} bytes are more than the {_MAT_BYTES} of a MAT file"
            )
            remedy = "Export a shorter part (`recording.part`)."
            raise ProblemError(f"{path}, column {column}", problem, remedy)
    content: dict[str, Any] = {n: recording[c][:, np.newaxis] for c, n in names.items()}
    content["units"] = {names[c.name]: c.unit for c in recording.columns}
    content["meanings"] = {names[c.name]: c.meaning for c in recording.columns}
    told = {mat_name(key): value for key, value in recording.attributes.items()}
    content["recording"] = {**told, "sample_time_s": recording.dt}
    savemat(path, content, long_field_names=True, do_compression=True)


def mat_name(name: str) -> str:
    """A column's name as MATLAB can have it: a letter, then letters, digits and _, 63 at most."""
    return (f"x{name}" if name.startswith("_") else name)[:_MAT_NAME]


def part(recording: Recording, start: float | None, end: float | None) -> Recording:
    t = recording[TIME]
    low = 0 if start is None else int(np.searchsorted(t, start))
    high = len(t) if end is None else int(np.searchsorted(t, end, side="right"))
    if low >= high and len(t):
        asked = f"{t[0] if start is None else start:g} to {t[-1] if end is None else end:g} s"
        told = f"The rows go from {t[0]:g} to {t[-1]:g} s."
        raise ProblemError("span of time", f"there is no row from {asked}", told)
    arrays = [recording[c.name][low:high] for c in recording.columns]
    return type(recording).from_arrays(
        recording.columns, arrays, recording.dt, recording.attributes
    )


def origin(recording: Recording) -> str:
    told = recording.attributes
    words = [str(told[key]) for key in ("programme",) if told.get(key)]
    words += [f"seed {told['seed']}"] if "seed" in told else []
    return ", ".join(words)


def describe(recording: Recording, place: str = "") -> str:
    """Summary of a recording: rows, duration, origin, columns with units."""
    rows, rate = len(recording), 1.0 / recording.dt
    head = f"{rows} row{'s' * (rows != 1)}, {rows * recording.dt:.6g} s at {rate:.6g} Hz"
    about = [part for part in (origin(recording), place) if part]
    if recording.attributes.get("finished") == 0:
        about.append("ended early")
    columns = ", ".join(f"{c.name} [{c.unit}]" for c in recording.columns)
    # No line break between a column and its unit.
    lines = textwrap.wrap(columns.replace(" [", "\0["), _WIDTH, break_long_words=False)
    listed = "\n".join(f"  {line}" for line in lines).replace("\0", " ")
    return f"<Recording: {'; '.join([head, *about])}\n{listed}>"
