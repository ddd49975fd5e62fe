"""Fit of a vector ARMA model to given spectra: two-stage matching, polish, fallback, certificate.

The long autoregression and the matched ARMA model are in `matching`, the record and its theory in `model`, the scalar
refinement in `polish`, the figures in `certificate`, the stream of samples in `process`. Here they are put together:

1.  The spectrum is checked (Hermitian, positive semi-definite, finite, its peak below the Nyquist frequency), and its
    correlations are computed.
2.  Components that are combinations of others (coincident points, coherence one) are left out: with R_0 scaled to a
    unit diagonal, the eigenvectors of vanishing eigenvalues carry no motion at any frequency. The model is fitted to
    the others and mapped back. Where round-off still makes the correlations indefinite, white noise of 1e-12 to 1e-6
    of the variance is added (ridge).
3.  AR(P), then ARMA(p, q): matched at as many lags as there are unknowns, and by least squares at more, up to P. Of
    those that are stable the one is taken that meets the spectra best. If none is stable, both orders fall by one until
    one is; at last AR(P) itself is taken, which is stable by construction.
4.  The variance is restored exactly, and the certificate made. If it is not good, a warning says by how much, and which
    orders would do.
"""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.filters.certificate import DEFAULT_LIMITS, Certificate, FilterFitWarning, Limits, model_errors
from tlpsim.loads.filters.matching import autoregressive_fit, matched_arma, with_variance
from tlpsim.loads.filters.model import ArmaModel, covariance, require_stable, spectrum, transformed
from tlpsim.loads.filters.polish import polished

__all__ = [
    "ArmaModel",
    "Certificate",
    "FilterFitWarning",
    "Fit",
    "Limits",
    "Orders",
    "covariance",
    "fit",
    "recommended_orders",
    "spectrum",
]

FloatArray = NDArray[np.float64]
Array = NDArray[np.float64] | NDArray[np.complex128]
Spectrum = Callable[[FloatArray], Array]

_INTERVALS = 2**14  # of the frequency between zero and Nyquist
_CHECKS = 256  # frequencies at which the spectral matrix is checked
_BAND = (0.004, 0.8)  # default band of the certificate, over the Nyquist frequency ...
_VOID_BAND = (0.004, 1.0)  # ... and where a white floor or a polish takes care of voids
_BAND_POINTS = 1000
_VOID_LEVEL = 0.01  # where a white floor is used, the certificate leaves out what is below this part of the peak
_TAIL_DECADES = 3
_RANK_TOLERANCE = 1e-10
_RIDGES = (0.0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6)
_INDEFINITE = 1e-6
_CONDITION_ROWS = 200
_LAG_PARTS = (8, 4, 2, 1)  # a match by least squares asks for the lags up to P over one of these
_COMPARED = ("auto_error_max", "auto_error_rms", "cross_error_max", "coherence_error_max")


@dataclass(frozen=True, slots=True, kw_only=True)
class Orders:
    """Orders P of the long autoregression, p and q of the ARMA model.

    With `autoregressive` equal to `long` and `moving_average` zero the model is the long autoregression.

    Raises
    ------
    ScenarioError
        Unless 1 <= p <= P and 0 <= q <= P.
    """

    long: int = 25
    autoregressive: int = 3
    moving_average: int = 3

    def __post_init__(self) -> None:
        if not (1 <= self.autoregressive <= self.long and 0 <= self.moving_average <= self.long < _INTERVALS):
            raise ScenarioError(
                f"orders of a random process are {self}; the autoregressive order must be from 1 to the long one, the "
                f"moving-average order from 0 to the long one, and the long one below {_INTERVALS}"
            )

    def __str__(self) -> str:
        if (self.autoregressive, self.moving_average) == (self.long, 0):
            return f"AR({self.long})"
        return f"AR({self.long}) -> ARMA({self.autoregressive}, {self.moving_average})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """A fitted model and what it is worth."""

    model: ArmaModel
    certificate: Certificate


LADDER = (
    Orders(long=25, autoregressive=3, moving_average=3),
    Orders(long=50, autoregressive=5, moving_average=5),
    Orders(long=100, autoregressive=6, moving_average=6),
    Orders(long=100, autoregressive=8, moving_average=8),
    Orders(long=200, autoregressive=8, moving_average=8),
    Orders(long=200, autoregressive=12, moving_average=12),
)
"""Orders that `recommended_orders` tries for several components, the cheapest first."""

POLISHED_LADDER = tuple(Orders(long=59, autoregressive=p, moving_average=p - 1) for p in (4, 6, 8, 10, 12, 16))
"""The same for a polished model of one component."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Target:
    """What is asked of a model: checked spectra in the band of the certificate, and correlations at all lags."""

    step: float
    correlation: FloatArray  # of the target and its white floor, (lags + 1, m, m)
    variance: FloatArray  # (m, m), without the floor
    variance_lost: float
    frequency: FloatArray
    density: Array
    level: float
    white_floor: float
    sample: Callable[[FloatArray], FloatArray]  # auto-spectrum of the first component


