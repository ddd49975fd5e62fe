"""First-order force on a platform that moves with the waves: closed forms of second order, and sums over components."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import j1

from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import inertia_transfer
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.elevation import ArmaSea, transition, voids
from tlpsim.loads.waves.field import WaveComponents
from tlpsim.loads.waves.sea import SeaState

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

DEPTH = 450.0
OFFSET = np.array([12.0, -7.0])
PERIOD = 50.0  # s, of the difference of 0.1 and 0.08 Hz, and of all sums
FREQUENCIES, HEADINGS = np.array([0.1, 0.08]), np.array([0.4, -0.3])
generator = np.random.default_rng(11)
FORCE = generator.standard_normal((6, 2)) + 1j * generator.standard_normal((6, 2))
MOTION = generator.standard_normal((2, 2)) + 1j * generator.standard_normal((2, 2))


def waves(frequency: FloatArray, amplitude: ComplexArray, heading: FloatArray) -> WaveComponents:
    return WaveComponents(
        frequency=frequency,
        amplitude=np.abs(amplitude),
        phase=np.angle(amplitude),
        wavenumber=wavenumber(2.0 * np.pi * frequency, DEPTH),
        heading=heading,
        water_depth=DEPTH,
        gravity=9.80665,
    )


def wave_vector(sea: WaveComponents) -> FloatArray:
    return sea.wavenumber * np.array([np.cos(sea.heading), np.sin(sea.heading)])


def position(sea: WaveComponents, motion: ComplexArray, times: FloatArray) -> FloatArray:
    """Pose (times, 6) at the offset, with the motion (2, N) a unit amplitude of the waves there."""
    amplitude = sea.amplitudes(0.0) * np.exp(-1j * OFFSET @ wave_vector(sea))
    result = np.zeros((len(times), 6))
    result[:, :2] = OFFSET + np.real(np.exp(1j * np.outer(times, sea.angular_frequency)) @ (motion * amplitude).T)
    return result


def diffraction(loads: WaveLoads, times: FloatArray, pose: FloatArray) -> FloatArray:
    return np.array([loads.evaluate(t, x, np.zeros(6)).diffraction for t, x in zip(times, pose, strict=True)])


def lines(sea: WaveComponents, force: ComplexArray, motion: ComplexArray, *, displaced: bool) -> ComplexArray:
    """Fourier coefficients (frequencies, 6) of the force over the common period."""
    loads = WaveLoads(
        sea=sea, members=issc_members(), excitation=lambda _: force, displaced_position=displaced, strip_length=40.0
    )
    times = PERIOD * np.arange(128) / 128
    return np.fft.rfft(diffraction(loads, times, position(sea, motion, times)), axis=0) / len(times)


@pytest.mark.parametrize("size", [0.01, 3.0])
def test_mean_force_on_a_platform_that_moves_with_a_regular_wave(size: float) -> None:
    sea = waves(FREQUENCIES[:1], np.array([size * np.exp(0.7j)]), HEADINGS[:1])
    force, motion = FORCE[:, :1], MOTION[:, :1]
    found = lines(sea, force, motion, displaced=True)[0].real
    vector = wave_vector(sea)[:, 0]
    shift = complex(vector @ motion[:, 0])
    second_order = 0.5 * size**2 * np.real(shift * np.conj(-1j * force[:, 0]))
    # exp(-i b cos(theta)) has the line -i J_1(b) where the closed form has -i b / 2; the next term is b²/8 of it.
    turn = abs(shift) * size
    np.testing.assert_allclose(found, second_order * 2.0 * j1(turn) / turn, rtol=1e-9)
    np.testing.assert_allclose(found, second_order, rtol=turn**2 / 8.0 + 1e-9)
    still = lines(sea, force, motion, displaced=False)[0].real
    np.testing.assert_allclose(still, 0.0, atol=1e-14 * size * np.abs(force).max())


def test_difference_frequency_force_of_two_waves() -> None:
    amplitude = np.array([0.03 * np.exp(0.3j), 0.02 * np.exp(-1.9j)])
    sea = waves(FREQUENCIES, amplitude, HEADINGS)
    vector = wave_vector(sea)
    turned = -1j * FORCE
    # F = sum_ij a_i a_j* T_ij, where the motion in wave i goes along the wave vector j.
    ahead = MOTION.T @ vector
    pairs = 0.25 * (np.einsum("ij,dj->dij", ahead, turned.conj()) + np.einsum("di,ji->dij", turned, ahead.conj()))
    local = amplitude * np.exp(-1j * OFFSET @ vector)
    found = lines(sea, FORCE, MOTION, displaced=True)
    # The next terms are smaller by the square of the turn k X.
    turn = np.max(np.abs(ahead)) * np.sum(np.abs(amplitude))
    tolerance = turn**2 * np.max(np.abs(found[1]))
    assert turn < 5e-3
    mean = np.einsum("i,dii->d", np.abs(local) ** 2, pairs).real
    np.testing.assert_allclose(found[0].real, mean, atol=tolerance)
    np.testing.assert_allclose(found[1], pairs[:, 0, 1] * local[0] * local[1].conj(), atol=tolerance)
    still = lines(sea, FORCE, MOTION, displaced=False)
    np.testing.assert_allclose(still[:4], 0.0, atol=1e-14)


def test_digital_filter_sea_equals_the_sum_over_its_components_at_the_platform() -> None:
    state = SeaState(
        significant_height=7.0,
        peak_period=12.0,
        heading=0.3,
        water_depth=DEPTH,
        directions=2,
        spreading_exponent=4.0,
        highest_frequency=0.25,
    )
    sea = ArmaSea(state, reach=150.0, seed=4)
    count, step = 1600, sea.sampling_step
    frequency = np.fft.rfftfreq(count, step)[1:-1]
    used = frequency < 1.1 * state.highest_frequency
    frequency = frequency[used]
    acting = transition(frequency, state.highest_frequency) * voids(frequency, state, 0.5 / step)
    amplitude = 2.0 / count * np.fft.rfft(sea.samples(0, count), axis=0)[1:-1][used] * acting[:, None]
    headings = np.repeat(state.spread().heading, len(frequency))
    parts = waves(np.tile(frequency, 2), amplitude.T.ravel(), headings)

    # The record is not periodic: only its middle is what the components say.
    times = np.arange(250.0, 550.0, 1.7)
    period = 1j * parts.angular_frequency
    pose = position(parts, 2.0 / (period + 0.3) * np.array([[1.0], [0.4]]) * 0.3, times)
    pose[:, 0] += 3.0 * np.sin(2.0 * np.pi * times / 100.0)
    transfer = inertia_transfer(issc_members(), parts)
    turn = np.exp(1j * (np.outer(times, parts.angular_frequency) - pose[:, :2] @ wave_vector(parts)))
    exact = np.real(turn @ (transfer * parts.amplitude * np.exp(1j * parts.phase)).T)
    found = diffraction(WaveLoads(sea=sea, members=issc_members()), times, pose)
    # Kernels of this window leave 1e-3, of short waves.
    off = np.std(found - exact, axis=0) / np.std(exact, axis=0)
    assert np.all(off < 3e-3), off
    # The same loads without the displacement are far off, so that the motion does count.
    still = diffraction(WaveLoads(sea=sea, members=issc_members(), displaced_position=False), times, pose)
    assert np.all(np.std(still - exact, axis=0) > 0.1 * np.std(exact, axis=0))
