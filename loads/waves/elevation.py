"""The sea by digital filters: an ARMA elevation, and the discrete convolution of it with any transfer function.

The elevation at the origin of each direction is a stationary ARMA process sampled at a step dt. A quantity with
the transfer function H(f) is its convolution with the kernel of weighted least squares (equations (1) to (3) of
`tlpsim.loads.filters.convolution`). That kernel is linear in the values of H on the frequency grid f_j,

    h_k = sum_j Re{H(f_j)} g'_jk + Im{H(f_j)} g"_jk                                                  (1)

so that with the local amplitudes

    a_j(t_n) = sum_k (g'_jk - i g"_jk) eta_{n-k},      q(t_n) = sum_k h_k eta_{n-k} = Re{sum_j H(f_j) a_j(t_n)}   (2)

one pass over the window of samples serves every quantity, and the factors of H that vary in time are exact:

    exp(i omega_j s) for a time t_n + s between two samples,   exp(-i k_j x) for a place x               (3)

are the kernels of that very time and place, without any interpolation. Samples later than t are made ahead.

Band. The weights of a kernel may only be as long as the window, while the chirp exp(-ikx) delays a frequency by x over
its group speed, without bound for rising f. Above a highest frequency f_c strip theory means nothing any more, so
there the amplitudes are taken to zero by a factor of equal power about f_c (cos² + sin² = 1),

    T(f) = cos(pi/4 (1 + (f - f_c) / (0.1 f_c))),   0.9 f_c < f < 1.1 f_c                             (4)

Voids. The fit of an ARMA model needs a white floor under the voids of a wave spectrum, here 1e-4 of its peak. Above f_c
eq. (4) takes it out. Toward zero frequency, where the pressure under a hull does not fade, it would make 10 to 30 % of
the standard deviation of the heave force; so H gets the factor

    V(f) = 1/2 - 1/2 cos(pi (f - 0.4 f_v) / (0.6 f_v)),   0.4 f_v < f < f_v                          (5)

with f_v the frequency below which lie 1e-5 of the variance (0.57 fp for Pierson-Moskowitz). A sharper one, such as
sqrt(S / S_model), would need a longer window. What is left changes standard deviations by less than 0.5 %.

Window. It reaches to either side by the delay of f_c over the greatest distance at which waves are asked for, and by
the inverse of the width of eq. (4). For the ISSC platform, f_c = 0.35 Hz, 61 m of reach on the hull and 30 m for its
offset, these are 41 and 14 s. Errors of the water velocity (root mean square, relative, largest over the strips) by
half of the window, Pierson-Moskowitz, Tp = 14.5 s, 21.6 degrees, without and with an offset of 20 m along the waves,
from `tests/loads/waves/test_elevation.py::test_documented_kernel_errors`:

                            20 s              30 s              40 s              50 s              60 s
    strips at -2.5 m   6.4e-2  1.7e-1    7.3e-3  4.4e-2    9.0e-4  5.8e-3    4.1e-4  8.9e-4    2.3e-4  3.8e-4
    pontoons           9.4e-5  2.2e-3    4.2e-5  4.7e-5    5.8e-6  6.5e-6    1.3e-6  1.6e-6    6.2e-7  7.3e-7

Deep down 20 s would do; it is the strips next to the surface, where the slow short waves are, that ask for more.
"""

import warnings
from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError, StepError
from tlpsim.loads.filters.arma import Fit, Orders, fit
from tlpsim.loads.filters.certificate import Certificate, FilterFitWarning
from tlpsim.loads.filters.convolution import ToeplitzKernels, floored
from tlpsim.loads.filters.known_fits import known_fit
from tlpsim.loads.filters.model import spectrum
from tlpsim.loads.filters.process import ArmaProcess, ProcessState
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.sea import SeaState, wave_stream

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

DEFAULT_ORDERS = Orders(long=59, autoregressive=8, moving_average=7)
DEFAULT_SAMPLING_STEP = 0.5
OFFSET_ALLOWANCE = 30.0
"""m, offset of the platform that the window has room for; further out the errors grow slowly"""

_WHITE_FLOOR = 1e-4
_TRANSITION = 0.1
_VOID_SHARE = 1e-5
_VOID_GRID = 10_001
# Frequencies a unit of bandwidth over the length of the window; 2 to 4 give the same errors to two digits.
_GRID_DENSITY = 2.5
_EARLIER_SAMPLES = 8  # before time zero, so that differences can be taken there
_PHASES = 10**9  # time is resolved to this part of a sampling step, so that sample instants are met exactly


