"""The frequency domain: its parts against other methods, and its response against the time domain and published tables.

    .venv/bin/python benchmarks/spectral.py [--quick]

Table I of Li and Kareem (1990) is set beside `scenarios/table_i.toml`, whose inputs were fitted to it
(`benchmarks/fit_table_i.py`), and `scenarios/table_i_issc_hull.toml`, where fewer were. B1 (waves alone) and B3 (wind
and current) are two cases of an independent program of the same theory, whose figures stand below. B1 is also run with
hydrodynamics of a mesh as coarse as that program's, `tests/scenarios/data/issc_tlp_capytaine.nc` (Capytaine 3.0, direct
method, 1576 panels, deep water), which tells what the mesh does.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from report import Row, at_least, at_most, main, within
from spectral_algebra import algebra
from spectral_hermite import hermite

from tlpsim.loads.bem.exchange.capytaine import read_capytaine
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.hydro.diffraction import excitation
from tlpsim.loads.hydro.radiation import convolution_memory, frequency_response, radiation
from tlpsim.loads.platform.body import generalized_force, turned_matrix
from tlpsim.loads.platform.equilibrium import damping_from_ratios
from tlpsim.loads.platform.motion import tangent_stiffness
from tlpsim.loads.simulation import simulate, start
from tlpsim.loads.spectral.model import SpectralModel, SpectralWaves
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.loads.spectral.response import respond
from tlpsim.loads.spectral.wave_grid import GridSea, acting_density
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.orchestrator.clock import to_seconds
from tlpsim.scenarios.compare import Comparison, compare
from tlpsim.scenarios.monolithic import twin
from tlpsim.scenarios.paper import TABLE_I
from tlpsim.scenarios.schema import Scenario
from tlpsim.scenarios.spectral import spectral_model, spectral_response
from tlpsim.scenarios.statistics.bands import BAND_EDGES, band_statistics
from tlpsim.scenarios.statistics.summary import TABLE_UNITS

FloatArray = NDArray[np.float64]

HERE = Path(__file__).parent
SCENARIOS, CASES = HERE.parent / "scenarios", HERE.parent / "tests" / "scenarios" / "data"
HORIZONTAL_BOUNDS = {"mean": 2.0, "low_frequency": 7.0, "wave_frequency": 2.0}
VERTICAL_BOUNDS = {"mean": 5.0, "low_frequency": 8.0, "wave_frequency": 8.0}
WORDS = {"mean": "mean", "low_frequency": "below 0.022 Hz", "wave_frequency": "0.022 to 0.2 Hz"}
FACTORS = np.array([factor for _, factor in TABLE_UNITS.values()])
# In table units, by frequency and by time domain: spreads of B1 in the wave band, means and slow spreads of B3.
B1 = np.array([0.7526, 0.3265, 0.4396, 0.7449, 1.0132, 0.3527]), np.array([0.754, 0.327, 0.449, 0.745, 1.010, 0.350])
B3_MEAN = np.array([6.934, 4.812, -8.781, 2.659, 3.108, 1.889])
B3_LOW = np.array([0.936, 0.494, 2.157, 1.053, 0.790, 0.472]), np.array([0.934, 0.493, 2.182, 1.066, 0.797, 0.471])


def linear(quick: bool) -> list[Row]:
    """Waves without drag and drift against the integral of the response amplitude operator."""
    # Without the air, which damps the platform's motion a little where it is still.
    model = dataclasses.replace(spectral_model(Scenario.load(CASES / "b1.toml")), wind=None)
    response = respond(model)
    waves = model.waves
    assert waves is not None
    found = [np.trapezoid(row, response.frequency) for row in response.contributions["waves"].T]
    exact = _rao_integral(model, waves, response, 8)
    error = float(np.max(np.abs(np.sqrt(found / exact) - 1.0)))
    return [at_most("linear case: spreads against the RAO integral on 8 times finer steps, worst", error, 1e-6)]


def _rao_integral(model: SpectralModel, waves: SpectralWaves, response: SpectralResponse, finer: int) -> FloatArray:
    """∫ |Z^-1 X|² S df about the mean position, in rates and loads of the hull alone, (6,)."""
    platform, pose = model.platform, response.mean_position
    step = response.frequency[1] / finer
    frequency = step * np.arange(1, int(1.1 * waves.state.highest_frequency / step) + 1)
    omega = 2.0 * np.pi * frequency
    heading = np.full(len(omega), waves.state.heading)
    depth, gravity = waves.state.water_depth, waves.state.gravity
    number = wavenumber(omega, depth, gravity)
    sea = GridSea(angular_frequency=omega, wavenumber=number, heading=heading, water_depth=depth, gravity=gravity)
    assert waves.excitation is not None
    force = waves.excitation(sea)
    memory = frequency_response(platform.memory.discrete(model.step), omega, model.step)
    stiffness = tangent_stiffness(platform, pose)
    loads = np.column_stack([generalized_force(unit, pose) for unit in np.eye(6)])
    mass, damping = (turned_matrix(each, float(pose[5])) for each in (platform.mass, platform.linear_damping))
    variance = np.zeros(6)
    for n, at in enumerate(omega):
        whole = stiffness - at**2 * mass + 1j * at * (damping + turned_matrix(memory[n], float(pose[5])))
        motion = np.linalg.solve(whole, loads @ force[:, n])
        variance += step * np.abs(motion) ** 2 * acting_density(waves, frequency[n : n + 1])[0]
    return variance


def table_i(quick: bool) -> list[Row]:
    """The paper's example: both domains, and both against the paper."""
    rows = _domains("table_i.toml", quick, True)
    return rows + ([] if quick else _domains("table_i_issc_hull.toml", quick, False))


