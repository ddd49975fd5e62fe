import math
import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.excitation import WaveLoads, mean_current_force
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import drag_force, strip_velocity_transfer
from tlpsim.loads.waves.airy import velocity_transfer
from tlpsim.loads.waves.field import WaveComponents, calm_water, elevation, regular_wave, wave_components
from tlpsim.loads.waves.sea import SeaState

REST = np.zeros(6)
HEADING = 0.4
STATE = SeaState(significant_height=9.0, peak_period=13.0, heading=HEADING, water_depth=450.0, highest_frequency=0.25)


@pytest.fixture(scope="module")
def sea() -> WaveComponents:
    return wave_components(STATE, count=80, seed=1)


@pytest.fixture(scope="module")
def loads(sea: WaveComponents) -> WaveLoads:
    return WaveLoads(sea=sea, members=issc_members(), current_speed=0.8, current_heading=1.1)


def test_kernel_equals_the_sums_over_components_and_strips(sea: WaveComponents, loads: WaveLoads) -> None:
    time = 123.4
    position = np.array([7.0, -4.0, -0.1, 1e-4, 2e-4, 0.02])
    velocity = np.array([0.5, -0.3, 0.02, 1e-3, -2e-3, 5e-3])
    forces = loads.evaluate(time, position, velocity)
    travel = position[0] * np.cos(HEADING) + position[1] * np.sin(HEADING)
    amplitude = sea.amplitude * np.exp(1j * (sea.angular_frequency * time - sea.wavenumber * travel + sea.phase))
    assert forces.elevation == pytest.approx(float(elevation(sea, time, 7.0, -4.0)), rel=1e-10)
    np.testing.assert_allclose(forces.diffraction, np.real(loads.excitation_transfer @ amplitude), rtol=1e-9)

    strips = loads.strips
    water = np.real(
        velocity_transfer(sea.angular_frequency, sea.wavenumber, HEADING, 450.0, strips.position) @ amplitude
    )
    current = 0.8 * np.array([np.cos(1.1), np.sin(1.1), 0.0])
    body = velocity[:3] + np.cross(velocity[3:], strips.position)
    relative = np.repeat(water + current - body, 2, axis=0)
    expected = drag_force(strips, np.sum(relative * strips.direction, axis=1))
    np.testing.assert_allclose(forces.viscous, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@given(x=st.floats(-50, 50), y=st.floats(-50, 50), time=st.floats(0, 1e4))
@settings(max_examples=25, deadline=None)
def test_displaced_position_is_a_shift_of_the_waves(
    sea: WaveComponents, loads: WaveLoads, x: float, y: float, time: float
) -> None:
    shift = sea.wavenumber * (x * np.cos(HEADING) + y * np.sin(HEADING))
    shifted = WaveLoads(
        sea=replace(sea, phase=sea.phase - shift),
        members=issc_members(),
        current_speed=0.8,
        current_heading=1.1,
    )
    moved = loads.evaluate(time, np.array([x, y, 0.0, 0.0, 0.0, 0.0]), REST)
    expected = shifted.evaluate(time, REST, REST)
    # Angles up to 1e4 s times 1.6 rad/s are rounded at 2e-12.
    scale = np.abs(expected.diffraction).max()
    np.testing.assert_allclose(moved.diffraction, expected.diffraction, atol=1e-9 * scale)
    np.testing.assert_allclose(moved.viscous, expected.viscous, atol=1e-9 * scale)
    assert moved.elevation == pytest.approx(expected.elevation, abs=1e-9)


def test_a_wavelength_further_on_the_forces_are_the_same() -> None:
    components = regular_wave(amplitude=3.0, period=11.0, heading=HEADING, water_depth=450.0)
    loads = WaveLoads(sea=components, members=issc_members())
    length = 2 * np.pi / components.wavenumber[0]
    there = np.array([length * np.cos(HEADING), length * np.sin(HEADING), 0.0, 0.0, 0.0, 0.0])
    moved, expected = loads.evaluate(3.0, there, REST), loads.evaluate(3.0, REST, REST)
    np.testing.assert_allclose(moved.diffraction, expected.diffraction, rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(moved.viscous, expected.viscous, rtol=1e-9, atol=1e-3)


def test_waves_at_the_origin_when_the_position_is_not_asked_for(sea: WaveComponents) -> None:
    loads = WaveLoads(sea=sea, members=issc_members(), displaced_position=False)
    moved, still = (loads.evaluate(5.0, np.array([x, -x, 0.0, 0.0, 0.0, 0.0]), REST) for x in (30.0, 0.0))
    np.testing.assert_array_equal(moved.diffraction, still.diffraction)
    assert moved.elevation == still.elevation


def test_current_on_the_platform_in_calm_water() -> None:
    members = issc_members(drag_coefficient=1.0)
    force = mean_current_force(members, current_speed=0.8, current_heading=0.0)
    # Four columns over the draught, and both pontoons across the flow with their height.
    area = 4 * 16.87 * 35.0 + 2 * 69.38 * 10.5
    np.testing.assert_allclose(force[:3], [0.5 * 1025.0 * area * 0.64, 0.0, 0.0], rtol=1e-12, atol=1e-6)
    centre = -(4 * 16.87 * 35.0 * 17.5 + 2 * 69.38 * 10.5 * 29.75) / area
    assert force[4] == pytest.approx(force[0] * centre, rel=1e-12)
    calm = WaveLoads(sea=calm_water(water_depth=450.0), members=members, current_speed=0.8, current_heading=0.0)
    forces = calm.evaluate(10.0, REST, REST)
    np.testing.assert_allclose(forces.viscous, force, rtol=1e-12, atol=1e-6)
    np.testing.assert_array_equal(forces.diffraction, 0.0)
    assert forces.elevation == 0.0


def test_platform_that_drifts_with_the_current_feels_no_drag() -> None:
    calm = WaveLoads(
        sea=calm_water(water_depth=450.0),
        members=issc_members(),
        current_speed=0.8,
        current_heading=0.5,
    )
    drifting = np.array([0.8 * np.cos(0.5), 0.8 * np.sin(0.5), 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(calm.evaluate(0.0, REST, drifting).viscous, 0.0, atol=1e-9)


def test_drag_opposes_every_motion_in_calm_water() -> None:
    calm = WaveLoads(sea=calm_water(water_depth=450.0), members=issc_members())
    generator = np.random.default_rng(0)
    for _ in range(20):
        velocity = generator.standard_normal(6) * np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.02])
        assert velocity @ calm.evaluate(0.0, REST, velocity).viscous < 0.0


def test_five_metre_strips_resolve_the_drag(sea: WaveComponents) -> None:
    coarse = WaveLoads(sea=sea, members=issc_members(), strip_length=5.0)
    fine = WaveLoads(sea=sea, members=issc_members(), strip_length=0.5)
    times = np.arange(0.0, 200.0, 2.0)
    forces = [np.array([loads.evaluate(time, REST, REST).viscous for time in times]) for loads in (coarse, fine)]
    spread = forces[1].std(axis=0)
    # The midpoint rule on exp(2kz) leaves (2k 5 m)² / 24: 1 % in waves of 7 s, less in the peak's.
    assert np.all(np.abs(forces[0] - forces[1]).std(axis=0) < 0.01 * spread)


def test_values_do_not_depend_on_what_was_asked_before(loads: WaveLoads) -> None:
    position, velocity = np.full(6, 0.1), np.full(6, 0.05)
    first = loads.evaluate(50.0, position, velocity)
    kept = first.diffraction.copy()
    loads.evaluate(60.0, 2 * position, -velocity)
    again = loads.evaluate(50.0, position, velocity)
    np.testing.assert_array_equal(first.diffraction, kept)
    np.testing.assert_array_equal(again.diffraction, kept)
    np.testing.assert_array_equal(again.viscous, first.viscous)


def test_another_process_makes_the_same_forces() -> None:
    program = (
        "import numpy as np\n"
        "from tlpsim.loads.hydro.excitation import WaveLoads\n"
        "from tlpsim.loads.hydro.issc_members import issc_members\n"
        "from tlpsim.loads.waves.elevation import ArmaSea\n"
        "from tlpsim.loads.waves.sea import SeaState\n"
        "state = SeaState(significant_height=9.0, peak_period=13.0, heading=0.4, water_depth=450.0)\n"
        "sea = ArmaSea(state, seed=1)\n"
        "hull = issc_members()\n"
        "loads = [WaveLoads(sea=sea, members=hull, current_speed=0.5, splash=on) for on in (False, True)]\n"
        "for n in range(100):\n"
        "    forces = loads[n % 2].evaluate(0.3 * n, np.full(6, 0.01 * n), np.full(6, 0.02))\n"
        "    print(forces.diffraction.tobytes().hex(), forces.viscous.tobytes().hex(), forces.elevation.hex())\n"
    )
    outputs = [
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert len(outputs[0]) > 100 * 12 * 16
    assert outputs[0] == outputs[1]


def test_drag_to_mean_water_level_is_the_sum_over_components_and_strips(sea: WaveComponents) -> None:
    members, velocity = issc_members(), np.array([0.5, -0.3, 0.02, 1e-3, -2e-3, 5e-3])
    loads = WaveLoads(sea=sea, members=members, current_speed=0.8, current_heading=1.1)
    forces = loads.evaluate(77.0, REST, velocity)
    amplitudes = sea.amplitudes(77.0)
    strips = loads.strips
    transfer = np.vstack([loads.excitation_transfer, strip_velocity_transfer(strips, sea)])
    rows = np.zeros(len(transfer))
    for n in range(len(amplitudes)):
        rows = rows + (transfer[:, n].real * amplitudes[n].real + -transfer[:, n].imag * amplitudes[n].imag)
    np.testing.assert_allclose(forces.diffraction, rows[:6], rtol=1e-11)
    current = strips.direction @ np.array([0.8 * np.cos(1.1), 0.8 * np.sin(1.1), 0.0])
    drag = np.zeros(6)
    for s in range(len(strips.position)):
        pair = slice(2 * s, 2 * s + 2)
        relative = rows[6:][pair] + current[pair]
        for dof in range(6):
            relative = relative - strips.projection[pair, dof] * velocity[dof]
        speed = math.sqrt(relative[0] * relative[0] + relative[1] * relative[1])
        force = strips.drag[pair] * speed * relative
        drag = drag + (strips.projection[2 * s] * force[0] + strips.projection[2 * s + 1] * force[1])
    np.testing.assert_allclose(forces.viscous, drag, rtol=1e-11)
    np.testing.assert_array_equal(forces.drift, 0.0)
    np.testing.assert_array_equal(forces.drift_damping, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Filters:
    transfer: NDArray[np.complex128]
    weight: NDArray[np.float64]
    constant: NDArray[np.float64]


def filters(count: int, components: int) -> Filters:
    generator = np.random.default_rng(7)
    transfer = generator.standard_normal((2, count, components))
    return Filters(
        transfer=transfer[0] + 1j * transfer[1],
        weight=generator.standard_normal((6, count)),
        constant=generator.standard_normal(6),
    )


@pytest.mark.parametrize("splash", [False, True])
def test_drift_is_the_sum_over_pairs_of_components(sea: WaveComponents, splash: bool) -> None:
    # F_0 + sum_ij Re{a_i conj(a_j) Q_ij} with Q = sum_r W_r G_ri conj(G_rj), at the displaced position.
    given = filters(3, len(sea.frequency))
    loads = WaveLoads(sea=sea, members=issc_members(), drift=given, splash=splash)
    time, position = 31.0, np.array([4.0, -9.0, 0.0, 0.0, 0.0, 0.0])
    travel = position[0] * np.cos(HEADING) + position[1] * np.sin(HEADING)
    amplitude = sea.amplitudes(time) * np.exp(-1j * sea.wavenumber * travel)
    kernel = np.einsum("dr,ri,rj->dij", given.weight, given.transfer, given.transfer.conj())
    expected = given.constant + np.real(np.einsum("i,j,dij->d", amplitude, amplitude.conj(), kernel))
    forces = loads.evaluate(time, position, REST)
    np.testing.assert_allclose(forces.drift, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    without = WaveLoads(sea=sea, members=issc_members(), splash=splash).evaluate(time, position, REST)
    np.testing.assert_allclose(forces.viscous, without.viscous, rtol=1e-10)
    np.testing.assert_allclose(forces.diffraction, without.diffraction, rtol=1e-10)


def test_drift_of_two_waves_has_only_the_difference_frequency() -> None:
    one, two = (
        regular_wave(amplitude=a, period=p, heading=0.0, water_depth=450.0) for a, p in ((2.0, 10.0), (1.5, 12.5))
    )
    pair = WaveComponents(
        **{
            name: np.concatenate([getattr(one, name), getattr(two, name)])
            for name in ("frequency", "amplitude", "phase", "wavenumber", "heading")
        },
        water_depth=450.0,
        gravity=one.gravity,
    )
    given = filters(1, 2)
    loads = WaveLoads(sea=pair, members=issc_members(), drift=given)
    # 50 s hold one period of the difference, 0.02 Hz, and whole ones of all sums.
    lines = np.fft.rfft([loads.evaluate(t, REST, REST).drift for t in 50.0 * np.arange(64) / 64], axis=0) / 64
    g, w = given.transfer[0], given.weight[:, 0]
    np.testing.assert_allclose(lines[0].real, given.constant + w * np.sum(np.abs(g * pair.amplitude) ** 2), rtol=1e-10)
    np.testing.assert_allclose(2.0 * lines[1], 2.0 * w * 3.0 * g[0] * np.conj(g[1]), rtol=1e-10)
    np.testing.assert_allclose(lines[2:], 0.0, atol=1e-10)


@pytest.mark.parametrize("splash", [False, True])
def test_drift_damping_acts_on_the_speed_of_the_platform(sea: WaveComponents, splash: bool) -> None:
    matrix = np.random.default_rng(3).standard_normal((6, 6))
    velocity = np.array([0.5, -0.3, 0.02, 1e-3, -2e-3, 5e-3])
    common = {"sea": sea, "members": issc_members(), "splash": splash, "current_speed": 0.8, "current_heading": 1.1}
    forces = WaveLoads(**common, drift_damping=matrix).evaluate(3.0, REST, velocity)
    np.testing.assert_allclose(forces.drift_damping, -matrix @ velocity, rtol=1e-12)
    parts = forces.diffraction + forces.viscous + forces.drift + forces.drift_damping
    np.testing.assert_allclose(forces.total, parts, rtol=1e-12)
    # Where the waves ride on the current the platform's speed through it counts: at that of the current, none.
    current = np.array([0.8 * np.cos(1.1), 0.8 * np.sin(1.1), 0.0, 0.0, 0.0, 0.0])
    riding = WaveLoads(**common, doppler=True, drift_damping=matrix)
    np.testing.assert_allclose(riding.evaluate(3.0, REST, REST).drift_damping, matrix @ current, rtol=1e-12)
    np.testing.assert_allclose(riding.evaluate(3.0, REST, current).drift_damping, 0.0, atol=1e-15)


def test_bad_drift_damping_is_refused(sea: WaveComponents) -> None:
    for matrix in (np.zeros((3, 3)), np.full((6, 6), np.nan)):
        with pytest.raises(ScenarioError, match=r"wave drift damping .* give a matrix \(6, 6\)"):
            WaveLoads(sea=sea, members=issc_members(), drift_damping=matrix)


def test_bad_drift_filters_are_refused(sea: WaveComponents) -> None:
    with pytest.raises(
        ScenarioError, match=r"the sea has 80 components, so they must be \(R, 80\), \(6, R\) and \(6,\)"
    ):
        WaveLoads(sea=sea, members=issc_members(), drift=filters(3, 79))
    good = filters(3, 80)
    with pytest.raises(ScenarioError, match="not finite"):
        WaveLoads(sea=sea, members=issc_members(), drift=replace(good, weight=np.full((6, 3), np.nan)))


def test_bad_input_is_refused(sea: WaveComponents) -> None:
    with pytest.raises(ScenarioError, match=r"current speed is -0.5 m/s; .* the heading gives the direction"):
        WaveLoads(sea=sea, members=issc_members(), current_speed=-0.5)
    with pytest.raises(ScenarioError, match="current heading is nan"):
        mean_current_force(issc_members(), current_speed=0.5, current_heading=float("nan"))
    with pytest.raises(ScenarioError, match="water density"):
        WaveLoads(sea=sea, members=issc_members(), water_density=0.0)
