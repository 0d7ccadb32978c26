"""Named warnings of identification: the finding and the action taken."""

from __future__ import annotations

import warnings


class DataWarning(UserWarning):
    """Base: the data or the fit deserve a look. The message says what was done."""


class SaturationWarning(DataWarning):
    """The input sits at its limit for part of the record."""


class ResampledWarning(DataWarning):
    """Time stamps were uneven; the record was interpolated onto an even grid."""


class RestWarning(DataWarning):
    """A record taken as starting at rest does not look so."""


class ConvergenceWarning(DataWarning):
    """An iteration ended before it settled; its last values are returned."""


class UnstableWarning(DataWarning):
    """The fitted model is unstable; its free run means nothing."""


class PoorFitWarning(DataWarning):
    """The fitted model does not describe the record; its parameters mean nothing."""


def notice(kind: type[DataWarning], message: str) -> None:
    warnings.warn(message, kind, stacklevel=3)
