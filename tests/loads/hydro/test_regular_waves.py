"""Waves, memory and mooring in time against the equation of motion in frequency, from the same boundary elements."""

from dataclasses import replace

import numpy as np
import pytest

from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.database import compute
from tlpsim.loads.bem.issc import issc_database, issc_problem
from tlpsim.loads.hydro.diffraction import excitation
from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.radiation import convolution_memory, radiation
from tlpsim.loads.platform.equilibrium import damping_from_ratios
from tlpsim.loads.platform.motion import PlatformModel, advance, initial_state
from tlpsim.loads.waves.field import regular_wave

STEP, DURATION, TRANSIENT, AMPLITUDE = 0.1, 1200.0, 300.0, 0.1
DEGREES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
BOUND = np.array([0.01, 0.01, 0.01, 0.02, 0.02, 0.01])


def platform() -> PlatformModel:
    memory = convolution_memory(radiation(issc_database()))
    body = replace(issc_tlp.body(), added_mass=memory.added_mass)
    undamped = PlatformModel(body=body, tendons=issc_tlp.tendons(), memory=memory)
    return replace(undamped, linear_damping=damping_from_ratios(undamped, issc_tlp.DAMPING_RATIOS))


@pytest.mark.parametrize("period", [8.0, 13.0])
def test_response_is_that_of_the_frequency_domain(period: float) -> None:
    heading = np.radians(35.0)
    wave = regular_wave(amplitude=AMPLITUDE, period=period, heading=heading, water_depth=450.0)
    loads = WaveLoads(
        sea=wave,
        members=replace(issc_members(), drag_coefficient=np.zeros((8, 2))),
        excitation=excitation(issc_database()),
    )
    model = platform()
    rest = np.zeros(6)
    state = initial_state(model, rest, rest, loads.evaluate(0.0, rest, rest).diffraction)
    record = []
    for k in range(1, round(DURATION / STEP) + 1):
        advance(model, state, loads.evaluate(k * STEP, state.position, state.velocity).diffraction, STEP)
        record.append(state.position.copy())
    time = STEP * np.arange(1, len(record) + 1)
    chosen = time > TRANSIENT
    omega = 2.0 * np.pi / period
    # The free motions of the start go on undamped in surge, sway and yaw; a Hann window leaves 1e-4 of them.
    window = np.hanning(int(chosen.sum())) * np.exp(-1j * omega * time[chosen])
    found = 2.0 * window @ np.array(record)[chosen] / np.hanning(int(chosen.sum())).sum() / AMPLITUDE

    panels = compute(replace(issc_problem(), omega=np.array([omega]), heading=np.array([heading])))
    mass = model.mass - model.body.added_mass
    dynamic = -(omega**2) * (mass + panels.added_mass[0]) + model.stiffness
    dynamic = dynamic + 1j * omega * (panels.radiation_damping[0] + model.linear_damping)
    exact = np.linalg.solve(dynamic, panels.excitation_force[0, 0])
    for name, one, other, bound in zip(DEGREES, found, exact, BOUND, strict=True):
        assert abs(one - other) < bound * abs(other), name
