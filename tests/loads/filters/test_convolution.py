"""Convolution kernels against closed forms, a direct least-squares solution, and records of waves."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.filters.convolution import (
    ToeplitzKernels,
    best_reach,
    convolve,
    floored,
    fraction_of_step,
    kernel,
    kernel_error,
    kernel_response,
    quadrature,
)
from tlpsim.loads.waves.airy import velocity_transfer, wavenumber

STEP = 0.5
REACH = 40  # ± 20 s
FREQUENCY = np.linspace(0.0, 0.5 / STEP, 1025)
FLAT = np.ones_like(FREQUENCY)
OMEGA = 2.0 * np.pi * FREQUENCY


def jonswap(frequency: np.ndarray, peak_period: float, enhancement: float = 3.3) -> np.ndarray:
    """Shape of a JONSWAP spectrum, written out here; its scale does not matter."""
    ratio = np.maximum(frequency * peak_period, 1e-6)
    width = np.where(ratio < 1.0, 0.07, 0.09)
    peak = enhancement ** np.exp(-((ratio - 1.0) ** 2) / (2.0 * width**2))
    with np.errstate(under="ignore"):
        return ratio**-5.0 * np.exp(np.maximum(-1.25 * ratio**-4.0, -700.0)) * peak


def water_velocity(x: float, z: float, depth: float) -> np.ndarray:
    """Horizontal and vertical velocity and their accelerations for a unit amplitude, shape (nf, 4)."""
    wave = wavenumber(OMEGA[1:], depth)
    velocity = velocity_transfer(OMEGA[1:], wave, 0.0, depth, np.array([[x, 0.0, z]]))[0, [0, 2]].T
    velocity = np.vstack([velocity[:1], velocity])  # at zero frequency the spectrum is zero, the value does not matter
    return np.hstack([velocity, 1j * OMEGA[:, np.newaxis] * velocity])


def test_closed_form_of_the_modulus_of_the_frequency() -> None:
    """H = |omega| with a flat weight: the Fourier coefficients of a triangle."""
    weights = kernel(OMEGA, FREQUENCY, FLAT, STEP, 20, 20)[0]
    lags = np.arange(1, 21)
    assert weights[20] == pytest.approx(np.pi / (2.0 * STEP), rel=1e-12)
    expected = ((-1.0) ** lags - 1.0) / (np.pi * lags**2 * STEP)
    # the trapezoidal rule over 1024 intervals
    np.testing.assert_allclose(weights[21:], expected, atol=2e-6)
    np.testing.assert_allclose(weights[:20], expected[::-1], atol=2e-6)


def test_closed_form_of_the_derivative() -> None:
    """H = i omega with a flat weight: h_k = (-1)^k / (k dt), odd."""
    weights = kernel(1j * OMEGA, FREQUENCY, FLAT, STEP, 15, 15)[0]
    lags = np.arange(1, 16)
    np.testing.assert_allclose(weights[16:], (-1.0) ** lags / (lags * STEP), rtol=2e-4)
    np.testing.assert_allclose(weights, -weights[::-1], atol=1e-12)


@given(fraction=st.floats(-0.5, 0.5))
def test_closed_form_of_a_fraction_of_a_step(fraction: float) -> None:
    """A flat weight gives the cardinal sine."""
    weights = kernel(fraction_of_step(FREQUENCY, STEP, fraction), FREQUENCY, FLAT, STEP, 6, 6)[0]
    np.testing.assert_allclose(weights, np.sinc(np.arange(-6, 7) + fraction), atol=1e-5)


@given(delay=st.integers(-10, 10), peak_period=st.floats(5.0, 20.0))
@settings(max_examples=30)
def test_a_delay_by_whole_samples_picks_one(delay: int, peak_period: float) -> None:
    weight = floored(jonswap(FREQUENCY, peak_period))
    weights = kernel(np.exp(-1j * OMEGA * STEP * delay), FREQUENCY, weight, STEP, 10, 12)[0]
    # condition number up to 1e6
    np.testing.assert_allclose(weights, np.arange(-10, 13) == delay, atol=1e-8)


def test_against_a_direct_least_squares_solution() -> None:
    """The same weighted problem by orthogonal factors rather than by its normal equations."""
    density = jonswap(FREQUENCY, 12.0)
    weight = floored(density, 1e-3)
    transfer = water_velocity(20.0, -12.0, 100.0)
    before, after = 25, 30
    root = np.sqrt(weight * quadrature(FREQUENCY))[:, np.newaxis]
    matrix = root * np.exp(-1j * STEP * np.outer(OMEGA, np.arange(-before, after + 1)))
    right = root * transfer
    expected = np.linalg.lstsq(np.vstack([matrix.real, matrix.imag]), np.vstack([right.real, right.imag]), rcond=None)[
        0
    ]
    found = kernel(transfer, FREQUENCY, weight, STEP, before, after)
    np.testing.assert_allclose(found, expected.T, atol=1e-9)


@given(factors=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)))
@settings(max_examples=20)
def test_kernels_are_linear_in_the_transfer_function(factors: tuple[float, float]) -> None:
    fitted = ToeplitzKernels(floored(jonswap(FREQUENCY, 10.0)), FREQUENCY, STEP, 12, 20)
    transfer = water_velocity(10.0, -20.0, np.inf)
    single = fitted.kernels(transfer)
    both = fitted.kernels(factors[0] * transfer[:, 0] + factors[1] * transfer[:, 3])
    np.testing.assert_allclose(both[0], factors[0] * single[0] + factors[1] * single[3], atol=1e-10)


PEAK_PERIODS = [6.0, 8.0, 10.0, 14.0, 18.0]
PLACES = [(x, z) for x in (-43.0, -20.0, 0.0, 43.0) for z in (-15.0, -25.0, -35.0)]


@pytest.mark.parametrize("peak_period", PEAK_PERIODS)
@pytest.mark.parametrize("depth", [np.inf, 450.0, 60.0])
def test_velocity_below_the_surface(peak_period: float, depth: float) -> None:
    """Kernels of ± 20 s, about a platform of 86 m, also between samples."""
    density = jonswap(FREQUENCY, peak_period)
    fitted = ToeplitzKernels(floored(density), FREQUENCY, STEP, REACH, REACH)
    for x, z in PLACES:
        for fraction in (0.0, 0.4):
            advance = fraction_of_step(FREQUENCY, STEP, fraction)[:, np.newaxis]
            transfer = water_velocity(x, z, depth)[:, :2] * advance
            error = kernel_error(fitted.kernels(transfer), transfer, FREQUENCY, density, STEP, REACH)
            assert error.max() <= 5e-4


@pytest.mark.parametrize("peak_period", PEAK_PERIODS)
@pytest.mark.parametrize(
    ("x", "z", "depth", "taps"),
    [(43.0, -15.0, np.inf, 81), (-43.0, -35.0, 60.0, 81), (73.0, -20.0, 450.0, 121), (90.0, -15.0, 450.0, 121)],
)
def test_acceleration_below_the_surface(peak_period: float, x: float, z: float, depth: float, taps: int) -> None:
    """Laid about the delay: 40 s in all about a platform, 60 s where it has drifted off."""
    density = jonswap(FREQUENCY, peak_period)
    transfer = water_velocity(x, z, depth)
    before, after = best_reach(transfer, FREQUENCY, floored(density), STEP, taps)
    kernels = kernel(transfer, FREQUENCY, floored(density), STEP, before, after)
    assert kernel_error(kernels, transfer, FREQUENCY, density, STEP, before).max() <= 5e-4


@pytest.mark.parametrize(("before", "after"), [(40, 40), (10, 40), (40, 12)])
def test_stated_error_is_that_of_a_record(before: int, after: int) -> None:
    """A periodic record of 1024 samples, convolved, against the exact output of every harmonic."""
    count = 1024
    harmonics = np.arange(1, count // 2)
    frequency = harmonics / (count * STEP)
    at = np.searchsorted(FREQUENCY, frequency - 1e-9)
    np.testing.assert_allclose(FREQUENCY[at], frequency, atol=1e-12)
    transfer = water_velocity(30.0, -15.0, np.inf)
    density = jonswap(FREQUENCY, 9.0)
    kernels = kernel(transfer, FREQUENCY, floored(density), STEP, before, after)
    phase = np.random.default_rng(2).uniform(0.0, 2.0 * np.pi, len(harmonics))
    amplitude = np.sqrt(density[at]) * np.exp(1j * phase)
    times = STEP * np.arange(count)
    carrier = np.exp(2j * np.pi * np.outer(times, frequency))
    record = (carrier @ amplitude).real
    found = convolve(kernels, np.concatenate([record[-after:], record, record[:before]]))
    exact = (carrier @ (amplitude[:, np.newaxis] * transfer[at])).real
    assert found.shape == exact.shape
    measured = np.sqrt(np.mean((found - exact) ** 2, axis=0) / np.mean(exact**2, axis=0))
    # the harmonics are every second frequency of the grid, so their sums differ a little from the integrals
    mask = np.zeros_like(density)
    mask[at] = density[at]
    expected = kernel_error(kernels, transfer, FREQUENCY, mask, STEP, before)
    np.testing.assert_allclose(measured, expected, rtol=1e-6)


def test_response_is_the_fourier_transform_of_the_kernel() -> None:
    kernels = np.random.default_rng(4).normal(size=(3, 8))
    response = kernel_response(kernels, np.arange(8) / (8 * STEP), STEP, 0)
    np.testing.assert_allclose(response, np.fft.fft(kernels, axis=1).T, atol=1e-12)


@pytest.mark.parametrize(("x", "z", "taps"), [(73.0, -15.0, 81), (-43.0, -8.0, 81), (20.0, -20.0, 41)])
def test_best_reach_is_the_best_of_all(x: float, z: float, taps: int) -> None:
    transfer = water_velocity(x, z, np.inf)[:, :2]
    weight = floored(jonswap(FREQUENCY, 10.0))

    def error(before: int) -> float:
        kernels = kernel(transfer, FREQUENCY, weight, STEP, before, taps - 1 - before)
        return float(kernel_error(kernels, transfer, FREQUENCY, weight, STEP, before).max())

    before, after = best_reach(transfer, FREQUENCY, weight, STEP, taps)
    assert before + after + 1 == taps
    assert error(before) == min(error(trial) for trial in range(max(before - 8, 0), min(before + 9, taps)))
    assert error(before) < 0.5 * error(taps // 2) or abs(before - taps // 2) < 8


def test_a_kernel_with_one_output_of_zero() -> None:
    transfer = np.column_stack([np.zeros_like(OMEGA), OMEGA])
    kernels = kernel(transfer, FREQUENCY, FLAT, STEP, 5, 5)
    np.testing.assert_array_equal(kernels[0], 0.0)
    assert kernel_error(kernels, transfer, FREQUENCY, FLAT, STEP, 5)[0] == 0.0
    assert kernel_error(kernels[::-1], transfer, FREQUENCY, FLAT, STEP, 5)[0] == np.inf


def test_records_are_read_only() -> None:
    fitted = ToeplitzKernels(FLAT, FREQUENCY, STEP, 3, 3)
    assert not fitted.weight.flags.writeable
    assert not fitted.frequency.flags.writeable


VOID = np.where(FREQUENCY < 0.1, 1.0, 0.0)
UNFINISHED = np.where(FREQUENCY < 0.1, 1.0, np.nan)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: ToeplitzKernels(FLAT, FREQUENCY, 0.0, 5, 5), ScenarioError, r"sampling step .* is 0\. s"),
        (
            lambda: ToeplitzKernels(FLAT, FREQUENCY, 0.7, 5, 5),
            ScenarioError,
            "1 Hz is above the Nyquist frequency 0.714",
        ),
        (lambda: ToeplitzKernels(FLAT[1:], FREQUENCY, STEP, 5, 5), ScenarioError, "must be one"),
        (lambda: ToeplitzKernels(FLAT, FREQUENCY[::-1], STEP, 5, 5), ScenarioError, "must rise"),
        (lambda: ToeplitzKernels(-FLAT, FREQUENCY, STEP, 5, 5), ScenarioError, "nowhere negative"),
        (lambda: ToeplitzKernels(UNFINISHED, FREQUENCY, STEP, 5, 5), ScenarioError, "weight must be finite"),
        (lambda: ToeplitzKernels(FLAT, FREQUENCY, STEP, -1, 5), ScenarioError, "taps before -1"),
        (lambda: ToeplitzKernels(FLAT[::64], FREQUENCY[::64], STEP, 40, 40), ScenarioError, "0.0625 Hz apart"),
        (lambda: ToeplitzKernels(VOID, FREQUENCY, STEP, 40, 40), SolverError, "raise the floor of the weight"),
        (lambda: kernel(np.zeros((5, 2)), FREQUENCY, FLAT, STEP, 5, 5), ScenarioError, r"it must be \(1025, rows\)"),
        (lambda: kernel(UNFINISHED, FREQUENCY, FLAT, STEP, 5, 5), ScenarioError, "transfer function is not finite"),
        (lambda: best_reach(OMEGA, FREQUENCY, FLAT, STEP, 0), ScenarioError, "0 taps; it must have 1 or more"),
    ],
)
def test_refusals(call: Callable[[], object], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()