def _matrices(spectrum: Spectrum, frequency: FloatArray) -> Array:
    """Spectral matrices (nf, m, m), checked to be finite and Hermitian with positive diagonals."""
    density = np.asarray(spectrum(frequency))
    if density.ndim == 1:
        density = density[:, None, None]
    if density.ndim != 3 or density.shape != (len(frequency), density.shape[1], density.shape[1]):
        raise ScenarioError(
            f"spectrum of a random process has shape {density.shape} at {len(frequency)} frequencies; it must be "
            "(nf,) or (nf, m, m)"
        )
    if not np.all(np.isfinite(density)):
        place = frequency[np.flatnonzero(~np.all(np.isfinite(density), axis=(1, 2)))[0]]
        raise ScenarioError(f"spectrum of a random process is not finite at {place:.6g} Hz; it must be, from 0 Hz on")
    auto = np.real(np.einsum("fii->fi", density))
    if np.any(auto < 0.0):
        row, component = np.argwhere(auto < 0.0)[0]
        raise ScenarioError(
            f"spectrum of a random process is {auto[row, component]:.6g} at {frequency[row]:.6g} Hz (component "
            f"{component}); it must be >= 0"
        )
    skew = np.max(np.abs(density - np.conj(np.swapaxes(density, 1, 2))))
    if skew > 1e-9 * np.max(auto):
        raise ScenarioError(f"spectrum of a random process is not Hermitian: it differs by {skew:.3g} from its adjoint")
    if np.iscomplexobj(density):
        return np.asarray(density, dtype=np.complex128)
    return np.asarray(density, dtype=np.float64)


def _check_definite(density: Array, frequency: FloatArray) -> None:
    auto = np.real(np.einsum("fii->fi", density))
    scale = np.sqrt(np.where(auto > 0.0, auto, 1.0))
    values = np.linalg.eigvalsh(density / scale[:, :, None] / scale[:, None, :])[:, 0]
    worst = int(np.argmin(values))
    if values[worst] < -_INDEFINITE:
        raise ScenarioError(
            f"spectrum of a random process has no process at {frequency[worst]:.6g} Hz: its coherence matrix has the "
            f"eigenvalue {values[worst]:.3g}, which must be >= {-_INDEFINITE:g}"
        )


