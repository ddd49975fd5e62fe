"""Interpolation filters against polynomials, continuity, a direct evaluation, and the documented errors."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.interpolation import (
    _CUBIC_HERMITE,
    _QUINTIC_HERMITE,
    CAUSAL,
    SYMMETRIC,
    InterpolationFilter,
    _hermite_filter,
    extrapolation_weights,
    frequency_response,
    interpolate,
    interpolation_error,
    kaiser_filter,
    optimal_filter,
    report,
)

FILTERS = [pytest.param(item, id=f"causal-{name}") for name, item in CAUSAL.items()]
FILTERS += [pytest.param(item, id=f"symmetric-{name}") for name, item in SYMMETRIC.items()]

# Highest degree of a polynomial that each filter reproduces: that for which its finite differences are exact,
# at most the degree of the Hermite polynomial.
CAUSAL_DEGREES = {"hold": 0, "linear": 1, "cubic": 2, "quintic": 3}
SYMMETRIC_DEGREES = {"hold": 0, "linear": 1, "cubic": 3, "quintic": 5, "six_point": 3}
CASES = [pytest.param(CAUSAL[name], degree, id=f"causal-{name}") for name, degree in CAUSAL_DEGREES.items()]
CASES += [pytest.param(SYMMETRIC[name], degree, id=f"symmetric-{name}") for name, degree in SYMMETRIC_DEGREES.items()]

coefficient = st.floats(-10.0, 10.0)


def taps(interpolation_filter: InterpolationFilter) -> np.ndarray:
    return np.arange(1 - interpolation_filter.before, interpolation_filter.after + 1)


def value_at(interpolation_filter: InterpolationFilter, samples: np.ndarray, time: float) -> float:
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
    # The least-squares weights solve equations of condition number 7e3; the others are closed forms.
    rounding = 1e-11 if item.name == "optimal" else 1e-13
    nodes = (0.0, 1.0) if item.after else (0.0,)
    for phase in nodes:
        expected = np.zeros(item.before + item.after)
        expected[item.before - 1 + int(phase)] = 1.0
        np.testing.assert_allclose(item.weights(phase), expected, atol=rounding)


@pytest.mark.parametrize("name", SYMMETRIC_DEGREES)
def test_polynomial_filters_give_back_a_sample_exactly(name: str) -> None:
    for table in (CAUSAL, SYMMETRIC):
        if name in table:
            weights = table[name].weights(0.0)
            assert weights[table[name].before - 1] == 1.0
            assert np.count_nonzero(weights) == 1


def test_reach() -> None:
    assert all(item.after <= 1 for item in CAUSAL.values())
    reaches = {name: (item.before, item.after) for name, item in SYMMETRIC.items()}
    assert reaches == {
        "hold": (1, 0),
        "linear": (1, 1),
        "cubic": (3, 3),
        "quintic": (4, 4),
        "six_point": (3, 3),
        "kaiser": (8, 8),
        "optimal": (6, 6),
    }
    assert all(item.name == name for table in (CAUSAL, SYMMETRIC) for name, item in table.items())


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
    (SYMMETRIC["six_point"], 0.5, (1.1e-6, 2.0e-5, 4.7e-4)),
    (SYMMETRIC["six_point"], 1.0, (2.0e-5, 4.7e-4, 1.4e-2)),
    (SYMMETRIC["kaiser"], 0.5, (6.4e-6, 1.3e-5, 3.3e-6)),
    (SYMMETRIC["kaiser"], 1.0, (1.3e-5, 3.3e-6, 7.6e-6)),
    (SYMMETRIC["optimal"], 0.5, (3.2e-6, 6.7e-6, 5.5e-6)),
    (SYMMETRIC["optimal"], 1.0, (6.7e-6, 5.5e-6, 6.8e-6)),
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
    values = [value_at(item, samples, time + 8) for time in times]
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
    for name in SYMMETRIC.keys() - {"hold"}:
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


# The kernel of a filter is its weight for the sample at distance t, as a function of t.


def kernel_at(item: InterpolationFilter, time: float) -> float:
    segment = int(np.floor(time))
    index = item.before - 1 - segment
    weights = item.weights(time - segment)
    return float(weights[index]) if 0 <= index < len(weights) else 0.0


def test_six_point_filter_is_the_fourth_order_kernel_of_keys() -> None:
    """Against the piecewise cubic as published (R. Keys, 1981, eq. for the fourth-order kernel)."""
    pieces = (
        Polynomial([1.0, 0.0, -7.0 / 3.0, 4.0 / 3.0]),
        Polynomial([5.0 / 2.0, -59.0 / 12.0, 3.0, -7.0 / 12.0]),
        Polynomial([-3.0 / 2.0, 7.0 / 4.0, -2.0 / 3.0, 1.0 / 12.0]),
    )
    for time in np.linspace(-2.99, 2.99, 101):
        expected = pieces[int(abs(time))](abs(time))
        assert kernel_at(SYMMETRIC["six_point"], time) == pytest.approx(expected, abs=1e-13)


def test_kaiser_filter_is_the_windowed_sinc_scaled_by_phase() -> None:
    """Against numpy's Kaiser window: points s apart of a window of 2 K + 1 / s points."""
    half_width, shape, parts = 8, 10.0, 10
    window = np.kaiser(2 * half_width * parts + 1, shape)
    times = np.arange(-half_width * parts, half_width * parts + 1) / parts
    kernel = np.sinc(times) * window
    for phase in range(parts):
        # samples at 1 - K ... K have distances phase - sample, newest sample first in the kernel's time
        values = kernel[[phase + parts * (half_width - k) for k in range(1 - half_width, half_width + 1)]]
        np.testing.assert_allclose(
            kaiser_filter(half_width, shape).weights(phase / parts), values / values.sum(), atol=1e-13
        )


