"""Refinement of a scalar ARMA model by least squares on the logarithm of its spectrum.

    S(f) = g prod_i |N_i(z)|² / prod_j |D_j(z)|²,   z = exp(-i 2 pi f dt)                            (1)
    N, D = 1 + a_1 z + a_2 z²,   a_2 = k_2,   a_1 = k_1 (1 + k_2),   k = c tanh x,   c < 1           (2)

A section with reflection coefficients |k| < 1 has its roots inside the unit circle, whatever x is: the model is stable
and of minimum phase by construction, and the search is free. It starts from the roots of a matched model, reflected
into the circle where they are not. Where the process is sampled much more often than its band needs, a match at a
longer step is the better start; its roots r become r^(1/n) at the n times shorter step.

The residual is w (ln S_model - ln S_target) with w = (S / S_max)^e, at frequencies that crowd where the spectrum is
high. Below a floor, where the target is a void, only an excess over the floor counts. A small exponent e favours the
tails, a large one the peak; of a few, the one is taken whose largest error is the least: in dB where S is above 1 % of
its peak, over 0.35 dB; root mean square of the density, over 2 %; excess in a void, over 3 dB.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tlpsim.loads.errors import SolverError
from tlpsim.loads.filters.matching import autoregressive_fit, correlation_from_spectrum, matched_arma
from tlpsim.loads.filters.model import ArmaModel

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_LARGEST_REFLECTION = 1.0 - 1e-4  # c of eq. (2)
_LARGEST_START = 0.999
_FLOOR = 1e-3  # of the peak; below, the target is a void
_VOID_WEIGHT = 0.3
_EXPONENTS = (0.25, 0.32, 0.4, 0.5)
_POINTS = 400
_UNIFORM_SHARE = 0.3  # of the points; the others crowd with the root of the spectrum
_EVALUATIONS = 300
_PRECISION = 1e-6
_GRID = 8193
_CORE = 0.01
_SCALES = 0.35, 0.02, 3.0  # dB, of the root mean square of the density, and dB over the floor of a void
_MEAN_SAMPLES = 6.7  # a start at a longer step has about so many samples to the mean period
_START_FLOOR = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sections:
    """Which of the reflection coefficients k (n, 2) are free, and how many sections of n are denominators."""

    denominators: int
    free: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Data:
    """Target at chosen frequencies: z, ln S / S_max floored, S / S_max floored, and where it is a void."""

    delay: ComplexArray
    logarithm: FloatArray
    relative: FloatArray
    void: NDArray[np.bool_]


def _reflections(roots: ComplexArray) -> FloatArray:
    """Reflection coefficients (n, 2) of sections with the given roots; k_2 = 0 for a single real one."""
    radius = np.abs(roots)
    roots = np.where(radius > 1.0, roots / np.maximum(radius, 1.0) ** 2, roots)
    real = np.sort(roots[np.abs(roots.imag) <= 1e-9].real)
    pairs = [(root, np.conj(root)) for root in roots[roots.imag > 1e-9]]
    pairs += [(real[i], real[-1 - i]) for i in range(len(real) // 2)]
    result = []
    for first, second in pairs:
        product = float(np.real(first * second))
        result.append((-float(np.real(first + second)) / (1.0 + product), product))
    if len(real) % 2:
        result.append((-float(real[len(real) // 2]), 0.0))
    return np.clip(np.array(result, dtype=np.float64).reshape(-1, 2), -_LARGEST_START, _LARGEST_START)


def _polynomial(reflections: FloatArray, order: int) -> FloatArray:
    """Product of the sections of eq. (2) in powers of z, shape (order + 1,)."""
    result = np.ones(1)
    for first, second in reflections:
        result = np.convolve(result, [1.0, first * (1.0 + second), second])
    return result[: order + 1]


def _data(target: Callable[[FloatArray], FloatArray], step: float) -> tuple[_Data, float]:
    """Target at `_POINTS` frequencies, and its peak."""
    nyquist = 0.5 / step
    grid = np.linspace(0.0, nyquist, _GRID)
    density = target(grid)
    peak = float(np.max(density))
    crowding = np.sqrt(density / peak)
    crowding *= (1.0 - _UNIFORM_SHARE) / np.trapezoid(crowding, grid)
    crowding += _UNIFORM_SHARE / nyquist
    share = np.concatenate([[0.0], np.cumsum(0.5 * (crowding[1:] + crowding[:-1]))])
    frequency = np.interp(np.linspace(0.0, 1.0, _POINTS), share / share[-1], grid)
    relative = target(frequency) / peak
    floored = np.maximum(relative, _FLOOR)
    data = _Data(
        delay=np.exp(-2j * np.pi * step * frequency),
        logarithm=np.log(floored),
        relative=floored,
        void=relative < _FLOOR,
    )
    return data, peak


def _log_spectrum(x: FloatArray, sections: _Sections, data: _Data) -> tuple[FloatArray, FloatArray]:
    """Logarithm of eq. (1), and its derivatives with respect to x = [ln g, the free x of eq. (2)]."""
    k = np.zeros(sections.free.shape)
    k[sections.free] = _LARGEST_REFLECTION * np.tanh(x[1:])
    sign = np.where(np.arange(len(k)) < sections.denominators, -1.0, 1.0)
    z = data.delay[:, None]
    polynomial = 1.0 + z * (k[:, 0] * (1.0 + k[:, 1])) + z**2 * k[:, 1]
    value = x[0] + (2.0 * np.log(np.abs(polynomial))) @ sign
    by_first = 2.0 * np.real(z / polynomial) * sign
    by_second = 2.0 * np.real(z**2 / polynomial) * sign
    slope = _LARGEST_REFLECTION - k**2 / _LARGEST_REFLECTION
    jacobian = np.empty((len(z), *k.shape))
    jacobian[:, :, 0] = by_first * (1.0 + k[:, 1]) * slope[:, 0]
    jacobian[:, :, 1] = (by_first * k[:, 0] + by_second) * slope[:, 1]
    return value, np.hstack([np.ones((len(z), 1)), jacobian[:, sections.free]])


def _search(x: FloatArray, sections: _Sections, data: _Data, exponent: float) -> FloatArray:
    """Least squares from x."""
    weight = data.relative**exponent * np.where(data.void, _VOID_WEIGHT, 1.0)

    def counts(value: FloatArray) -> FloatArray:
        return np.where(data.void & (value < data.logarithm), 0.0, weight)

    def residual(at: FloatArray) -> FloatArray:
        value, _ = _log_spectrum(at, sections, data)
        result: FloatArray = counts(value) * (value - data.logarithm)
        return result

    def jacobian(at: FloatArray) -> FloatArray:
        value, derivative = _log_spectrum(at, sections, data)
        result: FloatArray = counts(value)[:, None] * derivative
        return result

    found = least_squares(residual, x, jac=jacobian, max_nfev=_EVALUATIONS, ftol=_PRECISION, xtol=_PRECISION)
    return np.asarray(found.x, dtype=np.float64)


def _score(x: FloatArray, sections: _Sections, data: _Data) -> float:
    """The largest of the three errors of the module's text, each over its scale."""
    value, _ = _log_spectrum(x, sections, data)
    error = np.where(data.void, 0.0, value - data.logarithm)
    core = data.relative > _CORE
    largest = 10.0 / np.log(10.0) * float(np.max(np.abs(error[core])))
    # The points crowd with the density of `_data`: its inverse is the width that each stands for.
    width = 1.0 / (_UNIFORM_SHARE + np.sqrt(data.relative))
    density = np.sum(width * (data.relative * np.expm1(error)) ** 2) / np.sum(width * data.relative**2)
    excess = 10.0 / np.log(10.0) * float(np.max(np.where(data.void, value - data.logarithm, 0.0)))
    return max(largest / _SCALES[0], float(np.sqrt(density)) / _SCALES[1], excess / _SCALES[2])


