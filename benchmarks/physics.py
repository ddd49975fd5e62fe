"""Physics in the FMUs against the boundary element solution in the frequency domain.

    .venv/bin/python benchmarks/physics.py [--quick]

Regular waves run through the whole chain of FMUs (one harmonic component, drag coefficients zero) and are compared with
the motions that the equation of motion gives with the coefficients solved at that very frequency. Every component steps
by 0.1 s in it; what longer steps of the waves cost is in benchmarks/chain.py.
"""

from __future__ import annotations

import dataclasses
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from displaced_position import displaced_position
from numpy.typing import NDArray
from report import Row, at_least, at_most, main

from tlpsim.fmus.platform_fmu import TlpsimPlatform, platform_model
from tlpsim.fmus.tables import record_to_json
from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.database import compute, write
from tlpsim.loads.bem.issc import issc_database, issc_problem
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.filters.convolution import kernel_response
from tlpsim.loads.filters.model import spectrum
from tlpsim.loads.hydro.diffraction import excitation, excitation_transfer
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.radiation import convolution_memory, frequency_response, radiation
from tlpsim.loads.hydro.state_space import state_space_memory
from tlpsim.loads.platform.memory import Memory
from tlpsim.loads.platform.motion import PlatformModel, advance, initial_state
from tlpsim.loads.waves.elevation import ArmaSea, transition
from tlpsim.loads.waves.sea import SeaState
from tlpsim.scenarios.assemble import wave_loads, wind_loads
from tlpsim.scenarios.results import Results
from tlpsim.scenarios.run import run_scenario
from tlpsim.scenarios.schema import Scenario

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PERIODS = (6.0, 7.0, 8.0, 9.0, 11.0, 13.0, 15.0, 18.0)
HEADINGS = (0.0, 35.0)
BOUNDS = dict(zip(DEGREES_OF_FREEDOM, (1.0, 1.0, 1.0, 2.0, 2.0, 1.0), strict=True))
AMPLITUDE = 0.1
DURATION, TRANSIENT = 1600.0, 300.0
DECAY_PERIODS = (104.0, 104.0, 1.82, 1.92, 1.92, 83.0)  # s
DECAY_AMPLITUDES = np.array([1.0, 1.0, 0.01, 1e-4, 1e-4, 0.01])  # m, rad
WIND_BOXES = [{"position": [10.0, -10.0, 40.0], "size": [90.0, 60.0, 12.0], "shape_coefficient": 1.2}]
SMALL = 0.05  # of the largest motion over the periods: below it a relative error says little


def platform(kind: str) -> PlatformModel:
    """The built-in platform FMU's model with a kind of radiation memory."""
    defaults = {variable.name: variable.start for variable in TlpsimPlatform.table}
    return platform_model((defaults | {"radiation": kind}).__getitem__)


def regular_wave(folder: Path, period: float, heading: float, kind: str) -> tuple[float, ComplexArray]:
    """Frequency (rad/s) of a regular wave through the FMUs, and the motions (6,) a unit amplitude of it."""
    database = folder / "issc.h5"
    if not database.exists():
        write(issc_database(), database)
    frequency, half = 1.0 / period, 1e-4 / period
    members = dataclasses.replace(issc_members(), drag_coefficient=np.zeros((8, 2)))
    density = AMPLITUDE**2 / 2.0 / (2.0 * half)
    scenario = Scenario.from_dict(
        {
            "simulation": {"duration": DURATION, "start": "rest"},
            "platform": {"hydrodynamics": str(database), "radiation": kind},
            "waves": {
                "generator": "harmonic",
                "components": 1,
                "heading_deg": heading,
                "frequency_min": frequency - half,
                "frequency_max": frequency + half,
                "drift": "none",
                "splash": False,
                "table": {
                    "frequency": [frequency - 3.0 * half, frequency, frequency + 3.0 * half],
                    "density": [density, 1.0001 * density, density],
                },
            },
            "current": {"speed": 0.0},
            "components": {
                "wind": {"fmu": ""},
                "wave": {"step": 0.1, "parameters": {"members": record_to_json(members)}},
            },
        }
    )
    results = run_scenario(scenario, folder / "r.h5")
    times = results.time("platform")
    chosen = times >= TRANSIENT
    loads = wave_loads(scenario)
    assert loads is not None
    omega = float(loads.sea.angular_frequency[0])
    wave = loads.sea.amplitudes(0.0)[0]
    window = np.hanning(int(chosen.sum()))
    phase = window * np.exp(-1j * omega * times[chosen])
    motion = np.array(
        [
            2.0 * np.sum(phase * results.signal(f"platform.position.{name}")[chosen]) / window.sum()
            for name in DEGREES_OF_FREEDOM
        ]
    )
    return omega, motion / wave


