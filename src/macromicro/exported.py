"""A recording in other forms: xarray, pandas, MAT files, a part of it, a few words about it."""

from __future__ import annotations

import os
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.errors import InputError, MacromicroError
from macromicro.extras import remedy
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
    """A recording as a Dataset with the coordinate `t`, units as attributes.

    Parameters
    ----------
    recording : Recording
        The recording.

    Returns
    -------
    xarray.Dataset
        A variable of dimension `t` per column.

    Raises
    ------
    MacromicroError
        xarray is not installed; with the remedy.
    """
    try:
        import xarray
    except ImportError as error:
        raise MacromicroError(f"xarray is not installed; needed: {remedy('xarray')}") from error
    variables = {
        c.name: (TIME, recording[c.name], {"units": c.unit, "long_name": c.meaning})
        for c in recording.columns
    }
    time = {TIME: variables.pop(TIME)}
    attributes = {**recording.attributes, "format": FORMAT, "sample_time_s": recording.dt}
    return xarray.Dataset(variables, coords=time, attrs=attributes)


def as_dataframe(recording: Recording) -> pandas.DataFrame:
    """A recording as a DataFrame with the index `t`, in s; units in ``attrs["units"]``.

    Parameters
    ----------
    recording : Recording
        The recording.

    Returns
    -------
    pandas.DataFrame
        A column per column; `attrs` has their units and meanings by name (those of `t`, too),
        beside the recording's own attributes.

    Raises
    ------
    MacromicroError
        pandas is not installed; with the remedy.
    """
    try:
        import pandas
    except ImportError as error:
        raise MacromicroError(f"pandas is not installed; needed: {remedy('pandas')}") from error
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
    """Write a recording as a MAT file of version 5, as MATLAB's ``save -v7`` does.

    A vector of shape (rows, 1) per column, in its own type; `units` and `meanings`, structs with a
    field per column; `recording`, a struct of `sample_time_s` and the recording's attributes.
    A name that MATLAB cannot have is cut to 63 characters, and begins with `x` where it began
    with `_`.

    Parameters
    ----------
    recording : Recording
        The recording.
    path : str | os.PathLike[str]
        The file; replaced if it is there.

    Raises
    ------
    InputError
        Names that become one, or one of those above; a column of more bytes than such a file holds.
    """
    from scipy.io import savemat

    names = {c.name: mat_name(c.name) for c in recording.columns}
    taken = [*_MAT_OWN, *names.values()]
    for column, name in names.items():
        if taken.count(name) > 1:
            raise InputError(f"{path}, column {column}", name, "a name of its own in MATLAB")
        if recording[column].nbytes > _MAT_BYTES:
            found = f"{recording[column].nbytes} bytes"
            accepted = f"{_MAT_BYTES}: a shorter part, as `recording.part` gives it"
            raise InputError(f"{path}, column {column}", found, accepted)
    content: dict[str, Any] = {n: recording[c][:, np.newaxis] for c, n in names.items()}
    content["units"] = {names[c.name]: c.unit for c in recording.columns}
    content["meanings"] = {names[c.name]: c.meaning for c in recording.columns}
    told = {mat_name(key): value for key, value in recording.attributes.items()}
    content["recording"] = {**told, "sample_time_s": recording.dt}
    savemat(path, content, long_field_names=True, do_compression=True)


def mat_name(name: str) -> str:
    """A column's name as MATLAB can have it: a letter, then letters, digits and _, 63 at most.

    Parameters
    ----------
    name : str
        An identifier in ASCII, as columns have them.

    Returns
    -------
    str
        The same where that is one.
    """
    return (f"x{name}" if name.startswith("_") else name)[:_MAT_NAME]


def part(recording: Recording, start: float | None, end: float | None) -> Recording:
    """The rows of a span of time, in memory.

    Parameters
    ----------
    recording : Recording
        The recording.
    start, end : float | None
        First and last time, s as in its column `t`; None for its own.

    Returns
    -------
    Recording
        With the same columns and attributes.

    Raises
    ------
    InputError
        No row lies within.
    """
    t = recording[TIME]
    low = 0 if start is None else int(np.searchsorted(t, start))
    high = len(t) if end is None else int(np.searchsorted(t, end, side="right"))
    if low >= high and len(t):
        asked = f"{t[0] if start is None else start:g} to {t[-1] if end is None else end:g} s"
        raise InputError("span of time", asked, f"some of {t[0]:g} to {t[-1]:g} s")
    arrays = [recording[c.name][low:high] for c in recording.columns]
    return type(recording).from_arrays(
        recording.columns, arrays, recording.dt, recording.attributes
    )


def origin(recording: Recording) -> str:
    """Programme and seed of a recording, in words.

    Parameters
    ----------
    recording : Recording
        The recording.

    Returns
    -------
    str
        "" if it names none.
    """
    told = recording.attributes
    words = [str(told[key]) for key in ("programme",) if told.get(key)]
    words += [f"seed {told['seed']}"] if "seed" in told else []
    return ", ".join(words)


def described(recording: Recording, place: str = "") -> str:
    """What a recording holds: rows, duration, origin, columns with units.

    Parameters
    ----------
    recording : Recording
        The recording; its columns are not read.
    place : str, optional
        Its file.

    Returns
    -------
    str
        A few lines.
    """
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
