"""Motion: the integrator as a digital filter, free decay, energy, and an independent ODE solver."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tlpsim.loads import issc_tlp
from tlpsim.loads.errors import ScenarioError, StepError
from tlpsim.loads.platform import integration, motion
from tlpsim.loads.platform.body import Body, generalized_force, rotation_matrix
from tlpsim.loads.platform.equilibrium import (
    damping_from_ratios,
    mechanical_energy,
    natural_periods,
    single_periods,
    static_equilibrium,
)
from tlpsim.loads.platform.memory import DiscreteMemory, convolution, recursion
from tlpsim.loads.platform.motion import (
    PlatformModel,
    advance,
    inertia_force,
    initial_state,
    remaining,
    restoring_force,
    set_intact,
)
from tlpsim.loads.platform.tendons import Tendons, tendon_drag, tendon_loads
from tlpsim.loads.waves.current import uniform_current

TLP = issc_tlp.platform()
UNDAMPED = issc_tlp.platform(np.zeros(6))
REST = np.zeros(6)


def only(*indices: int) -> NDArray[np.bool_]:
    return np.isin(np.arange(6), indices)


def oscillator(period: float, ratio: float = 0.0, method: str = "fox_goodwin") -> PlatformModel:
    """Linear heave oscillator of a unit tonne: a body afloat on its waterplane, without tendons."""
    mass, gravity, density = 1000.0, 9.80665, 1025.0
    frequency = 2.0 * np.pi / period
    body = Body(
        mass=mass,
        centre_of_gravity=np.zeros(3),
        inertia=mass * np.eye(3),
        added_mass=np.zeros((6, 6)),
        displaced_volume=mass / density,
        centre_of_buoyancy=np.zeros(3),
        waterplane_area=mass * frequency**2 / (density * gravity),
        waterplane_moments=np.zeros(2),
    )
    none = Tendons(
        fairleads=np.zeros((0, 3)),
        anchors=np.zeros((0, 3)),
        axial_stiffness=np.zeros(0),
        pretension=np.zeros(0),
    )
    model = PlatformModel(body=body, tendons=none, free=only(2), method=method)
    return replace(model, linear_damping=damping_from_ratios(model, [0, 0, ratio, 0, 0, 0]))


def free_motion(model: PlatformModel, position: NDArray[np.float64], step: float, count: int) -> NDArray[np.float64]:
    """Positions (count + 1, 6) after a release from `position` without load."""
    state = initial_state(model, position, REST, REST)
    record = [state.position.copy()]
    for _ in range(count):
        advance(model, state, REST, step)
        record.append(state.position.copy())
    return np.array(record)


def recurrence_period(record: NDArray[np.float64], step: float) -> float:
    """Period of a single undamped sinusoid, from x_{n+1} + x_{n-1} = 2 cos(W) x_n."""
    middle = record[1:-1]
    cosine = middle @ (record[2:] + record[:-2]) / (2.0 * middle @ middle)
    # 1 - cos(W) taken from second differences keeps its digits for slow modes.
    second = middle @ (record[2:] - 2.0 * middle + record[:-2]) / (middle @ middle)
    assert cosine < 1.0
    return float(2.0 * np.pi * step / (2.0 * np.arcsin(np.sqrt(-second / 4.0))))


def spectral_period(record: NDArray[np.float64], step: float) -> float:
    """Period of the largest line of a Hann-windowed spectrum, interpolated by a parabola of its logarithm."""
    lines = np.log(np.abs(np.fft.rfft((record - record.mean()) * np.hanning(len(record)))))
    peak = int(np.argmax(lines[1:])) + 1
    left, middle, right = lines[peak - 1 : peak + 2]
    return float(len(record) * step / (peak + 0.5 * (left - right) / (left - 2.0 * middle + right)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AnisotropicMemory:
    """Retardation functions that differ between surge, sway and the angles; as taps they couple sway with roll."""

    recursive: bool
    longest_step: float = 0.25

    def discrete(self, step: float) -> DiscreteMemory:
        if self.recursive:
            # z' = -z/2 + v by the trapezoidal rule.
            drive = 0.5 * step / (1.0 + 0.25 * step) * np.eye(6)
            transition = (1.0 - 0.25 * step) / (1.0 + 0.25 * step) * np.eye(6)
            output = np.diag([1e6, 6e6, 0.0, 1e9, 5e9, 1e10])
            return recursion(output @ drive, transition, drive, output)
        pairs = np.array([[0, 0], [1, 1], [1, 3], [3, 1], [5, 5]])
        taps = step * np.exp(-0.5 * step * np.arange(1, int(20.0 / step)))[:, None]
        return convolution(np.zeros((6, 6)), pairs, taps * np.array([1e6, 6e6, 5e6, 5e6, 1e10]))


def turned_mass(model: PlatformModel, yaw: complex) -> NDArray[Any]:
    """Mass matrix on the rates of the pose of a hull that is turned by `yaw`, which may be complex."""
    turn = np.eye(6, dtype=type(yaw))
    turn[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    return turn @ model.mass @ turn.T


def lagrangian_inertia(
    model: PlatformModel, pose: NDArray[np.float64], velocity: NDArray[np.float64]
) -> NDArray[np.float64]:
    """d/dt dL/dx' - dL/dx of L = 1/2 x'^T M(yaw) x' without the acceleration's part; dM/dyaw by a complex step."""
    slope = turned_mass(model, complex(pose[5], 1e-30)).imag / 1e-30
    force = velocity[5] * slope @ velocity
    force[5] -= 0.5 * velocity @ slope @ velocity
    return force


@pytest.mark.parametrize("method", list(motion.METHODS))
@pytest.mark.parametrize("period", [1.8, 2.2, 5.0, 20.0])
def test_discrete_transfer_function(method: str, period: float) -> None:
    model, step = oscillator(2.2, 0.2, method), 0.1
    beta = motion.METHODS[method]
    mass, damping, stiffness = model.mass[2, 2], model.linear_damping[2, 2], model.stiffness[2, 2]
    phase = 2.0 * np.pi * step / period
    square = 4.0 * np.sin(0.5 * phase) ** 2
    shrink = 1.0 - beta * square
    # Of the recurrence in the module's docstring; with beta = 0 it is that of central differences.
    transfer = 1.0 / (stiffness - square * mass / (step**2 * shrink) + 1j * damping * np.sin(phase) / (step * shrink))
    state = initial_state(model, REST, REST, REST)
    times, record = np.arange(1, 1801), []
    for n in times:
        force = np.zeros(6)
        force[2] = 1e3 * np.cos(phase * n)
        advance(model, state, force, step)
        record.append(state.position[2])
    # The transient has sunk by exp(-0.2 * 2.86 * 80) = 1e-20 before the fitted samples.
    tail = times[800:]
    design = np.column_stack((np.cos(phase * tail), np.sin(phase * tail)))
    cosine, sine = np.linalg.lstsq(design, np.array(record[800:]), rcond=None)[0]
    assert cosine - 1j * sine == pytest.approx(1e3 * transfer, rel=1e-10)


@pytest.mark.parametrize(
    ("method", "error"),
    [("central_difference", 3.4e-3), ("fox_goodwin", 1.4e-5), ("average_acceleration", -6.7e-3)],
)
def test_frequency_error_of_a_tether_mode(method: str, error: float) -> None:
    record = free_motion(oscillator(2.2, method=method), np.array([0, 0, 1.0, 0, 0, 0]), 0.1, 2000)[:, 2]
    # The stated figures have two digits.
    assert 2.2 / recurrence_period(record, 0.1) - 1.0 == pytest.approx(error, rel=0.04)


@pytest.mark.parametrize(
    ("method", "order"), [("central_difference", 2), ("fox_goodwin", 4), ("average_acceleration", 2)]
)
def test_order_of_accuracy_by_step_halving(method: str, order: int) -> None:
    model, errors = oscillator(2.2, method=method), []
    for count in (170, 340, 680):  # 4.25 periods: on a zero crossing, where the phase error stands alone
        record = free_motion(model, np.array([0, 0, 1.0, 0, 0, 0]), 4.25 * 2.2 / count, count)
        errors.append(abs(record[-1, 2]))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(rates, order, atol=0.05)


@given(*[st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(np.array)] * 4, st.integers(0, 4095))
@settings(max_examples=50, deadline=None)
def test_kernels_agree_with_the_array_forms(
    unit_pose: NDArray[np.float64],
    unit_rates: NDArray[np.float64],
    unit_acceleration: NDArray[np.float64],
    unit_load: NDArray[np.float64],
    flags: int,
) -> None:
    tubes = issc_tlp.steel_tubes() | {"submerged_weight": np.array([2000.0])}
    body = replace(TLP.body, centre_of_gravity=np.array([0.5, -0.3, 3.0]))
    current = uniform_current(0.7, 0.4) if flags % 3 == 0 else None
    model = replace(TLP, body=body, tendons=issc_tlp.tendons(tubes=tubes), current=current)
    intact = (flags >> np.arange(12)) % 2 == 1
    pose = unit_pose * [40.0, 40.0, 3.0, 0.3, 0.3, 1.0]
    velocity = unit_rates * [2.0, 2.0, 0.2, 0.02, 0.02, 0.05]
    load = unit_load * [1e7, 1e7, 1e7, 1e8, 1e8, 1e8]
    total, tensions, bottom = np.empty(6), np.empty(12), np.empty(12)
    matrices, hydrostatics, lines, line_masses, _ = model.arrays
    integration.generalized_load(pose, velocity, load, hydrostatics, lines, intact, total, tensions, bottom)
    left = remaining(model, intact)
    _, top_tensions, bottom_tensions = tendon_loads(left.tendons, pose)
    # Rounding: 415 m eps times EA/l0, and sums of forces on levers of up to 60 m.
    np.testing.assert_allclose(tensions[intact], top_tensions, rtol=1e-12, atol=1e-4)
    np.testing.assert_allclose(bottom[intact], bottom_tensions, rtol=1e-12, atol=1e-4)
    assert not tensions[~intact].any()
    assert not bottom[~intact].any()
    drag = tendon_drag(left.tendons, pose, velocity, body.water_density, left.flow)
    expected = generalized_force(load + drag, pose) - restoring_force(left, pose)
    np.testing.assert_allclose(total, expected, rtol=0, atol=1e-11 * (1e9 + top_tensions.sum()))
    np.testing.assert_allclose(matrices[0] - line_masses[~intact].sum(axis=0), left.mass, rtol=1e-12, atol=1e-3)
    past, work = 1e6 * unit_load, (np.empty(6), np.empty(6))
    acceleration = unit_acceleration * [1.0, 1.0, 1.0, 0.01, 0.01, 0.01]
    integration.resisting_force(pose[5], velocity, acceleration, *matrices[:2], past, *work, total)
    turn = np.eye(6)
    turn[:3, :3] = rotation_matrix(np.array([0.0, 0.0, pose[5]]))
    expected = turn @ (matrices[1] @ turn.T @ velocity + past) + inertia_force(model, pose, velocity, acceleration)
    np.testing.assert_allclose(total, expected, rtol=1e-12, atol=1e-3)


@pytest.mark.parametrize(
    ("index", "amplitude", "period"),
    [(0, 0.1, 103.6), (1, 0.1, 103.6), (2, 1e-3, 1.82), (3, 1e-5, 1.92), (4, 1e-5, 1.92), (5, 1e-3, 82.7)],
)
def test_free_decay_of_single_degrees_of_freedom(index: int, amplitude: float, period: float) -> None:
    model = replace(UNDAMPED, free=only(index))
    record = free_motion(model, amplitude * np.eye(6)[index], 0.1, 3000)
    measured = recurrence_period(record[:, index], 0.1)
    assert measured == pytest.approx(period, rel=0.02)
    # Fox-Goodwin at 0.1 s is off by 3e-5 in the fastest mode; the tethers' cubic stiffness adds less.
    assert measured == pytest.approx(single_periods(model)[index], rel=1e-4)
    np.testing.assert_array_equal(record[:, np.arange(6) != index], 0.0)


@pytest.mark.parametrize(
    ("index", "amplitude", "count"),
    [(0, 0.1, 20720), (2, 1e-3, 4000), (4, 1e-5, 4000), (3, 1e-5, 4000), (5, 1e-3, 16540)],
)
def test_free_decay_of_the_coupled_platform(index: int, amplitude: float, count: int) -> None:
    record = free_motion(UNDAMPED, amplitude * np.eye(6)[index], 0.1, count)
    # 20 periods or more in a Hann-windowed spectrum: the parabola finds the line to a hundredth of a bin.
    assert spectral_period(record[:, index], 0.1) == pytest.approx(natural_periods(UNDAMPED)[index], rel=5e-4)


def test_heave_decays_with_its_damping_ratio() -> None:
    record = free_motion(TLP, np.array([0, 0, 1e-3, 0, 0, 0]), 0.02, 1500)[:, 2]
    ratio = 0.02
    frequency = 2.0 * np.pi / single_periods(TLP)[2]
    damped = frequency * np.sqrt(1.0 - ratio**2)
    time = 0.02 * np.arange(1501)
    envelope = 1e-3 * np.exp(-ratio * frequency * time)
    expected = envelope * (np.cos(damped * time) + ratio / np.sqrt(1.0 - ratio**2) * np.sin(damped * time))
    # Damping acts on the trapezoidal velocity, off by (omega h)²/12 = 4e-4, over 100 radians of motion.
    np.testing.assert_allclose(record, expected, atol=1e-3 * 5e-4)


@pytest.mark.parametrize(
    ("force", "velocity"),
    [
        ([2.6e6, 1.0e6, 0.0, 0.0, 0.0, 2.0e7], [0.0] * 6),
        ([6.0e6, 3.0e6, 0.0, 0.0, 0.0, 3.0e8], [0.3, -0.5, 0.0, 0.0, 0.0, 0.02]),  # 13 degrees of yaw, and more
    ],
)
def test_energy_of_the_undamped_platform_does_not_drift(force: list[float], velocity: list[float]) -> None:
    pose = static_equilibrium(UNDAMPED, force)
    state = initial_state(UNDAMPED, pose, velocity, REST)
    start, energies = mechanical_energy(UNDAMPED, state), []
    for n in range(51_800):  # fifty surge periods
        advance(UNDAMPED, state, REST, 0.1)
        if n % 7 == 0:
            energies.append(mechanical_energy(UNDAMPED, state))
    deviation = np.array(energies) / start - 1.0
    # The trapezoidal velocity ripples the kinetic energy by (omega h)²/6: 6e-6 in surge, 2 % in the tether
    # modes, which carry little of the total. No drift: first and last tenth agree on average.
    assert np.abs(deviation).max() < 2e-5
    tenth = len(deviation) // 10
    assert abs(deviation[-tenth:].mean() - deviation[:tenth].mean()) < 1e-7


def test_against_an_independent_ode_solver() -> None:
    end, last = 20.0, np.array([4.0e6, -2.0e6, 3.0e6, 2.0e7, 5.0e7, 6.0e7])
    pose, rates = np.array([5.0, -3.0, -0.04, 1e-4, -1e-4, 0.02]), np.array([0.2, 0.1, 0.0, 0.0, 0.0, 1e-3])

    def slope(time: float, values: NDArray[np.float64]) -> NDArray[np.float64]:
        at, rate = values[:6], values[6:]
        drive = generalized_force(last * time / end, at) - restoring_force(TLP, at)
        drive -= lagrangian_inertia(TLP, at, rate) + TLP.linear_damping @ rate
        return np.concatenate((rate, np.linalg.solve(turned_mass(TLP, at[5]), drive)))

    exact = solve_ivp(slope, (0.0, end), np.concatenate((pose, rates)), method="DOP853", rtol=1e-10, atol=1e-12).y[
        :, -1
    ]
    errors = []
    for step in (0.1, 0.05, 0.025):
        state = initial_state(TLP, pose, rates, REST)
        count = round(end / step)
        for n in range(count):
            advance(TLP, state, last * (n + 1) / count, step)
        errors.append(np.abs(state.position - exact[:6]) / np.abs(exact[:6]))
    # A transient start excites the velocity's second-order error: a quarter for each halving.
    assert np.all(errors[0] < [1e-5, 1e-4, 5e-4, 5e-4, 5e-3, 1e-5])
    np.testing.assert_allclose(np.log2(np.max(errors[1]) / np.max(errors[2])), 2.0, atol=0.3)


@given(*[st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(np.array)] * 3, st.floats(-np.pi, np.pi))
@settings(max_examples=30)
def test_inertia_is_that_of_the_lagrangian(
    place: NDArray[np.float64], velocity: NDArray[np.float64], acceleration: NDArray[np.float64], yaw: float
) -> None:
    body = replace(TLP.body, added_mass=np.diag([1e7, 9e7, 3e7, 6e10, 7e10, 1e11]) + TLP.body.added_mass)
    model = replace(TLP, body=body)
    pose = np.concatenate((place[:5], [yaw]))
    expected = turned_mass(model, yaw) @ acceleration + lagrangian_inertia(model, pose, velocity)
    # Rounding of moments of inertia of 1e11.
    np.testing.assert_allclose(inertia_force(model, pose, velocity, acceleration), expected, rtol=1e-12, atol=1e-2)


@pytest.mark.parametrize(("turn", "recursive"), [(np.pi / 6.0, False), (2.0, False), (2.0, True)])
def test_a_platform_turned_with_its_anchors_and_loads_moves_alike(turn: float, recursive: bool) -> None:
    """Inertia, added mass, damping, memory and drag turn with yaw, for a hull of no symmetry at all."""
    body = replace(TLP.body, added_mass=TLP.body.added_mass + np.diag([0, 5e7, 0, 0, 3e10, 0]))
    whole = issc_tlp.tendons(tubes=issc_tlp.steel_tubes())
    size = np.sqrt(np.diag(TLP.mass))
    damping = np.outer(size, size) * (np.diag([0.01, 0.05, 0.1, 0.1, 0.2, 0.02]) + 0.005)
    cosine, sine = np.cos(turn), np.sin(turn)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    results = []
    for angle, change in ((0.0, np.eye(3)), (turn, rotation)):
        memory = AnisotropicMemory(recursive=recursive)
        model = PlatformModel(body=body, tendons=whole, linear_damping=damping, memory=memory)
        state = initial_state(model, REST, REST, REST)
        # Anchors that are turned after the lines have got their lengths.
        lines = model.arrays[2].copy()
        lines[:, 3:6] = whole.anchors @ change.T
        object.__setattr__(model, "arrays", (*model.arrays[:2], lines, *model.arrays[3:]))
        state.position[5] = angle
        poses = []
        for n in range(600):
            load = 1e7 * np.array([1.0, 1.0, 0.5, 2.0, 2.0, 20.0]) * np.sin(0.05 * n + np.arange(6))
            advance(model, state, np.concatenate((change @ load[:3], change @ load[3:])), 0.1)
            position = state.position - np.array([0, 0, 0, 0, 0, angle])
            poses.append(np.concatenate((change.T @ position[:3], position[3:])))
        results.append(np.array(poses))
    largest = np.abs(results[0]).max(axis=0)
    assert np.all(largest > [1.0, 0.3, 1e-3, 1e-6, 1e-6, 1e-3])
    # The corrections end at the rounding of the tethers' stiffness; the held tangent of zero pose is turned as well.
    np.testing.assert_allclose(results[1] / largest, results[0] / largest, rtol=0, atol=1e-7)


def test_platform_stays_in_equilibrium() -> None:
    force = np.array([2.6e6, 1.0e6, 0.0, 1e7, 2e7, 3e7])
    pose = static_equilibrium(TLP, force)
    state = initial_state(TLP, pose, REST, force)
    for _ in range(200):
        advance(TLP, state, force, 0.1)
    np.testing.assert_allclose(state.position, pose, rtol=0, atol=1e-9)
    np.testing.assert_allclose(state.tensions, tendon_loads(TLP.tendons, pose)[1], rtol=1e-9)


def test_corrections_end_on_the_equation_of_motion() -> None:
    """Slack, tight and lost lines with drag, at a large yaw: the acceleration is that of the array form there."""
    model = replace(TLP, tendons=issc_tlp.tendons(tubes=issc_tlp.steel_tubes()))
    generator = np.random.default_rng(8)
    forces = np.cumsum(generator.normal(size=(400, 6)), axis=0) * [1e6, 1e6, 3e6, 5e7, 5e7, 1e8]
    state = initial_state(model, [5.0, 5.0, 0.0, 0.0, 0.0, 0.4], REST, REST)
    slack = 0
    for n, force in enumerate(forces):
        if n == 150:
            set_intact(model, state, np.arange(12) % 3 != 1)
        advance(model, state, force, 0.1)
        exact = initial_state(model, state.position, state.velocity, force, state.intact)
        # The first digits that the tethers' rounding takes: 1e-3 N on the mass, and 1e-12 of the acceleration squared.
        size = np.abs(exact.acceleration).max()
        np.testing.assert_allclose(state.acceleration, exact.acceleration, rtol=1e-9, atol=1e-9 * max(size, 1e-3))
        np.testing.assert_allclose(state.tensions, exact.tensions, rtol=1e-9, atol=1.0)
        slack += int(np.any(state.tensions[state.intact] == 0.0))
    assert 20 < slack < 380


def test_load_is_linear_between_the_ends_of_a_step() -> None:
    # A fast roll mode forces ten sub-steps on a heave motion that nothing restores.
    body = replace(oscillator(2.2).body, waterplane_area=0.0, waterplane_moments=np.array([1.3, 0.0]))
    model = PlatformModel(body=body, tendons=oscillator(2.2).tendons, free=only(2, 3))
    assert model.highest_frequency / motion.LARGEST_PHASE > 9.0
    first, last = np.array([0, 0, 100.0, 0, 0, 0]), np.array([0, 0, 700.0, 0, 0, 0])
    state = initial_state(model, REST, REST, first)
    advance(model, state, last, 1.0)
    # The integral of the ramp; the trapezoidal rule has it exactly.
    assert state.velocity[2] == pytest.approx(0.5 * (100.0 + 700.0) / 1000.0, rel=1e-12)
    assert state.acceleration[2] == pytest.approx(0.7, rel=1e-12)
    np.testing.assert_array_equal(state.force, last)


def test_substeps_are_the_steps_of_a_finer_master() -> None:
    force = np.array([3e6, 1e6, 1e6, 1e7, 1e7, 1e7])
    coarse = initial_state(TLP, REST, REST, REST)
    advance(TLP, coarse, force, 0.9)
    fine = initial_state(TLP, REST, REST, REST)
    for n in range(9):
        advance(TLP, fine, force * (n + 1) / 9.0, 0.1)
    np.testing.assert_allclose(coarse.position, fine.position, rtol=1e-9, atol=1e-13)


def test_snapshot_repeats_bit_for_bit() -> None:
    generator = np.random.default_rng(11)
    forces = generator.normal(size=(50, 6)) * [1e6, 1e6, 1e6, 1e7, 1e7, 1e7]
    state = initial_state(TLP, REST, REST, REST)
    advance(TLP, state, forces[0], 0.1)
    snapshot = state.copy()
    runs = []
    for start in (state, snapshot):
        for force in forces[1:]:
            advance(TLP, start, force, 0.1)
        runs.append(np.concatenate((start.position, start.velocity, start.acceleration, start.tensions)))
    np.testing.assert_array_equal(runs[0], runs[1])


def test_held_degrees_of_freedom_do_not_move() -> None:
    model = replace(TLP, free=only(0, 1, 5))
    pose = np.array([1.0, 0.0, -0.1, 1e-3, 0.0, 0.05])
    state = initial_state(model, pose, np.ones(6) * 1e-2, REST)
    np.testing.assert_array_equal(state.velocity[2:5], 0.0)
    for _ in range(50):
        advance(model, state, np.full(6, 1e6), 0.1)
    np.testing.assert_array_equal(state.position[2:5], pose[2:5])
    np.testing.assert_array_equal(state.acceleration[2:5], 0.0)
    assert np.all(state.position[[0, 1, 5]] != pose[[0, 1, 5]])


def test_tendons_go_slack_and_tight_again() -> None:
    state = initial_state(TLP, REST, REST, REST)
    push = np.array([0, 0, -1.5 * issc_tlp.TOTAL_PRETENSION, 0, 0, 0])
    slack, tight = 0, 0
    for n in range(200):
        advance(TLP, state, push if n < 100 else REST, 0.1)
        slack += int(np.all(state.tensions == 0.0))
        tight += int(np.all(state.tensions > 0.0))
    assert slack > 20
    assert tight > 20


def test_bad_steps_are_refused_and_leave_the_state_alone() -> None:
    state = initial_state(TLP, REST, REST, REST)
    advance(TLP, state, np.full(6, 1e5), 0.1)
    before = state.copy()
    for force, step, message in (
        (np.array([1.0, np.nan, 0, 0, 0, 0]), 0.1, "expected finite numbers"),
        (np.zeros(5), 0.1, r"has shape \(5,\), expected \(6,\)"),
        (REST, 0.0, "platform step is 0.0 s"),
        (REST, np.inf, "platform step is inf s"),
        (np.full(6, 1e200), 0.1, "did not converge"),
    ):
        with pytest.raises(StepError, match=message):
            advance(TLP, state, force, step)
    for name in ("position", "velocity", "acceleration", "force", "tensions"):
        np.testing.assert_array_equal(getattr(state, name), getattr(before, name))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"method": "euler"}, "integration method is 'euler', expected one of central_difference"),
        ({"linear_damping": -np.eye(6)}, "linear_damping feeds energy in"),
        ({"linear_damping": np.zeros(6)}, r"linear_damping has shape \(6,\)"),
        ({"free": np.ones(3, dtype=bool)}, r"free has shape \(3,\)"),
    ],
)
def test_bad_models_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        replace(TLP, **changes)  # type: ignore[arg-type]


def test_bad_initial_states_are_refused() -> None:
    with pytest.raises(ScenarioError, match="initial velocity holds nan"):
        initial_state(TLP, REST, np.full(6, np.nan), REST)
