"""Slow drift in time against the double sum and the bi-spectral integral; wave drift damping.

.venv/bin/python benchmarks/drift.py [--quick]
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Collection, Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from report import Row, at_most, main
from scipy import stats

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hulls import issc_hull, lid, tlp
from tlpsim.loads.bem.issc import issc_database
from tlpsim.loads.bem.quadratic import quadratic_part
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.bem.surface import hull_surface, surface_fields
from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.filters.convolution import kernel_response
from tlpsim.loads.filters.model import spectrum
from tlpsim.loads.hydro.drift import (
    Kernel,
    Waves,
    drift_spectrum,
    newman_kernel,
    quadratic_kernel,
    wave_drift_damping,
)
from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.quadratic_filters import (
    DriftFilters,
    drift_force,
    newman_filters,
    quadratic_filters,
)
from tlpsim.loads.waves.elevation import ArmaSea, transition, voids
from tlpsim.loads.waves.field import wave_components
from tlpsim.loads.waves.sea import Sea, SeaState

FloatArray = NDArray[np.float64]

STORM = SeaState(
    spectrum="pierson_moskowitz",
    significant_height=7.1,
    peak_period=14.5,
    heading=np.radians(21.6),
    water_depth=450.0,
    highest_frequency=0.25,
)
SPREAD = dataclasses.replace(STORM, directions=5, spreading_exponent=10.0)
REACH = 91.0  # m
RECORDS, DURATION, STEP = 24, 10800.0, 1.0  # s
LOW = 0.022  # Hz, end of the low frequencies of the published statistics
PANEL = 5.0  # m
BAND = (0.15, 1.75)  # rad/s
OMEGA_STEP = 0.02  # rad/s
MEAN_BOUND, SPREAD_BOUND = 2.0, 5.0  # %
LEVEL = 0.9973  # of confidence, where a bound is the standard error of the records
NAMED = {0: "surge", 1: "sway", 5: "yaw"}


@lru_cache
def database() -> HydrodynamicDatabase:
    return issc_database()


@lru_cache
def transfer(directions: int) -> QuadraticTransfer:
    """Quadratic part for the fixed ISSC hull by pressure, with all pairs of the sea's headings."""
    mesh = tlp(issc_hull(), PANEL)
    body = discretize(mesh, STORM.water_depth, lid(mesh, 2))
    hull = hull_surface(body)
    omega = np.arange(BAND[0], BAND[1], OMEGA_STEP)
    heading = dataclasses.replace(SPREAD, directions=directions).spread().heading
    still = np.zeros((directions, 6), dtype=np.complex128)
    fields = [
        surface_fields(body, solve(body, float(each), heading, 1025.0, STORM.gravity), still, hull) for each in omega
    ]
    table = np.empty((directions, directions, len(omega), len(omega), 6), dtype=np.complex128)
    for i, first in enumerate(fields):
        for j, second in enumerate(fields[: i + 1]):
            part = quadratic_part(first, second, "pressure")
            table[:, :, i, j] = part
            table[:, :, j, i] = np.swapaxes(part, 0, 1).conj()
    return QuadraticTransfer(omega=omega, heading=heading, transfer=table)


def of_one_heading(table: QuadraticTransfer) -> QuadraticTransfer:
    """What a table without pairs of headings knows."""
    return dataclasses.replace(table, transfer=np.einsum("aa...->a...", table.transfer))


def record(filters: DriftFilters, sea: Sea) -> FloatArray:
    """Force (times, 6) of one record."""
    times = STEP * np.arange(round(DURATION / STEP))
    return np.concatenate(
        [drift_force(filters, np.array([sea.amplitudes(t) for t in block])) for block in np.array_split(times, 12)]
    )


def statistics(force: FloatArray) -> FloatArray:
    """Mean, and spreads below and above the limit of low frequencies, (3, 6)."""
    lines = np.fft.rfft(force, axis=0) / len(force)
    energy = 2.0 * np.abs(lines[1:]) ** 2
    frequency = np.fft.rfftfreq(len(force), STEP)[1:]
    low = frequency < LOW
    return np.array([lines[0].real, np.sqrt(energy[low].sum(axis=0)), np.sqrt(energy[~low].sum(axis=0))])


