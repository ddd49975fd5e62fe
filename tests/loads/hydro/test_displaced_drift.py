"""Drift without what the displaced position makes: wave loads in time, products of two waves, whole mean drift."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.bem.quadratic_transfer import FIXED_BODY, QUADRATIC_PART, QuadraticTransfer
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.diffraction import excitation
from tlpsim.loads.hydro.displaced_drift import (
    displaced_drift,
    displaced_kernel,
    quadratic_kernel_without,
    without_displaced_position,
)
from tlpsim.loads.hydro.drift import Waves, completed_drift, quadratic_kernel
from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.quadratic_filters import newman_filters
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.field import WaveComponents

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

DEPTH, GRAVITY = 60.0, 9.80665
FREQUENCY, HEADING = np.array([0.08, 0.1, 0.12]), np.array([-0.3, 0.4])
PERIOD = 50.0  # s, of all differences and sums of the frequencies
NUMBER = wavenumber(2.0 * np.pi * FREQUENCY, DEPTH)
generator = np.random.default_rng(5)


def random(*shape: int) -> ComplexArray:
    return generator.standard_normal(shape) + 1j * generator.standard_normal(shape)


def database(motion: ComplexArray | None, force: ComplexArray, drift: FloatArray | None = None) -> HydrodynamicDatabase:
    """Motions, forces (headings, frequencies, 6) and mean drift at `FREQUENCY` and `HEADING`."""
    count = len(FREQUENCY)
    return HydrodynamicDatabase(
        omega=2.0 * np.pi * FREQUENCY,
        heading=HEADING,
        depth=DEPTH,
        density=1025.0,
        gravity=GRAVITY,
        added_mass=np.zeros((count, 6, 6)),
        radiation_damping=np.zeros((count, 6, 6)),
        excitation_force=force,
        froude_krylov_force=force,
        added_mass_infinite=np.zeros((6, 6)),
        added_mass_zero=np.zeros((6, 6)),
        mean_drift=np.zeros((len(HEADING), count, 6)) if drift is None else drift,
        response_amplitude=motion,
    )


DATABASE = database(random(2, 3, 6), random(2, 3, 6))


def waves(frequency: FloatArray, amplitude: ComplexArray, heading: FloatArray, depth: float) -> WaveComponents:
    return WaveComponents(
        frequency=frequency,
        amplitude=np.abs(amplitude),
        phase=np.angle(amplitude),
        wavenumber=wavenumber(2.0 * np.pi * frequency, depth),
        heading=heading,
        water_depth=depth,
        gravity=GRAVITY,
    )


def forces_in_motion(loads: WaveLoads, motion: ComplexArray, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First-order and drift force (times, 6) of a platform with motions (2, N) a unit amplitude of the waves."""
    sea = loads.sea
    pose = np.zeros((len(times), 6))
    pose[:, :2] = np.array([(motion @ sea.amplitudes(t)).real for t in times])
    found = [loads.evaluate(t, x, np.zeros(6)) for t, x in zip(times, pose, strict=True)]
    return np.array([each.diffraction for each in found]), np.array([each.drift for each in found])


@pytest.mark.parametrize("headings", [(0, 0), (0, 1), (1, 0)])
def test_kernel_is_the_slow_part_of_the_forces_in_time(headings: tuple[int, int]) -> None:
    """Two waves: the line at their difference frequency over the common period is 2 a_1 a_2* T_12, halved by rfft."""
    at, heading = np.array([1, 0]), np.array(headings)
    amplitude = np.array([0.03 * np.exp(0.3j), 0.02 * np.exp(-1.9j)])
    sea = waves(FREQUENCY[at], amplitude, HEADING[heading], DEPTH)
    loads = WaveLoads(sea=sea, members=issc_members(), excitation=excitation(DATABASE), strip_length=40.0)
    times = PERIOD * np.arange(128) / 128
    assert DATABASE.response_amplitude is not None
    first_order, _ = forces_in_motion(loads, DATABASE.response_amplitude[heading, at, :2].T, times)
    lines = np.fft.rfft(first_order, axis=0) / len(times)
    both = Waves(sea.angular_frequency, sea.heading)
    pairs = np.stack([displaced_kernel(DATABASE)(both, both, component) for component in range(6)])
    product = amplitude[:, None] * amplitude.conj()
    # The next terms are smaller by the square of the turn k X, below 0.01.
    size = np.max(np.abs(lines[1]))
    assert size > 1e-6
    np.testing.assert_allclose(lines[1], (product * pairs)[:, 0, 1], atol=1e-4 * size)
    np.testing.assert_allclose(lines[0].real, np.einsum("dii->d", product * pairs).real, atol=1e-4 * size)


