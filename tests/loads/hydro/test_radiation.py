"""Radiation memory: a closed pair of damping and retardation, Ogilvie's relation, and an independent integrator."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.hydro.radiation import (
    LARGEST_DISAGREEMENT,
    Radiation,
    convolution_memory,
    frequency_response,
    radiation,
)
from tlpsim.loads.platform.body import Body
from tlpsim.loads.platform.equilibrium import damping_from_ratios
from tlpsim.loads.platform.motion import PlatformModel, advance, initial_state
from tlpsim.loads.platform.tendons import Tendons

# H(s) = b s / (s² + 2 zeta w s + w²) is passive, radiates nothing in slow motion, and is known in both domains.
RATE, RATIO, STRENGTH, INFINITE = 0.8, 0.3, 2.0e6, 5.0e7


def transfer(omega: np.ndarray) -> np.ndarray:
    s = 1j * omega
    return STRENGTH * s / (s**2 + 2.0 * RATIO * RATE * s + RATE**2)


def retardation(time: np.ndarray) -> np.ndarray:
    damped = RATE * np.sqrt(1.0 - RATIO**2)
    decay = np.exp(-RATIO * RATE * time)
    return STRENGTH * decay * (np.cos(damped * time) - RATIO * RATE / damped * np.sin(damped * time))


def database(omega: np.ndarray, **changes: object) -> HydrodynamicDatabase:
    """The closed pair in heave; a heave added mass of infinite frequency that the database itself does not know."""
    count = len(omega)
    added, damping = np.zeros((2, count, 6, 6))
    response = transfer(omega)
    added[:] = 1e7 * np.eye(6)
    added[:, 2, 2] = INFINITE + response.imag / omega
    damping[:, 2, 2] = response.real
    force = np.zeros((1, count, 6), dtype=np.complex128)
    content = {
        "omega": omega,
        "heading": np.zeros(1),
        "depth": np.inf,
        "density": 1025.0,
        "gravity": 9.80665,
        "added_mass": added,
        "radiation_damping": damping,
        "excitation_force": force,
        "froude_krylov_force": force,
        "added_mass_infinite": np.full((6, 6), np.nan),
        "added_mass_zero": np.full((6, 6), np.nan),
        "mean_drift": np.zeros((1, count, 3)),
    }
    return HydrodynamicDatabase(**(content | changes))  # type: ignore[arg-type]


FINE = np.arange(0.05, 12.0, 0.05)


@pytest.fixture(scope="module")
def issc() -> Radiation:
    return radiation(issc_database())


def test_retardation_and_infinite_added_mass_of_a_closed_pair() -> None:
    found = radiation(database(FINE))
    # The closed damping falls as omega^-2 where omega^-3 is assumed, beyond fifteen times its peak: 1 % of K(0), and
    # what that leaves out is slow, so it is in the added mass: 2/pi int_12^inf (1/w² - 1/w³ 12) dw of its 2 zeta w b.
    np.testing.assert_allclose(found.retardation[:, 2, 2], retardation(found.time), atol=0.02 * STRENGTH)
    assert found.added_mass_infinite[2, 2] == pytest.approx(INFINITE, rel=1e-3)
    assert found.pairs.tolist() == [[2, 2]]
    # It is over at 0.2 %: exp(-0.24 t) is that after 26 s.
    assert 20.0 <= found.duration < 32.0


def test_taps_have_the_transfer_function_of_the_closed_pair() -> None:
    memory = convolution_memory(radiation(database(FINE)))
    omega = np.linspace(0.05, 3.0, 60)
    response = frequency_response(memory.discrete(0.1), omega, 0.1)[:, 2, 2]
    # 0.2 % of the peak, STRENGTH / (2 zeta w), is the end of the kernel; the trapezoidal rule is off by h² w K(0) / 12.
    peak = STRENGTH / (2.0 * RATIO * RATE)
    np.testing.assert_allclose(response, transfer(omega), atol=0.008 * peak)


def test_oscillator_with_memory_against_an_ode_solver() -> None:
    """Free decay in heave: the filter of the closed pair is two states of an ordinary differential equation."""
    mass, stiffness = 4.0e7, 3.0e7
    memory = convolution_memory(radiation(database(FINE)))
    body = Body(
        mass=mass,
        centre_of_gravity=np.zeros(3),
        inertia=1e9 * np.eye(3),
        added_mass=np.diag([1e7, 1e7, memory.added_mass[2, 2], 1e7, 1e7, 1e7]),
        displaced_volume=mass / 1025.0,
        centre_of_buoyancy=np.zeros(3),
        waterplane_area=stiffness / (1025.0 * 9.80665),
        waterplane_moments=np.zeros(2),
        gravity=9.80665,
    )
    none = Tendons(
        fairleads=np.zeros((0, 3)), anchors=np.zeros((0, 3)), axial_stiffness=np.zeros(0), pretension=np.zeros(0)
    )
    model = PlatformModel(body=body, tendons=none, free=np.arange(6) == 2, memory=memory)
    state = initial_state(model, [0, 0, 1.0, 0, 0, 0], np.zeros(6), np.zeros(6))
    heave = [1.0]
    for _ in range(600):
        advance(model, state, np.zeros(6), 0.1)
        heave.append(state.position[2])

    def rate(_: float, y: np.ndarray) -> list[float]:
        x, v, p, q = y  # force of the memory b q of q'' + 2 zeta w q' + w² q = v, here p' = q, q as the output
        acceleration = -(stiffness * x + STRENGTH * q) / (mass + INFINITE)
        return [v, acceleration, q, v - 2.0 * RATIO * RATE * q - RATE**2 * p]

    exact = solve_ivp(rate, (0.0, 60.0), [1.0, 0.0, 0.0, 0.0], t_eval=np.arange(601) * 0.1, rtol=1e-10, atol=1e-10).y[0]
    assert np.abs(exact[450:]).max() < 0.8  # the memory does damp
    # As the transfer function: 0.5 % of the start.
    np.testing.assert_allclose(heave, exact, atol=0.005)


def test_ogilvies_relation_holds_on_the_issc_tlp(issc: Radiation) -> None:
    """Added mass at each frequency from damping at all: two results of the panels that know nothing of each other."""
    source = issc_database()
    memory = convolution_memory(issc)
    response = frequency_response(memory.discrete(0.1), source.omega, 0.1)
    added = issc.added_mass_infinite + response.imag / source.omega[:, None, None]
    size = np.sqrt(np.outer(np.diagonal(source.added_mass_zero), np.diagonal(source.added_mass_zero)))
    size[2, :] = size[:, 2] = np.inf  # heave has no limit of zero frequency in water of finite depth
    size[2, 2] = source.added_mass_infinite[2, 2]
    assert np.max(np.abs(added - source.added_mass) / size) < 0.01
    assert issc.disagreement < 0.003
    # The limit of infinite frequency is solved for on its own: 0.5 % is the damping beyond the database.
    limit = source.added_mass_infinite
    assert np.diagonal(issc.added_mass_infinite) == pytest.approx(np.diagonal(limit), rel=0.006)


def test_damping_of_the_taps_is_that_of_the_database(issc: Radiation) -> None:
    source = issc_database()
    response = frequency_response(convolution_memory(issc).discrete(0.1), source.omega, 0.1)
    outer = np.outer(issc.scale, issc.scale)
    # The kernel ends at 0.2 %: its end rounds the sharpest peaks by 2 %.
    assert np.max(np.abs(response.real - source.radiation_damping) / outer) < 0.02
    every = frequency_response(convolution_memory(issc).discrete(0.1), np.linspace(0.0, np.pi / 0.1, 4001), 0.1).real
    lowest = np.linalg.eigvalsh(0.5 * (every + every.transpose(0, 2, 1)) / outer)[:, 0]
    assert lowest.min() > -2e-4  # of the largest damping: what the cut at the end of the kernel may feed in


@pytest.mark.parametrize("step", [0.05, 0.2])
def test_the_memory_does_not_depend_on_the_step(issc: Radiation, step: float) -> None:
    omega = np.linspace(0.1, 1.2, 23)
    memory = convolution_memory(issc)
    outer = np.outer(issc.scale, issc.scale)
    difference = frequency_response(memory.discrete(step), omega, step) - frequency_response(
        memory.discrete(0.1), omega, 0.1
    )
    # h² omega K(0) / 12 of the trapezoidal rule, K(0) being half of the largest damping.
    assert np.max(np.abs(difference) / outer) < 1.2 * 0.2**2 * 0.5 / 12.0 + 5e-4


def test_databases_that_cannot_give_a_memory_are_refused() -> None:
    with pytest.raises(ScenarioError, match="has 3 frequencies; radiation memory needs 8 or more"):
        radiation(database(FINE[:3]))
    good = database(FINE)
    with pytest.raises(ScenarioError, match="does not know added mass and damping"):
        radiation(replace(good, added_mass=good.added_mass * np.nan))
    wrong = good.added_mass.copy()
    wrong[:, 2, 2] += 0.5 * INFINITE * np.sin(FINE)
    with pytest.raises(ScenarioError, match=f"contradict each other.*limit {100 * LARGEST_DISAGREEMENT:g} %"):
        radiation(replace(good, added_mass=wrong))


def test_memory_neither_rings_nor_damps_in_the_tether_modes(issc: Radiation) -> None:
    """At 1.8 s nothing is radiated in heave: period of M + A_inf, and the 2 % of critical damping that was given."""
    memory = convolution_memory(issc)
    body = replace(issc_tlp.body(), added_mass=memory.added_mass)
    model = PlatformModel(body=body, tendons=issc_tlp.tendons(), free=np.arange(6) == 2, memory=memory)
    model = replace(model, linear_damping=damping_from_ratios(model, [0.0, 0.0, 0.02, 0.0, 0.0, 0.0]))
    state = initial_state(model, [0.0, 0.0, 0.01, 0.0, 0.0, 0.0], np.zeros(6), np.zeros(6))
    heave = []
    for _ in range(1000):
        advance(model, state, np.zeros(6), 0.02)
        heave.append(state.position[2])
    omega = np.sqrt(model.stiffness[2, 2] / model.mass[2, 2])
    time = 0.02 * np.arange(1, 1001)
    damped = omega * np.sqrt(1.0 - 0.02**2)
    exact = np.exp(-0.02 * omega * time) * (np.cos(damped * time) + 0.02 * omega / damped * np.sin(damped * time))
    # Eleven periods: what the omega^-3 tail of a damping of nothing may add, and the geometry of the tethers.
    np.testing.assert_allclose(heave, 0.01 * exact, atol=0.005 * 0.01)
