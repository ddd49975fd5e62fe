"""Streams of samples: exact start, exact repeat, exact restore, and the covariance that the model has."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import lfilter

from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.filters.model import ArmaModel, covariance, impulse_response, largest_pole
from tlpsim.loads.filters.process import ArmaProcess, generate, stationary_start
from tlpsim.loads.filters.random_numbers import noise_block

FloatArray = NDArray[np.float64]


def model_of(seed: int, size: int, p: int, q: int, pole: float = 0.8) -> ArmaModel:
    generator = np.random.default_rng(seed)
    moving_average = generator.standard_normal((q + 1, size, size))
    model = ArmaModel(
        autoregressive=generator.standard_normal((p, size, size)), moving_average=moving_average, step=1.0
    )
    scale = (pole / largest_pole(model)) ** np.arange(1, p + 1)
    return ArmaModel(
        autoregressive=model.autoregressive * scale[:, None, None], moving_average=moving_average, step=1.0
    )


def crowded_model() -> ArmaModel:
    """Eight poles crowded at a small angle, as those of a sea sampled many times a period."""
    poles = np.array([0.985, 0.98, 0.975, 0.97]) * np.exp(1j * np.array([0.16, 0.2, 0.23, 0.3]))
    polynomial = np.poly(np.r_[poles, poles.conj()]).real
    return ArmaModel(autoregressive=-polynomial[1:, None, None], moving_average=np.ones((2, 1, 1)), step=1.0)


@pytest.mark.parametrize(("size", "p", "q"), [(1, 1, 0), (2, 3, 2), (3, 2, 4), (2, 0, 2)])
def test_start_has_exactly_the_joint_covariance(size: int, p: int, q: int) -> None:
    if p:
        model = model_of(3, size, p, q)
    else:
        model = ArmaModel(autoregressive=np.zeros((0, size, size)), moving_average=np.ones((q + 1, size, size)), step=1)
    count = (p + q) * size
    # The start is linear in the noise; its columns are the images of unit noises.
    columns = []
    for unit in np.eye(count):
        samples, noises = stationary_start(model, unit.reshape(p + q, size))
        columns.append(np.concatenate([samples.ravel(), noises.ravel()]))
    joint = np.array(columns).T @ np.array(columns)
    lagged, response = covariance(model, max(p - 1, 0)), impulse_response(model, q + 1)
    expected = np.eye(count)
    for i in range(p):
        for j in range(p):
            block = lagged[i - j] if i >= j else lagged[j - i].T
            expected[i * size : (i + 1) * size, j * size : (j + 1) * size] = block
        for j in range(q):
            lag = (i - p) - (j - q)
            block = response[lag] if lag >= 0 else np.zeros((size, size))
            rows, places = slice(i * size, (i + 1) * size), slice((p + j) * size, (p + j + 1) * size)
            expected[rows, places], expected[places, rows] = block, block.T
    np.testing.assert_allclose(joint, expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("make", [lambda: model_of(1, 2, 3, 2), crowded_model])
def test_process_is_stationary_from_the_first_sample(make) -> None:  # type: ignore[no-untyped-def]
    """Variance of sample n over many streams, for n at the start, against the exact variance."""
    model = make()
    streams, count = 2000, 12
    samples = np.array([generate(model, 0, stream, count) for stream in range(streams)])
    ratio = np.mean(samples**2, axis=0) / np.diagonal(covariance(model, 0)[0])
    # Standard deviation of a variance estimate, sqrt(2 / 2000) = 3.2 %; 4.5 of them for 24 numbers.
    np.testing.assert_allclose(ratio, 1.0, atol=4.5 * np.sqrt(2 / streams))


@given(
    seed=st.integers(0, 2**32 - 1),
    size=st.integers(1, 3),
    p=st.integers(1, 4),
    q=st.integers(0, 4),
    retained=st.integers(1, 9),
    firsts=st.lists(st.integers(0, 3000), min_size=1, max_size=8),
)
@settings(max_examples=30, deadline=None)
def test_windows_in_any_order_are_the_samples_of_one_pass(
    seed: int, size: int, p: int, q: int, retained: int, firsts: list[int]
) -> None:
    model = model_of(seed, size, p, q)
    straight = generate(model, seed, 1, 3010)
    process = ArmaProcess(model, seed, 1, retained)
    for first in firsts:
        np.testing.assert_array_equal(process.window(first, retained), straight[first : first + retained])


def test_samples_equal_a_library_filter_run_on_the_same_noise() -> None:
    model = model_of(2, 1, 3, 2)
    p, q = model.orders
    samples, noises = stationary_start(model, noise_block(7, 1, 0, p + q, 1))
    noise = np.vstack([noises, noise_block(7, 1, 1, 500, 1)]).ravel()
    numerator = model.moving_average[:, 0, 0]
    denominator = np.r_[1.0, -model.autoregressive[:, 0, 0]]
    # lfilter from rest with the start subtracted: continue its own state from the past by brute force.
    past = samples.ravel()
    expected = list(past)
    for n in range(500):
        ma = numerator @ noise[n + q - np.arange(q + 1)]
        expected.append(ma - denominator[1:] @ np.array(expected[-1 : -p - 1 : -1]))
    np.testing.assert_allclose(generate(model, 7, 1, 500).ravel(), expected[p:], atol=1e-10)
    # After the start has died away the two agree whatever came before.
    settled = lfilter(numerator, denominator, noise)[q:]
    np.testing.assert_allclose(generate(model, 7, 1, 500).ravel()[200:], settled[200:], atol=1e-10)


def test_streams_and_seeds_are_distinct() -> None:
    model = model_of(5, 2, 2, 1)
    base = generate(model, 9, 4, 6)
    assert not np.array_equal(generate(model, 10, 4, 6), base)
    assert not np.array_equal(generate(model, 9, 5, 6), base)
    np.testing.assert_array_equal(generate(model, 9, 4, 6), base)


@pytest.mark.parametrize("at", [0, 300, 1023, 1024, 5000])
def test_restored_stream_continues_exactly_also_in_another_object(at: int) -> None:
    model = model_of(1, 2, 3, 2)
    process = ArmaProcess(model, seed=0, stream=0, retained=4)
    process.window(at, 4)
    state = process.get_state()
    assert not state.samples.flags.writeable
    expected = process.window(at + 800, 4).copy()
    here = generate(model, 0, 0, at + 4)[at:]
    for restored in (process, ArmaProcess(model, seed=0, stream=0, retained=4)):
        restored.set_state(state)
        np.testing.assert_array_equal(restored.window(at, 4), here)
        np.testing.assert_array_equal(restored.window(at + 800, 4), expected)
    other = ArmaProcess(model, seed=0, stream=0, retained=5)
    with pytest.raises(ScenarioError, match=r"shapes \(4, 2\) and \(2, 2\); they must be .* \(5, 2\) and \(2, 2\)"):
        other.set_state(state)


def test_samples_have_the_covariance_of_the_model() -> None:
    model = model_of(7, 2, 2, 2)
    count = 400_000
    samples = generate(model, 2, 0, count)
    exact = covariance(model, 400)
    # Bartlett: the variance of a sample covariance is below (1 / n) sum over lags of 2 |R_k|² / R_0²; four sigma.
    scale = np.sqrt(np.outer(np.diag(exact[0]), np.diag(exact[0])))
    bound = 4.0 * np.sqrt(4.0 / count * np.sum(np.max(np.abs(exact / scale), axis=(1, 2)) ** 2))
    for lag in range(4):
        sampled = samples[lag:].T @ samples[: count - lag] / (count - lag)
        assert np.max(np.abs(sampled - exact[lag]) / scale) < bound


def test_bad_use_is_refused() -> None:
    model = model_of(0, 1, 1, 0)
    process = ArmaProcess(model, 0, 0, 3)
    for first, count in ((-1, 2), (0, 0), (0, 4)):
        with pytest.raises(ValueError, match="window of 3"):
            process.window(first, count)
    unstable = ArmaModel(autoregressive=np.full((1, 1, 1), 1.01), moving_average=np.ones((1, 1, 1)), step=1.0)
    with pytest.raises(SolverError, match=r"largest pole is 1\.01"):
        ArmaProcess(unstable, 0, 0, 3)