def _domains(name: str, quick: bool, bound: bool) -> list[Row]:
    records = 4 if quick else 24
    found = compare(Scenario.load(SCENARIOS / name), records)
    rows = []
    by_name = found.by_name()
    for k, degree in enumerate(DEGREES_OF_FREEDOM):
        limits = HORIZONTAL_BOUNDS if degree in ("surge", "sway", "yaw") else VERTICAL_BOUNDS
        for statistic, words in WORDS.items():
            row = by_name[f"position.{degree}", statistic]
            item = f"{name}, {records} × 3 h: {degree}, {words}, frequency over time domain"
            error = 100.0 * (row.ratio - 1.0)
            limit = limits[statistic]
            text = f"{error:+.1f} % ({FACTORS[k] * row.frequency:.3f}, {FACTORS[k] * row.time:.3f}"
            text += f" ± {FACTORS[k] * row.error:.2g})"
            # What the records' own scatter hides is no error of the method.
            own = 200.0 * abs(row.error / row.time)
            ok = abs(error) <= limit + (own if quick else 0.0) if bound else None
            rows.append(Row(item=item, measured=text, bound=f"± {limit:g} %" if bound else "", ok=ok))
    for k, degree in enumerate(DEGREES_OF_FREEDOM):
        for statistic, words in WORDS.items():
            row = by_name[f"position.{degree}", statistic]
            theirs = TABLE_I[degree][statistic]
            for domain, value in (("frequency", row.frequency), ("time", row.time)):
                away = nearest(float(FACTORS[k] * value), theirs)
                item = f"{name}, {domain} domain against the paper's Table I: {degree}, {words}"
                text = f"{100.0 * away:+.1f} % ({FACTORS[k] * value:.3f}; {theirs[0]:g}, {theirs[1]:g})"
                ok = abs(away) <= 0.15 if bound else None
                rows.append(Row(item=item, measured=text, bound="± 15 %" if bound else "", ok=ok))
    return rows + (_times(found) if bound else [])


def nearest(value: float, columns: tuple[float, float]) -> float:
    """Relative distance from the nearer of two columns, zero between them."""
    low, high = sorted(abs(column) for column in columns)
    size = abs(value)
    return size / low - 1.0 if size < low else max(size / high - 1.0, 0.0)


def _times(found: Comparison) -> list[Row]:
    times = found.times
    fmus = compare(found.scenario, 2, cosimulation=True).times
    spread = spectral_response(found.scenario.with_(waves={"directions": 15}))
    rows = [
        at_most("one analysis of table_i.toml", times.frequency_domain, 1.0, "s"),
        Row(item="one analysis with 15 directions", measured=f"{sum(spread.seconds.values()):.1f} s"),
        Row(item="a record of 3 h, twin; as FMUs", measured=f"{times.record:.2f}; {fmus.record:.2f} s"),
        Row(
            item=f"records for ± 2 % on the slowest spread ({times.scattered})", measured=f"{times.records_needed:.0f}"
        ),
        at_least("time of these records, twin over frequency domain", times.ratio, 10.0, "×", ".0f"),
    ]
    ratio = times.records_needed * fmus.record / times.frequency_domain
    return [*rows, at_least("time of these records, FMUs over frequency domain", ratio, 50.0, "×", ".0f")]


