"""Equilibrium, stiffness and periods against closed forms that are solved here on their own."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from tlpsim.loads import issc_tlp
from tlpsim.loads.errors import ScenarioError, SolverError
from tlpsim.loads.platform.equilibrium import (
    damping_from_ratios,
    natural_periods,
    potential_energy,
    single_periods,
    static_equilibrium,
)
from tlpsim.loads.platform.motion import PlatformModel, advance, initial_state, restoring_force, tangent_stiffness
from tlpsim.loads.platform.tendons import Tendons, tendon_drag, tendon_loads
from tlpsim.loads.waves.current import uniform_current

MODEL = issc_tlp.platform()
LENGTH = 415.0
SPECIFIC_WEIGHT = 1025.0 * 9.80665
WATERPLANE_STIFFNESS = SPECIFIC_WEIGHT * 4.0 * np.pi * 8.435**2
NET_BUOYANCY = 14.0e6 * 9.80665
UNSTRETCHED = LENGTH / (1.0 + NET_BUOYANCY / 3.37e11)
POSES = st.tuples(
    st.lists(st.floats(-30.0, 30.0), min_size=2, max_size=2),
    st.lists(st.floats(-3.0, 1.0), min_size=1, max_size=1),
    st.lists(st.floats(-0.05, 0.05), min_size=2, max_size=2),
    st.lists(st.floats(-0.3, 0.3), min_size=1, max_size=1),
).map(np.concatenate)


def no_tendons() -> Tendons:
    return Tendons(
        fairleads=np.zeros((0, 3)),
        anchors=np.zeros((0, 3)),
        axial_stiffness=np.zeros(0),
        pretension=np.zeros(0),
    )


def parallel_line(horizontal: float) -> tuple[float, float]:
    """Heave and total tension when all fairleads stand `horizontal` metres off their anchors.

    The elastic line with the vertical balance T (L + z)/l = net buoyancy - waterplane stiffness z.
    """

    def imbalance(heave: float) -> float:
        length = np.hypot(horizontal, LENGTH + heave)
        tension = 3.37e11 * (length / UNSTRETCHED - 1.0)
        return float(tension * (LENGTH + heave) / length - NET_BUOYANCY + WATERPLANE_STIFFNESS * heave)

    heave = brentq(imbalance, -100.0, 1.0, xtol=1e-13, rtol=1e-15)
    return heave, 3.37e11 * (np.hypot(horizontal, LENGTH + heave) / UNSTRETCHED - 1.0)


@pytest.mark.parametrize("force", [2.6e6, 2.0e7])
def test_offset_setdown_and_tension_under_a_horizontal_force(force: float) -> None:
    def imbalance(surge: float) -> float:
        heave, tension = parallel_line(surge)
        return float(tension * surge / np.hypot(surge, LENGTH + heave) - force)

    surge = brentq(imbalance, 0.0, 200.0, xtol=1e-12, rtol=1e-15)
    heave, tension = parallel_line(surge)
    # Through the fairleads' level the force tilts nothing, so all six freedoms keep the closed form.
    pose = static_equilibrium(MODEL, [force, 0.0, 0.0, 0.0, -35.0 * force, 0.0])
    # Tension is the difference of lengths, so its rounding is 415 m eps EA/l0 = 1e-12 of it.
    np.testing.assert_allclose(pose, [surge, 0.0, heave, 0.0, 0.0, 0.0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(tendon_loads(MODEL.tendons, pose)[1], tension / 12.0, rtol=1e-9)
    # Setdown of stiff lines is about surge²/2L: elastic stretch takes 3 % of it here at most.
    assert -heave == pytest.approx(surge**2 / (2.0 * LENGTH), rel=0.04)


def test_force_at_the_origin_with_only_surge_and_heave_free() -> None:
    model = replace(MODEL, free=np.array([True, False, True, False, False, False]))
    pose = static_equilibrium(model, [2.6e6, 0.0, 0.0, 0.0, 0.0, 0.0])
    level = static_equilibrium(MODEL, [2.6e6, 0.0, 0.0, 0.0, -35.0 * 2.6e6, 0.0])
    np.testing.assert_allclose(pose, level, rtol=1e-10, atol=1e-12)


def test_force_at_the_origin_pitches_by_its_lever_to_the_fairleads() -> None:
    pose = static_equilibrium(MODEL, [2.6e6, 0.0, 0.0, 0.0, 0.0, 0.0])
    # The lever of 35 m over the pitch stiffness; the stiffness at the offset differs by less than 1 %.
    assert pose[4] == pytest.approx(35.0 * 2.6e6 / MODEL.stiffness[4, 4], rel=0.01)


@pytest.mark.parametrize("yaw", [0.03, 0.3])
def test_setdown_from_yaw(yaw: float) -> None:
    radius = 43.125 * np.sqrt(2.0)
    chord = 2.0 * radius * np.sin(0.5 * yaw)
    heave, tension = parallel_line(chord)
    moment = tension * radius**2 * np.sin(yaw) / np.hypot(chord, LENGTH + heave)
    pose = static_equilibrium(MODEL, [0.0, 0.0, 0.0, 0.0, 0.0, moment])
    np.testing.assert_allclose(pose, [0.0, 0.0, heave, 0.0, 0.0, yaw], rtol=1e-9, atol=1e-12)
    assert heave < 0.0


def test_yaw_at_an_offset_tilts_by_unequal_setdown() -> None:
    pose = static_equilibrium(MODEL, [2.6e6, 2.0e6, 0.0, 35.0 * 2.0e6, -35.0 * 2.6e6, 3.5e7])
    surge, sway, yaw = pose[0], pose[1], pose[5]
    assert yaw == pytest.approx(0.028, abs=0.002)
    # Column i moves by (x0 - yaw y_i, y0 + yaw x_i) and sets down by half its square over L: a tilt of
    # roll = yaw x0/L, pitch = yaw y0/L, less 1 % for the hull's own restoring and 1 % for rotated levers.
    assert pose[3] == pytest.approx(yaw * surge / LENGTH, rel=0.025)
    assert pose[4] == pytest.approx(yaw * sway / LENGTH, rel=0.025)


@given(POSES)
@settings(max_examples=30, deadline=None)
def test_restoring_is_the_gradient_of_the_energy(pose: np.ndarray) -> None:
    gradient = [potential_energy(MODEL, pose + 1e-30j * unit).imag / 1e-30 for unit in np.eye(6)]
    scale = 6e8 + tendon_loads(MODEL.tendons, pose)[1].sum()
    np.testing.assert_allclose(restoring_force(MODEL, pose), gradient, rtol=0, atol=1e-10 * scale)


def test_tangent_stiffness_against_finite_differences() -> None:
    generator = np.random.default_rng(7)
    for _ in range(5):
        pose = generator.uniform(-1.0, 1.0, 6) * [20.0, 20.0, 0.0, 1e-4, 1e-4, 0.1]
        # Setdown keeps all lines tight.
        pose[2] = -(pose[0] ** 2 + pose[1] ** 2 + 2.0 * (43.125 * pose[5]) ** 2) / (2.0 * LENGTH)
        step = np.array([1e-3, 1e-3, 1e-4, 1e-6, 1e-6, 1e-5])
        columns = [
            (restoring_force(MODEL, pose + h * unit) - restoring_force(MODEL, pose - h * unit)) / (2.0 * h)
            for h, unit in zip(step, np.eye(6), strict=True)
        ]
        difference = np.column_stack(columns)
        # Scaled by the diagonal, so that every entry counts; rounding of the lines' forces, 1e-4 N on levers
        # of 60 m, over the steps is some 1e-6 of it.
        diagonal = np.sqrt(np.abs(np.diag(difference)))
        scaled = difference / np.outer(diagonal, diagonal)
        exact = tangent_stiffness(MODEL, pose) / np.outer(diagonal, diagonal)
        np.testing.assert_allclose(scaled, scaled.T, atol=1e-4)
        np.testing.assert_allclose(scaled, exact, atol=1e-4)


def test_stiffness_at_rest_has_its_closed_form() -> None:
    axial = 3.37e11 / UNSTRETCHED
    lateral = NET_BUOYANCY / LENGTH
    weight, buoyancy = 40.5e6 * 9.80665, 54.5e6 * 9.80665
    second_moment = np.pi * 8.435**4 + 4.0 * np.pi * 8.435**2 * 43.125**2
    pitch = (
        axial * 43.125**2
        + lateral * 35.0**2
        + NET_BUOYANCY * 35.0
        + SPECIFIC_WEIGHT * second_moment
        + buoyancy * MODEL.body.centre_of_buoyancy[2]
        - weight * 3.0
    )
    expected = np.diag([lateral, lateral, axial + WATERPLANE_STIFFNESS, pitch, pitch, lateral * 2.0 * 43.125**2])
    expected[0, 4] = expected[4, 0] = -35.0 * lateral
    expected[1, 3] = expected[3, 1] = 35.0 * lateral
    # Rounding of the heave and pitch stiffness enters the others at 1e-16 of it.
    np.testing.assert_allclose(MODEL.stiffness, expected, rtol=1e-10, atol=1e-3)


def test_natural_periods_of_the_surge_pitch_pair() -> None:
    m, k = MODEL.mass[np.ix_([0, 4], [0, 4])], MODEL.stiffness[np.ix_([0, 4], [0, 4])]
    # det(K - s M) = 0 as a quadratic in s.
    cross = m[0, 0] * k[1, 1] + m[1, 1] * k[0, 0] - 2.0 * m[0, 1] * k[0, 1]
    slow, fast = np.sort(np.roots([np.linalg.det(m), -cross, np.linalg.det(k)]).real)
    coupled, single = natural_periods(MODEL), single_periods(MODEL)
    np.testing.assert_allclose(coupled[[0, 4]], 2.0 * np.pi / np.sqrt([slow, fast]), rtol=1e-8)
    np.testing.assert_allclose(coupled[[1, 3]], coupled[[0, 4]], rtol=1e-10)
    np.testing.assert_allclose(coupled[[2, 5]], single[[2, 5]], rtol=1e-10)
    np.testing.assert_allclose(single, 2.0 * np.pi * np.sqrt(np.diag(MODEL.mass) / np.diag(MODEL.stiffness)))


def test_held_and_unrestored_degrees_of_freedom_have_no_period() -> None:
    model = PlatformModel(
        body=replace(issc_tlp.body(), mass=54.5e6),
        tendons=no_tendons(),
        free=np.array([1, 0, 1, 1, 1, 1], dtype=bool),
    )
    periods = natural_periods(model)
    assert np.isnan(periods[1])
    np.testing.assert_array_equal(periods[[0, 5]], np.inf)
    assert np.all(np.isfinite(periods[[2, 3, 4]]))
    assert np.all(np.isinf(single_periods(model)[[0, 1, 5]]))


def test_held_degrees_of_freedom_stay_where_they_start() -> None:
    model = replace(MODEL, free=np.array([True, True, True, False, False, False]))
    pose = static_equilibrium(model, [2.6e6, 0.0, 0.0, 0.0, 0.0, 1e8], start=[0.0, 0.0, 0.0, 0.001, 0.0, 0.2])
    np.testing.assert_array_equal(pose[3:], [0.001, 0.0, 0.2])
    np.testing.assert_allclose(restoring_force(model, pose)[:3], [2.6e6, 0.0, 0.0], atol=1.0)
    held = replace(MODEL, free=np.zeros(6, dtype=bool))
    np.testing.assert_array_equal(static_equilibrium(held, np.ones(6), start=np.ones(6)), 1.0)


def test_equilibrium_under_a_load_that_turns_with_yaw() -> None:
    """A force of 2 MN ahead that acts 10 m to the right at rest, and at 10 cos + 30 sin m of a yaw to the left."""

    def load(yaw: float) -> list[float]:
        return [2e6, 0.0, 0.0, 0.0, -70e6, 2e6 * (10.0 * np.cos(yaw) + 30.0 * np.sin(yaw))]

    pose = static_equilibrium(MODEL, load)
    np.testing.assert_allclose(static_equilibrium(MODEL, load(pose[5])), pose, rtol=0.0, atol=1e-8)
    assert pose[5] > 1.01 * static_equilibrium(MODEL, load(0.0))[5]
    with pytest.raises(SolverError, match="still changes by more than 1e-09 rad"):
        static_equilibrium(MODEL, lambda yaw: [0.0, 0.0, 0.0, 0.0, 0.0, 1e8 if yaw < 0.01 else 0.0])


def test_no_equilibrium_is_an_error() -> None:
    drifting = PlatformModel(body=replace(issc_tlp.body(), mass=54.5e6), tendons=no_tendons())
    with pytest.raises(SolverError, match="no equilibrium near"):
        static_equilibrium(drifting, [1e5, 0.0, 0.0, 0.0, 0.0, 0.0])


def test_damping_ratios_need_a_stiffness() -> None:
    damping = damping_from_ratios(MODEL, [0.05] * 6)
    expected = 0.1 * np.sqrt(np.diag(MODEL.mass) * np.diag(MODEL.stiffness))
    np.testing.assert_allclose(damping, np.diag(expected))
    with pytest.raises(ScenarioError, match=r"damping ratio in heave is -0\.1, expected >= 0"):
        damping_from_ratios(MODEL, [0.0, 0.0, -0.1, 0.0, 0.0, 0.0])
    drifting = PlatformModel(body=replace(issc_tlp.body(), mass=54.5e6), tendons=no_tendons())
    with pytest.raises(ScenarioError, match=r"damping ratio in surge is 0\.1, but its stiffness is"):
        damping_from_ratios(drifting, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0])


def test_equilibrium_in_a_current_on_the_tendons() -> None:
    """Offset of the drag at the tops over the surge stiffness, and where a long simulation comes to rest."""
    tendons = issc_tlp.tendons(tubes=issc_tlp.steel_tubes())
    model = replace(issc_tlp.platform(), tendons=tendons, current=uniform_current(0.8, 0.0))
    position = static_equilibrium(model, np.zeros(6))
    drag = tendon_drag(tendons, np.zeros(6), np.zeros(6), model.body.water_density, model.flow)
    assert drag[0] > 1e5
    # The stiffness grows by a few parts in a thousand over this offset.
    assert position[0] == pytest.approx(drag[0] / model.stiffness[0, 0], rel=5e-3)
    damped = replace(model, linear_damping=damping_from_ratios(model, np.full(6, 0.7)))
    state = initial_state(damped, np.zeros(6), np.zeros(6), np.zeros(6))
    for _ in range(6000):
        advance(damped, state, np.zeros(6), 0.1)
    np.testing.assert_allclose(state.position[:2], position[:2], atol=2e-3 * position[0])