def transition(frequency: FloatArray, highest_frequency: float) -> FloatArray:
    """Factor T of eq. (4) at `frequency` (Hz): one in the band, zero above."""
    place = np.clip((frequency / highest_frequency - 1.0) / _TRANSITION, -1.0, 1.0)
    return np.asarray(np.cos(0.25 * np.pi * (1.0 + place)))


def voids(frequency: FloatArray, state: SeaState, nyquist: float) -> FloatArray:
    """Factor V of eq. (5) at `frequency` (Hz), for samples that hold the waves up to `nyquist` (Hz)."""
    fine = np.linspace(0.0, nyquist, _VOID_GRID)
    energy = np.cumsum(state.density(fine))
    edge = fine[np.searchsorted(energy, _VOID_SHARE * energy[-1])]
    if edge == 0.0:
        return np.ones_like(frequency)
    place = np.clip((frequency / edge - 0.4) / 0.6, 0.0, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * place))


def window_half_length(state: SeaState, reach: float) -> float:
    """Half of the window in s for waves up to `reach` m from the origin, see the head of this file."""
    top = np.array([0.999, 1.001]) * 2.0 * np.pi * state.highest_frequency
    slowness = float(np.diff(wavenumber(top, state.water_depth, state.gravity))[0] / np.diff(top)[0])
    return slowness * reach + 1.0 / (2.0 * _TRANSITION * state.highest_frequency)


@njit(cache=True)
def _local_amplitudes(analysis: FloatArray, window: FloatArray, sums: FloatArray) -> None:
    """Sums of eq. (2), real parts first; `analysis` (taps, 2n), `window` (taps, 1), oldest sample first."""
    sums[:] = 0.0
    for tap in range(analysis.shape[0]):
        sample = window[tap, 0]
        for j in range(analysis.shape[1]):
            sums[j] += analysis[tap, j] * sample