def test_diagonal_of_the_kernel_is_the_drift() -> None:
    whole = displaced_drift(DATABASE)
    for j, heading in enumerate(HEADING):
        sea = Waves(DATABASE.omega, np.full(3, heading))
        for component in range(6):
            found = np.diagonal(displaced_kernel(DATABASE)(sea, sea, component))
            np.testing.assert_allclose(found, whole[j, :, component], atol=1e-14)


@pytest.mark.parametrize(("heading", "frequency"), [(6, 18), (6, 25), (6, 33), (0, 33), (12, 25), (3, 40)])
def test_both_together_are_the_whole_mean_drift(heading: int, frequency: int) -> None:
    """The ISSC TLP in a regular wave, moving as in its database: mean of wave loads with what is left of the drift."""
    data = issc_database()
    motion = data.response_amplitude
    assert motion is not None
    omega, amplitude = data.omega[frequency : frequency + 1], 0.01
    sea = waves(omega / (2.0 * np.pi), np.array([amplitude * np.exp(0.7j)]), data.heading[heading : heading + 1], 450.0)
    rest = newman_filters(without_displaced_position(data), sea)
    loads = WaveLoads(sea=sea, members=issc_members(), excitation=excitation(data), drift=rest, strip_length=80.0)
    times = 2.0 * np.pi / omega[0] * np.arange(16) / 16
    parts = forces_in_motion(loads, motion[heading, frequency, :2, None], times)
    first_order, drift = (each.mean(axis=0) for each in parts)
    expected = amplitude**2 * data.mean_drift[heading, frequency]
    # The parts may cancel, and where symmetry leaves nothing there is rounding; a turn k X of 2e-4 leaves its square.
    size = np.abs(first_order)[[0, 1, 5]] + np.abs(expected)
    tolerance = 1e-6 * np.maximum(size, 1e-3 * size.max())
    assert np.all(np.abs((first_order + drift)[[0, 1, 5]] - expected) < tolerance)
    assert not np.any(drift[2:5])
    assert np.max(np.abs(first_order[[0, 1, 5]] / size)) > 0.01  # the displaced part does count


def table(pairs: bool, **changes: str) -> QuadraticTransfer:
    """T of nothing but products of motions and gradients of `DATABASE`, term by term."""
    motion, force = DATABASE.response_amplitude, DATABASE.excitation_force
    assert motion is not None
    along = NUMBER[:, None] * np.array([np.cos(HEADING), np.sin(HEADING)])[:, :, None, None]  # (2, h, n, 1)
    gradient = -1j * along * force
    half = 0.25 * np.einsum("amc,cbni->abmni", motion[..., :2], gradient.conj())
    other = 0.25 * np.einsum("cami,bnc->abmni", gradient, motion[..., :2].conj())
    transfer = half + other
    return QuadraticTransfer(
        omega=DATABASE.omega,
        heading=HEADING,
        transfer=transfer if pairs else np.einsum("aa...->a...", transfer),
        **changes,
    )


BOTH = Waves(np.tile(DATABASE.omega, 2), np.repeat(HEADING, 3))