def _target(
    spectrum: Spectrum, step: float, lags: int, white_floor: float, voids: bool, band: tuple[float, float] | None
) -> _Target:
    if not (np.isfinite(step) and step > 0.0):
        raise ScenarioError(f"sampling step of a random process is {step} s; it must be finite and > 0")
    if not 0.0 <= white_floor < 1.0:
        raise ScenarioError(f"white floor of a random process is {white_floor}; it must be from 0 to 1")
    nyquist = 0.5 / step
    frequency = np.linspace(0.0, nyquist, _INTERVALS + 1)
    density = _matrices(spectrum, frequency)
    checked = slice(0, None, _INTERVALS // _CHECKS)
    _check_definite(density[checked], frequency[checked])
    auto = np.real(np.einsum("fii->fi", density))
    # irfft is 2 / n times the trapezoidal sum; with n = 2 intervals and df = fN / intervals the integral is
    # fN times the transform.
    correlation: FloatArray = nyquist * np.fft.irfft(density, axis=0)[: lags + 1]
    variance = correlation[0].copy()
    if not np.all(np.diagonal(variance) > 0.0):
        component = int(np.argmin(np.diagonal(variance)))
        raise ScenarioError(
            f"spectrum of a random process has no variance below the Nyquist frequency {nyquist:.6g} Hz (component "
            f"{component}); leave out what does not move"
        )
    beyond = nyquist * np.logspace(0.0, _TAIL_DECADES, 100 * _TAIL_DECADES + 1)
    tail = np.real(np.einsum("fii->fi", _matrices(spectrum, beyond)))
    for component in range(auto.shape[1]):
        if np.max(tail[:, component]) > np.max(auto[:, component]):
            peak = float(beyond[np.argmax(tail[:, component])])
            raise ScenarioError(
                f"sampling step of a random process is {step} s, with the Nyquist frequency {nyquist:.6g} Hz below the "
                f"spectrum's peak at {peak:.6g} Hz; it must be below {0.5 / peak:.3g} s, better {0.15 / peak:.3g} s"
            )
    lost = np.trapezoid(tail * beyond[:, None], np.log(beyond), axis=0)
    floor = white_floor * np.max(auto, axis=0)
    correlation[0] += nyquist * np.diag(floor)
    lowest, highest = _VOID_BAND if voids else _BAND
    low, high = band if band is not None else (lowest * nyquist, highest * nyquist)
    if not 0.0 < low < high <= nyquist:
        raise ScenarioError(
            f"band of the certificate is {low} to {high} Hz; it must lie between zero and the Nyquist frequency "
            f"{nyquist:.6g} Hz"
        )
    compared = np.geomspace(low, high, _BAND_POINTS)
    return _Target(
        step=step,
        correlation=correlation,
        variance=variance,
        variance_lost=float(np.max(lost / (lost + np.diagonal(variance)))),
        frequency=compared,
        density=_matrices(spectrum, compared),
        level=_VOID_LEVEL if voids else 0.0,
        white_floor=white_floor,
        sample=lambda at: np.real(_matrices(spectrum, at)[:, 0, 0]),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Autoregression:
    """AR(P) of components z = right y that are uncorrelated and of unit variance at lag zero; y = left z."""

    left: FloatArray
    right: FloatArray
    correlation: FloatArray
    model: ArmaModel
    ridge: float
    condition_number: float


def _condition(correlation: FloatArray) -> float:
    size = correlation.shape[1]
    blocks = max(1, min(len(correlation) - 1, _CONDITION_ROWS // size))
    scale = np.sqrt(np.diagonal(correlation[0]))
    scaled = correlation / scale[:, None] / scale[None, :]
    matrix = np.block([[scaled[i - j] if i >= j else scaled[j - i].T for j in range(blocks)] for i in range(blocks)])
    values = np.linalg.eigvalsh(matrix)
    return float(values[-1] / values[0]) if values[0] > 0.0 else float("inf")


def _long_autoregression(correlation: FloatArray, step: float) -> tuple[ArmaModel, FloatArray, float]:
    """AR(P), the correlations that it has, and the ridge over the variance that they needed."""
    scale = np.trace(correlation[0]) / correlation.shape[1]
    for ridge in _RIDGES:
        lifted = correlation.copy()
        lifted[0] += ridge * scale * np.eye(correlation.shape[1])
        try:
            model = autoregressive_fit(lifted, step)
            require_stable(model)
        except SolverError as error:
            failure = error
        else:
            return model, lifted, ridge
    raise SolverError(f"{failure} (tried with ridges of up to {_RIDGES[-1]:g} of the variance)")


def _candidates(orders: Orders) -> Iterator[Orders]:
    """Orders in the order of preference: as asked, then both lower by one, at last the long autoregression."""
    p, q = orders.autoregressive, orders.moving_average
    while p >= 1:
        yield Orders(long=orders.long, autoregressive=p, moving_average=q)
        p, q = p - 1, max(q - 1, 0)
    yield Orders(long=orders.long, autoregressive=orders.long, moving_average=0)


def _matches(target: _Target, long: _Autoregression, orders: Orders, polish: bool) -> Iterator[ArmaModel]:
    """Models of the independent components: of as many equations as unknowns, and of more."""
    p, q = orders.autoregressive, orders.moving_average
    if (p, q) == (orders.long, 0):
        yield long.model
        return
    model = matched_arma(long.model, long.correlation, p, q, lags=p)
    yield polished(model, target.sample, orders.long) if polish else model
    if not polish:
        for lags in sorted({max(p, orders.long // part) for part in _LAG_PARTS} - {p}):
            yield matched_arma(long.model, long.correlation, p, q, lags)


def _best_match(
    target: _Target, long: _Autoregression, orders: Orders, polish: bool, limits: Limits
) -> tuple[ArmaModel, dict[str, Any]]:
    """The model whose worst figure is the least, each over its limit; SolverError if there is none that is stable."""
    found, failures = [], []
    for match in _matches(target, long, orders, polish):
        try:
            restored = with_variance(match, long.right @ target.variance @ long.right.T)
            model = transformed(restored, long.left, long.right)
            errors = model_errors(model, target.density, target.frequency, np.diagonal(target.variance), target.level)
        except SolverError as error:
            failures.append(error)
        else:
            found.append((model, errors))
    if not found:
        raise failures[0]
    return min(found, key=lambda pair: max(pair[1][name] / getattr(limits, name) for name in _COMPARED))


def _autoregression(target: _Target, long: int) -> _Autoregression:
    correlation = target.correlation[: long + 1]
    scale = np.sqrt(np.diagonal(correlation[0]))
    values, vectors = np.linalg.eigh(correlation[0] / scale[:, None] / scale[None, :])
    moving = values > _RANK_TOLERANCE * values[-1]
    kept, deviation = vectors[:, moving], np.sqrt(values[moving])
    left = scale[:, None] * kept * deviation
    right = (kept / scale[:, None]).T / deviation[:, None]
    model, reduced, ridge = _long_autoregression(right @ correlation @ right.T, target.step)
    return _Autoregression(
        left=left,
        right=right,
        correlation=reduced,
        model=model,
        ridge=ridge,
        condition_number=_condition(reduced),
    )


def _fit(target: _Target, long: _Autoregression, orders: Orders, polish: bool, limits: Limits) -> Fit:
    fallback = ""
    for used in _candidates(orders):
        try:
            model, errors = _best_match(target, long, used, polish, limits)
        except SolverError as error:
            fallback = fallback or f"{used}: {error}"
        else:
            break
    else:
        raise SolverError(f"ARMA fit: no model of the orders {orders} or lower ones can be used; {fallback}")
    certificate = Certificate(
        band=(float(target.frequency[0]), float(target.frequency[-1])),
        level=target.level,
        variance_lost=target.variance_lost,
        condition_number=long.condition_number,
        orders_asked=str(orders),
        orders_used=str(used),
        fallback=fallback,
        rank=len(long.right),
        white_floor=target.white_floor,
        ridge=long.ridge,
        limits=limits,
        **errors,
    )
    return Fit(model=model, certificate=certificate)


def fit(
    spectrum: Spectrum,
    step: float,
    *,
    orders: Orders = Orders(),
    white_floor: float = 0.0,
    polish: bool = False,
    band: tuple[float, float] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Fit:
    """ARMA model of a process with given spectra, sampled at `step`, and its certificate.

    Parameters
    ----------
    spectrum
        Function of frequency (nf,) in Hz, from 0 on, that returns one-sided spectra in unit²/Hz: cross-spectra of shape
        (nf, m, m), or one auto-spectrum of shape (nf,).
    step
        Sampling step in s. What the spectrum holds above the Nyquist frequency 1 / (2 step) is left out.
    orders
        P, p and q.
    white_floor
        White noise added to the target before the match, over the peak of the spectrum: needed where the spectrum has
        voids, as that of waves below its peak. 1e-4 is usual.
    polish
        Refine the model of one component by least squares on its spectrum; stable and minimum-phase by construction.
    band
        Lowest and highest frequency in Hz of the comparison in the certificate; by default 0.4 % to 80 % of the Nyquist
        frequency. With a white floor or a polish it counts only where the spectrum is above 1 % of its peak.
    limits
        What the certificate holds to be good enough.

    Raises
    ------
    ScenarioError
        If the spectrum or a parameter is bad: not finite, negative, no process, without variance, with its peak above
        the Nyquist frequency.
    SolverError
        If no model can be fitted.

    Warns
    -----
    FilterFitWarning
        If the certificate is not to be trusted; says the figure, its limit and the orders that would do.
    """
    target = _target(spectrum, step, orders.long, white_floor, white_floor > 0.0 or polish, band)
    if polish and len(target.variance) > 1:
        raise ScenarioError(f"ARMA fit: the polish is for one component, not for {len(target.variance)}")
    result = _fit(target, _autoregression(target, orders.long), orders, polish, limits)
    if result.certificate.trusted:
        return result
    better = recommended_orders(spectrum, step, white_floor=white_floor, polish=polish, band=band, limits=limits)
    certificate = replace(result.certificate, advice=_advice(result.certificate, step, better))
    warnings.warn(certificate.advice, FilterFitWarning, stacklevel=2)
    return Fit(model=result.model, certificate=certificate)


def recommended_orders(
    spectrum: Spectrum,
    step: float,
    *,
    white_floor: float = 0.0,
    polish: bool = False,
    band: tuple[float, float] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Orders | None:
    """First orders of a ladder whose fit is within the limits; None if none is. Arguments as those of `fit`.

    Raises
    ------
    ScenarioError
        If the spectrum or a parameter is bad.
    """
    ladder = POLISHED_LADDER if polish else LADDER
    target = _target(
        spectrum, step, max(orders.long for orders in ladder), white_floor, white_floor > 0.0 or polish, band
    )
    for long, steps in groupby(ladder, key=lambda orders: orders.long):
        try:
            autoregression = _autoregression(target, long)
        except SolverError:
            continue
        for orders in steps:
            if _fit(target, autoregression, orders, polish, limits).certificate.trusted:
                return orders
    return None


def _advice(certificate: Certificate, step: float, better: Orders | None) -> str:
    missed = "; ".join(
        f"{name.replace('_', ' ')} {getattr(certificate, name):.3g}, limit {getattr(certificate.limits, name):.3g}"
        for name in certificate.misses
    )
    remedy = f"{better} would do" if better else "no orders tried would do, choose another sampling step"
    return f"{certificate.orders_used} at a step of {step:g} s misses its spectrum: {missed}; {remedy}"
