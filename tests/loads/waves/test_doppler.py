"""Waves on a current against the dispersion relation and against a platform that drifts through still water."""

import numpy as np
import pytest

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.current import Current, power_law_current, uniform_current
from tlpsim.loads.waves.doppler import current_along_waves, delay_ratio, sea_in_current, wavenumber_in_current
from tlpsim.loads.waves.field import WaveComponents, calm_water, regular_wave, wave_components
from tlpsim.loads.waves.sea import SeaState

GRAVITY = 9.80665
OMEGA = 2.0 * np.pi * np.linspace(0.02, 0.35, 50)
REST = np.zeros(6)


@pytest.mark.parametrize("depth", [5.0, 60.0, np.inf])
@pytest.mark.parametrize("speed", [-1.0, -0.3, 0.0, 0.5, 3.0])
def test_wavenumber_satisfies_the_dispersion_relation(depth: float, speed: float) -> None:
    k = wavenumber_in_current(OMEGA, depth, speed)
    sigma = OMEGA - k * speed
    assert np.all(sigma > 0.0)
    tanh = np.tanh(k * depth) if np.isfinite(depth) else 1.0
    np.testing.assert_allclose(sigma**2, GRAVITY * k * tanh, rtol=1e-12)
    # The root that goes on from still water, not that of the waves which the current has overtaken.
    assert np.all(np.diff(k) > 0.0)
    assert np.all(np.sign(k - wavenumber(OMEGA, depth)) == -np.sign(speed)) or speed == 0.0


def test_wavenumber_without_current_is_that_of_still_water() -> None:
    np.testing.assert_allclose(wavenumber_in_current(OMEGA, 40.0, 0.0), wavenumber(OMEGA, 40.0), rtol=1e-13)


def test_a_current_stops_the_waves_beyond_a_quarter_of_g_over_its_speed() -> None:
    speed = 2.0
    limit = GRAVITY / (4.0 * speed)
    # At the limit the group stands still: k = 4 omega² / g.
    k = wavenumber_in_current(0.999999 * limit, np.inf, -speed)
    assert k == pytest.approx(4.0 * limit**2 / GRAVITY, rel=3e-3)
    with pytest.raises(ScenarioError, match=r"a current of -2 m/s along the waves stops those of 0.1951 Hz and above"):
        wavenumber_in_current(np.array([0.5 * limit, 1.0001 * limit, 1.1 * limit]), np.inf, -speed)
    with pytest.raises(ScenarioError, match="stops those"):
        wavenumber_in_current(np.array([0.5]), 5.0, -7.1)
    with pytest.raises(ScenarioError, match="not finite"):
        wavenumber_in_current(np.array([0.5]), 5.0, np.nan)


def test_effective_current_of_a_linear_profile_in_closed_form() -> None:
    # U0 (1 + z/h) down to z = -h: 2k int U exp(2kz) dz = U0 (1 - (1 - exp(-2kh)) / 2kh). The kink at -h costs the
    # quadrature 1e-4.
    k, reach = np.array([0.01, 0.05, 0.3]), 40.0
    current = Current(depth=[0.0, reach], speed=[1.5, 0.0], heading=[0.0, 0.0])
    twice = 2.0 * k * reach
    expected = 1.5 * (1.0 - (1.0 - np.exp(-twice)) / twice)
    heading = np.array([0.0, 0.4, np.pi])
    np.testing.assert_allclose(current_along_waves(current, k, heading, np.inf), expected * np.cos(heading), rtol=1e-3)


@pytest.mark.parametrize("depth", [10.0, 450.0, np.inf])
def test_effective_current_of_a_uniform_one_is_itself(depth: float) -> None:
    found = current_along_waves(uniform_current(0.9, 0.5), wavenumber(OMEGA, depth), np.full(50, 1.2), depth)
    np.testing.assert_allclose(found, 0.9 * np.cos(0.7), rtol=1e-13)


def test_effective_current_in_finite_depth_is_the_weighted_mean() -> None:
    current, k = power_law_current(1.0, 0.0, 50.0), 0.05
    z = 50.0 * (np.arange(200_000) + 0.5) / 200_000 - 50.0
    weight = 2.0 * k * np.cosh(2.0 * k * (z + 50.0)) / np.sinh(2.0 * k * 50.0)
    expected = np.mean((1.0 + z / 50.0) ** (1.0 / 7.0) * weight) * 50.0
    # The slope at the sea bed is infinite, which the quadrature sees as 4e-5.
    found = current_along_waves(current, np.array([k]), np.zeros(1), 50.0)
    assert found[0] == pytest.approx(expected, rel=2e-4)


