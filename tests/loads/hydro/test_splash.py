"""Drag to the instantaneous surface against direct summation, closed forms and symmetry."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.excitation import WaveLoads, mean_current_force
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import Members
from tlpsim.loads.hydro.splash import largest_elevation, pieces
from tlpsim.loads.waves.airy import travel
from tlpsim.loads.waves.current import Current, current_velocity, power_law_current, uniform_current
from tlpsim.loads.waves.elevation import ArmaSea
from tlpsim.loads.waves.field import WaveComponents, calm_water, regular_wave, wave_components
from tlpsim.loads.waves.kinematics import kinematics
from tlpsim.loads.waves.sea import Sea, SeaState
from tlpsim.loads.waves.stretching import STRETCHING

FloatArray = NDArray[np.float64]

REST = np.zeros(6)
DENSITY = 1025.0
DEPTH = 120.0
STATE = SeaState(
    significant_height=8.0, peak_period=11.0, heading=0.4, water_depth=DEPTH, directions=3, highest_frequency=0.3
)


def members(*ends: tuple[list[float], list[float]], width: float = 4.0) -> Members:
    """Round members between the given ends, C_D = 1."""
    start, end = (np.array([one[i] for one in ends]) for i in (0, 1))
    axis = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
    across = np.cross(axis, np.where(np.abs(axis[:, 1:2]) < 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]]))
    count = len(ends)
    return Members(
        start=start,
        end=end,
        across=across / np.linalg.norm(across, axis=1)[:, None],
        width=np.full((count, 2), width),
        area=np.full(count, 0.25 * np.pi * width**2),
        drag_coefficient=np.ones((count, 2)),
        added_mass_coefficient=np.zeros((count, 2)),
        end_pressure=np.zeros((count, 2)),
        end_added_mass_coefficient=np.zeros((count, 2)),
    )


def pile(draught: float = 30.0, x: float = 0.0) -> Members:
    return members(([x, 0.0, -draught], [x, 0.0, 0.0]))


FRAME = members(
    ([-20.0, 3.0, -25.0], [-20.0, 3.0, 0.0]),  # column, given from below
    ([25.0, -10.0, 0.0], [25.0, -10.0, -30.0]),  # column, given from above
    ([-15.0, 5.0, -22.0], [12.0, -5.0, 0.0]),  # brace through the surface
    ([-20.0, 3.0, -20.0], [25.0, -10.0, -20.0]),  # pontoon
    ([-20.0, 30.0, -2.5], [25.0, 30.0, -2.5]),  # pontoon that falls dry
)


@pytest.fixture(scope="module")
def sea() -> WaveComponents:
    return wave_components(STATE, count=40, seed=3)


def direct_drag(
    hull: Members, sea: Sea, time: float, velocity: FloatArray, current: Current, name: str, strip_length: float
) -> FloatArray:
    """Sum over the wet parts of pieces, water velocity at their middle by `kinematics`, elevation at their centre."""
    cut = pieces(hull, strip_length, DENSITY, 20.0)
    elevation = kinematics(sea, time, np.column_stack([cut.centre[:, :2], np.zeros(len(cut.centre))])).elevation
    surface = np.zeros_like(elevation) if name == "none" else elevation
    total = np.zeros(6)
    for p in range(len(cut.centre)):
        low, high = cut.centre[p] - 0.5 * cut.span[p], cut.centre[p] + 0.5 * cut.span[p]
        if surface[p] <= low[2]:
            continue
        wet = 1.0 if surface[p] >= high[2] else (surface[p] - low[2]) / (high[2] - low[2])
        middle = low + 0.5 * wet * cut.span[p]
        place = np.array([[*cut.centre[p, :2], middle[2]]])
        water = kinematics(sea, time, place, stretching=name).velocity[0]
        moved = elevation[p] if current.stretched else 0.0
        flow = current_velocity(current, np.array([DEPTH * (middle[2] - moved) / (DEPTH + moved)]))[0]
        relative = water + flow - velocity[:3] - np.cross(velocity[3:], middle)
        pair = cut.direction[2 * p : 2 * p + 2]
        along = pair @ relative
        force = wet * np.hypot(*along) * (cut.drag[2 * p : 2 * p + 2] * along) @ pair
        total += np.concatenate([force, np.cross(middle, force)])
    return total


@pytest.mark.parametrize("name", STRETCHING)
@pytest.mark.parametrize(
    "current",
    [
        uniform_current(0.6, 2.0),
        power_law_current(0.9, 1.0, DEPTH, stretched=True),
    ],
)
def test_force_is_the_sum_over_the_wet_pieces(sea: WaveComponents, name: str, current: Current) -> None:
    loads = WaveLoads(
        sea=sea, members=FRAME, water_density=DENSITY, splash=True, stretching=name, largest_elevation=20.0,
        strip_length=4.0, current=current,
    )  # fmt: skip
    velocity = np.array([0.7, -0.4, 0.3, 0.01, -0.02, 0.015])
    times = 17.0 * np.arange(40)
    found = np.array([loads.evaluate(time, REST, velocity).viscous for time in times])
    exact = np.array([direct_drag(FRAME, sea, time, velocity, current, name, 4.0) for time in times])
    # The series is off by at most 2e-3 of the surface velocity, and that only in the shortest waves at the worst
    # height; the waves of the peak have less than a tenth of it.
    error = np.sqrt(np.mean((found - exact) ** 2, axis=0)) / exact.std(axis=0)
    assert error.max() < 5e-4


def test_which_end_of_a_member_is_named_first_does_not_matter(sea: WaveComponents) -> None:
    turned = replace(FRAME, start=FRAME.end, end=FRAME.start)
    velocity = np.array([0.7, -0.4, 0.3, 0.01, -0.02, 0.015])
    one, other = (
        np.array(
            [WaveLoads(sea=sea, members=hull, splash=True).evaluate(t, REST, velocity).viscous for t in (2.0, 9.0)]
        )
        for hull in (FRAME, turned)
    )
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(one).max())


def test_a_brace_goes_on_above_the_water_along_its_axis() -> None:
    # From (0, 0, -12) to (9, 0, 0): 15 m, and a quarter more where the platform is down by 3 m. The flow across it.
    brace = members(([0.0, 0.0, -12.0], [9.0, 0.0, 0.0]))
    calm = WaveLoads(
        sea=calm_water(water_depth=DEPTH), members=brace, water_density=DENSITY, splash=True,
        current_speed=0.8, current_heading=0.5 * np.pi,
    )  # fmt: skip
    for heave, length in ((0.0, 15.0), (-3.0, 18.75), (4.0, 10.0)):
        force = calm.evaluate(0.0, np.array([0.0, 0.0, heave, 0.0, 0.0, 0.0]), REST).viscous
        assert force[1] == pytest.approx(0.5 * DENSITY * 4.0 * 0.64 * length, rel=1e-12)
        assert force[5] == pytest.approx(force[1] * 0.5 * 0.6 * length, rel=1e-12)


@pytest.mark.parametrize("name", ["wheeler", "vertical", "linear"])
def test_strips_of_five_metres_resolve_the_splash_zone(name: str) -> None:
    sea = wave_components(STATE, count=60, seed=5)
    coarse, fine = (
        WaveLoads(sea=sea, members=issc_members(), splash=True, stretching=name, strip_length=length)
        for length in (5.0, 0.5)
    )
    times = np.arange(0.0, 300.0, 2.3)
    forces = [np.array([loads.evaluate(t, REST, REST).viscous for t in times]) for loads in (coarse, fine)]
    error = np.sqrt(np.mean((forces[0] - forces[1]) ** 2, axis=0)) / forces[1].std(axis=0)
    # (2k 5 m)² / 24 of the midpoint rule is 0.5 % at the peak of 11 s and 3 % at half of it; the yaw moment is a
    # difference of the columns.
    assert error[:5].max() < 0.02
    assert error[5] < 0.03


def mean_over_a_period(loads: WaveLoads, period: float, count: int = 400) -> FloatArray:
    times = period * (np.arange(count) + 0.5) / count
    return np.mean([loads.evaluate(time, REST, REST).viscous for time in times], axis=0)


@pytest.mark.parametrize("name", ["vertical", "linear"])
@pytest.mark.parametrize("heading", [0.0, 0.7])
def test_mean_drag_of_the_splash_zone_on_a_pile(name: str, heading: float) -> None:
    # 0.5 rho C_D D E[eta |u| u] at z = 0 with E|cos|³ = 4 / (3 pi). The next order is 1.2 ka of it, here 0.4 %; the
    # strip under the surface, cut at most by an amplitude of 0.15 m, is 0.5 m long.
    period, amplitude = 9.0, 0.15
    wave = regular_wave(amplitude=amplitude, period=period, heading=heading, water_depth=np.inf)
    loads = WaveLoads(
        sea=wave, members=pile(30.0), water_density=DENSITY, splash=True, stretching=name, largest_elevation=1.0,
        strip_length=0.5,
    )  # fmt: skip
    omega = 2.0 * np.pi / period
    expected = 2.0 / (3.0 * np.pi) * DENSITY * 4.0 * omega**2 * amplitude**3
    mean = mean_over_a_period(loads, period)
    np.testing.assert_allclose(mean[:2], expected * np.array([np.cos(heading), np.sin(heading)]), rtol=0.01, atol=1e-9)


def test_wheeler_keeps_only_the_mean_drag_of_the_lower_end() -> None:
    # The wet length has the same profile in crest and trough but for what moves over the lower end: the closed form
    # at z = 0 times exp(-2kL). A short pile, so that something is left; next order as above.
    period, amplitude, draught = 9.0, 0.15, 6.0
    wave = regular_wave(amplitude=amplitude, period=period, heading=0.0, water_depth=np.inf)
    loads = WaveLoads(
        sea=wave, members=pile(draught), water_density=DENSITY, splash=True, largest_elevation=1.0, strip_length=0.25
    )
    omega = 2.0 * np.pi / period
    expected = 2.0 / (3.0 * np.pi) * DENSITY * 4.0 * omega**2 * amplitude**3 * np.exp(-2.0 * wave.wavenumber[0] * 6.0)
    assert mean_over_a_period(loads, period)[0] == pytest.approx(expected, rel=0.02)


def test_mean_drag_of_the_splash_zone_in_a_random_sea() -> None:
    # E[eta |u| u] = 2 sqrt(2 / pi) s_u Cov(u, eta) for a Gaussian pair. What drag to z = 0 gives at the same instant
    # is taken off, since it has no mean. 20 000 independent instants: 1.5 % of standard error, two of them.
    state = SeaState(significant_height=0.2, peak_period=9.0, water_depth=DEPTH, highest_frequency=0.2)
    sea = wave_components(state, count=120, seed=4)
    still = WaveLoads(sea=sea, members=pile(30.0), water_density=DENSITY, strip_length=1.0)
    splash = WaveLoads(
        sea=sea, members=pile(30.0), water_density=DENSITY, strip_length=1.0, splash=True, stretching="vertical",
        largest_elevation=1.0,
    )  # fmt: skip
    half = 0.5 * sea.amplitude**2
    speed = sea.angular_frequency / np.tanh(sea.wavenumber * DEPTH)
    expected = 0.5 * DENSITY * 4.0 * np.sqrt(8.0 / np.pi * np.sum(half * speed**2)) * np.sum(half * speed)
    times = 41.0 * np.arange(20_000)
    surge = [
        splash.evaluate(t, REST, REST).viscous[0] - still.evaluate(t, REST, REST).viscous[0] for t in times.tolist()
    ]
    assert np.mean(surge) == pytest.approx(expected, rel=0.03)


def test_every_column_has_its_own_water_line() -> None:
    wave = regular_wave(amplitude=3.0, period=8.0, heading=0.0, water_depth=np.inf)
    half = np.pi / wave.wavenumber[0]
    here, there = (WaveLoads(sea=wave, members=pile(20.0, x), splash=True, stretching="linear") for x in (0.0, half))
    for time in (0.0, 1.1, 3.0):
        expected = here.evaluate(time + 4.0, REST, REST).viscous
        np.testing.assert_allclose(there.evaluate(time, REST, REST).viscous[0], expected[0], rtol=1e-9)
    # In the trough the pile is wet over 17 m, in the crest over 23 m.
    assert here.evaluate(0.0, REST, REST).viscous[0] > -1.2 * there.evaluate(0.0, REST, REST).viscous[0] > 0.0


@pytest.mark.parametrize(
    ("position", "wet"),
    [
        ([0.0, 0.0, -1.5, 0.0, 0.0, 0.0], 21.5),
        ([0.0, 0.0, 2.0, 0.0, 0.0, 0.0], 18.0),
        ([0.0, 0.0, 0.0, 0.0, 0.1, 0.0], 21.0),
        ([0.0, 0.0, 0.0, 0.1, 0.0, 0.0], 20.0),
    ],
)
def test_heave_and_rotation_wet_a_column_that_they_push_down(position: list[float], wet: float) -> None:
    calm = WaveLoads(
        sea=calm_water(water_depth=DEPTH), members=pile(20.0, 10.0), water_density=DENSITY, splash=True,
        current_speed=0.8,
    )  # fmt: skip
    force = calm.evaluate(0.0, np.array(position), REST).viscous
    assert force[0] == pytest.approx(0.5 * DENSITY * 4.0 * 0.64 * wet, rel=1e-12)
    assert force[4] == pytest.approx(force[0] * (0.5 * wet - 20.0), rel=1e-12)


def test_calm_water_gives_the_mean_force_of_the_current() -> None:
    current = power_law_current(1.2, 0.5, 450.0)
    calm = WaveLoads(sea=calm_water(water_depth=450.0), members=issc_members(), splash=True, current=current)
    expected = mean_current_force(issc_members(), current=current)
    # The table of the current, 0.25 m apart, is linear between its heights: 1e-9 of the power law.
    found = calm.evaluate(3.0, REST, REST).viscous
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max())


def test_without_stretching_and_rise_it_is_the_drag_to_mean_water_level(sea: WaveComponents) -> None:
    fixed = WaveLoads(sea=sea, members=issc_members(), current_speed=0.5)
    none = WaveLoads(sea=sea, members=issc_members(), current_speed=0.5, splash=True, stretching="none")
    velocity = np.array([0.7, -0.4, 0.3, 0.01, -0.02, 0.015])
    one, other = (
        np.array([loads.evaluate(t, REST, velocity).viscous for t in np.arange(0.0, 100.0, 3.0)])
        for loads in (fixed, none)
    )
    # Only the series over the columns differs, as above.
    assert np.max(np.abs(one - other) / one.std(axis=0)) < 1e-3


def test_waves_higher_than_the_range_keep_the_velocity_of_its_end() -> None:
    wave = regular_wave(amplitude=6.0, period=10.0, heading=0.0, water_depth=np.inf)
    short, long = (WaveLoads(sea=wave, members=pile(), splash=True, largest_elevation=e) for e in (4.0, 8.0))
    crest = [loads.evaluate(0.0, REST, REST).viscous[0] for loads in (short, long)]
    # Two of 36 m of wet pile are not counted, next to the surface where the water is fastest.
    assert 0.80 * crest[1] < crest[0] < crest[1]


@pytest.mark.parametrize("make", [lambda s: wave_components(s, count=60, seed=1), lambda s: ArmaSea(s, seed=1)])
def test_values_do_not_depend_on_what_was_asked_before(make: Callable[[SeaState], Sea]) -> None:
    loads = WaveLoads(sea=make(STATE), members=FRAME, splash=True)
    position, velocity = np.full(6, 0.1), np.full(6, 0.05)
    first = loads.evaluate(50.0, position, velocity)
    kept = first.viscous.copy()
    loads.evaluate(60.0, 2 * position, -velocity)
    np.testing.assert_array_equal(first.viscous, kept)
    np.testing.assert_array_equal(loads.evaluate(50.0, position, velocity).viscous, kept)


def test_displaced_position_is_where_the_water_line_is_taken(sea: WaveComponents) -> None:
    loads = WaveLoads(sea=sea, members=pile(), splash=True, stretching="vertical")
    there = np.array([12.0, -7.0, 0.0, 0.0, 0.0, 0.0])
    moved = WaveComponents(
        frequency=sea.frequency,
        amplitude=sea.amplitude,
        phase=sea.phase + np.angle(travel(sea.wavenumber, sea.heading, np.array([12.0]), np.array([-7.0]))[0]),
        wavenumber=sea.wavenumber,
        heading=sea.heading,
        water_depth=DEPTH,
        gravity=sea.gravity,
    )
    expected = WaveLoads(sea=moved, members=pile(), splash=True, stretching="vertical").evaluate(9.0, REST, REST)
    np.testing.assert_allclose(loads.evaluate(9.0, there, REST).viscous, expected.viscous, rtol=1e-9)


def test_largest_elevation_of_a_sea_state() -> None:
    # 4.5 / 4 of Hs, but for the energy beyond 0.35 Hz: 1 - exp(-1.25 (0.0714 / 0.35)^4) is 0.2 % of the variance.
    state = SeaState(spectrum="pierson_moskowitz", significant_height=8.0, peak_period=14.0, water_depth=100.0)
    assert largest_elevation(state) == pytest.approx(9.0, rel=3e-3)
    assert largest_elevation(SeaState(significant_height=0.0, water_depth=100.0)) == 1.0


def test_bad_input_is_refused(sea: WaveComponents) -> None:
    with pytest.raises(ScenarioError, match="stretching 'wheler' is not known; did you mean 'wheeler'"):
        WaveLoads(sea=sea, members=FRAME, splash=True, stretching="wheler")
    with pytest.raises(ScenarioError, match="largest elevation of the splash zone is"):
        WaveLoads(sea=sea, members=FRAME, splash=True, largest_elevation=0.0)
    with pytest.raises(ScenarioError, match=r"largest elevation of the splash zone is 200.0 m; it must be < the depth"):
        WaveLoads(sea=sea, members=FRAME, splash=True, largest_elevation=200.0)
    with pytest.raises(ScenarioError, match=r"an end lies at z = -200.0 m, below the sea bed"):
        WaveLoads(sea=sea, members=pile(200.0), splash=True, excitation=lambda s: np.zeros((6, len(s.heading))))
