"""Turbulent wind speed at several points as a function of time.

The fluctuations are a stationary Gaussian vector process with given spectra and coherence. A vector ARMA model, fitted
by two-stage matching, samples it at a step of its own, and the samples are interpolated by the twice continuously
differentiable symmetric quintic filter. Those that the filter needs from after the asked time are made ahead, so that
nothing is delayed; at the sample instants the value is the sample. The realization depends on the seed, the sampling
step and the wind, and not on when it is asked.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError, StepError
from tlpsim.loads.filters.arma import FilterFitWarning, Fit, Orders, covariance, fit
from tlpsim.loads.filters.interpolation import SYMMETRIC
from tlpsim.loads.filters.known_fits import known_fit
from tlpsim.loads.filters.process import ArmaProcess, ProcessState
from tlpsim.loads.wind.admittance import admittance_by_name
from tlpsim.loads.wind.coherence import DEFAULT_DECAY, Decay, coherence_by_name, cross_spectrum, loosened
from tlpsim.loads.wind.profile import Profile
from tlpsim.loads.wind.spectra import spectrum_by_name, wind_points

FloatArray = NDArray[np.float64]
Spectrum = Callable[[FloatArray], FloatArray]

WIND_STREAM = 1
DEFAULT_ORDERS = Orders(long=25, autoregressive=3, moving_average=3)
"""Those of Li and Kareem (1990): AR(25), then ARMA(3, 3)."""

_FILTER = SYMMETRIC["quintic"]
_PHASES = 10**9  # time is resolved to this part of a sampling step, so that sample instants are met exactly
_CACHED_PHASES = 4096
# Frequencies over which a whole variance is integrated, Hz; the tails of all spectra beyond hold less than 1e-4.
_ALL_FREQUENCIES = np.geomspace(1e-8, 1e6, 3000)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gusts:
    """What the turbulence is like, and how it is sampled.

    Parameters
    ----------
    spectrum
        Name in `tlpsim.loads.wind.spectra.SPECTRA`.
    coherence
        Name in `tlpsim.loads.wind.coherence.COHERENCES`.
    decay
        Coefficients of Davenport's coherence.
    admittance
        Name in `tlpsim.loads.wind.admittance.ADMITTANCES`.
    sampling_step
        In s. The window of the long autoregression, 25 steps, should be 25 s or longer.
    orders
        Of the digital filter.
    seed
        Whole number that names the realization.
    """

    spectrum: str = "kaimal"
    coherence: str = "davenport"
    decay: Decay = DEFAULT_DECAY
    admittance: str = "none"
    sampling_step: float = 1.0
    orders: Orders = DEFAULT_ORDERS
    seed: int = 0


class SpeedField(Protocol):
    """Wind speed at n points: a mean and a fluctuation about it."""

    speed: FloatArray
    """Mean, shape (n,), m/s"""
    sampled_variance: FloatArray
    """Variance of the fluctuation, shape (n,), m²/s²"""

    def fluctuation(self, time: float) -> FloatArray:
        """Fluctuation at `time` (s), shape (n,), m/s."""

    def get_state(self) -> ProcessState:
        """Snapshot that `set_state` restores exactly."""

    def set_state(self, state: ProcessState) -> None:
        """Restore a snapshot."""


class WindField:
    """Wind speed at n points, from a digital filter.

    The only state is a window of recent samples, and it is a cache: every value is a function of time alone.

    Parameters
    ----------
    speed
        Mean speed at the points, shape (n,), m/s.
    spectrum
        Cross-spectra as a function of frequency (nf,) in Hz, shape (nf, n, n), m²/s² per Hz.
    fitted
        Digital filter of these spectra.
    seed
        Whole number that names the realization.

    Raises
    ------
    ScenarioError
        If the seed is out of range.
    """

    def __init__(self, *, speed: FloatArray, spectrum: Spectrum, fitted: Fit, seed: int) -> None:
        self.speed = speed
        self.spectrum = spectrum
        self.model = fitted.model
        self.sampling_step = fitted.model.step
        self.certificate = fitted.certificate
        self.sampled_variance: FloatArray = np.diagonal(covariance(self.model, 0)[0]).copy()
        self.sampled_variance.flags.writeable = False
        self._process = ArmaProcess(self.model, seed, WIND_STREAM, _FILTER.before + _FILTER.after)
        self._weights: dict[int, FloatArray] = {}

    @property
    def captured_variance(self) -> FloatArray:
        """Part of the variance over all frequencies that the samples hold, shape (n,)."""
        density = np.diagonal(self.spectrum(_ALL_FREQUENCIES), axis1=1, axis2=2)
        # Trapezoids over the logarithm of the frequency; the integrand vanishes at both ends.
        whole = np.sum(density * _ALL_FREQUENCIES[:, None], axis=0) * np.log(_ALL_FREQUENCIES[1] / _ALL_FREQUENCIES[0])
        return np.asarray(self.sampled_variance / whole)

    def fluctuation(self, time: float) -> FloatArray:
        """Fluctuation of the wind speed at the points at `time` (s, >= 0), shape (n,), m/s.

        Raises
        ------
        StepError
            If the time is negative or not finite.
        """
        _check_time(time)
        index, phase = divmod(round(time / self.sampling_step * _PHASES), _PHASES)
        weights = self._weights.get(phase)
        if weights is None:
            if len(self._weights) >= _CACHED_PHASES:
                self._weights.clear()
            weights = self._weights[phase] = _FILTER.weights(phase / _PHASES)
        # Sample `before - 1` of the stream lies at time zero, so that the window of time zero starts at sample 0.
        result: FloatArray = weights @ self._process.window(index, len(weights))
        return result

    def get_state(self) -> ProcessState:
        """Snapshot that `set_state` restores exactly."""
        return self._process.get_state()

    def set_state(self, state: ProcessState) -> None:
        """Restore a snapshot of a field of the same parameters.

        Raises
        ------
        ScenarioError
            If the snapshot is of another shape.
        """
        self._process.set_state(state)


class StillAir:
    """No wind at n points."""

    def __init__(self, count: int) -> None:
        zeros = np.zeros(count)
        zeros.flags.writeable = False
        self.speed: FloatArray = zeros
        self.sampled_variance: FloatArray = zeros

    def fluctuation(self, time: float) -> FloatArray:
        """Zeros, shape (n,), m/s.

        Raises
        ------
        StepError
            If the time is negative or not finite.
        """
        _check_time(time)
        return np.zeros(len(self.speed))

    def get_state(self) -> ProcessState:
        """Snapshot that holds nothing."""
        empty = np.zeros((0, len(self.speed)))
        return ProcessState(index=0, samples=empty, noises=empty)

    def set_state(self, state: ProcessState) -> None:
        """There is nothing to restore."""


def _check_time(time: float) -> None:
    if not 0.0 <= time < np.inf:
        raise StepError(f"wind field asked for time {time} s; its record starts at 0 s, shift the start of the run")


def gust_spectrum(
    *, position: FloatArray, area: FloatArray, heading: float, profile: Profile, gusts: Gusts
) -> tuple[FloatArray, Spectrum]:
    """Mean speeds at the points, shape (n,), m/s, and cross-spectra of the speeds that act on areas there.

    Parameters
    ----------
    position
        Points, shape (n, 3), m.
    area
        Of the segments at the points, shape (n,), m²; only an admittance asks for them.
    heading
        Direction toward which the wind blows, rad.
    profile, gusts
        Mean and fluctuation.

    Raises
    ------
    ScenarioError
        If a parameter is out of range, or a name is not known.
    """
    position = np.array(position, dtype=np.float64)
    if position.ndim != 2 or position.shape[1:] != (3,) or not np.all(np.isfinite(position)):
        raise ScenarioError(f"wind points have shape {position.shape}; they must be finite, of shape (n, 3)")
    if not np.isfinite(heading):
        raise ScenarioError(f"wind heading is {heading} rad; it must be finite")
    family = spectrum_by_name(gusts.spectrum)
    coherence = coherence_by_name(gusts.coherence)
    admittance = admittance_by_name(gusts.admittance)
    points = wind_points(position[:, 2], profile)

    def density(frequency: FloatArray) -> FloatArray:
        return family.density(frequency, points) * admittance(frequency, area, points.speed) ** 2

    def root_coherence(frequency: FloatArray) -> FloatArray:
        return coherence(frequency, position, heading, points, gusts.decay)

    factor = loosened(
        density, root_coherence, 0.5 / float(require_positive("sampling step of the gusts", gusts.sampling_step, "s"))
    )
    return points.speed, cross_spectrum(density, lambda frequency: factor * root_coherence(frequency))


def wind_field(
    *, position: FloatArray, area: FloatArray, heading: float, profile: Profile, gusts: Gusts
) -> WindField | StillAir:
    """Wind at points of a platform; still air if its mean speed is zero. For the parameters see `gust_spectrum`.

    Raises
    ------
    ScenarioError
        If a parameter is out of range, or a name is not known.
    SolverError
        If the filter cannot be fitted.

    Warns
    -----
    FilterFitWarning
        If the filter misses the spectra by more than the limits of its certificate.
    """
    if profile.speed_10 == 0.0:
        return StillAir(len(position))
    speed, spectrum = gust_spectrum(position=position, area=area, heading=heading, profile=profile, gusts=gusts)
    # The realization's seed is no part of the filter.
    key = ("gusts", _rows(position), _rows(area), heading, profile, replace(gusts, seed=0))
    fitted = known_fit(key, lambda: _fitted(spectrum, gusts))
    if fitted.certificate.advice:
        warnings.warn(
            f"gusts, spectrum {gusts.spectrum!r}: {fitted.certificate.advice}", FilterFitWarning, stacklevel=2
        )
    return WindField(speed=speed, spectrum=spectrum, fitted=fitted, seed=gusts.seed)


def _rows(array: FloatArray) -> tuple[Any, ...]:
    """An array as a part of a key."""
    rows = np.asarray(array, dtype=np.float64).tolist()
    return tuple(tuple(row) if isinstance(row, list) else row for row in rows)


def _fitted(spectrum: Spectrum, gusts: Gusts) -> Fit:
    # With one thread, since another number of them would change the last bits, and so the record of a seed.
    with warnings.catch_warnings(), threadpool_limits(1, user_api="blas"):
        warnings.simplefilter("ignore", FilterFitWarning)
        return fit(spectrum, gusts.sampling_step, orders=gusts.orders)
