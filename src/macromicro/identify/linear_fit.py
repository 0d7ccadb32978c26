"""LinearFit: the result of a linear identification, with its validation."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify import coverage

_ROUNDING = 1e-9

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
    covariance: Array  #: in the order a, b; allows for coloured residuals
    #: an array per record, the method's own: one-step errors of least_squares and gls, free-run
    #: errors of the others
    residuals: tuple[Array, ...]
    free_run: tuple[Array, ...]  #: an array per record
    fit: float  #: percent, 100 (1 - |y - free run| / |y - mean y|)
    whiteness: Whiteness  #: test of the residuals
    iterations: int = 1  #: iterations of the method; 1 where it needs none
    converged: bool = True  #: of the iterations
    #: d1, d2, ... of `gls`; empty for the others
    noise: Array = field(default_factory=lambda: np.zeros(0))
    #: of `output_error`: the free-run fit in percent that the search reached from each beginning;
    #: empty for the others
    starts: dict[str, float] = field(default_factory=dict)
    doubt: str = ""  #: why `covariance` is withheld, all NaN; empty where it is told
    #: errors of a and b as drawn, where a force that repeats along the way or rounding to counts
    #: makes them other than normal
    draws: Array | None = None

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
        """Derivatives of the continuous poles by a and b, (na, na + nb); infinite for a double
        pole.

        A(p) = 0 gives dp / da_k = -p^(na - k) / A'(p), and ds = dp / (p dt).
        """
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
        return float(coverage.errors(self.covariance, self._gain_slopes)[0])

    @property
    def factors(self) -> Array:
        """Coverage factors (`coverage.factors`) of a and b, shape (2, na + nb)."""
        return coverage.factors(self.draws, np.eye(len(self.a) + len(self.b)))

    @property
    def gain_factors(self) -> Array:
        """Coverage factors of the static gain, shape (2,)."""
        return np.asarray(coverage.factors(self.draws, self._gain_slopes)[:, 0])

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

        top = np.r_[np.zeros(self.delay), self.b]
        return np.asarray(lfilter(top, np.r_[1.0, self.a], np.asarray(u, np.float64)))

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
        names = [f"a{i + 1}" for i in range(len(self.a))] + [
            f"b{i + 1}" for i in range(len(self.b))
        ]
        values = np.r_[self.a, self.b]
        errors = ["" if np.isnan(s) else f" +- {s:.2g}" for s in self.std]
        rows = [f"{n} {v:.6g}{e}" for n, v, e in zip(names, values, errors, strict=True)]
        state = "white" if self.whiteness.white else "not white"
        return f"{self.method}: " + ", ".join(rows) + f"; fit {self.fit:.2f} %, residuals {state}"


def withheld(fit: LinearFit, doubt: str) -> LinearFit:
    unknown = np.full_like(fit.covariance, np.nan)
    return replace(fit, covariance=unknown, doubt=doubt, draws=None)


def exact(fit: LinearFit) -> bool:
    left = sum(float(e @ e) for e in fit.residuals)
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(left <= _ROUNDING**2 * sum(float(y @ y) for y in fit.free_run))


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


def percent(outputs: list[Array], runs: tuple[Array, ...]) -> float:
    """Free-simulation fit over all records, each about its own mean."""
    missed = sum(float(((y - f) ** 2).sum()) for y, f in zip(outputs, runs, strict=True))
    spread = sum(float(((y - y.mean()) ** 2).sum()) for y in outputs)
    return 100.0 * (1.0 - (missed / spread) ** 0.5) if spread > 0.0 else float("nan")
