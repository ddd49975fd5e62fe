"""Theory of the ARMA model against closed forms, the Lyapunov equation, and numerical integration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov
from scipy.signal import lfilter

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.filters.model import (
    ArmaModel,
    covariance,
    impulse_response,
    largest_pole,
    round_off,
    spectrum,
    transformed,
)

FloatArray = NDArray[np.float64]


def random_model(seed: int, size: int, p: int, q: int, pole: float = 0.8, step: float = 0.5) -> ArmaModel:
    """Stable model: its coefficients are scaled as a^k, which scales all poles by a."""
    generator = np.random.default_rng(seed)
    autoregressive = generator.standard_normal((p, size, size))
    moving_average = generator.standard_normal((q + 1, size, size))
    model = ArmaModel(autoregressive=autoregressive, moving_average=moving_average, step=step)
    if p:
        scale = (pole / largest_pole(model)) ** np.arange(1, p + 1)
        model = ArmaModel(
            autoregressive=autoregressive * scale[:, None, None], moving_average=moving_average, step=step
        )
    return model


def state_space(model: ArmaModel) -> tuple[FloatArray, FloatArray]:
    """x_n = F x_{n-1} + G w_n with the newest samples and noises as state."""
    (p, q), size = model.orders, model.size
    length = (p + q + 1) * size
    transition, gain = np.zeros((length, length)), np.zeros((length, size))
    transition[size : p * size, : (p - 1) * size] = np.eye((p - 1) * size)
    transition[(p + 1) * size :, p * size : -size] = np.eye(q * size)
    transition[:size, : p * size] = np.hstack(list(model.autoregressive))
    # The newest noise enters the state one row below the samples; those before it move down one.
    transition[:size, p * size : -size] = np.hstack([np.zeros((size, 0)), *model.moving_average[1:]])
    gain[:size], gain[p * size : (p + 1) * size] = model.moving_average[0], np.eye(size)
    return transition, gain


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 3), p=st.integers(1, 4), q=st.integers(0, 4))
@settings(max_examples=30, deadline=None)
def test_covariance_solves_the_lyapunov_equation(seed: int, size: int, p: int, q: int) -> None:
    model = random_model(seed, size, p, q)
    transition, gain = state_space(model)
    joint = solve_discrete_lyapunov(transition, gain @ gain.T)
    found = covariance(model, p - 1)
    scale = np.abs(joint).max()
    for lag in range(p):
        np.testing.assert_allclose(found[lag], joint[:size, lag * size : (lag + 1) * size], atol=1e-8 * scale)


@pytest.mark.parametrize(("size", "p", "q"), [(1, 3, 2), (2, 2, 4), (3, 3, 0), (2, 0, 3)])
def test_spectrum_is_the_transform_of_the_covariance(size: int, p: int, q: int) -> None:
    model = random_model(4, size, p, q)
    frequency = np.linspace(0.0, 0.5 / model.step, 2049)
    density = spectrum(model, frequency)
    for lag, expected in enumerate(covariance(model, 5)):
        wave = np.exp(2j * np.pi * frequency * lag * model.step)
        # The trapezoidal rule is exact to round-off for a periodic analytic function with so many points.
        integral = np.trapezoid(np.real(density * wave[:, None, None]), frequency, axis=0)
        np.testing.assert_allclose(integral, expected, atol=1e-10 * np.abs(covariance(model, 0)).max())


def test_closed_forms_of_the_first_order_process() -> None:
    pole, zero, step = 0.7, 0.4, 0.5
    model = ArmaModel(autoregressive=np.full((1, 1, 1), pole), moving_average=np.array([[[1.0]], [[zero]]]), step=step)
    variance = (1 + zero**2 + 2 * pole * zero) / (1 - pole**2)
    first = (1 + pole * zero) * (pole + zero) / (1 - pole**2)
    np.testing.assert_allclose(covariance(model, 2).ravel(), [variance, first, pole * first], rtol=1e-14)
    z = np.exp(-2j * np.pi * np.array([0.0, 0.3, 0.9]) * step)
    closed = 2 * step * np.abs((1 + zero * z) / (1 - pole * z)) ** 2
    np.testing.assert_allclose(spectrum(model, np.array([0.0, 0.3, 0.9]))[:, 0, 0], closed, rtol=1e-13)
    assert largest_pole(model) == pytest.approx(pole)


def test_impulse_response_equals_a_library_filter() -> None:
    model = random_model(8, 1, 4, 2)
    expected = lfilter(
        model.moving_average[:, 0, 0], np.r_[1.0, -model.autoregressive[:, 0, 0]], np.r_[1.0, np.zeros(49)]
    )
    np.testing.assert_allclose(impulse_response(model, 50)[:, 0, 0], expected, atol=1e-12 * np.abs(expected).max())


def test_transformed_process_has_the_transformed_covariance() -> None:
    model = random_model(2, 2, 3, 1)
    left = np.array([[1.0, 0.5], [0.0, 2.0], [1.0, -1.0]])
    wide = transformed(model, left, np.linalg.pinv(left))
    expected = left @ covariance(model, 3) @ left.T
    np.testing.assert_allclose(covariance(wide, 3), expected, atol=1e-12 * np.abs(expected).max())


def test_round_off_is_what_single_precision_shows() -> None:
    """Run the recursion in 32 bits, whose unit round-off is 2^29 times larger, beside 64 bits."""
    poles = 0.97 * np.exp(1j * np.array([0.15, 0.2, 0.25]))
    polynomial = np.poly(np.r_[poles, poles.conj()]).real.astype(np.float32).astype(np.float64)
    model = ArmaModel(autoregressive=-polynomial[1:, None, None], moving_average=np.ones((1, 1, 1)), step=1.0)
    noise = np.random.default_rng(0).standard_normal(100_000).astype(np.float32)
    exact = lfilter([1.0], polynomial, noise.astype(np.float64))
    rounded = lfilter(np.ones(1, dtype=np.float32), polynomial.astype(np.float32), noise)
    assert rounded.dtype == np.float32
    measured = np.std(rounded - exact) / np.std(exact) / 2.0**29
    # An order of magnitude is asked: how the roundings of one sample add up depends on the form of the filter.
    assert 0.1 < round_off(model) / measured < 10.0


def test_bad_models_are_refused() -> None:
    one = np.ones((1, 1, 1))
    with pytest.raises(ScenarioError, match=r"must have the shapes \(p, m, m\)"):
        ArmaModel(autoregressive=np.ones((1, 2, 2)), moving_average=one, step=1.0)
    with pytest.raises(ScenarioError, match="moving average part is not finite"):
        ArmaModel(autoregressive=one, moving_average=np.nan * one, step=1.0)
    with pytest.raises(ScenarioError, match=r"sampling step is 0.0 s"):
        ArmaModel(autoregressive=one, moving_average=one, step=0.0)
    with pytest.raises(SolverError, match="largest pole is 1"):
        covariance(ArmaModel(autoregressive=one, moving_average=one, step=1.0), 0)
    many = ArmaModel(autoregressive=(1 - 2e-6) * np.eye(6)[None], moving_average=np.eye(6)[None], step=1.0)
    with pytest.raises(SolverError, match="lengthen the sampling step"):
        covariance(many, 0)
