"""Turbulent wind speed at several points as a function of time.

The fluctuations are a stationary Gaussian vector process with given spectra and coherence, sampled at a step of
their own by an autoregressive model of order 25, and interpolated between the samples by the twice continuously
differentiable symmetric quintic filter. The samples that the filter needs from after the asked time are made
ahead, so that nothing is delayed; at the sample instants the value is the sample. The realization depends on the
seed, the sampling step and the wind, and not on when it is asked.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError, StepError
from tlpsim.loads.filters.arma import AutoregressiveProcess, ProcessState, correlation_from_spectrum
from tlpsim.loads.filters.interpolation import SYMMETRIC
from tlpsim.loads.wind.coherence import cross_spectrum, davenport
from tlpsim.loads.wind.spectra import WindPoints, logarithmic_wind_points, spectrum_by_name

FloatArray = NDArray[np.float64]

WIND_STREAM = 1
_FILTER = SYMMETRIC["quintic"]
_PHASES = 10**9  # time is resolved to this part of a sampling step, so that sample instants are met exactly
_CACHED_PHASES = 4096


class WindField:
    """Wind speed fluctuations at n points.

    The only state is a window of recent samples, and it is a cache: every value is a function of time alone.

    Parameters
    ----------
    points
        Height and mean speed of the points.
    spectrum
        Cross-spectra as a function of frequency (nf,) in Hz, shape (nf, n, n), m²/s² per Hz.
    variance
        Variance of the fluctuations over all frequencies, shape (n,), m²/s².
    sampling_step
        In s.
    order
        Order of the autoregressive model.
    seed
        Whole number that names the realization.

    Raises
    ------
    ScenarioError, SolverError
        If a parameter is out of range, or the model cannot be fitted.
    """

    def __init__(
        self,
        *,
        points: WindPoints,
        spectrum: Callable[[FloatArray], FloatArray],
        variance: FloatArray,
        sampling_step: float,
        order: int,
        seed: int,
    ) -> None:
        correlation = correlation_from_spectrum(spectrum, sampling_step, order)
        self.points = points
        self.spectrum = spectrum
        self.sampling_step = sampling_step
        self.sampled_variance: FloatArray = np.diagonal(correlation[0]).copy()
        self.sampled_variance.flags.writeable = False
        self.captured_variance: FloatArray = self.sampled_variance / variance
        self.captured_variance.flags.writeable = False
        self._count = _FILTER.before + _FILTER.after
        self._process = AutoregressiveProcess(correlation, seed, WIND_STREAM, self._count)
        self.model = self._process.model
        self._weights: dict[int, FloatArray] = {}

    def fluctuation(self, time: float) -> FloatArray:
        """Fluctuation of the wind speed at the points at `time` (s, >= 0), shape (n,), m/s.

        Raises
        ------
        StepError
            If the time is negative or not finite.
        """
        if not 0.0 <= time < np.inf:
            raise StepError(f"wind field asked for time {time} s; its record starts at 0 s, shift the start of the run")
        index, phase = divmod(round(time / self.sampling_step * _PHASES), _PHASES)
        weights = self._weights.get(phase)
        if weights is None:
            if len(self._weights) >= _CACHED_PHASES:
                self._weights.clear()
            weights = self._weights[phase] = _FILTER.weights(phase / _PHASES)
        # Sample `before - 1` of the stream lies at time zero, so that the window of time zero starts at sample 0.
        result: FloatArray = weights @ self._process.window(index, self._count)
        return result

    def get_state(self) -> ProcessState:
        """Snapshot that `set_state` restores exactly: index of the newest sample, and recent samples."""
        return self._process.get_state()

    def set_state(self, state: ProcessState) -> None:
        """Restore a snapshot of a field of the same parameters.

        Raises
        ------
        ScenarioError
            If the snapshot is of another shape.
        """
        self._process.set_state(state)


def wind_field(
    *,
    position: FloatArray,
    heading: float,
    speed_10: float,
    roughness_length: float = 0.005,
    spectrum: str = "kaimal",
    lateral_coherence: float = 16.0,
    vertical_coherence: float = 10.0,
    sampling_step: float = 1.0,
    order: int = 25,
    seed: int = 0,
) -> WindField:
    """Wind field at given points in a logarithmic profile, with Davenport's coherence.

    Parameters
    ----------
    position
        Points, shape (n, 3), m.
    heading
        Direction toward which the wind blows, rad.
    speed_10
        Mean wind speed at 10 m, m/s.
    roughness_length
        z0, m.
    spectrum
        Name in `SPECTRA`.
    lateral_coherence, vertical_coherence
        Davenport's decay coefficients.
    sampling_step, order, seed
        See `WindField`. The window of 25 steps should be 25 s or longer.

    Raises
    ------
    ScenarioError
        If a parameter is out of range or the spectrum is not known.
    SolverError
        If the autoregressive model cannot be fitted.
    """
    position = np.array(position, dtype=np.float64)
    if position.ndim != 2 or position.shape[1:] != (3,) or not np.all(np.isfinite(position)):
        raise ScenarioError(f"wind points have shape {position.shape}; they must be finite, of shape (n, 3)")
    if not np.isfinite(heading):
        raise ScenarioError(f"wind heading is {heading} rad; it must be finite")
    family = spectrum_by_name(spectrum)
    points = logarithmic_wind_points(position[:, 2], speed_10, roughness_length)
    return WindField(
        points=points,
        spectrum=cross_spectrum(
            lambda frequency: family.density(frequency, points),
            lambda frequency: davenport(
                frequency, position, points.speed, heading, lateral_coherence, vertical_coherence
            ),
        ),
        variance=family.variance(points),
        sampling_step=sampling_step,
        order=order,
        seed=seed,
    )
