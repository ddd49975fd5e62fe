"""The hybrid filter against harmonics that are really filtered, and against a kernel of the acceleration itself."""

import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.filters.convolution import convolve, floored, fraction_of_step, kernel
from tlpsim.loads.filters.differentiation import derivative_gain
from tlpsim.loads.filters.hybrid import derivative_error, derivative_response, interpolate_and_differentiate
from tlpsim.loads.filters.interpolation import SYMMETRIC, interpolate


@pytest.mark.parametrize("name", SYMMETRIC)
@pytest.mark.parametrize("order", [2, 6])
def test_stated_error_is_that_of_a_record(name: str, order: int) -> None:
    step, ratio, frequency, item = 0.5, 5, 0.1, SYMMETRIC[name]
    omega = 2.0 * np.pi * frequency
    samples = np.exp(1j * omega * step * np.arange(100))
    parts = [interpolate_and_differentiate(item, part, step, ratio, order)[1] for part in (samples.real, samples.imag)]
    found = parts[0] + 1j * parts[1]
    times = (item.before - 1) * step + (order // 2 + np.arange(len(found))) * step / ratio
    errors = (found - 1j * omega * np.exp(1j * omega * times)) / omega
    whole = len(errors) // ratio * ratio  # the error repeats with every sample
    measured = np.sqrt(np.mean(np.abs(errors[:whole]) ** 2))
    # abs: the acceleration of rounded samples, 1e-16 / 0.1 s over 0.6 rad/s, with room
    assert measured == pytest.approx(float(derivative_error(item, frequency, step, ratio, order)), rel=1e-6, abs=1e-13)


def test_signal_and_derivative_belong_to_the_same_times() -> None:
    samples = np.random.default_rng(1).normal(size=(30, 2))
    item = SYMMETRIC["optimal"]
    signal, derivative = interpolate_and_differentiate(item, samples, 0.5, 5, 4)
    assert signal.shape == derivative.shape
    np.testing.assert_array_equal(signal, interpolate(item, samples, 5)[2:-2])
    np.testing.assert_allclose((signal[2:, 0] - signal[:-2, 0]) / 0.2, derivative[1:-1, 0], rtol=0.2, atol=0.3)


def test_mean_response_is_the_gain_of_the_difference() -> None:
    """With a filter of negligible error what is left is the central difference's own gain at the fine step."""
    frequency = np.array([0.05, 0.1, 0.2])
    response = derivative_response(SYMMETRIC["kaiser"], frequency, 0.5, 5, 2)
    carrier = 2j * np.pi * frequency * np.exp(2j * np.pi * 0.1 * np.outer(np.arange(5), frequency))
    gain = np.mean(response / carrier, axis=0)
    # the filter's pass-band error, 1e-5
    np.testing.assert_allclose(gain, derivative_gain(frequency, 0.1, 2), atol=2e-5)


def test_acceleration_beside_a_kernel_of_its_own() -> None:
    """Velocity 15 m down from the elevation, then its derivative, against direct kernels at every phase."""
    step, ratio, reach = 0.5, 5, 40
    frequency = np.linspace(0.0, 1.0, 1025)
    omega = 2.0 * np.pi * frequency
    ratio_to_peak = np.maximum(14.0 * frequency, 0.2)
    density = ratio_to_peak**-5.0 * np.exp(-1.25 * ratio_to_peak**-4.0)
    velocity = omega * np.exp(-15.0 * omega**2 / 9.80665)
    weight = floored(density)
    harmonics = frequency[1:-1:2]
    rng = np.random.default_rng(7)
    amplitude = np.sqrt(density[1:-1:2]) * np.exp(2j * np.pi * rng.uniform(size=len(harmonics)))

    def record(transfer: np.ndarray, times: np.ndarray) -> np.ndarray:
        return (np.exp(2j * np.pi * np.outer(times, harmonics)) @ (amplitude * transfer[1:-1:2])).real

    elevation = record(np.ones_like(omega), step * np.arange(1200))
    item = SYMMETRIC["optimal"]
    speed = convolve(kernel(velocity, frequency, weight, step, reach, reach), elevation)[:, 0]
    _, hybrid = interpolate_and_differentiate(item, speed, step, ratio)
    phases = [1j * omega * velocity * fraction_of_step(frequency, step, j / ratio) for j in range(ratio)]
    direct = convolve(kernel(np.array(phases).T, frequency, weight, step, reach, reach), elevation).ravel()
    first = (item.before - 1) * ratio + 3
    direct = direct[first : first + len(hybrid)]
    times = reach * step + (first + np.arange(len(hybrid))) * step / ratio
    exact = record(1j * omega * velocity, times)
    scale = np.std(exact)
    assert np.std(direct - exact) / scale < 1e-3
    assert np.std(hybrid - exact) / scale < 2e-3
    assert np.std(hybrid - direct) / scale < 2e-3


def test_refusals() -> None:
    item = SYMMETRIC["cubic"]
    with pytest.raises(ScenarioError, match="frequency of a derivative"):
        derivative_error(item, [0.0, 0.1], 0.5, 5)
    with pytest.raises(ScenarioError, match="order 5 is not one of 2, 4, 6"):
        derivative_error(item, 0.1, 0.5, 5, 5)
    with pytest.raises(ScenarioError, match="ratio is 0"):
        derivative_response(item, [0.1], 0.5, 0)
