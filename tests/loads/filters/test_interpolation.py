"""Interpolation filters against polynomials, continuity, a direct evaluation, and the documented errors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from tlpsim.loads.filters.interpolation import (
    _CUBIC_HERMITE,
    _QUINTIC_HERMITE,
    CAUSAL,
    SYMMETRIC,
    InterpolationFilter,
    _hermite_filter,
    extrapolation_weights,
    frequency_response,
    interpolation_error,
)

FILTERS = [pytest.param(item, id=f"causal-{name}") for name, item in CAUSAL.items()]
FILTERS += [pytest.param(item, id=f"symmetric-{name}") for name, item in SYMMETRIC.items()]

# Highest degree of a polynomial that each filter reproduces: that for which its finite differences are exact,
# at most the degree of the Hermite polynomial.
CAUSAL_DEGREES = {"hold": 0, "linear": 1, "cubic": 2, "quintic": 3}
SYMMETRIC_DEGREES = {"hold": 0, "linear": 1, "cubic": 3, "quintic": 5}
CASES = [pytest.param(CAUSAL[name], degree, id=f"causal-{name}") for name, degree in CAUSAL_DEGREES.items()]
CASES += [pytest.param(SYMMETRIC[name], degree, id=f"symmetric-{name}") for name, degree in SYMMETRIC_DEGREES.items()]

coefficient = st.floats(-10.0, 10.0)


def taps(interpolation_filter: InterpolationFilter) -> np.ndarray:
    return np.arange(1 - interpolation_filter.before, interpolation_filter.after + 1)


def interpolate(interpolation_filter: InterpolationFilter, samples: np.ndarray, time: float) -> float:
    """Evaluate at a time in sample steps, sample 0 at time 0."""
    segment = int(np.floor(time))
    window = samples[segment + taps(interpolation_filter)]
    return float(interpolation_filter.weights(time - segment) @ window)


@pytest.mark.parametrize(("item", "degree"), CASES)
@given(coefficients=st.lists(coefficient, min_size=6, max_size=6), phase=st.floats(0.0, 1.0, exclude_max=True))
def test_polynomials_are_reproduced(
    item: InterpolationFilter, degree: int, coefficients: list[float], phase: float
) -> None:
    polynomial = Polynomial(coefficients[: degree + 1])
    value = item.weights(phase) @ polynomial(taps(item).astype(float))
    # round-off of samples up to 10 * 4**5 * 6
    assert value == pytest.approx(polynomial(phase), abs=1e-10)


@pytest.mark.parametrize(("item", "degree"), CASES)
def test_next_degree_is_not_reproduced(item: InterpolationFilter, degree: int) -> None:
    """Guards the table above: it states the degree, not a lower bound."""
    if degree == 5:  # the 7-point second derivative is exact for degree 7, the quintic itself only for 5
        degree = 6
    values = taps(item).astype(float) ** (degree + 1)
    errors = [abs(item.weights(s) @ values - s ** (degree + 1)) for s in (0.3, 0.7)]
    assert max(errors) > 1e-3


@pytest.mark.parametrize("item", FILTERS)
def test_weights_sum_to_one_and_interpolate_nodes(item: InterpolationFilter) -> None:
    for phase in np.linspace(0.0, 1.0, 11):
        weights = item.weights(phase)
        assert weights.shape == (item.before + item.after,)
        assert weights.sum() == pytest.approx(1.0, abs=1e-13)
    at_start = item.weights(0.0)
    assert at_start[item.before - 1] == 1.0
    assert np.count_nonzero(at_start) == 1
    if item.after:
        expected = np.zeros_like(at_start)
        expected[item.before] = 1.0
        np.testing.assert_allclose(item.weights(1.0), expected, atol=1e-13)


def test_reach() -> None:
    assert all(item.after <= 1 for item in CAUSAL.values())
    assert [(item.before, item.after) for item in SYMMETRIC.values()] == [(1, 0), (1, 1), (3, 3), (4, 4)]


@pytest.mark.parametrize(
    ("item", "orders"),
    [
        pytest.param(CAUSAL["cubic"], 1, id="causal-cubic"),
        pytest.param(CAUSAL["quintic"], 2, id="causal-quintic"),
        pytest.param(SYMMETRIC["cubic"], 1, id="symmetric-cubic"),
        pytest.param(SYMMETRIC["quintic"], 2, id="symmetric-quintic"),
    ],
)
def test_derivatives_are_continuous_at_nodes(item: InterpolationFilter, orders: int) -> None:
    """Cubic filters are C1, quintic ones C2, for any samples: the one-sided derivatives agree."""
    samples = np.random.default_rng(5).normal(size=16)
    degree = 3 if orders == 1 else 5
    phases = np.linspace(0.0, 1.0, degree + 1)
    left, right = (
        Polynomial.fit(phases, [item.weights(s) @ samples[n + taps(item)] for s in phases], degree).convert()
        for n in (7, 8)
    )
    for order in range(1, orders + 1):
        # the polynomials pass through their points to round-off; differentiating twice loses a few digits
        assert left.deriv(order)(1.0) == pytest.approx(right.deriv(order)(0.0), abs=1e-10)
    assert abs(left.deriv(orders + 1)(1.0) - right.deriv(orders + 1)(0.0)) > 1e-3


# Root mean square error relative to the signal at 0.05, 0.1 and 0.2 Hz, derived independently for ten output
# values a sample step (three significant digits at most, hence 5 % on the smallest).
DOCUMENTED = [
    ("hold", 0.5, (8.4e-2, 1.7e-1, 3.3e-1)),
    ("linear", 0.5, (2.2e-3, 9.0e-3, 3.6e-2)),
    ("cubic", 0.5, (9.0e-5, 7.5e-4, 6.8e-3)),
    ("hold", 1.0, (0.17, 0.33, 0.65)),
    ("linear", 1.0, (9.0e-3, 3.6e-2, 0.14)),
    ("cubic", 1.0, (7.5e-4, 6.8e-3, 7.0e-2)),
]
# Measured with this module; they keep the table in docs/decisions/0001-multirate-coupling.md true.
MEASURED = [
    (CAUSAL["quintic"], 0.5, (1.9e-5, 3.1e-4, 5.1e-3)),
    (CAUSAL["quintic"], 1.0, (3.1e-4, 5.1e-3, 8.3e-2)),
    (SYMMETRIC["cubic"], 0.5, (1.1e-6, 2.0e-5, 4.7e-4)),
    (SYMMETRIC["cubic"], 1.0, (2.0e-5, 4.7e-4, 1.4e-2)),
    (SYMMETRIC["quintic"], 0.5, (1.8e-9, 2.3e-7, 3.1e-5)),
    (SYMMETRIC["quintic"], 1.0, (2.3e-7, 3.1e-5, 4.0e-3)),
]


@pytest.mark.parametrize(
    ("item", "step", "expected"), [(CAUSAL[name], step, errors) for name, step, errors in DOCUMENTED] + MEASURED
)
def test_documented_errors(item: InterpolationFilter, step: float, expected: tuple[float, ...]) -> None:
    np.testing.assert_allclose(interpolation_error(item, [0.05, 0.1, 0.2], step, 10), expected, rtol=0.05)


@pytest.mark.parametrize("item", FILTERS)
def test_error_agrees_with_interpolated_sine(item: InterpolationFilter) -> None:
    """The closed form against a sine that is really interpolated, over a whole number of periods."""
    step, ratio, frequency = 0.5, 5, 0.1
    samples = np.sin(2 * np.pi * frequency * step * np.arange(-8, 220))
    times = np.arange(0, 200 * ratio) / ratio
    values = [interpolate(item, samples, time + 8) for time in times]
    errors = np.asarray(values) - np.sin(2 * np.pi * frequency * step * times)
    expected = interpolation_error(item, frequency, step, ratio)
    assert np.sqrt(2.0 * np.mean(errors**2)) == pytest.approx(float(expected), rel=1e-6)


@pytest.mark.parametrize("item", FILTERS)
def test_frequency_response_agrees_with_fourier_transform(item: InterpolationFilter) -> None:
    """Gain and images against the Fourier transform of an interpolated harmonic."""
    step, ratio, periods, samples_a_period = 0.5, 5, 4, 8
    count = periods * samples_a_period
    frequency = 1.0 / (samples_a_period * step)
    samples = np.exp(2j * np.pi * np.arange(-8, count + 8) / samples_a_period)
    values = [item.weights(j / ratio) @ samples[8 + n + taps(item)] for n in range(count) for j in range(ratio)]
    spectrum = np.fft.fft(values) / len(values)
    for image in (0, 1, 2):
        line = periods + image * count
        expected = frequency_response(item, frequency + image / step, step, ratio)
        assert spectrum[line] == pytest.approx(complex(expected), abs=1e-12)


def test_symmetric_filters_keep_the_phase() -> None:
    for name in ("linear", "cubic", "quintic"):
        gain = frequency_response(SYMMETRIC[name], [0.05, 0.1, 0.2], 0.5, 10)
        # the response of an even kernel is real, but for the node that belongs to one segment only
        np.testing.assert_allclose(gain.imag, 0.0, atol=1e-12)


@given(
    coefficients=st.lists(coefficient, min_size=3, max_size=3),
    order=st.integers(0, 2),
    phase=st.floats(0.0, 10.0),
)
def test_extrapolation_continues_polynomials(coefficients: list[float], order: int, phase: float) -> None:
    polynomial = Polynomial(coefficients[: order + 1])
    samples = polynomial(np.arange(-order, 1.0))
    value = extrapolation_weights(order, phase) @ samples
    # weights up to 132 at phase 10 multiply samples up to 70
    assert value == pytest.approx(polynomial(phase), abs=1e-10)


def test_extrapolation_order_is_checked() -> None:
    with pytest.raises(ValueError, match="order 3 is not one of 0, 1, 2"):
        extrapolation_weights(3, 0.5)


def test_refused_stencils() -> None:
    """The numbers in docs/decisions/0001-multirate-coupling.md on filters that were not chosen."""
    five = _hermite_filter(
        "quintic, five samples",
        _QUINTIC_HERMITE,
        (np.array([3, -16, 36, -48, 25]) / 12, np.array([11, -56, 114, -104, 35]) / 12),
        0,
    )
    catmull_rom = _hermite_filter("Catmull-Rom", _CUBIC_HERMITE, (np.array([-1, 0, 1]) / 2,), 1)

    def noise_gain(item: InterpolationFilter) -> float:
        return float(max(np.linalg.norm(item.weights(phase)) for phase in np.linspace(0.0, 1.0, 21)))

    four = CAUSAL["quintic"]
    gain = interpolation_error(four, 0.1, 0.5, 10) / interpolation_error(five, 0.1, 0.5, 10)
    assert gain == pytest.approx(3.8, rel=0.02)
    assert (noise_gain(five), noise_gain(four)) == pytest.approx((2.05, 1.61), rel=0.01)
    assert interpolation_error(catmull_rom, 0.1, 0.5, 10) == pytest.approx(3.9e-4, rel=0.02)
