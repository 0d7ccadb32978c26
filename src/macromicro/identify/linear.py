"""Discrete linear models: `LinearFit` and the six methods that find one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import wraps
from inspect import signature
from typing import TYPE_CHECKING, Any, NamedTuple, ParamSpec

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import _linear, clusters
from macromicro.identify._linear import Solution, Start, Task, free_runs, prepare_task
from macromicro.identify.clusters import Spread
from macromicro.identify.notices import ConvergenceWarning, RestWarning, UnstableWarning, notice
from macromicro.identify.records import Signals, fit_percent

if TYPE_CHECKING:
    from scipy.signal import TransferFunction

MAX_ITERATIONS = _linear.MAX_ITERATIONS
_ROUNDING = 1e-9
_BENT = 0.125  # at the ends of a 95 % interval runs are then off by a quarter of what moves them
_BY_FREE_RUN = ("mls", "sriv", "output_error")  # methods whose residual is the free run's
_NEED_WHITE = ("least_squares", "gls", "mls")  # methods that are biased where residuals are not

Complex = npt.NDArray[np.complex128]


class Whiteness(NamedTuple):
    """Ljung-Box test of residuals: Q = n (n+2) sum r_k^2 / (n-k), chi-square when white.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import Whiteness
    >>> Whiteness(autocorrelation=np.zeros(5), statistic=3.2, p_value=0.67, white=True).white
    True
    """

    autocorrelation: Array  #: r_1 ... r_lags
    statistic: float  #: Q
    p_value: float  #: chance of so large a Q from white residuals
    white: bool  #: `p_value` is at least 1 %


@dataclass(frozen=True)
class LinearFit:
    """y = (b1 z^-1 + b2 z^-2 + ...) / (1 + a1 z^-1 + ...) u, delayed by `delay` - 1 more.

    Examples
    --------
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import least_squares
    >>> u = [1.0, -1.0, 1.0, 1.0] * 20
    >>> fit = least_squares(u, lfilter([0.0, 0.2], [1.0, -0.9], u), na=1, nb=1, dt=0.01)
    >>> round(fit.gain, 6), fit.poles.real.round(6)
    (2.0, array([0.9]))
    """

    method: str  #: name of the function that found it
    a: Array  #: without the leading 1: (4.3), b / (z + a), has a = [-0.95833]
    b: Array  #: unit of y per unit of u; (4.3) has [165.72]
    dt: float  #: sample time, s
    delay: int  #: samples from u to y
    covariance: Array  #: in the order a, b; by the scatter of stretches of the records
    #: an array per record, the method's own: one-step errors of least_squares and gls, free-run
    #: errors of the others
    residuals: tuple[Array, ...]
    free_run: tuple[Array, ...]  #: an array per record
    fit: float  #: percent, 100 (1 - |y - free run| / |y - mean y|)
    whiteness: Whiteness  #: test of the residuals
    iterations: int = 1  #: iterations of the method; 1 where it needs none
    converged: bool = True  #: of the iterations
    #: d1, d2, ... of `gls` and `box_jenkins`; empty for the others
    noise: Array = field(default_factory=lambda: np.zeros(0))
    #: of `output_error`: the free-run fit in percent that the search reached from each beginning;
    #: empty for the others
    starts: dict[str, float] = field(default_factory=dict)
    doubt: str = ""  #: why intervals may not hold the true values; empty where they should
    #: of each stretch of the records: its part of the covariance, for degrees of freedom
    shares: Array | None = None

    @property
    def std(self) -> Array:
        """Standard errors of a and b, in this order."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def poles(self) -> Complex:
        """Poles in z: the roots of z^na + a1 z^(na-1) + ..."""
        return np.roots(np.r_[1.0, self.a]).astype(np.complex128)

    @property
    def continuous_poles(self) -> Complex:
        """Poles in s [rad/s], ln(z) / dt, for an input held between samples."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(self.poles) / self.dt, dtype=np.complex128)

    @property
    def pole_slopes(self) -> Complex:
        """Derivatives of the continuous poles by a and b; infinite for double ones."""
        # A(p) = 0 gives dp / da_k = -p^(na - k) / A'(p), and ds = dp / (p dt).
        poles, na = self.poles, len(self.a)
        derived = np.polyval(np.polyder(np.r_[1.0, self.a]), poles)
        powers = poles[:, None] ** np.arange(na - 1, -1, -1)
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes = -powers / (derived * poles * self.dt)[:, None]
        return np.hstack([slopes, np.zeros((na, len(self.b)))])

    @property
    def gain(self) -> float:
        """Static gain sum(b) / (1 + sum(a)), (4.6); infinite for an integrator."""
        rest = 1.0 + self.a.sum()
        return float(self.b.sum() / rest) if rest != 0.0 else float("inf")

    @property
    def gain_std(self) -> float:
        """Standard error of the static gain, to first order."""
        return float(clusters.errors(self.covariance, self._gain_slopes)[0])

    @property
    def factors(self) -> Array:
        """Coverage factors of a and b for 68 and 95 %, shape (2, na + nb)."""
        return self.spread.factors()

    @property
    def gain_factors(self) -> Array:
        """Coverage factors of the static gain, shape (2,)."""
        return np.asarray(self.spread.factors(self._gain_slopes)[:, 0])

    @property
    def spread(self) -> Spread:
        """Covariance and what its coverage factors follow from."""
        return clusters.normal_spread(self.covariance, self.shares)

    @property
    def _gain_slopes(self) -> Array:
        """Derivative of the static gain by a and b, shape (1, na + nb)."""
        rest = 1.0 + self.a.sum()
        slopes = np.r_[np.full(len(self.a), -self.gain), np.ones(len(self.b))] / rest
        return np.asarray(slopes[None])

    def simulate(self, u: npt.ArrayLike) -> Array:
        """Free simulation from rest.

        Parameters
        ----------
        u : array_like, shape (n,)
            Input.

        Returns
        -------
        ndarray, shape (n,)
            y.
        """
        from scipy.signal import lfilter

        return np.asarray(lfilter(*self._polynomials, np.asarray(u, np.float64)))

    def predict(self, u: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        """One-step prediction from the measured past of the output.

        Parameters
        ----------
        u, y : array_like, shape (n,)
            Input and measured output, from rest.

        Returns
        -------
        ndarray, shape (n,)
            y by the model.
        """
        from scipy.signal import lfilter

        top, bottom = self._polynomials
        past = lfilter(np.r_[0.0, bottom[1:]], [1.0], np.asarray(y, np.float64))
        return np.asarray(lfilter(top, [1.0], np.asarray(u, np.float64)) - past)

    def score(self, u: npt.ArrayLike, y: npt.ArrayLike) -> float:
        """Fit of the free simulation to another record.

        Parameters
        ----------
        u, y : array_like, shape (n,)
            Input and measured output, from rest.

        Returns
        -------
        float
            Percent, as `fit`.
        """
        return fit_percent([np.asarray(y, np.float64)], [self.simulate(u)])

    def to_scipy(self) -> TransferFunction:
        """The model as a transfer function of SciPy in z.

        Returns
        -------
        TransferFunction
            With the sample time `dt`.
        """
        from scipy.signal import TransferFunction

        return TransferFunction(*self._in_z, dt=self.dt)

    def to_control(self) -> Any:
        """The model as a discrete transfer function of python-control, which must be installed.

        Returns
        -------
        control.TransferFunction
            In z, with the sample time `dt`.
        """
        from control import TransferFunction

        return TransferFunction(*self._in_z, self.dt)

    @property
    def _polynomials(self) -> tuple[Array, Array]:
        """Numerator and denominator in z^-1."""
        return np.r_[np.zeros(self.delay), self.b], np.r_[1.0, self.a]

    @property
    def _in_z(self) -> tuple[Array, Array]:
        """Numerator and denominator in z."""
        top, bottom = self._polynomials
        size = max(len(top), len(bottom))
        top, bottom = (np.r_[each, np.zeros(size - len(each))] for each in (top, bottom))
        first = int(np.argmax(top != 0.0))
        return top[first:], bottom

    def with_integrator(self) -> tuple[Array, Array]:
        """(4.4): the model times dt z^-1 / (1 - z^-1), for positions; its delay is `delay` + 1.

        Returns
        -------
        a : ndarray, shape (na + 1,)
            Without the leading 1.
        b : ndarray, shape (nb,)
            Unit of position per unit of u.
        """
        a = np.convolve(np.r_[1.0, self.a], [1.0, -1.0])[1:]
        return a, self.b * self.dt

    def __str__(self) -> str:
        names = [f"a{i + 1}" for i in range(len(self.a))]
        names += [f"b{i + 1}" for i in range(len(self.b))]
        values = np.r_[self.a, self.b]
        errors = ["" if np.isnan(s) else f" +- {s:.2g}" for s in self.std]
        rows = [f"{n} {v:.6g}{e}" for n, v, e in zip(names, values, errors, strict=True)]
        state = "white" if self.whiteness.white else "not white"
        return f"{self.method}: " + ", ".join(rows) + f"; fit {self.fit:.2f} %, residuals {state}"


def whiteness(residuals: tuple[Array, ...], parameters: int, lags: int = 20) -> Whiteness:
    """Ljung-Box test over records, with each record's own lags."""
    from scipy.special import chdtrc

    n = sum(len(e) for e in residuals)
    lags = max(min(lags, min(len(e) for e in residuals) // 4), 1)
    power = sum(float(e @ e) for e in residuals)
    if power <= 0.0:
        return Whiteness(np.zeros(lags), 0.0, 1.0, True)
    k = np.arange(1, lags + 1)
    r = np.array([sum(float(e[i:] @ e[:-i]) for e in residuals) for i in k]) / power
    q = float(n * (n + 2) * (r**2 / (n - k)).sum())
    p = float(chdtrc(max(lags - parameters, 1), q))
    return Whiteness(r, q, p, p >= 0.01)


def _finish(method: str, task: Task, solution: Solution) -> LinearFit:
    theta, size = solution.theta, task.size
    runs = tuple(free_runs(task, theta))
    residuals = _linear.per_record(task, solution.residual)
    if not solution.converged:
        notice(
            ConvergenceWarning,
            f"{method}: not settled after {solution.iterations} iterations; the last values are "
            "returned",
        )
    a = theta[: task.na]
    if task.na and np.abs(np.roots(np.r_[1.0, a])).max() > 1.0 + 1e-9:
        notice(
            UnstableWarning, f"{method}: the model is unstable; its free run grows without bound"
        )
    if not task.starts:
        _check_rest(method, task, residuals)
    with np.errstate(over="ignore", invalid="ignore"):
        fit = fit_percent(task.outputs, runs)
        at = _linear.linearise(task, theta) if method in _BY_FREE_RUN else solution
    covariance, shares = np.full((size, size), np.nan), None
    if np.isfinite(at.psi).all() and np.isfinite(at.residual).all():
        found_spread = _linear.spread(task, at)
        covariance = found_spread.covariance[:size, :size]
        shares = found_spread.shares[:, :size, :size]
    found = LinearFit(
        method,
        a,
        theta[task.na : size],
        task.dt,
        task.delay,
        covariance,
        residuals,
        runs,
        fit,
        whiteness(residuals, size),
        solution.iterations,
        solution.converged,
        solution.noise,
        dict(solution.starts),
        shares=shares,
    )
    return replace(found, doubt=_doubt(task, found, theta))


def _check_rest(method: str, task: Task, residuals: tuple[Array, ...]) -> None:
    """Warn of records whose first output is far from the rest state, zero."""
    for i, (record, e) in enumerate(zip(task.data, residuals, strict=True)):
        usual = float(np.sqrt(np.mean(e[1:] ** 2)))
        most = float(np.abs(record.y).max())
        # With delay 0 the input acts on the first sample already.
        if task.delay and abs(record.y[0]) > min(6.0 * usual + 1e-9 * most, 0.5 * most):
            notice(
                RestWarning,
                f"{method}: record {i} starts at {record.y[0]:g}, not at rest; taken as at rest. "
                'Use start="free" to estimate its initial state',
            )


def _doubt(task: Task, fit: LinearFit, theta: Array) -> str:
    """Why the intervals of a fit may not hold the true values."""
    left = sum(float(e @ e) for e in fit.residuals)
    with np.errstate(over="ignore", invalid="ignore"):
        if left <= _ROUNDING**2 * sum(float(y @ y) for y in fit.free_run):
            return ""
    if fit.shares is None:
        return "the free run overflows, so that errors are unknown"
    white = fit.whiteness.white
    # Above order 1 Steiglitz-McBride does not end at the minimum of its residuals' sum of squares
    # (Stoica and Soderstrom, 1981).
    if (fit.method in _NEED_WHITE and not white) or (fit.method == "mls" and task.na > 1):
        return f"{fit.method} is biased by this noise; see box_jenkins"
    if fit.method in _BY_FREE_RUN and task.na > 1 and not white:
        return "residuals are not white, and a pole may follow the noise; see box_jenkins"
    if _nonlinearity(task, fit, theta) > _BENT:
        return "so large that free runs are not proportional to them"
    return ""


def _nonlinearity(task: Task, fit: LinearFit, theta: Array) -> float:
    """Nonlinearity of free simulations within one standard error."""
    # |y(+) + y(-) - 2 y| / |y(+) - y(-)| in the worst independent direction (D. Bates, D. Watts, J.
    # Royal Statistical Society B 42, 1980, p. 1).
    size = np.where(fit.std > 0.0, fit.std, 1.0)
    power, turned = np.linalg.eigh(fit.covariance / np.outer(size, size))
    middle, most = np.concatenate(fit.free_run), 0.0
    for move in (turned * np.sqrt(np.maximum(power, 0.0))).T:
        by = np.zeros(len(theta))
        by[: task.size] = size * move
        more, less = (np.concatenate(free_runs(task, theta + s * by)) for s in (1.0, -1.0))
        with np.errstate(over="ignore", invalid="ignore"):
            first, second = np.linalg.norm(more - less), np.linalg.norm(more + less - 2.0 * middle)
        if not np.isfinite(second):
            return float(np.inf)
        most = max(most, float(second / first) if first > 0.0 else 0.0)
    return most


P = ParamSpec("P")


def _method(
    given: Callable[P, Task],
) -> Callable[[Callable[[Task], Solution]], Callable[P, LinearFit]]:
    """A public method by its solution; it takes what `given` takes and documents."""

    def method(solved: Callable[[Task], Solution]) -> Callable[P, LinearFit]:
        name = solved.__name__

        @wraps(solved)
        def fitted(*args: P.args, **named: P.kwargs) -> LinearFit:
            task = given(*args, **named)
            return _finish(name, task, solved(task))

        taken = signature(given).replace(return_annotation="LinearFit")
        fitted.__signature__ = taken  # type: ignore[attr-defined]
        if solved.__doc__ and given.__doc__:
            shared = given.__doc__.partition("\n\n    ")[2].rstrip()
            fitted.__doc__ = solved.__doc__.replace("Examples\n", f"{shared}\n\n    Examples\n", 1)
        return fitted

    return method


@_method(prepare_task)
def least_squares(task: Task) -> Solution:
    """B = (U'U)^-1 U'Y (Section 4.1.1): y[k] = -a1 y[k-1] - ... + b1 u[k-delay] + ... + e[k].

    Consistent only for white e; otherwise `doubt` says that it is biased. Output noise does so: on
    speeds from differentiated encoder counts b is several times too large (`mls` avoids this).

    Examples
    --------
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import least_squares
    >>> u = [1.0, -1.0, 1.0, 1.0] * 20  # V, every 10 ms
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u)  # y[k] = 0.9 y[k-1] + 0.2 u[k-1]
    >>> fit = least_squares(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(6), fit.b.round(6)
    (array([-0.9]), array([0.2]))
    """
    return _linear.equation_error(task)


def gls(
    u: Signals,
    y: Signals,
    na: int,
    nb: int,
    dt: float,
    delay: int = 1,
    weights: Signals | None = None,
    *,
    noise_order: int = 4,
    start: Start = "rest",
) -> LinearFit:
    """Generalised least squares (Clarke, 1967): A y = B u + e / D, D of order `noise_order`.

    Least squares with D as an autoregression of the residuals, by which input and output are
    filtered, until the parameters settle. Output noise is e A, not e / D: a high order approximates
    it, and `box_jenkins` treats it exactly. Samples before `noise_order` are not judged. Where e
    is not white, `doubt` says that the result is biased.

    Parameters
    ----------
    u, y, na, nb, dt, delay, weights
        As for `least_squares`.
    noise_order : int, optional
        Order of D, 1 to 50.
    start : Start, optional
        As for `least_squares`.

    Returns
    -------
    LinearFit
        Its `noise` holds d1, d2, ... of D.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import gls
    >>> u, e = np.sign(np.random.default_rng(0).standard_normal((2, 2000)))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + lfilter([0.01], [1.0, -1.4, 0.45], e)
    >>> fit = gls(u, y, na=1, nb=1, dt=0.01, noise_order=1)  # noise e / (A D), D = 1 - 0.5 z^-1
    >>> fit.a.round(2), fit.b.round(2), fit.noise.round(1)
    (array([-0.9]), array([0.2]), array([-0.5]))
    """
    if not isinstance(noise_order, int) or not 1 <= noise_order <= 50:
        raise InputError("noise_order", noise_order, "a whole number from 1 to 50")
    task = prepare_task(u, y, na, nb, dt, delay, weights, start=start)
    return _finish("gls", task, _linear.generalise(task, noise_order))


@_method(prepare_task)
def mls(task: Task) -> Solution:
    """Modified least squares (Section 4.1.1, Figure 4.2), read as Steiglitz-McBride (1965).

    Least squares with input and output filtered by 1 / A until the parameters settle; the residual
    is y - (B / A) u. The flow chart is lost; this reading fits its text ("an additional loop
    filters bias noise"). Exact for white output noise; `doubt` names the bias under other noise and
    above order 1.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import mls
    >>> u, noise = np.random.default_rng(0).standard_normal((2, 2000))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + 0.1 * noise  # white noise of the sensor
    >>> fit = mls(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(2), fit.b.round(2)
    (array([-0.9]), array([0.2]))
    """
    return _linear.iterate(task, instruments=False)


@_method(prepare_task)
def sriv(task: Task) -> Solution:
    """Simplified refined instrumental variables (Young and Jakeman, 1979), starting from `mls`.

    The instruments are the regressors of the model's noise-free output, which removes the bias
    under any noise that is independent of the input. Errors as for `output_error`.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import sriv
    >>> u, e = np.random.default_rng(0).standard_normal((2, 2000))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + lfilter([0.1], [1.0, -0.5], e)  # coloured noise
    >>> fit = sriv(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(2), fit.b.round(2)
    (array([-0.9]), array([0.2]))
    """
    return _linear.iterate(task, instruments=True)


@_method(prepare_task)
def output_error(task: Task) -> Solution:
    """Minimiser of sum w (y - (B / A) u)^2, by trust regions with exact gradients.

    Consistent for noise independent of the input, and of least variance if it is white (Ljung,
    System Identification, chapter 7). Searches start at the results of `mls`, `sriv`,
    `least_squares` and a first-order model; the best end is taken, and `starts` lists them all.
    `doubt` says where a pole of a higher order may follow coloured noise.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import output_error
    >>> u, noise = np.random.default_rng(0).standard_normal((2, 2000))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + 0.1 * noise  # white noise of the sensor
    >>> fit = output_error(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(2), fit.b.round(2)
    (array([-0.9]), array([0.2]))
    """
    tried = _linear.begins(task)
    ends = _linear.search_minima(task, tried)
    with np.errstate(over="ignore", invalid="ignore"):
        fits = {n: fit_percent(task.outputs, free_runs(task, ends[n].theta)) for n in tried}
    return next(iter(ends.values()))._replace(starts=fits)


@_method(prepare_task)
def box_jenkins(task: Task) -> Solution:
    """y = (B / A) u + e / D with e white: a model of the machine and one of the noise.

    D is an autoregression of the residual, of the order (at most 30) that Akaike's criterion
    prefers; A and B minimise D (y - (B / A) u); repeated until they settle. This is the prediction-
    error method for Box-Jenkins models with autoregressive noise (Ljung, System Identification,
    sections 4.2 and 7.2; Young and Jakeman, 1979), of least variance for noise independent of the
    input. Its intervals hold under every disturbance of docs/validation/identification.md.
    `noise` holds d1, d2, ... of D; residuals are e.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import box_jenkins
    >>> u, e = np.random.default_rng(0).standard_normal((2, 2000))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + lfilter([0.1], [1.0, -0.5], e)  # D = 1 - 0.5 z^-1
    >>> fit = box_jenkins(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(2), fit.b.round(2), fit.noise.round(1)
    (array([-0.9]), array([0.2]), array([-0.5]))
    """
    return _linear.box_jenkins(task)
