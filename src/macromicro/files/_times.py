"""Dates and times of day as seconds since the first row."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError

_DAY = 86400.0
_PARTS = re.compile(
    r"^\s*(?:(?P<a>\d+)[-/.](?P<b>\d+)[-/.](?P<c>\d+))?[T ]*"
    r"(?:(?P<h>\d+):(?P<m>\d+)(?::(?P<s>\d+(?:[.,]\d+)?))?)?\s*(?P<p>[AaPp][Mm])?"
    r"(?:Z|(?P<z>[+-])(?P<zh>\d\d):?(?P<zm>\d\d))?\s*$"
)


def seconds(texts: Sequence[str | None], where: str) -> Array:
    """Seconds since midnight before the first time."""
    # Without dates, a time of day that falls by more than half a day begins the next day.
    hidden = np.array([not (text or "").strip() for text in texts])
    of_day, zone, dates = (
        np.zeros(len(texts)),
        np.zeros(len(texts)),
        np.full((3, len(texts)), np.nan),
    )
    for row, text in enumerate(texts):
        if hidden[row]:
            continue
        found = _PARTS.match(text or "")
        if not found:
            accepted = "a date or a time of day, as 2024-03-01 12:00:00.5 or 12:00:00"
            raise InputError(f"{where}, row {row + 1}", text, accepted)
        a, b, c, h, m, s, noon, sign, zone_h, zone_m = found.groups()
        hours = float(h or 0.0)
        if noon:
            hours = hours % 12.0 + 12.0 * (noon.upper() == "PM")
        of_day[row] = 3600.0 * hours + 60.0 * float(m or 0.0) + float((s or "0").replace(",", "."))
        if sign:
            east = 3600.0 * float(zone_h) + 60.0 * float(zone_m)
            zone[row] = -east if sign == "-" else east
        if a:
            dates[:, row] = float(a), float(b), float(c)
    if np.isnan(dates[0]).all():
        later = np.cumsum(np.r_[0.0, np.diff(of_day) < -0.5 * _DAY])
        days = np.asarray(later, dtype=np.float64)
    else:
        days = _days(dates[0], dates[1], dates[2], where)
    days = np.where(hidden, np.nan, days)
    first = days[np.isfinite(days)]
    return (days - (first[0] if len(first) else 0.0)) * _DAY + of_day - zone


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
            remedy = "Write dates as 2024-03-01, or give a column of numbers in s."
            raise ProblemError(where, "day and month of these dates are ambiguous", remedy)
    year = np.where(year < 100.0, year + 2000.0, year)
    if (month[good] < 1).any() or (month[good] > 12).any():
        raise ProblemError(where, "a month is not from 1 to 12", "Write dates as 2024-03-01.")
    months = ((year - 1970.0) * 12.0 + month - 1.0).astype("datetime64[M]")
    days = months.astype("datetime64[D]").astype(np.float64) + day - 1.0
    return np.where(good, days, np.nan)