def cases(quick: bool) -> list[Row]:
    """The independent program's cases B1 and B3, by both domains."""
    rows = []
    records = 2 if quick else 16
    first = Scenario.load(CASES / "b1.toml")
    model = spectral_model(first)
    times = _records(first, records)
    coarse = respond(_with_capytaine(model, first))
    for k, degree in enumerate(DEGREES_OF_FREEDOM):
        ours = FACTORS[k] * respond_spread(respond(model), degree)
        item = f"B1, {degree}, 0.022 to 0.2 Hz"
        rows.append(within(f"{item}, frequency domain", float(ours), float(B1[0][k]), 0.03))
        again = FACTORS[k] * respond_spread(coarse, degree)
        nearer = float(B1[0][k] if abs(again - B1[0][k]) < abs(again - B1[1][k]) else B1[1][k])
        rows.append(within(f"{item}, with that program's hydrodynamics", float(again), nearer, 0.01))
        rows.append(within(f"{item}, time domain", float(times[2][k]), float(B1[1][k]), 0.03))
    second = Scenario.load(CASES / "b3.toml")
    response = spectral_response(second)
    mean, low = earth_roll(response)
    times = _records(second, records)
    for k, degree in enumerate(DEGREES_OF_FREEDOM):
        rows.append(within(f"B3, {degree}, mean, frequency domain", float(mean[k]), float(B3_MEAN[k]), 0.02))
        rows.append(within(f"B3, {degree}, mean, time domain", float(times[0][k]), float(B3_MEAN[k]), 0.02))
        item = f"B3, {degree}, below 0.022 Hz"
        rows.append(within(f"{item}, frequency domain", float(low[k]), float(B3_LOW[0][k]), 0.02))
        own = 0.0 if not quick else 0.1
        rows.append(within(f"{item}, time domain", float(times[1][k]), float(B3_LOW[1][k]), 0.02 + own))
    return rows


def respond_spread(response: SpectralResponse, degree: str) -> float:
    return response.quantities[f"position.{degree}"].spread(*BAND_EDGES)


def earth_roll(response: SpectralResponse) -> tuple[FloatArray, FloatArray]:
    """Means and low-frequency spreads in table units, with roll about the earth's x axis, as the other program's."""
    roll, pitch, yaw = response.mean_position[3:]
    change = np.eye(6)
    change[3, 3:] = np.cos(yaw), -np.sin(yaw), -roll * np.sin(yaw) - pitch * np.cos(yaw)
    mean = response.mean_position.copy()
    mean[3] = roll * np.cos(yaw) - pitch * np.sin(yaw)
    low = response.frequency <= BAND_EDGES[0]
    density = np.einsum("ij,fjk,ik->fi", change, response.cross_spectrum[low], change).real
    return FACTORS * mean, FACTORS * np.sqrt(np.trapezoid(density, response.frequency[low], axis=0))


def _records(scenario: Scenario, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and spreads in both bands over records of 3 h of the twin, in table units, roll about the earth's x axis."""
    found = []
    for seed in range(1, count + 1):
        whole = twin(scenario.with_(simulation={"seed": seed, "duration": 11400.0}))
        state = start(whole.model, whole.position, whole.velocity, whole.intact)
        step = to_seconds(whole.step)
        records = list(simulate(whole.model, state, step=step, steps=round(11400.0 / step)))
        position = np.concatenate([record.position for record in records])
        roll, pitch, yaw = position[:, 3:].T
        position[:, 3] = roll * np.cos(yaw) - pitch * np.sin(yaw)
        time = step * np.arange(len(position))
        each = [band_statistics(time, column, start=600.0) for column in position.T]
        found.append([[row.mean, row.low_frequency, row.wave_frequency] for row in each])
    values = np.array(found)
    spreads = np.sqrt(np.mean(values[..., 1:] ** 2, axis=0))
    return FACTORS * values[..., 0].mean(axis=0), FACTORS * spreads[:, 0], FACTORS * spreads[:, 1]


def _with_capytaine(model: SpectralModel, scenario: Scenario) -> SpectralModel:
    """B1 with the hydrodynamics of the other program."""
    database = read_capytaine(CASES / "issc_tlp_capytaine.nc", np.inf)
    memory = convolution_memory(radiation(database))
    body = dataclasses.replace(model.platform.body, added_mass=memory.added_mass)
    undamped = dataclasses.replace(model.platform, body=body, memory=memory, linear_damping=np.zeros((6, 6)))
    damping = damping_from_ratios(undamped, scenario.platform.damping_ratios)
    assert model.waves is not None
    return dataclasses.replace(
        model,
        platform=dataclasses.replace(undamped, linear_damping=damping),
        waves=dataclasses.replace(model.waves, excitation=excitation(database)),
    )


if __name__ == "__main__":
    main("Frequency domain", [hermite, algebra, linear, table_i, cases])
