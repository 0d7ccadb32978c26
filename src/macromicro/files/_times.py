"""Dates and times of day as seconds since the first row."""

from __future__ import annotations

from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError

_DAY = 86400.0
_PARTS = (
    r"^\s*(?:(?P<a>\d+)[-/.](?P<b>\d+)[-/.](?P<c>\d+))?[T ]*"
    r"(?:(?P<h>\d+):(?P<m>\d+)(?::(?P<s>\d+(?:[.,]\d+)?))?)?\s*(?P<p>[AaPp][Mm])?"
    r"(?:Z|(?P<z>[+-])(?P<zh>\d\d):?(?P<zm>\d\d))?\s*$"
)


def seconds(texts: Any, where: str) -> Array:
    """Seconds since midnight before the first time."""
    # Without dates, a time of day that falls by more than half a day begins the next day.
    import pyarrow as pa
    import pyarrow.compute as pc

    found = pc.extract_regex(texts, _PARTS)
    empty = pc.fill_null(pc.equal(pc.utf8_trim_whitespace(texts), ""), True)
    bad = pc.and_(pc.is_null(found), pc.invert(empty)).to_numpy(zero_copy_only=False)
    if bad.any():
        row = int(bad.argmax())
        accepted = "a date or a time of day, as 2024-03-01 12:00:00.5 or 12:00:00"
        raise InputError(f"{where}, row {row + 1}", texts[row].as_py(), accepted)

    def part(name: str) -> Array:
        text = pc.replace_substring(pc.struct_field(found, name), ",", ".")
        full = pc.if_else(pc.equal(text, ""), pa.scalar(None, pa.string()), text)
        return np.asarray(
            pc.cast(full, pa.float64()).to_numpy(zero_copy_only=False), dtype=np.float64
        )

    hours, minutes, rest = (part(name) for name in "hms")
    noon = pc.utf8_upper(pc.fill_null(pc.struct_field(found, "p"), ""))
    afternoon = pc.fill_null(pc.equal(noon, "PM"), False).to_numpy(zero_copy_only=False)
    morning = pc.fill_null(pc.equal(noon, "AM"), False).to_numpy(zero_copy_only=False)
    hours = np.where(afternoon | morning, hours % 12.0 + 12.0 * afternoon, hours)
    east = _filled(part("zh")) * 3600.0 + _filled(part("zm")) * 60.0
    west = pc.fill_null(pc.equal(pc.struct_field(found, "z"), "-"), False)
    zone = np.where(west.to_numpy(zero_copy_only=False), -east, east)
    hidden = empty.to_numpy(zero_copy_only=False)
    of_day = 3600.0 * _filled(hours) + 60.0 * _filled(minutes) + _filled(rest)
    a, b, c = (part(name) for name in "abc")
    if np.isnan(a[~hidden]).all():
        later = np.cumsum(np.r_[0.0, np.diff(of_day) < -0.5 * _DAY])
        days = np.asarray(later, dtype=np.float64)
    else:
        days = _days(a, b, c, where)
    days = np.where(hidden, np.nan, days)
    first = days[np.isfinite(days)]
    return (days - (first[0] if len(first) else 0.0)) * _DAY + of_day - zone


def _filled(values: Array) -> Array:
    return np.where(np.isnan(values), 0.0, values)


def _days(a: Array, b: Array, c: Array, where: str) -> Array:
    """Days since 1970 of dates whose order is inferred."""
    good = np.isfinite(a) & np.isfinite(b) & np.isfinite(c)
    a, b, c = (np.where(good, v, 1.0) for v in (a, b, c))
    if a[good].max() > 31.0:
        year, month, day = a, b, c
    elif b[good].max() > 12.0:
        year, month, day = c, a, b
    else:
        year, month, day = c, b, a
        moves = np.ptp(a[good]) > 0.0 and np.ptp(b[good]) > 0.0
        if moves and a[good].max() <= 12.0:
            raise ProblemError(
                where,
                "day and month of these dates are ambiguous",
                "Write dates as 2024-03-01, or give a column of numbers in s.",
            )
    year = np.where(year < 100.0, year + 2000.0, year)
    if (month[good] < 1).any() or (month[good] > 12).any():
        raise ProblemError(where, "a month is not from 1 to 12", "Write dates as 2024-03-01.")
    months = ((year - 1970.0) * 12.0 + month - 1.0).astype("datetime64[M]")
    days = months.astype("datetime64[D]").astype(np.float64) + day - 1.0
    return np.where(good, days, np.nan)