@pytest.mark.parametrize("speed", [-0.9, 1.3])
@pytest.mark.parametrize("splash", [False, True])
def test_a_fixed_platform_in_a_current_is_one_that_drifts_through_still_water(speed: float, splash: bool) -> None:
    # Seen from the water, the platform drifts with -U through waves of frequency sigma: elevation, first-order force
    # (at sigma) and drag (relative velocity) are the same. The direction of the current is not that of the waves.
    heading, turn, depth, amplitude = 0.4, 1.0, 90.0, 2.5
    along = speed * np.cos(turn - heading)
    omega = 2.0 * np.pi / 9.0
    k = wavenumber_in_current(omega, depth, along)
    sigma = float(omega - k * along)
    measured = regular_wave(amplitude=amplitude, period=9.0, heading=heading, water_depth=depth)
    still = regular_wave(amplitude=amplitude, period=2.0 * np.pi / sigma, heading=heading, water_depth=depth)
    direction = np.array([np.cos(turn), np.sin(turn), 0.0, 0.0, 0.0, 0.0])
    fixed = WaveLoads(
        sea=measured,
        members=issc_members(),
        current_speed=abs(speed),
        current_heading=turn + (np.pi if speed < 0.0 else 0.0),
        doppler=True,
        splash=splash,
    )
    drifting = WaveLoads(sea=still, members=issc_members(), splash=splash)
    for time in (0.0, 3.7, 211.0):
        one = fixed.evaluate(time, REST, REST)
        other = drifting.evaluate(time, -speed * time * direction, -speed * direction)
        assert one.elevation == pytest.approx(other.elevation, abs=1e-9)
        # The range of wavenumbers is one wave, but the series are of it at both: rounding only.
        for a, b in ((one.diffraction, other.diffraction), (one.viscous, other.viscous)):
            np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-8 * np.abs(b).max())


def test_a_platform_that_moves_slowly_meets_the_waves_at_the_frequency_of_encounter() -> None:
    speed, heading = 0.5, 0.6
    wave = regular_wave(amplitude=1.0, period=8.0, heading=heading, water_depth=np.inf)
    loads = WaveLoads(sea=wave, members=issc_members())
    encounter = 2.0 * np.pi / 8.0 - wave.wavenumber[0] * speed * np.cos(heading)
    times = np.arange(512) * 40.0 * (2.0 * np.pi / encounter) / 512
    records = []
    for time in times:
        forces = loads.evaluate(time, np.array([speed * time, 0.0, 0.0, 0.0, 0.0, 0.0]), REST)
        records.append([forces.elevation, forces.diffraction[0]])
    lines = np.abs(np.fft.rfft(np.array(records), axis=0)) / 256
    # Forty periods of encounter in the record: all of it in line 40.
    assert lines[40, 0] == pytest.approx(1.0, rel=1e-9)
    assert np.all(np.argmax(lines, axis=0) == 40)
    assert np.delete(lines, 40, axis=0).max(axis=0)[0] < 1e-9


def test_the_sea_keeps_its_amplitudes_and_its_frequency_at_a_fixed_place() -> None:
    state = SeaState(significant_height=4.0, peak_period=10.0, heading=0.3, directions=3, water_depth=60.0)
    sea = wave_components(state, count=20, seed=2)
    moved = sea_in_current(sea, power_law_current(0.8, 2.0, 60.0))
    np.testing.assert_array_equal(moved.amplitudes(12.0), sea.amplitudes(12.0))
    along = current_along_waves(power_law_current(0.8, 2.0, 60.0), sea.wavenumber, sea.heading, 60.0)
    np.testing.assert_allclose(moved.angular_frequency + moved.wavenumber * along, sea.angular_frequency, rtol=1e-13)
    np.testing.assert_allclose(wavenumber(moved.angular_frequency, 60.0), moved.wavenumber, rtol=1e-11)
    assert len(sea_in_current(calm_water(water_depth=60.0), uniform_current(1.0)).wavenumber) == 0


def test_nothing_changes_without_current() -> None:
    state = SeaState(significant_height=4.0, peak_period=10.0, water_depth=450.0)
    sea: WaveComponents = wave_components(state, count=20, seed=2)
    one, other = (
        WaveLoads(sea=sea, members=issc_members(), doppler=on).evaluate(5.0, REST, REST) for on in (False, True)
    )
    np.testing.assert_allclose(one.diffraction, other.diffraction, rtol=1e-10, atol=1e-4)
    np.testing.assert_allclose(one.viscous, other.viscous, rtol=1e-10, atol=1e-4)


def test_groups_take_longer_against_the_current() -> None:
    # Deep water: the time over a distance by the wavenumbers of neighbouring frequencies, dk / domega.
    pair = 2.0 * np.pi * 0.25 * np.array([0.9999, 1.0001])
    slowness = [np.diff(wavenumber_in_current(pair, np.inf, speed))[0] for speed in (0.0, -0.8)]
    assert delay_ratio(uniform_current(0.8, np.pi), 0.25, 0.0, np.inf) == pytest.approx(
        slowness[1] / slowness[0], rel=1e-5
    )