class ArmaSea:
    """A sea whose elevation is made by recursive digital filters; a `tlpsim.loads.waves.sea.Sea`.

    Its only state is the windows of recent samples, and they are a cache: every value is a function of time alone.

    Parameters
    ----------
    state
        Spectrum, directions, water and highest frequency; the lowest one has no effect, since nothing is cut there.
    sampling_step
        Of the elevation, s. The realization depends on it, and not on when it is asked.
    orders
        Of the long autoregressive and of the final ARMA model.
    reach
        Greatest distance from the origin in m at which waves will be asked for.
    seed
        Whole number that names the realization.

    Raises
    ------
    ScenarioError
        If a parameter is out of range, the sampling step is too long for the band, or the sea is calm.
    SolverError
        If the filter cannot be fitted.
    """

    def __init__(
        self,
        state: SeaState,
        *,
        sampling_step: float = DEFAULT_SAMPLING_STEP,
        orders: Orders = DEFAULT_ORDERS,
        reach: float = 100.0,
        seed: int = 0,
    ) -> None:
        require_positive("sampling step of the waves", sampling_step, "s")
        top, nyquist = (1.0 + _TRANSITION) * state.highest_frequency, 0.5 / sampling_step
        if top >= nyquist:
            raise ScenarioError(
                f"sampling step of the waves is {sampling_step} s, whose Nyquist frequency {nyquist:.4g} Hz lies below "
                f"{top:.4g} Hz, the end of the band; take at most {0.5 / top:.3g} s or lower the highest frequency"
            )
        if not (np.isfinite(reach) and reach >= 0.0):
            raise ScenarioError(f"reach of the waves is {reach} m; it must be finite and >= 0")
        # Directions are no part of the filter.
        level = replace(state, heading=0.0, directions=1, spreading_exponent=1.0)
        fitted = known_fit(("elevation", level, sampling_step, orders), lambda: _fitted(level, sampling_step, orders))
        if fitted.certificate.advice:
            shape = "of the table" if state.table is not None else repr(state.spectrum)
            warnings.warn(f"elevation, spectrum {shape}: {fitted.certificate.advice}", FilterFitWarning, stacklevel=2)
        self.state = state
        self.sampling_step = sampling_step
        self.model = fitted.model
        self.certificate: Certificate = fitted.certificate
        self.half = int(np.ceil(window_half_length(state, reach) / sampling_step))
        taps = 2 * self.half + 1
        count = int(np.ceil(_GRID_DENSITY * nyquist * taps * sampling_step))
        grid = nyquist * (np.arange(count) + 0.5) / count
        made = spectrum(self.model, grid)[:, 0, 0].real
        kernels = ToeplitzKernels(floored(made), grid, sampling_step, self.half, self.half)
        used = grid < top
        self.frequency = grid[used]
        self.frequency.flags.writeable = False
        factor = voids(self.frequency, state, nyquist) * transition(self.frequency, state.highest_frequency)
        self._analysis = _analysis(kernels, used, factor)

        parts = state.spread()
        number = wavenumber(2.0 * np.pi * self.frequency, state.water_depth, state.gravity)
        self.angular_frequency: FloatArray = np.tile(2.0 * np.pi * self.frequency, len(parts.share))
        self.wavenumber: FloatArray = np.tile(number, len(parts.share))
        self.heading: FloatArray = np.repeat(parts.heading, len(number))
        self.water_depth, self.gravity = state.water_depth, state.gravity
        self._scale = np.sqrt(parts.share)
        self._processes = [ArmaProcess(self.model, seed, wave_stream(j), taps) for j in range(len(parts.share))]
        self._sums = np.zeros(2 * len(self.frequency))

    @property
    def earliest(self) -> float:
        """Earliest time that can be asked for, s, a little before zero."""
        return -_EARLIER_SAMPLES * self.sampling_step

    def amplitudes(self, time: float) -> ComplexArray:
        """Local amplitudes of eq. (2) at `time` (s), shape (N,), m, direction after direction.

        Raises
        ------
        StepError
            If the time lies before the record or is not finite.
        """
        if not self.earliest <= time < np.inf:
            raise StepError(f"waves asked for time {time} s; their record starts at 0 s, shift the start of the run")
        index, phase = divmod(round(time / self.sampling_step * _PHASES), _PHASES)
        count = len(self.frequency)
        turn = np.exp(1j * (self.angular_frequency[:count] * (phase / _PHASES * self.sampling_step)))
        result = np.empty((len(self._processes), count), dtype=np.complex128)
        for j, process in enumerate(self._processes):
            # Time zero is the sample `half + _EARLIER_SAMPLES` of the stream, the middle of its window.
            window = process.window(index + _EARLIER_SAMPLES, len(self._analysis))
            _local_amplitudes(self._analysis, window, self._sums)
            result[j] = (self._sums[:count] - 1j * self._sums[count:]) * turn * self._scale[j]
        return result.ravel()

    def samples(self, first: int, count: int) -> FloatArray:
        """Elevations of the directions at the origin at times first dt, (first + 1) dt, ..., shape (count, M), m.

        These are the samples of the processes, with what they hold above the highest frequency.
        """
        taps = len(self._analysis)
        offset = first + self.half + _EARLIER_SAMPLES
        blocks = [
            [process.window(offset + k, min(taps, count - k)).copy() for k in range(0, count, taps)]
            for process in self._processes
        ]
        return np.hstack([np.concatenate(block) for block in blocks]) * self._scale

    def kernels(self, transfer: ComplexArray) -> FloatArray:
        """Weights h_k of eq. (1), with the factors of eq. (4) and (5), for inspection.

        Parameters
        ----------
        transfer
            Values at `frequency`, shape (rows, n).

        Returns
        -------
        Shape (rows, 2 half + 1), of the lags -half ... half, as `tlpsim.loads.filters.convolution` has them.
        """
        parts = np.hstack([transfer.real, transfer.imag])
        return np.asarray(parts @ self._analysis.T[:, ::-1])

    def get_state(self) -> list[ProcessState]:
        """Snapshot that `set_state` restores exactly, one process a direction."""
        return [process.get_state() for process in self._processes]

    def set_state(self, states: list[ProcessState]) -> None:
        """Restore a snapshot of a sea of the same parameters.

        Raises
        ------
        ScenarioError
            If the snapshot is of another shape.
        """
        if len(states) != len(self._processes):
            raise ScenarioError(f"state of the waves has {len(states)} directions; it must be {len(self._processes)}")
        for process, state in zip(self._processes, states, strict=True):
            process.set_state(state)


def _fitted(state: SeaState, sampling_step: float, orders: Orders) -> Fit:
    # With one thread, since another number of them would change the last bits, and so the record of a seed.
    with warnings.catch_warnings(), threadpool_limits(1, user_api="blas"):
        warnings.simplefilter("ignore", FilterFitWarning)
        return fit(state.density, sampling_step, orders=orders, white_floor=_WHITE_FLOOR, polish=True)


def _analysis(kernels: ToeplitzKernels, used: NDArray[np.bool_], factor: FloatArray) -> FloatArray:
    """Matrix of eq. (2), shape (taps, 2n): g' of the used frequencies, then g", the oldest sample's row first."""
    unit = np.diag(used.astype(np.float64))[:, used] * factor
    parts = np.vstack([kernels.kernels(unit), kernels.kernels(1j * unit)])
    return np.ascontiguousarray(parts[:, ::-1].T)