def _starts(
    model: ArmaModel, target: Callable[[FloatArray], FloatArray], long: int
) -> list[tuple[ComplexArray, ComplexArray]]:
    """Poles and zeros to start from: those of the model, and those of a match at a longer step."""

    def roots(of: ArmaModel) -> tuple[ComplexArray, ComplexArray]:
        poles = np.roots(np.concatenate([[1.0], -of.autoregressive[:, 0, 0]]))
        return poles.astype(np.complex128), np.roots(of.moving_average[:, 0, 0]).astype(np.complex128)

    result = [roots(model)]
    grid = np.linspace(0.0, 0.5 / model.step, _GRID)
    density = target(grid)
    ratio = round(float(np.sum(density) / np.sum(density * grid)) / (_MEAN_SAMPLES * model.step))
    if ratio > 1:
        step = model.step * ratio
        correlation = correlation_from_spectrum(lambda frequency: target(frequency)[:, None, None], step, long)
        correlation[0] += _START_FLOOR * np.max(density) * 0.5 / step
        try:
            autoregression = autoregressive_fit(correlation, step)
            coarse = matched_arma(autoregression, correlation, *model.orders, lags=len(model.autoregressive))
        except SolverError:
            return result
        poles, zeros = (np.where(np.abs(z) > 1.0, 1.0 / np.conj(z), z) for z in roots(coarse))
        # A root on the negative axis would leave its conjugate; it stays where it is.
        result.append(
            (
                np.where((np.abs(poles.imag) < 1e-9) & (poles.real < 0.0), poles, poles ** (1.0 / ratio)),
                np.where((np.abs(zeros.imag) < 1e-9) & (zeros.real < 0.0), zeros, zeros ** (1.0 / ratio)),
            )
        )
    return result