@pytest.mark.parametrize("pairs", [False, True])
def test_nothing_is_left_of_a_table_of_those_products_alone(pairs: bool) -> None:
    whole, rest = quadratic_kernel(table(pairs)), quadratic_kernel_without(table(pairs), DATABASE)
    for component in range(6):
        size = np.max(np.abs(whole(BOTH, BOTH, component)))
        np.testing.assert_allclose(rest(BOTH, BOTH, component), 0.0, atol=1e-13 * size)


def test_a_component_that_no_table_tells_is_left_alone() -> None:
    whole = table(pairs=True)
    silent = replace(whole, transfer=whole.transfer * (np.arange(6) != 2))
    rest = quadratic_kernel_without(silent, DATABASE)
    assert not np.any(rest(BOTH, BOTH, 2))


def test_a_hull_that_is_fixed_or_at_rest_keeps_its_drift() -> None:
    drift = generator.standard_normal((2, 3, 6))
    fixed, still = (
        replace(DATABASE, mean_drift=drift, response_amplitude=each) for each in (None, 0.0 * random(2, 3, 6))
    )
    of_fixed = table(pairs=True, contents=f"{QUADRATIC_PART}; {FIXED_BODY} 'box', form 'control'")
    cases = [(table(pairs=True), fixed), (table(pairs=True), still), (of_fixed, DATABASE)]
    for data in (fixed, still):
        assert not np.any(displaced_drift(data))
        np.testing.assert_array_equal(without_displaced_position(data).mean_drift, drift)
        assert not np.any(displaced_kernel(data)(BOTH, BOTH, 0))
    for told, data in cases:
        whole = quadratic_kernel(told)(BOTH, BOTH, 5)
        np.testing.assert_array_equal(quadratic_kernel_without(told, data)(BOTH, BOTH, 5), whole)
    assert np.any(quadratic_kernel_without(table(pairs=True), DATABASE)(BOTH, BOTH, 5) != whole)


@pytest.mark.parametrize("components", [[0, 1, 5], list(range(6))])
def test_drift_of_three_components_stays_one_of_three(components: list[int]) -> None:
    data = replace(DATABASE, mean_drift=generator.standard_normal((2, 3, len(components))))
    left = without_displaced_position(data).mean_drift
    np.testing.assert_allclose(left + displaced_drift(DATABASE)[..., components], data.mean_drift, rtol=1e-13)


def test_motions_that_are_not_known_are_refused() -> None:
    motion = random(2, 3, 6)
    motion[0, 1, 0] = np.nan
    for use in (displaced_drift, displaced_kernel, without_displaced_position):
        with pytest.raises(ScenarioError, match=r"response amplitudes that are not known .*displaced_position = false"):
            use(replace(DATABASE, response_amplitude=motion))


def test_what_is_left_keeps_the_symmetry_of_the_hull() -> None:
    """Headings of 45° of the ISSC TLP are completed to the whole circle, as those of the whole drift."""
    data = issc_database()
    found, whole = (completed_drift(each)[0] for each in (without_displaced_position(data), data))
    np.testing.assert_array_equal(found, whole)
    assert len(found) == 96


@settings(max_examples=25)
@given(
    omega=st.lists(st.floats(0.3, 2.0), min_size=2, max_size=5),
    heading=st.floats(-np.pi, np.pi),
    component=st.integers(0, 5),
)
def test_kernel_is_its_adjoint(omega: list[float], heading: float, component: int) -> None:
    """T_nm = T_mn*, or the force were not real; and all of it goes with the size of the motion."""
    data = issc_database()
    sea, other = Waves(np.array(omega), np.full(len(omega), heading)), Waves(np.array([0.5, 1.1]), np.array([0.2, 2.0]))
    matrix = displaced_kernel(data)(sea, other, component)
    size = 1e-12 * np.max(np.abs(matrix))
    np.testing.assert_allclose(displaced_kernel(data)(other, sea, component), matrix.conj().T, atol=size)
    assert data.response_amplitude is not None
    doubled = replace(data, response_amplitude=2.0 * data.response_amplitude)
    np.testing.assert_allclose(displaced_kernel(doubled)(sea, other, component), 2.0 * matrix, atol=size)