@pytest.mark.parametrize(("half_width", "band"), [(3, 0.2), (6, 0.25), (8, 0.3), (4, 0.4)])
@pytest.mark.parametrize("phase", [0.1, 0.5, 0.85])
def test_no_other_weights_have_a_smaller_error_in_the_band(half_width: int, band: float, phase: float) -> None:
    """Against a direct least-squares solution on a fine grid of frequencies, with the same floor."""
    floor = 1e-6
    frequency = (np.arange(4000) + 0.5) / 8000.0
    weight = np.sqrt(np.where(frequency < band, 1.0, floor))[:, np.newaxis]
    item = optimal_filter(half_width, band, floor)
    samples = np.exp(2j * np.pi * np.outer(frequency, taps(item)))
    target = np.exp(2j * np.pi * frequency * phase)[:, np.newaxis]
    # the constraint, by elimination of the first weight
    matrix = weight * (samples[:, 1:] - samples[:, :1])
    right = weight * (target - samples[:, :1])
    rest = np.linalg.lstsq(np.vstack([matrix.real, matrix.imag]), np.vstack([right.real, right.imag])[:, 0], rcond=None)
    expected = np.concatenate([[1.0 - rest[0].sum()], rest[0]])

    def error(weights: np.ndarray) -> float:
        return float(np.linalg.norm(weight[:, 0] * (samples @ weights - target[:, 0])))

    assert error(item.weights(phase)) == pytest.approx(error(expected), rel=1e-3)


# Issue of look-ahead filters: band, largest error, worst image in dB.
@pytest.mark.parametrize("name", ["kaiser", "optimal"])
@pytest.mark.parametrize(
    ("step", "ratio", "error", "image"), [(0.5, 5, 2e-5, -90.0), (1.0, 10, 5e-5, -85.0), (1.0, 7, 5e-5, -85.0)]
)
def test_long_filters_in_the_wave_band(name: str, step: float, ratio: int, error: float, image: float) -> None:
    found = report(SYMMETRIC[name], (0.05, 0.2), step, ratio)
    assert found.pass_band_error <= error
    assert found.worst_image <= image
    assert found.latency == SYMMETRIC[name].after * step
    assert found.taps == SYMMETRIC[name].before + SYMMETRIC[name].after


@pytest.mark.parametrize("item", FILTERS)
@given(frequency=st.floats(0.01, 0.45))
def test_pass_band_error_and_images_make_up_the_whole_error(item: InterpolationFilter, frequency: float) -> None:
    """Parseval: the mean square error over a sample step is that of the wanted line plus all images."""
    ratio = 6
    gain = frequency_response(item, frequency, 1.0, ratio)
    images = frequency_response(item, frequency + np.arange(1.0, ratio), 1.0, ratio)
    expected = np.sqrt(abs(gain - 1.0) ** 2 + np.sum(np.abs(images) ** 2))
    assert float(interpolation_error(item, frequency, 1.0, ratio)) == pytest.approx(expected, rel=1e-6, abs=1e-12)
    found = report(item, (frequency, frequency), 1.0, ratio)
    assert found.pass_band_error == pytest.approx(abs(gain - 1.0), abs=1e-12)
    assert 10.0 ** (found.worst_image / 20.0) == pytest.approx(np.abs(images).max(), rel=1e-9, abs=1e-12)


def test_filters_can_be_told_apart() -> None:
    assert (
        len({*CAUSAL.values(), *SYMMETRIC.values()}) == len(CAUSAL) + len(SYMMETRIC) - 2
    )  # hold and linear are shared
    assert optimal_filter(6, 0.25) != SYMMETRIC["optimal"]


def test_no_images_without_a_finer_step() -> None:
    found = report(SYMMETRIC["cubic"], (0.05, 0.2), 0.5, 1)
    assert (found.pass_band_error, found.worst_image) == (0.0, -np.inf)


@pytest.mark.parametrize("item", FILTERS)
def test_whole_records_agree_with_single_values(item: InterpolationFilter) -> None:
    samples = np.random.default_rng(3).normal(size=(40, 2))
    fine = interpolate(item, samples, 4)
    first = item.before - 1
    assert fine.shape == ((40 - item.before - item.after + 1) * 4, 2)
    for row in (0, 1, 17, len(fine) - 1):
        for column in (0, 1):
            expected = value_at(item, samples[:, column], first + row / 4)
            assert fine[row, column] == pytest.approx(expected, abs=1e-12)
    np.testing.assert_array_equal(interpolate(item, samples[:, 0], 4), fine[:, 0])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: kaiser_filter(0, 5.0), "half-width is 0 samples; it must be 1 or more"),
        (lambda: kaiser_filter(4, -1.0), "shape of the window is -1.0"),
        (lambda: optimal_filter(4, 0.0), "band ends at 0.0 cycles a sample"),
        (lambda: optimal_filter(4, 0.2, 0.0), "floor is 0.0; it must be from 1e-12 to 1"),
        (lambda: interpolate(SYMMETRIC["cubic"], np.zeros(5), 2), "5 samples; it needs 6"),
        (lambda: interpolate(SYMMETRIC["cubic"], np.zeros(9), 0), "ratio is 0; it must be >= 1"),
        (lambda: report(SYMMETRIC["cubic"], (0.1, 0.2), 0.0, 5), "sample step of an interpolation filter is 0"),
        (lambda: report(SYMMETRIC["cubic"], (0.1, 1.2), 0.5, 5), "must lie within 0 and 1 Hz"),
    ],
)
def test_refusals(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        call()