def against_theory(
    text: str,
    expected: FloatArray,
    found: FloatArray,
    bounds: tuple[float, ...],
    quick: bool,
    axes: Mapping[int, str] = NAMED,
    small_means: Collection[str] = (),
) -> list[Row]:
    """Statistics of records (records, k, 6) against theory (k, 6), k leading ones of those of `statistics`.

    `bounds` are in % of theory, or of the standard error of a few records where `quick`; `small_means` names the axes
    whose mean is next to nothing beside its spread.
    """
    count = len(found)
    mean, error = found.mean(axis=0), found.std(axis=0, ddof=1) / np.sqrt(count)
    within = float(stats.t.ppf(0.5 + 0.5 * LEVEL, count - 1))
    names = ("mean", f"spread below {LOW} Hz", f"spread above {LOW} Hz")
    rows = []
    for axis, name in axes.items():
        for k, limit in enumerate(bounds):
            item = f"{text}, {name}: {names[k]}, {expected[k, axis]:.4g}"
            if name in small_means and k == 0:
                off = abs(mean[k, axis] - expected[k, axis]) / error[k, axis]
                rows.append(at_most(f"{item}; off by standard errors", off, within))
                continue
            off = 100.0 * (mean[k, axis] / expected[k, axis] - 1.0)
            spread = 100.0 * error[k, axis] / abs(expected[k, axis])
            bound = max(limit, within * spread) if quick else limit
            ok = abs(off) <= bound
            rows.append(Row(item=item, measured=f"{off:+.2f} ± {spread:.2f} %", bound=f"± {bound:.3g} %", ok=bool(ok)))
    return rows


def compared(text: str, filters: DriftFilters, kernel: Kernel, state: SeaState, quick: bool) -> list[Row]:
    """Records of the filters against eqs. (2) and (3) of `tlpsim.loads.hydro.drift`."""
    count = 4 if quick else RECORDS
    coarse = 1e-3 if len(state.spread().share) == 1 else 2e-3
    theory = drift_spectrum(kernel, state, coarse)
    expected = np.array([theory.mean, theory.spread(0.0, LOW), theory.spread(LOW)])
    forces = [record(filters, ArmaSea(state, reach=REACH, seed=seed)) for seed in range(1, count + 1)]
    found = np.array([statistics(force) for force in forces])
    rows = against_theory(text, expected, found, (MEAN_BOUND, SPREAD_BOUND, SPREAD_BOUND), quick, small_means=("yaw",))
    surge = np.concatenate([force[:, 0] for force in forces])
    skew = float(np.mean((surge - surge.mean()) ** 3) / surge.std() ** 3)
    rows.append(Row(item=f"{text}, surge: skewness", measured=f"{skew:.3f}", bound="> 0", ok=skew > 0.0))
    return rows


def newman_records(quick: bool) -> list[Row]:
    rows = []
    for mean in ("arithmetic", "geometric"):
        filters = newman_filters(database(), ArmaSea(STORM, reach=REACH), mean)
        rows += compared(f"Newman {mean}, filters", filters, newman_kernel(database(), mean), STORM, quick)
    return rows


def table_records(quick: bool) -> list[Row]:
    kernel = quadratic_kernel(transfer(1))
    filters = quadratic_filters(kernel, ArmaSea(STORM, reach=REACH), STORM)
    rows = compared("QTF, filters", filters, kernel, STORM, quick)
    for each in filters.certificate:
        rows.append(
            Row(
                item=f"QTF, {each.component}: terms of {each.order}; share of mean, of spread; error left",
                measured=f"{each.terms}; {each.mean_share:.4f}, {each.spread_share:.5f}; {each.error:.1e}",
            )
        )
    return rows