def polished(model: ArmaModel, target: Callable[[FloatArray], FloatArray], long: int) -> ArmaModel:
    """Stable model of minimum phase whose spectrum is nearer to the target, of the same orders and step.

    Parameters
    ----------
    model
        Of one component, with p >= 1; need not be stable.
    target
        Spectrum as a function of frequency (nf,) in Hz, shape (nf,), unit²/Hz.
    long
        Order of the autoregression of a start at a longer step.
    """
    p, q = model.orders
    data, peak = _data(target, model.step)
    found = []
    for poles, zeros in _starts(model, target, long):
        # A leading coefficient that vanishes takes roots away; they belong in the origin.
        poles, zeros = (np.pad(z, (0, n - len(z))) for z, n in ((poles, p), (zeros, q)))
        denominators, numerators = _reflections(poles), _reflections(zeros)
        start = np.vstack([denominators, numerators])
        free = np.ones(start.shape, dtype=bool)
        free[len(denominators) - 1, 1] = p % 2 == 0
        free[len(start) - 1, 1] = q % 2 == 0 if q else free[len(start) - 1, 1]
        sections = _Sections(denominators=len(denominators), free=free)
        x = np.concatenate([[0.0], np.arctanh(start[free] / _LARGEST_REFLECTION)])
        value, _ = _log_spectrum(x, sections, data)
        x[0] = np.average(data.logarithm - value, weights=data.relative)
        for exponent in _EXPONENTS:
            x = _search(x, sections, data, exponent)
            found.append((_score(x, sections, data), x, sections))
    _, x, sections = min(found, key=lambda item: item[0])
    k = np.zeros(sections.free.shape)
    k[sections.free] = _LARGEST_REFLECTION * np.tanh(x[1:])
    gain = np.sqrt(np.exp(x[0]) * peak / (2.0 * model.step))
    return ArmaModel(
        autoregressive=-_polynomial(k[: sections.denominators], p)[1:, None, None],
        moving_average=gain * _polynomial(k[sections.denominators :], q)[:, None, None],
        step=model.step,
    )