def response(quick: bool) -> list[Row]:
    """Regular-wave response of the chain against the response at that frequency."""
    periods, headings = (PERIODS[1::4], HEADINGS[1:]) if quick else (PERIODS, HEADINGS)
    model = platform("convolution")
    mass = model.mass - model.body.added_mass
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for heading in headings:
            found, exact = [], []
            for period in periods:
                omega, motion = regular_wave(Path(name), period, heading, "convolution")
                at = dataclasses.replace(issc_problem(), omega=np.array([omega]), heading=np.radians([heading]))
                panels = compute(at)
                dynamic = -(omega**2) * (mass + panels.added_mass[0]) + model.stiffness
                dynamic = dynamic + 1j * omega * (panels.radiation_damping[0] + model.linear_damping)
                found.append(motion)
                exact.append(np.linalg.solve(dynamic, panels.excitation_force[0, 0]))
            rows += response_rows(periods, heading, np.array(found), np.array(exact))
    return rows


def response_rows(periods: Sequence[float], heading: float, found: ComplexArray, exact: ComplexArray) -> list[Row]:
    rows = []
    for index, name in enumerate(DEGREES_OF_FREEDOM):
        size = np.abs(exact[:, index])
        if size.max() < 1e-9:
            continue
        error = 100.0 * np.abs(np.abs(found[:, index]) - size) / np.maximum(size, SMALL * size.max())
        worst = int(np.argmax(error))
        item = f"regular waves, {heading:g}°, {name}, worst of {len(periods)} periods (T = {periods[worst]:g} s)"
        rows.append(at_most(item, float(error[worst]), BOUNDS[name], "%"))
    return rows


def force_spectrum(quick: bool) -> list[Row]:
    """Standard deviation of the first-order force: response of the kernels, and transfer function times spectrum."""
    database = issc_database()
    worst = dict.fromkeys(DEGREES_OF_FREEDOM, (0.0, ""))
    frequency = np.linspace(1e-4, 0.999, 8000)
    for period in (14.5,) if quick else (8.0, 11.0, 14.5, 17.0):
        for heading in (22.5,) if quick else (0.0, 22.5, 45.0, 100.0):
            state = SeaState(
                spectrum="pierson_moskowitz",
                significant_height=7.0,
                peak_period=period,
                heading=np.radians(heading),
                water_depth=450.0,
            )
            sea = ArmaSea(state, reach=100.0)
            gain = kernel_response(sea.kernels(excitation(database)(sea)), frequency, sea.sampling_step, sea.half)
            made = spectrum(sea.model, frequency)[:, 0, 0].real
            headings = np.full(len(frequency), state.heading)
            transfer = excitation_transfer(database, 2.0 * np.pi * frequency, headings, 450.0)
            wanted = state.density(frequency) * transition(frequency, state.highest_frequency) ** 2
            found, exact = np.sqrt(np.abs(gain.T) ** 2 @ made), np.sqrt(np.abs(transfer) ** 2 @ wanted)
            for name, one, other in zip(DEGREES_OF_FREEDOM, found, exact, strict=True):
                if other > 1e-3 * exact[3 if name in ("roll", "pitch", "yaw") else 0 : None].max():
                    worst[name] = max(worst[name], (100.0 * abs(one / other - 1.0), f"Tp {period:g} s, {heading:g}°"))
    return [
        at_most(f"force spectrum from kernels, standard deviation, {name} ({case})", error, 1.0, "%")
        for name, (error, case) in worst.items()
    ]