def spread_records(quick: bool) -> list[Row]:
    """Five directions, all pairs; then what tables of one heading make of it."""
    kernel = quadratic_kernel(transfer(SPREAD.directions))
    filters = quadratic_filters(kernel, ArmaSea(SPREAD, reach=REACH), SPREAD)
    rows = compared("QTF of pairs, 5 directions", filters, kernel, SPREAD, quick)
    newman = newman_filters(database(), ArmaSea(SPREAD, reach=REACH))
    rows += compared("Newman, 5 directions", newman, newman_kernel(database()), SPREAD, quick)
    exact = drift_spectrum(kernel, SPREAD, 2e-3)
    rough = drift_spectrum(quadratic_kernel(of_one_heading(transfer(SPREAD.directions))), SPREAD, 2e-3)
    ratio = rough.spread(0.0, LOW) / exact.spread(0.0, LOW)
    for axis, name in enumerate(DEGREES_OF_FREEDOM):
        rows.append(
            Row(item=f"tables of one heading for pairs: {name}, spread below {LOW} Hz", measured=f"x {ratio[axis]:.2f}")
        )
    return rows


def harmonic_records(quick: bool) -> list[Row]:
    """A sum of harmonic components; each record has its own frequencies, hence its own filters."""
    kernel = newman_kernel(database())
    theory = drift_spectrum(kernel, STORM, 1e-3)
    count = 4 if quick else RECORDS
    found = []
    for seed in range(1, count + 1):
        sea = wave_components(STORM, count=400, seed=seed)
        found.append(statistics(record(newman_filters(database(), sea), sea)))
    mean = np.mean(found, axis=0)
    error = np.std(found, axis=0, ddof=1) / np.sqrt(count)
    rows = []
    for k, (what, expected) in enumerate((("mean", theory.mean), (f"spread below {LOW} Hz", theory.spread(0.0, LOW)))):
        off, spread = 100.0 * (mean[k, 0] / expected[0] - 1.0), 100.0 * error[k, 0] / expected[0]
        bound = max(
            (MEAN_BOUND, SPREAD_BOUND)[k], float(stats.t.ppf(0.5 + 0.5 * LEVEL, count - 1)) * spread if quick else 0.0
        )
        rows.append(
            Row(
                item=f"Newman, harmonic sea, surge: {what}",
                measured=f"{off:+.2f} ± {spread:.2f} %",
                bound=f"± {bound:.3g} %",
                ok=bool(abs(off) <= bound),
            )
        )
    return rows


def double_sum(quick: bool) -> list[Row]:
    """Eq. (1) term by term, at a displaced position, against filters with all terms."""
    del quick
    sea = wave_components(STORM, count=200, seed=3)
    waves = Waves(sea.angular_frequency, sea.heading)
    shift = np.exp(-1j * sea.wavenumber * (12.0 * np.cos(sea.heading) - 7.0 * np.sin(sea.heading)))
    amplitudes = np.array([sea.amplitudes(t) * shift for t in np.arange(0.0, 600.0, 2.0)])
    rows = []
    for text, kernel, tolerance in (
        ("QTF, all terms", quadratic_kernel(transfer(1)), 0.0),
        ("QTF, default tolerance", quadratic_kernel(transfer(1)), None),
        ("Newman", newman_kernel(database()), -1.0),
    ):
        exact = np.array(
            [np.einsum("ti,ij,tj->t", amplitudes, kernel(waves, waves, k), amplitudes.conj()).real for k in range(6)]
        ).T
        if tolerance is None:
            filters = quadratic_filters(kernel, sea, STORM)
        elif tolerance < 0.0:
            filters = newman_filters(database(), sea)
        else:
            filters = quadratic_filters(kernel, sea, STORM, tolerance)
        axes = [k for k in range(6) if np.any(exact[:, k])]
        off = drift_force(filters, amplitudes)[:, axes] - exact[:, axes]
        size = np.sqrt(np.mean(exact[:, axes] ** 2, axis=0))
        if tolerance is None:
            left = float(np.max(np.sqrt(np.mean(off**2, axis=0)) / size))
            rows.append(at_most(f"{text} against the double sum, rms, worst component", left, 1e-2))
        else:
            rows.append(at_most(f"{text} against the double sum", float(np.max(np.abs(off) / size)), 1e-9))
    return rows


