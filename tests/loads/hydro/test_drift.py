"""Slow drift: filters against double sums term by term, closed forms of spectra, and Gaussian records."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import gamma

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro import quadratic_filters as filters_module
from tlpsim.loads.hydro.drift import (
    Waves,
    completed_drift,
    drift_coefficients,
    drift_spectrum,
    mean_drift_force,
    newman_kernel,
    quadratic_kernel,
    wave_drift_damping,
)
from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.quadratic_filters import (
    component_variance,
    drift_force,
    newman_filters,
    quadratic_filters,
)
from tlpsim.loads.waves.elevation import ArmaSea
from tlpsim.loads.waves.field import WaveComponents, calm_water, regular_wave, wave_components
from tlpsim.loads.waves.sea import SeaState

STORM = SeaState(spectrum="pierson_moskowitz", significant_height=7.0, peak_period=14.0, heading=0.3, water_depth=450.0)
SPREAD = replace(STORM, directions=3, spreading_exponent=4.0)
OMEGA = np.linspace(0.1, 2.5, 25)
EIGHTH = np.radians(np.linspace(0.0, 45.0, 4))
GRAVITY, DENSITY = 9.80665, 1025.0


def database(drift: NDArray, heading: NDArray = EIGHTH, omega: NDArray = OMEGA) -> HydrodynamicDatabase:
    """A database of which only the mean drift counts."""
    count = len(omega)
    none = np.zeros((len(heading), count, 6), dtype=np.complex128)
    return HydrodynamicDatabase(
        omega=omega,
        heading=heading,
        depth=450.0,
        density=DENSITY,
        gravity=GRAVITY,
        added_mass=np.zeros((count, 6, 6)),
        radiation_damping=np.zeros((count, 6, 6)),
        excitation_force=none,
        froude_krylov_force=none,
        added_mass_infinite=np.zeros((6, 6)),
        added_mass_zero=np.zeros((6, 6)),
        mean_drift=drift,
    )


def force_size(omega: NDArray) -> NDArray:
    """Cubic, which cubic splines keep, and of both signs."""
    return 1e5 * (omega**3 - 0.4 * omega**2 + 0.1 * omega - 0.02)


def yaw_size(omega: NDArray) -> NDArray:
    return 1e6 * (0.5 - omega + 0.1 * omega**3)


def square_hull(omega: NDArray, heading: NDArray) -> NDArray:
    """Mean drift (6, N) of the symmetry of a square, whose headings a Fourier series keeps."""
    none = np.zeros(np.broadcast(omega, heading).shape)
    size = force_size(omega)
    return np.stack(
        [
            size * np.cos(heading),
            size * np.sin(heading),
            none,
            none,
            none,
            yaw_size(omega) * np.sin(4.0 * heading),
        ]
    )


def square_database(components: int = 3) -> HydrodynamicDatabase:
    six = np.moveaxis(square_hull(OMEGA[None, :], EIGHTH[:, None]), 0, -1)
    return database(six[..., [0, 1, 5]] if components == 3 else six)


def double_sum(sea: WaveComponents, transfer: NDArray, time: float, x: float, y: float) -> NDArray:
    """Force (6,) of T (6, N, N) by cosines and sines of phase differences at (x, y)."""
    along = x * np.cos(sea.heading) + y * np.sin(sea.heading)
    phase = sea.angular_frequency * time + sea.phase - sea.wavenumber * along
    apart = phase[:, None] - phase[None, :]
    product = sea.amplitude[:, None] * sea.amplitude[None, :]
    return np.sum(product * (transfer.real * np.cos(apart) - transfer.imag * np.sin(apart)), axis=(1, 2))


def displaced(sea: WaveComponents, time: float, x: float, y: float) -> NDArray:
    shift = sea.wavenumber * (x * np.cos(sea.heading) + y * np.sin(sea.heading))
    return sea.amplitudes(time) * np.exp(-1j * shift)


@pytest.mark.parametrize("components", [3, 6])
def test_mean_drift_of_a_database_at_any_wave(components: int) -> None:
    headings, _ = completed_drift(square_database(components))
    assert len(headings) == 24
    rng = np.random.default_rng(1)
    waves = Waves(rng.uniform(0.1, 2.5, 40), rng.uniform(-np.pi, np.pi, 40))
    drift, margin = drift_coefficients(square_database(components), waves)
    exact = square_hull(*waves)
    np.testing.assert_allclose(drift, exact, atol=1e-10 * np.abs(exact).max())
    np.testing.assert_allclose(margin, 1.0)


def test_drift_fades_beyond_the_frequencies_of_the_data() -> None:
    waves = Waves(np.array([0.05, 2.5, 2.625, 2.75, 3.5]), np.zeros(5))
    drift, margin = drift_coefficients(square_database(), waves)
    ends = square_hull(np.array([0.1, 2.5]), np.zeros(2))[0]
    expected = [0.25 * ends[0], ends[1], 0.5 * ends[1], 0.0, 0.0]
    np.testing.assert_allclose(margin**2 * drift[0], expected, atol=1e-9 * abs(ends[1]))


@pytest.mark.parametrize("mean", ["arithmetic", "geometric"])
@pytest.mark.parametrize("state", [STORM, SPREAD])
def test_newman_filters_are_the_double_sum(mean: str, state: SeaState) -> None:
    sea = wave_components(state, count=30, seed=2)
    drift = square_hull(sea.angular_frequency, sea.heading)
    first, second = drift[:, :, None], drift[:, None, :]
    if mean == "arithmetic":
        transfer = 0.5 * (first + second)
    else:
        transfer = np.where(first * second > 0.0, np.sign(first) * np.sqrt(np.abs(first * second)), 0.0)
    filters = newman_filters(square_database(), sea, mean)
    assert len(filters.transfer) <= 6
    for time, x, y in ((0.0, 0.0, 0.0), (37.3, 0.0, 0.0), (412.0, 14.0, -6.0)):
        exact = double_sum(sea, transfer.astype(complex), time, x, y)
        found = drift_force(filters, displaced(sea, time, x, y))
        # Rounding, of products that reach the square of the sum of the amplitudes.
        np.testing.assert_allclose(found, exact, atol=1e-11 * np.sum(sea.amplitude) ** 2 * np.abs(drift).max())


def complex_response(omega: NDArray, heading: NDArray) -> NDArray:
    """(..., 2) two linear quantities, cubic in frequency at any heading."""
    return np.stack(
        [
            300.0 * (omega**2 + 1j * omega * np.cos(heading)) + 20.0 * np.sin(heading),
            100.0 * (1.0 - 1j * omega**3) * np.cos(heading),
        ],
        axis=-1,
    )


def product_table(heading: NDArray, pairs: bool) -> QuadraticTransfer:
    """T of |A|² - |B|² in surge, of |B|² in yaw."""
    a, b = np.moveaxis(complex_response(OMEGA[None, :], heading[:, None]), -1, 0)
    parts = []
    for value in (a, b):
        full = value[:, None, :, None] * value.conj()[None, :, None, :]
        parts.append(full if pairs else np.einsum("hhij->hij", full))
    transfer = np.zeros((*parts[0].shape, 6), dtype=np.complex128)
    transfer[..., 0], transfer[..., 5] = parts[0] - parts[1], parts[1]
    return QuadraticTransfer(omega=OMEGA, heading=heading, transfer=transfer)


def test_table_of_pairs_of_headings_is_products_of_first_order() -> None:
    """All headings of a spread sea act together, as first-order quantities do: no sum over pairs is needed to tell."""
    sea = wave_components(SPREAD, count=25, seed=4)
    response = complex_response(sea.angular_frequency, sea.heading)
    kernel = quadratic_kernel(product_table(SPREAD.spread().heading, True))
    filters = quadratic_filters(kernel, sea, SPREAD)
    # Surge is a sum of two terms, yaw of one.
    assert [record.terms for record in filters.certificate] == [2, 0, 0, 0, 0, 1]
    for time, x in ((3.0, 0.0), (250.0, 20.0)):
        amplitudes = displaced(sea, time, x, 0.0)
        first, second = np.abs(amplitudes @ response) ** 2
        np.testing.assert_allclose(
            drift_force(filters, amplitudes)[[0, 5]], [first - second, second], rtol=1e-9, atol=1e-9 * (first + second)
        )


def test_table_between_its_headings_round_the_circle() -> None:
    """T of second order in cos and sin of the heading, from twelve headings, at headings that it has not."""
    heading = np.radians(30.0) * np.arange(12)
    sea = wave_components(STORM, count=25, seed=4)
    first, second = np.abs(sea.amplitudes(8.0) @ complex_response(sea.angular_frequency, sea.heading)) ** 2
    for pairs in (True, False):
        filters = quadratic_filters(quadratic_kernel(product_table(heading, pairs)), sea, STORM, 0.0)
        found = drift_force(filters, sea.amplitudes(8.0))
        np.testing.assert_allclose(found[[0, 5]], [first - second, second], atol=1e-9 * (first + second))


def test_table_of_one_heading_is_averaged_for_pairs() -> None:
    sea = wave_components(SPREAD, count=12, seed=4)
    heading = SPREAD.spread().heading
    own = np.stack([complex_response(sea.angular_frequency, np.full(36, value))[:, 1] for value in sea.heading])
    # own[n, i]: response at frequency i and the heading of wave n; T_ij by eq. (5).
    rows = np.arange(36)
    table = np.einsum("ni,nj->nij", own, own.conj())
    transfer = np.zeros((6, 36, 36), dtype=np.complex128)
    transfer[5] = 0.5 * (table[rows[:, None], rows[:, None], rows] + table[rows, rows[:, None], rows])
    kernel = quadratic_kernel(product_table(heading, False))
    waves = Waves(sea.angular_frequency, sea.heading)
    np.testing.assert_allclose(kernel(waves, waves, 5), transfer[5], atol=1e-9 * np.abs(transfer[5]).max())
    filters = quadratic_filters(kernel, sea, SPREAD, 0.0)
    exact = double_sum(sea, transfer, 77.0, 5.0, 9.0)
    found = drift_force(filters, displaced(sea, 77.0, 5.0, 9.0))
    np.testing.assert_allclose(found[5], exact[5], rtol=1e-8)


def smooth_table(width: float = 0.15) -> QuadraticTransfer:
    """A table of many terms: D falls off with the difference of the frequencies, and turns with it."""
    gap = OMEGA[:, None] - OMEGA[None, :]
    transfer = np.zeros((1, len(OMEGA), len(OMEGA), 6), dtype=np.complex128)
    transfer[0, ..., 0] = 1e5 * np.exp(-0.5 * (gap / width) ** 2 + 3j * gap)
    transfer[0, ..., 4] = -1e6 * np.exp(-0.5 * (gap / width) ** 2)
    return QuadraticTransfer(omega=OMEGA, heading=np.array([0.3]), transfer=transfer)


@pytest.mark.parametrize("tolerance", [0.1, 0.01])
def test_certificate_tells_what_is_left_out(tolerance: float) -> None:
    kernel = quadratic_kernel(smooth_table())
    sea = wave_components(STORM, count=60, seed=7)
    full = quadratic_filters(kernel, sea, STORM, 0.0)
    cut = quadratic_filters(kernel, sea, STORM, tolerance)
    record = cut.certificate[0]
    assert record.terms < 0.5 * record.order
    assert record.error <= tolerance
    assert "surge" in cut.table()
    # Realizations of the sea, each component a complex normal number of the variance 2 S df.
    rng = np.random.default_rng(3)
    normal = rng.standard_normal((2, 40_000, 60)) * np.sqrt(0.5 * component_variance(sea, STORM))
    amplitudes = normal[0] + 1j * normal[1]
    whole, rest = drift_force(full, amplitudes)[:, 0], drift_force(cut, amplitudes)[:, 0]
    # Standard errors of 40 000: mean 0.5 %, spread 1 % as the tail is exponential, skewness 3 %.
    assert np.mean(whole) == pytest.approx(record.mean, rel=0.02)
    assert np.std(whole) == pytest.approx(record.spread, rel=0.03)
    assert np.std(whole - rest) == pytest.approx(record.error * record.spread, rel=0.03)
    skewness = np.mean((rest - np.mean(rest)) ** 3) / np.std(rest) ** 3
    assert skewness == pytest.approx(record.skewness, rel=0.1)
    # What is left of the mean is a constant force.
    kept = record.mean_share * record.mean
    assert cut.constant[0] == pytest.approx(record.mean - kept)
    assert np.mean(rest) == pytest.approx(record.mean, rel=0.02)


def test_push_of_the_waves_is_skewed_as_chi_square() -> None:
    """One term is an exponential variate: spread equal to mean, skewness 2, and -2 for a pull."""
    sea = wave_components(STORM, count=40)
    kernel = quadratic_kernel(smooth_table(width=100.0))
    surge, pitch = (quadratic_filters(kernel, sea, STORM, 1e-3).certificate[k] for k in (0, 4))
    assert surge.mean == pytest.approx(surge.spread, rel=1e-3)
    assert surge.skewness == pytest.approx(2.0, abs=1e-3)
    assert pitch.skewness == pytest.approx(-2.0, abs=1e-3)


def test_large_matrices_give_the_same_terms(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = quadratic_kernel(smooth_table(width=0.4))
    sea = wave_components(STORM, count=240, seed=7)
    dense = quadratic_filters(kernel, sea, STORM, 0.01)
    monkeypatch.setattr(filters_module, "_LARGEST_DENSE", 100)
    sparse = quadratic_filters(kernel, sea, STORM, 0.01)
    assert [a.terms for a in sparse.certificate] == [a.terms for a in dense.certificate]
    amplitudes = sea.amplitudes(100.0)
    np.testing.assert_allclose(drift_force(sparse, amplitudes), drift_force(dense, amplitudes), rtol=1e-8)
    again = quadratic_filters(kernel, sea, STORM, 0.01)
    assert np.array_equal(again.transfer, sparse.transfer)


def test_variances_of_the_components_add_up_to_the_sea() -> None:
    """E|a|² is twice the variance of a component: Σ = 2 m0 = Hs²/8 in all directions together."""
    for sea in (wave_components(SPREAD, count=300), ArmaSea(SPREAD, reach=50.0)):
        # Frequencies random in their bins make widths of neighbours that are right on average, to 1 %.
        total = np.sum(component_variance(sea, SPREAD))
        assert total == pytest.approx(SPREAD.significant_height**2 / 8.0, rel=0.02)
    shares = [np.sum(component_variance(sea, SPREAD)[sea.heading == value]) for value in np.unique(sea.heading)]
    np.testing.assert_allclose(shares / total, SPREAD.spread().share, rtol=1e-9)


def test_rounding_in_a_component_makes_no_filters() -> None:
    table = smooth_table()
    noise = np.random.default_rng(0).standard_normal((25, 25))
    transfer = table.transfer.copy()
    transfer[0, ..., 1] = 1e-8 * (noise + noise.T)
    filters = quadratic_filters(
        quadratic_kernel(replace(table, transfer=transfer)), wave_components(STORM, count=30), STORM
    )
    assert filters.certificate[1].terms == 0
    assert not np.any(filters.weight[1])


def constant_drift(size: float) -> HydrodynamicDatabase:
    drift = np.zeros((2, len(OMEGA), 3))
    drift[..., 0] = size
    return database(drift, heading=np.array([0.0, 0.3]))


def test_spectrum_of_a_constant_coefficient() -> None:
    """F = D |envelope|²: mean 2 D m0 = D Hs²/8, an exponential variate, and 8 D² ∫ S² df at zero frequency."""
    size = 2e4
    state = replace(STORM, highest_frequency=0.37)
    found = drift_spectrum(newman_kernel(constant_drift(size)), state)
    expected = size * state.significant_height**2 / 8.0
    # A share of 5/4 (fp / 0.37 Hz)^4 = 0.2 % of the energy lies above, and little below the band.
    assert found.mean[0] == pytest.approx(expected, rel=4e-3)
    assert mean_drift_force(constant_drift(size), state)[0] == pytest.approx(expected, rel=4e-3)
    assert found.spread()[0] == pytest.approx(expected, rel=6e-3)
    frequency = np.linspace(1e-3, 0.37, 40_000)
    square = np.trapezoid(state.density(frequency) ** 2, frequency)
    assert found.density[0, 0] == pytest.approx(8.0 * size**2 * square, rel=1e-4)
    bands = found.spread(0.0, 0.022) ** 2 + found.spread(0.022) ** 2
    assert bands[0] == pytest.approx(found.spread()[0] ** 2)


def test_spectrum_does_not_depend_on_the_number_of_equal_directions() -> None:
    """Where T is the same for all pairs of headings, a spread sea gives the force of the long-crested one."""
    drift = np.zeros((12, len(OMEGA), 6))
    drift[..., 2] = force_size(OMEGA)
    round_hull = database(drift, heading=np.radians(30.0) * np.arange(12))
    one, three = (drift_spectrum(newman_kernel(round_hull), state, 2e-3) for state in (STORM, SPREAD))
    np.testing.assert_allclose(three.density, one.density, rtol=1e-9)
    np.testing.assert_allclose(three.mean, one.mean, rtol=1e-9)


@pytest.mark.parametrize("mean", ["arithmetic", "geometric"])
def test_mean_alone_is_that_of_the_spectrum(mean: str) -> None:
    table = square_database()
    whole = drift_spectrum(newman_kernel(table, mean), SPREAD, 2e-3)
    np.testing.assert_allclose(mean_drift_force(table, SPREAD, 2e-3), whole.mean, rtol=1e-12, atol=1e-9)


RECORDS, DURATION, STEP, LOW = 24, 10800.0, 2.0, 0.022


def test_records_of_a_digital_sea_have_the_spectrum_of_the_integral() -> None:
    """24 records of three hours. Their standard errors are 1 % of the mean and 1 % of the spread below 0.022 Hz."""
    state = replace(STORM, highest_frequency=0.2)
    table = square_database()
    theory = drift_spectrum(newman_kernel(table), state, 1e-3)
    filters = newman_filters(table, ArmaSea(state, reach=80.0))
    found = []
    for seed in range(RECORDS):
        sea = ArmaSea(state, reach=80.0, seed=seed)
        amplitudes = np.array([sea.amplitudes(t) for t in np.arange(0.0, DURATION, STEP)])
        force = drift_force(filters, amplitudes)[:, 0]
        lines = np.abs(np.fft.rfft(force) / len(force)) ** 2
        low = np.fft.rfftfreq(len(force), STEP)[1:] < LOW
        third = np.mean((force - force.mean()) ** 3) / force.std() ** 3
        found.append([force.mean(), np.sqrt(2.0 * lines[1:][low].sum()), np.sqrt(2.0 * lines[1:][~low].sum()), third])
    mean, low_spread, high_spread, skewness = np.mean(found, axis=0)
    errors = np.std(found, axis=0, ddof=1) / np.sqrt(RECORDS)
    assert errors[0] < 0.015 * theory.mean[0]
    assert errors[1] < 0.02 * theory.spread(0.0, LOW)[0]
    assert mean == pytest.approx(theory.mean[0], rel=0.02)
    assert low_spread == pytest.approx(theory.spread(0.0, LOW)[0], rel=0.05)
    assert high_spread == pytest.approx(theory.spread(LOW)[0], rel=0.05)
    assert 0.5 < skewness < 2.5


def test_wave_loads_with_filters_at_the_displaced_platform() -> None:
    sea = ArmaSea(replace(STORM, highest_frequency=0.2), reach=50.0, seed=3)
    filters = quadratic_filters(quadratic_kernel(smooth_table()), sea, STORM, 0.05)
    assert np.any(filters.constant)
    loads = WaveLoads(sea=sea, members=issc_members(), drift=filters)
    position = np.array([8.0, -3.0, 0.0, 0.0, 0.0, 0.0])
    found = loads.evaluate(31.7, position, np.zeros(6)).drift
    shift = sea.wavenumber * (8.0 * np.cos(sea.heading) - 3.0 * np.sin(sea.heading))
    amplitudes = sea.amplitudes(31.7) * np.exp(-1j * shift)
    np.testing.assert_allclose(found, drift_force(filters, amplitudes), rtol=1e-11)
    assert np.array_equal(loads.evaluate(31.7, position, np.zeros(6)).drift, found)
    values = filters.rows @ amplitudes
    np.testing.assert_allclose(values.real[0::2] + 1j * values.real[1::2], filters.transfer @ amplitudes, rtol=1e-11)


def test_regular_wave_gives_the_mean_drift() -> None:
    sea = regular_wave(amplitude=2.5, period=8.0, heading=0.8, water_depth=450.0)
    filters = newman_filters(square_database(), sea)
    expected = 2.5**2 * square_hull(sea.angular_frequency, sea.heading)[:, 0]
    for time in (0.0, 3.3):
        np.testing.assert_allclose(drift_force(filters, sea.amplitudes(time)), expected, atol=1e-6)


def test_wave_drift_damping_of_a_round_wall() -> None:
    """D = 2/3 ρ g a along the waves: B = 8/3 ρ a ω along them and half of it across (Aranha's formula by hand).

    The mean is that with 2 ∫ ω S df, in a Pierson-Moskowitz sea 2 · 2 π m0 fp (5/4)^(1/4) Γ(3/4).
    """
    radius = 10.0
    heading = np.radians(7.5) * np.arange(48)
    size = 2.0 / 3.0 * DENSITY * GRAVITY * radius
    drift = np.zeros((48, len(OMEGA), 3))
    drift[..., 0], drift[..., 1] = size * np.cos(heading)[:, None], size * np.sin(heading)[:, None]
    state = replace(STORM, highest_frequency=0.38)
    damping = wave_drift_damping(database(drift, heading), state)
    moment = state.significant_height**2 / 16.0 * 1.25**0.25 * gamma(0.75) / state.peak_period
    along = 8.0 / 3.0 * DENSITY * radius * 4.0 * np.pi * moment
    axes = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    # The waves above 0.38 Hz have 5/3 fp^3 / 0.38^3 of m1 in units of m0 fp: 0.8 %.
    expected = axes.T @ np.diag([along, 0.5 * along]) @ axes
    np.testing.assert_allclose(damping[:2, :2], expected, atol=0.012 * along)
    assert not np.any(damping[2:]) and not np.any(damping[:, 2:])  # noqa: PT018
    # A spread sea: E cos 2θ of the cos-2s spreading is s (s - 1) / ((s + 1) (s + 2)).
    spread = wave_drift_damping(database(drift, heading), replace(state, directions=3, spreading_exponent=4.0))
    tilt = 4.0 * 3.0 / (5.0 * 6.0)
    expected = axes.T @ np.diag([0.75 + 0.25 * tilt, 0.75 - 0.25 * tilt]) @ axes * along
    np.testing.assert_allclose(spread[:2, :2], expected, atol=0.012 * along)


def test_wave_drift_damping_by_the_symmetry_of_the_hull() -> None:
    """Eighth of a circle, or the whole of it."""
    heading = np.radians(15.0) * np.arange(24)
    six = np.moveaxis(square_hull(OMEGA[None, :], heading[:, None]), 0, -1)
    whole = wave_drift_damping(database(six, heading), SPREAD)
    assert whole[5, 0] != 0.0
    np.testing.assert_allclose(wave_drift_damping(square_database(), SPREAD), whole, atol=1e-9 * np.abs(whole).max())


def test_wave_drift_damping_between_a_few_headings() -> None:
    """Headings to either side of zero are one arc; a drift linear in them keeps its derivative."""
    heading = np.array([-0.1, 0.0, 0.1])
    drift = np.zeros((3, len(OMEGA), 3))
    drift[..., 0] = 1e4
    drift[..., 1] = 5e4 * heading[:, None]
    damping = wave_drift_damping(database(drift, heading), replace(STORM, heading=0.05))
    # B_yy over B_xx: 2 dD_y/dβ + 4 D_y tan β over 4 D_x, to the second order of 0.05.
    assert damping[1, 1] / damping[0, 0] == pytest.approx((2.0 * 5.0 + 4.0 * 5.0 * 0.05**2) / 4.0, rel=0.01)


def test_errors_say_what_is_wrong() -> None:
    sea = wave_components(STORM, count=5)
    with pytest.raises(ScenarioError, match="'median'"):
        newman_filters(square_database(), sea, "median")
    unknown = square_database()
    with pytest.raises(ScenarioError, match="mean drift that is not known"):
        newman_filters(replace(unknown, mean_drift=np.nan * unknown.mean_drift), sea)
    with pytest.raises(ScenarioError, match=r"17\.19"):
        newman_filters(database(np.ones((1, 25, 3)), heading=np.array([1.0])), sea)
    table = smooth_table()
    with pytest.raises(ScenarioError, match="shape"):
        replace(table, transfer=table.transfer[0])
    with pytest.raises(ScenarioError, match="ascending"):
        replace(table, omega=OMEGA[::-1])
    with pytest.raises(ScenarioError, match="not finite"):
        replace(table, transfer=np.nan * table.transfer)
    skew = table.transfer.copy()
    skew[..., 4] *= 1j
    with pytest.raises(ScenarioError, match="differ in pitch"):
        replace(table, transfer=skew)
    kernel = quadratic_kernel(table)
    with pytest.raises(ScenarioError, match="tolerance"):
        quadratic_filters(kernel, sea, STORM, 1.0)
    with pytest.raises(ScenarioError, match="without waves"):
        quadratic_filters(kernel, calm_water(water_depth=450.0), STORM)
    lonely = database(np.ones((2, 25, 3)), heading=np.array([1.0, 1.2]))
    with pytest.raises(ScenarioError, match=r"17\.19"):
        wave_drift_damping(lonely, STORM)
    with pytest.raises(ScenarioError, match="frequency step"):
        drift_spectrum(kernel, STORM, 0.0)