def ogilvie(quick: bool) -> list[Row]:
    """Added mass from damping at all frequencies against that of the panels, and the limit solved on its own."""
    database = issc_database()
    found = radiation(database)
    response = frequency_response(convolution_memory(found).discrete(0.1), database.omega, 0.1)
    added = found.added_mass_infinite + response.imag / database.omega[:, None, None]
    rows = []
    for mode, name in ((0, "A11"), (2, "A33"), (4, "A55"), (5, "A66")):
        limit = database.added_mass_infinite[mode, mode]
        error = 100.0 * np.max(np.abs(added[:, mode, mode] - database.added_mass[:, mode, mode])) / limit
        rows.append(at_most(f"Ogilvie's relation at every frequency, {name}", float(error), 1.0, "%"))
        apart = 100.0 * abs(found.added_mass_infinite[mode, mode] / limit - 1.0)
        # The panels' own coefficients are known to their error bars only.
        bar = 100.0 * database.error["added_mass_infinite"][mode, mode] / limit
        rows.append(at_most(f"infinite-frequency {name} by it against that of the panels", apart, float(bar), "%"))
    return rows


def filters(quick: bool) -> list[Row]:
    """The state-space memory against the convolution: transfer function, passivity, free decay; time of a step."""
    found = radiation(issc_database())
    began = time.perf_counter()
    kinds = {"convolution": convolution_memory(found), "state_space": state_space_memory(found)}
    memory = kinds["state_space"]
    rows = [
        Row(
            item="state space: orders, time of the fit",
            measured=f"{memory.orders}, {time.perf_counter() - began:.1f} s",
        ),
        at_most("state space: rms error of the transfer function", 100.0 * memory.error, 2.0, "%"),
    ]
    omega = np.concatenate([np.arange(0.0, 5.0, 0.0005), np.geomspace(5.0, 1e4, 2000)])
    damping = memory.response(omega).real / np.outer(found.scale, found.scale)
    lowest = np.linalg.eigvalsh(0.5 * (damping + damping.transpose(0, 2, 1)))[:, 0].min()
    rows.append(at_least("state space: smallest damping at any frequency, of the largest", float(lowest), 0.0))
    for degree, (name, period) in enumerate(zip(DEGREES_OF_FREEDOM, DECAY_PERIODS, strict=True)):
        records = [decay(kind, degree, 5.0 * period) for kind in kinds.values()]
        difference = np.sqrt(np.mean((records[1] - records[0]) ** 2) / np.mean(records[0] ** 2))
        rows.append(at_most(f"free decay, {name}, 5 periods: state space - convolution", 100.0 * difference, 0.5, "%"))
    for kind in ("convolution", "state_space", "none"):
        model = platform(kind)
        state = initial_state(model, np.zeros(6), np.zeros(6), np.zeros(6))
        advance(model, state, np.zeros(6), 0.1)
        began = time.perf_counter()
        for _ in range(10_000):
            advance(model, state, np.full(6, 1e5), 0.1)
        rows.append(
            Row(item=f"step of 0.1 s, radiation {kind}", measured=f"{(time.perf_counter() - began) * 100:.1f} µs")
        )
    return rows


def decay(memory: Memory, degree: int, duration: float) -> FloatArray:
    """Free decay of one degree of freedom, the others held."""
    free = np.arange(6) == degree
    body = dataclasses.replace(issc_tlp.body(), added_mass=memory.added_mass)  # type: ignore[attr-defined]
    model = PlatformModel(body=body, tendons=issc_tlp.tendons(), free=free, memory=memory)
    state = initial_state(model, np.where(free, DECAY_AMPLITUDES, 0.0), np.zeros(6), np.zeros(6))
    record = []
    for _ in range(round(duration / 0.1)):
        advance(model, state, np.zeros(6), 0.1)
        record.append(state.position[degree])
    return np.array(record)


