"""Methods that filter by their own last result: Steiglitz-McBride, the "modified least squares" of
Figure 4.2, and SRIV."""

from __future__ import annotations

from macromicro.identify.linear_fit import LinearFit, exact, withheld
from macromicro.identify.noise_model import compared
from macromicro.identify.records import Signals
from macromicro.identify.refined import instrumental, steiglitz_mcbride
from macromicro.identify.regression import Start, finished, prepared


def mls(
    u: Signals,
    y: Signals,
    na: int,
    nb: int,
    dt: float,
    delay: int = 1,
    weights: Signals | None = None,
    *,
    start: Start = "rest",
) -> LinearFit:
    """Modified least squares (Section 4.1.1, Figure 4.2), read as Steiglitz-McBride (1965).

    Least squares; input and output are filtered by 1 / A; repeated until the parameters settle. At
    the end the residual is y - (B / A) u, the output's own noise. The flow chart is lost; this
    reading fits its text ("an additional loop filters bias noise"). Exact for white output noise,
    slightly biased for coloured noise, where its errors are withheld. They are, too, of an order
    above 1, where it is not the minimum of its residuals (Stoica and Soderstrom, 1981).

    Parameters
    ----------
    u, y : array_like
        Input and output, as for `least_squares`.
    na, nb : int
        Numbers of coefficients a and b.
    dt : float
        Sample time, s.
    delay : int, optional
        Samples from u to y.
    weights : Signals | None, optional
        As for `least_squares`.
    start : Start, optional
        As for `least_squares`.

    Returns
    -------
    LinearFit
        Coefficients with their covariance.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.
    """
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    solution, count, done = steiglitz_mcbride(task)
    fit = finished("mls", task, solution, count, converged=done)
    if na > 1 and not exact(fit):
        # Stoica and Soderstrom, 1981: it is not the minimum of its residuals' sum of squares.
        return withheld(fit, "the errors of mls of an order above 1 are not known; see box_jenkins")
    return compared(task, solution, fit)


def sriv(
    u: Signals,
    y: Signals,
    na: int,
    nb: int,
    dt: float,
    delay: int = 1,
    weights: Signals | None = None,
    *,
    start: Start = "rest",
) -> LinearFit:
    """Simplified refined instrumental variables (Young and Jakeman, 1979), starting from `mls`.

    As `mls`, but the regressors are correlated with those of the model's own noise-free output (the
    instruments), which removes the bias under any noise that the input did not cause. Errors are
    drawn, or withheld, as those of `output_error`.

    Parameters
    ----------
    u, y : array_like
        Input and output, as for `least_squares`.
    na, nb : int
        Numbers of coefficients a and b.
    dt : float
        Sample time, s.
    delay : int, optional
        Samples from u to y.
    weights : Signals | None, optional
        As for `least_squares`.
    start : Start, optional
        As for `least_squares`.

    Returns
    -------
    LinearFit
        Coefficients with their covariance.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.
    """
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    solution, count, done = instrumental(task)
    fit = finished("sriv", task, solution, count, converged=done)
    return compared(task, solution, fit)
