"""A recording in other forms: tables of xarray and pandas, and a few words about it."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from macromicro.errors import MacromicroError
from macromicro.extras import remedy
from macromicro.recording_format import FORMAT, TIME

if TYPE_CHECKING:
    import pandas
    import xarray

    from macromicro.recording import Recording

_WIDTH = 96  # characters of a line


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