def wind(quick: bool) -> list[Row]:
    """Decompositions of the wind force against its square, and yaw-dependent areas, in hours of the default storm.

    The platform moves as it does in that storm. The force is along the wind, so that surge and sway differ alike. What
    "expanded" leaves out, D (v² - 2 u v), is (v² + 2 u v) / U² of the mean at most, and v / U of the spread: with v of
    0.3 m/s, u of 3 m/s and U of 30 m/s rms 0.2 and 1 %. The moment has the same bounds at arms of the same size. What
    "linear" leaves out, u² - sigma², changes the spread by the skewness that the gusts of an hour happen to have.
    """
    seeds, duration = ((1,), 600.0) if quick else (range(1, 11), 3600.0)
    cases = {
        "expanded against full": ({"decomposition": "expanded"}, {}),
        "linear against full": ({"decomposition": "linear"}, {}),
        "deck of 90 × 60 m at its yaw, against at zero yaw": (
            {"boxes": WIND_BOXES},
            {"boxes": WIND_BOXES, "yaw_dependent_area": False},
        ),
    }
    changes: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as name:
        for seed in seeds:
            scenario = Scenario.from_dict({"simulation": {"duration": 600.0 + duration, "seed": seed}})
            results = run_scenario(scenario, Path(name) / "r.h5", monolithic=True)
            for case, settings in cases.items():
                one, other = (wind_forces(scenario.with_(wind=each), results) for each in settings)
                for statistic, word in ((np.mean, "mean"), (np.std, "standard deviation")):
                    for column, degrees in ((0, "surge and sway"), (5, "yaw")):
                        change = 100.0 * float(statistic(one[:, column]) / statistic(other[:, column]) - 1.0)
                        changes.setdefault(f"{case}: {word}, {degrees}", []).append(change)
    rows = []
    for item, found in changes.items():
        worst = max(found, key=abs)
        item = f"wind, largest of {len(seeds)} × {duration:g} s, {item}"
        bound = 0.2 if "mean" in item else 1.0
        bounded = at_most(item, abs(worst), bound, "%")
        rows.append(bounded if "expanded" in item else Row(item=item, measured=f"{worst:+.3f} %"))
    return rows


def wind_forces(scenario: Scenario, results: Results) -> FloatArray:
    """Wind force every 0.5 s after ten minutes, (m, 6) N, N·m, of a scenario on the platform that `results` has."""
    loads = wind_loads(scenario)
    assert loads is not None
    times, yaw = results.time("platform"), results.signal("platform.position.yaw")
    velocity = np.column_stack([results.signal(f"platform.velocity.{degree}") for degree in DEGREES_OF_FREEDOM])
    chosen = np.flatnonzero(times >= 600.0)[::5]
    return np.array([loads.evaluate(float(times[k]), velocity[k], float(yaw[k])) for k in chosen])


def storm(quick: bool) -> list[Row]:
    """The default storm with drag, current, wind, diffraction and radiation."""
    duration = 1800.0 if quick else 10800.0
    rows = []
    with tempfile.TemporaryDirectory() as name:
        run_scenario(Scenario.from_dict({"simulation": {"duration": 60.0}}), Path(name) / "r.h5")
        for kind in ("convolution",) if quick else ("convolution", "state_space", "none"):
            scenario = Scenario.from_dict({"simulation": {"duration": duration}, "platform": {"radiation": kind}})
            began = time.perf_counter()
            run_scenario(scenario, Path(name) / "r.h5")
            speed = duration / (time.perf_counter() - began)
            rows.append(at_least(f"storm of {duration:g} s, radiation {kind}", speed, 500.0, "× real time", ".0f"))
    return rows


if __name__ == "__main__":
    main("Physics of the FMUs", [response, force_spectrum, ogilvie, filters, displaced_position, wind, storm])