def realized(quick: bool) -> list[Row]:
    """Error of the kernels of the filters over the exact output, root mean square in the sea."""
    del quick
    sea = ArmaSea(STORM, reach=REACH)
    frequency = np.linspace(0.02, 0.249, 900)
    density = spectrum(sea.model, frequency)[:, 0, 0].real
    factor = transition(frequency, STORM.highest_frequency) * voids(frequency, STORM, 0.5 / sea.sampling_step)
    fine = dataclasses.replace(
        wave_components(STORM, count=1),
        **{
            "frequency": frequency,
            "amplitude": np.zeros(900),
            "phase": np.zeros(900),
            "wavenumber": np.ones(900),
            "heading": np.full(900, STORM.heading),
        },
    )
    rows = []
    for mean, reach, bound in (("arithmetic", REACH, 0.03), ("arithmetic", 150.0, 0.012), ("geometric", 150.0, None)):
        sea = ArmaSea(STORM, reach=reach)
        made, exact = (newman_filters(database(), each, mean) for each in (sea, fine))
        response = kernel_response(sea.kernels(made.rows), frequency, sea.sampling_step, sea.half).T
        wanted = exact.rows * factor
        error = np.sqrt(np.sum(density * np.abs(response - wanted) ** 2, axis=1))
        worst = float(np.max(error / np.sqrt(np.sum(density * np.abs(wanted) ** 2, axis=1))))
        item = f"Newman {mean}, reach {reach:g} m: error of the kernels, worst row, rms"
        rows.append(Row(item=item, measured=f"{worst:.2g}") if bound is None else at_most(item, worst, bound))
    return rows


def cost(quick: bool) -> list[Row]:
    sea = ArmaSea(STORM, reach=REACH)
    began = time.perf_counter()
    filters = quadratic_filters(quadratic_kernel(transfer(1)), sea, STORM)
    took = time.perf_counter() - began
    rows = [
        Row(item=f"QTF filters of six components: seconds to make, {len(sea.heading)} waves", measured=f"{took:.3g} s")
    ]
    still = np.zeros(6)
    for text, drift in (("none", None), ("Newman", newman_filters(database(), sea)), ("QTF", filters)):
        loads = WaveLoads(sea=sea, members=issc_members(), drift=drift)
        loads.evaluate(0.0, still, still)
        count = 1000 if quick else 10000
        began = time.perf_counter()
        for k in range(count):
            loads.evaluate(0.5 * k, still, still)
        taken = 1e6 * (time.perf_counter() - began) / count
        extra = 0 if drift is None else len(drift.rows)
        rows.append(Row(item=f"wave loads of one instant, drift: {text}, {extra} rows", measured=f"{taken:.3g} µs"))
    return rows


def damping(quick: bool) -> list[Row]:
    """Wave drift damping of the ISSC hull held fixed, and its half-step check."""
    del quick
    matrix = wave_drift_damping(database(), STORM)
    fine = wave_drift_damping(database(), STORM, 1e-4)
    error = float(np.max(np.abs(matrix - fine)) / np.max(np.abs(fine)))
    return [
        Row(
            item="wave drift damping of the fixed ISSC hull: surge, sway",
            measured=f"{1e-3 * matrix[0, 0]:.1f}, {1e-3 * matrix[1, 1]:.1f} kN s/m",
        ),
        at_most("the same at a fifth of the frequency step", error, 1e-3),
    ]


if __name__ == "__main__":
    main(
        "Slow drift",
        [
            double_sum,
            newman_records,
            table_records,
            spread_records,
            harmonic_records,
            realized,
            cost,
            damping,
        ],
    )
