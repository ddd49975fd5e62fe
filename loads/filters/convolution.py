"""Discrete convolution: a linear transfer function as a short filter on a sampled reference process.

    y_n = sum_{k=-before..after} h_k x_{n-k},      K(f) = sum_k h_k exp(-i 2 pi f k dt)              (1)
    h = argmin int_0^{fN} W(f) |H(f) - K(f)|^2 df                                                    (2)
    sum_l r_{k-l} h_l = b_k,   r_k = int W cos(2 pi f k dt) df,   b_k = int W Re{H exp(i 2 pi f k dt)} df   (3)

This is the discrete convolution model of Li and Kareem (1990): water velocities, pressures and wave forces from
the surface elevation. Instead of cutting the Fourier series of H with a window, the weights are those that make
the error of the output least when x has the spectrum W. The matrix of (3) is symmetric, Toeplitz, and the same
for all transfer functions, so it is factorized once. Taps with k < 0 use samples later than n: the reference is
a source that can be run ahead, and y has no delay.

H may carry any phase: exp(i 2 pi f s dt) gives y at the fraction s of a step after t_n, exp(-i k x) the wave's
travel over a distance x. The shortest kernel that will do is the longest of these delays and some periods.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.checks import require_positive
from tlpsim.loads.errors import ScenarioError, SolverError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Weights are found to condition number times 1e-16 of their size: 1e-6 is left at this limit.
_LARGEST_CONDITION = 1e10


def floored(density: FloatArray, floor: float = 1e-6) -> FloatArray:
    """Weight for eq. (2) from the spectrum of the reference: S + floor max S, same shape.

    A spectrum with voids leaves the gain there open, and eq. (3) singular; the floor keeps it small.
    """
    return density + floor * float(np.max(density))


def quadrature(frequency: FloatArray) -> FloatArray:
    """Trapezoidal integration weights of a rising frequency grid (nf,), Hz."""
    widths = np.diff(frequency)
    return 0.5 * (np.concatenate([widths, [0.0]]) + np.concatenate([[0.0], widths]))


def fraction_of_step(frequency: FloatArray, step: float, fraction: float) -> ComplexArray:
    """Transfer function (nf,) of an advance by `fraction` of a step: y_n is then x at t_n + fraction step."""
    return np.asarray(np.exp(2j * np.pi * frequency * step * fraction))


def _checked_grid(frequency: FloatArray, weight: FloatArray, step: float, taps: int) -> tuple[FloatArray, FloatArray]:
    frequency = np.asarray(frequency, dtype=np.float64)
    weight = np.asarray(weight, dtype=np.float64)
    require_positive("sampling step of a convolution kernel", step, "s")
    if frequency.ndim != 1 or weight.shape != frequency.shape:
        raise ScenarioError(
            f"convolution kernel: shapes of frequency {frequency.shape} and weight {weight.shape} must be one (nf,)"
        )
    nyquist = 0.5 / step
    if len(frequency) < 2 or np.any(np.diff(frequency) <= 0.0) or frequency[0] < 0.0:
        raise ScenarioError("convolution kernel: frequencies must rise from 0 Hz or more")
    if frequency[-1] > nyquist * (1.0 + 1e-9):
        raise ScenarioError(
            f"convolution kernel: frequency {frequency[-1]:g} Hz is above the Nyquist frequency {nyquist:g} Hz of the "
            f"step {step:g} s; cut the grid there"
        )
    if not np.all(np.isfinite(weight)) or np.any(weight < 0.0) or not np.any(weight > 0.0):
        raise ScenarioError("convolution kernel: the weight must be finite, nowhere negative and somewhere positive")
    spacing, limit = float(np.diff(frequency).max()), 0.5 / (taps * step)
    if spacing > limit:
        raise ScenarioError(
            f"convolution kernel: frequencies are {spacing:g} Hz apart; a kernel of {taps * step:g} s needs "
            f"{limit:g} Hz or less"
        )
    return frequency, weight


def _checked_transfer(transfer: ArrayLike, frequencies: int) -> ComplexArray:
    values = np.asarray(transfer, dtype=np.complex128)
    values = values[:, np.newaxis] if values.ndim == 1 else values
    if values.ndim != 2 or len(values) != frequencies:
        raise ScenarioError(
            f"convolution kernel: transfer function has shape {values.shape}; it must be ({frequencies}, rows)"
        )
    if not np.all(np.isfinite(values)):
        raise ScenarioError("convolution kernel: transfer function is not finite on the frequency grid")
    return values


def _normal_matrix(measure: FloatArray, angle: FloatArray, taps: int) -> FloatArray:
    """The matrix r_{k-l} of eq. (3), shape (taps, taps)."""
    lags = np.arange(taps)
    row = np.cos(np.outer(lags, angle)) @ measure
    matrix = row[np.abs(np.subtract.outer(lags, lags))]
    condition = float(np.linalg.cond(matrix))
    if not condition < _LARGEST_CONDITION:
        raise SolverError(
            f"convolution kernel of {taps} taps: condition number {condition:.3g}, limit {_LARGEST_CONDITION:g}; "
            "raise the floor of the weight, take fewer taps or a longer sampling step"
        )
    return matrix


@dataclass(frozen=True, slots=True, eq=False)
class ToeplitzKernels:
    """Kernels of many transfer functions with one weight: eq. (3), factorized once.

    Parameters
    ----------
    weight
        W(f), shape (nf,): the spectrum of the reference process, with a floor (`floored`).
    frequency
        Rising grid, shape (nf,), Hz, up to the Nyquist frequency at most; spacing at most 1 / (2 taps step).
    step
        Sampling step in s.
    before
        Number of taps before lag zero: how many samples later than n are used.
    after
        Number of taps after lag zero: how many samples earlier than n are used.

    Raises
    ------
    ScenarioError
        If the arguments do not fit each other or have bad values.
    SolverError
        If the weight is so near zero over a part of the band that the kernel is undetermined there.
    """

    weight: FloatArray
    frequency: FloatArray
    step: float
    before: int
    after: int
    # (2 nf, taps): multiplied by the real and imaginary parts of a transfer function it gives its kernel.
    _solution: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.before < 0 or self.after < 0:
            raise ScenarioError(f"convolution kernel: taps before {self.before} and after {self.after} must be >= 0")
        taps = self.before + self.after + 1
        frequency, weight = _checked_grid(self.frequency, self.weight, self.step, taps)
        measure = weight * quadrature(frequency)
        angle = 2.0 * np.pi * self.step * frequency
        matrix = _normal_matrix(measure, angle, taps)
        phase = np.outer(np.arange(-self.before, self.after + 1), angle)
        sides = np.hstack([np.cos(phase) * measure, -np.sin(phase) * measure])
        solution = np.ascontiguousarray(np.linalg.solve(matrix, sides).T)
        for name, array in (("frequency", frequency.copy()), ("weight", weight.copy()), ("_solution", solution)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def kernels(self, transfer: ArrayLike) -> FloatArray:
        """Weights h of eq. (1) for each row of outputs.

        Parameters
        ----------
        transfer
            H(f), shape (nf, rows) or (nf,), complex, for exp(+i omega t).

        Returns
        -------
        Shape (rows, before + after + 1); column j belongs to the lag k = j - before, so that
        ``kernels[:, ::-1] @ x[n - after : n + before + 1]`` is y_n.

        Raises
        ------
        ScenarioError
            If the shape does not fit the frequency grid, or a value is not finite.
        """
        values = _checked_transfer(transfer, len(self.frequency))
        parts = np.concatenate([values.real, values.imag])
        return np.asarray(parts.T @ self._solution)


def kernel(
    transfer: ArrayLike, frequency: FloatArray, weight: FloatArray, step: float, before: int, after: int
) -> FloatArray:
    """Kernels of one set of transfer functions; arguments, result and errors as of `ToeplitzKernels`."""
    return ToeplitzKernels(weight, frequency, step, before, after).kernels(transfer)


def best_reach(
    transfer: ArrayLike, frequency: FloatArray, weight: FloatArray, step: float, taps: int
) -> tuple[int, int]:
    """How to lay `taps` taps about lag zero: (before, after) of least error, eq. (2), in the worst row.

    A transfer function with a delay, such as a wave's travel to a point down the wave, wants most of its taps
    after lag zero.

    Raises
    ------
    ScenarioError, SolverError
        As `ToeplitzKernels`.
    """
    if taps < 1:
        raise ScenarioError(f"convolution kernel: {taps} taps; it must have 1 or more")
    frequency, weight = _checked_grid(frequency, weight, step, taps)
    values = _checked_transfer(transfer, len(frequency))
    measure = weight * quadrature(frequency)
    angle = 2.0 * np.pi * step * frequency
    inverse = np.linalg.inv(_normal_matrix(measure, angle, taps))
    phase = np.outer(np.arange(1 - taps, taps), angle)
    sides = np.cos(phase) @ (measure[:, np.newaxis] * values.real)
    sides -= np.sin(phase) @ (measure[:, np.newaxis] * values.imag)
    windows = np.lib.stride_tricks.sliding_window_view(sides, taps, axis=0)  # (ways to lay the taps, rows, taps)
    explained = np.einsum("jrt,jrt->jr", windows @ inverse, windows)
    power = measure @ np.abs(values) ** 2
    share = np.divide(explained, power, out=np.ones_like(explained), where=power > 0.0)
    after = int(np.argmax(share.min(axis=1)))
    return taps - 1 - after, after


def kernel_response(kernels: FloatArray, frequency: FloatArray, step: float, before: int) -> ComplexArray:
    """Response K(f) of kernels (rows, taps), eq. (1), shape (nf, rows)."""
    lags = np.arange(kernels.shape[1]) - before
    return np.asarray(np.exp(-2j * np.pi * step * np.outer(frequency, lags)) @ kernels.T)


def kernel_error(
    kernels: FloatArray, transfer: ArrayLike, frequency: FloatArray, density: FloatArray, step: float, before: int
) -> FloatArray:
    """Root mean square error of each output over its own root mean square, for a reference of spectrum `density`.

    Parameters
    ----------
    kernels
        Shape (rows, taps).
    transfer
        H(f), shape (nf, rows) or (nf,).
    frequency, density
        Rising grid in Hz and one-sided spectrum of the reference, shape (nf,); not necessarily the grid or
        weight of the fit.
    step, before
        As in the fit.

    Returns
    -------
    Shape (rows,); 0 for an output that is zero and has a zero kernel, infinite for one that is zero but has not.
    """
    exact = np.asarray(transfer, dtype=np.complex128).reshape(len(frequency), -1)
    measure = density * quadrature(np.asarray(frequency, dtype=np.float64))
    error = measure @ np.abs(exact - kernel_response(kernels, frequency, step, before)) ** 2
    power = measure @ np.abs(exact) ** 2
    ratio = np.divide(error, power, out=np.where(error > 0.0, np.inf, 0.0), where=power > 0.0)
    return np.sqrt(ratio)


def convolve(kernels: FloatArray, samples: FloatArray) -> FloatArray:
    """Outputs of all kernels (rows, taps) wherever the samples (count,) reach, eq. (1).

    Returns
    -------
    Shape (count - taps + 1, rows); row 0 belongs to sample number `after`.
    """
    windows = np.lib.stride_tricks.sliding_window_view(samples, kernels.shape[1])
    return np.asarray(windows @ kernels[:, ::-1].T)
