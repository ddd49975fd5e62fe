"""Wave forces at the displaced position against sums over components, and against the integrals of second order.

The elevation of a sea by digital filters is taken apart by a discrete Fourier transform, and its components are added
at each instant where the platform is at that instant:

    F(t) = Re sum_n H(omega_n) A_n exp(i (omega_n t - k_n . X(t)))                                        (1)

X(t) is an offset, a slow oscillation, and the motion by the hull's response amplitudes R in these very waves. The term
of the displaced position is F(t) less the force at the offset. For X(t) without the slow oscillation it is a quadratic
force to second order, with eqs. (2) and (3) of `tlpsim.loads.hydro.drift` and the transfer function of
`tlpsim.loads.hydro.displaced_drift`.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from drift import DURATION, LOW, NAMED, REACH, STEP, STORM, against_theory, database, statistics
from numba import njit
from numpy.typing import NDArray
from report import Row, at_most

from tlpsim.loads.hydro.diffraction import excitation, excitation_transfer
from tlpsim.loads.hydro.displaced_drift import displaced_kernel
from tlpsim.loads.hydro.drift import Waves, drift_spectrum
from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.elevation import ArmaSea, transition, voids
from tlpsim.loads.waves.sea import SeaState

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SEAS = {
    "Pierson-Moskowitz, 21.6°": STORM,
    "JONSWAP, 0°": SeaState(significant_height=7.0, peak_period=14.0, water_depth=STORM.water_depth),
}
OFFSET = np.array([10.0, 4.0])  # m
SLOW = np.array([3.0, 1.0])  # m
SLOW_PERIOD = 100.0  # s
MARGIN = 600.0  # s, of the record at either end, beyond the memory of any transfer function
MEAN_BOUND, SPREAD_BOUND = 8.0, 5.0  # %
FAR = 250.0  # m, reach at which the kernels have next to no error left
RECORDS = {"sums": 12, "integrals": 24}
QUICK_RECORDS = {"sums": 1, "integrals": 4}
NOTHING = 1e-6  # of the largest: below it there is only rounding

TIMES = MARGIN + STEP * np.arange(round(DURATION / STEP))


def wave_vector(waves: Waves) -> FloatArray:
    """Shape (2, N), rad/m."""
    number = wavenumber(waves.omega, STORM.water_depth, STORM.gravity)
    return number * np.array([np.cos(waves.heading), np.sin(waves.heading)])


def force_transfer(waves: Waves) -> ComplexArray:
    """H, shape (6, N)."""
    return excitation_transfer(database(), *waves, STORM.water_depth, STORM.gravity)


def motion_transfer(waves: Waves) -> ComplexArray:
    """R in surge and sway, shape (2, N). Motions have the symmetry of forces, hence their interpolation."""
    response = database().response_amplitude
    assert response is not None
    motions = dataclasses.replace(database(), excitation_force=response)
    return excitation_transfer(motions, *waves, STORM.water_depth, STORM.gravity)[:2]


class Components(NamedTuple):
    """What a record of elevation from time zero consists of: waves, amplitudes (N,), and its length, s."""

    waves: Waves
    amplitude: ComplexArray
    duration: float


def components(sea: ArmaSea) -> Components:
    """Of the sea's samples over the record and its margins, with the factors of the band in which waves act."""
    state, step = sea.state, sea.sampling_step
    samples = sea.samples(0, round((DURATION + 2.0 * MARGIN) / step))
    frequency = np.fft.rfftfreq(len(samples), step)[1:-1]
    lines = 2.0 / len(samples) * np.fft.rfft(samples, axis=0)[1:-1]
    factor = transition(frequency, state.highest_frequency) * voids(frequency, state, 0.5 / step)
    acting = factor > NOTHING
    headings = state.spread().heading
    waves = Waves(np.tile(2.0 * np.pi * frequency[acting], len(headings)), np.repeat(headings, acting.sum()))
    return Components(waves, (factor[:, None] * lines)[acting].T.ravel(), step * len(samples))


@njit(cache=True)
def summed(times, place, omega, vector, amplitude, result):  # type: ignore[no-untyped-def]
    """Eq. (1) at `times` (m,) and `place` (m, 2) for `amplitude` (rows, N), into `result` (m, rows)."""
    result[:] = 0.0
    for m in range(len(times)):
        for n in range(len(omega)):
            phase = omega[n] * times[m] - vector[0, n] * place[m, 0] - vector[1, n] * place[m, 1]
            turn = complex(np.cos(phase), np.sin(phase))
            for row in range(len(amplitude)):
                result[m, row] += (amplitude[row, n] * turn).real


def at_places(parts: Components, transfer: Callable[[Waves], ComplexArray], place: FloatArray) -> FloatArray:
    """Eq. (1) at `TIMES` for the rows of a transfer function at places (times, 2), shape (times, rows)."""
    amplitude = transfer(parts.waves) * parts.amplitude
    result = np.empty((len(TIMES), len(amplitude)))
    summed(TIMES, place, parts.waves.omega, wave_vector(parts.waves), amplitude, result)
    return result


def at_offset(parts: Components, transfer: Callable[[Waves], ComplexArray]) -> FloatArray:
    """The same at `OFFSET` all the time, by a fast transform."""
    turn = np.exp(-1j * (OFFSET @ wave_vector(parts.waves)))
    amplitude = transfer(parts.waves) * parts.amplitude * turn
    count = round(parts.duration / STEP)
    lines = np.zeros((count // 2 + 1, len(amplitude)), dtype=np.complex128)
    np.add.at(lines, np.rint(parts.waves.omega * parts.duration / (2.0 * np.pi)).astype(int), amplitude.T)
    first = round(MARGIN / STEP)
    return np.fft.irfft(0.5 * count * lines, count, axis=0)[first : first + len(TIMES)]


def forces(loads: WaveLoads, place: FloatArray) -> FloatArray:
    """First-order force at `TIMES` on a platform at `place` (times, 2), shape (times, 6)."""
    position, still = np.zeros((len(TIMES), 6)), np.zeros(6)
    position[:, :2] = place
    return np.array([loads.evaluate(t, x, still).diffraction for t, x in zip(TIMES, position, strict=True)])


class Record(NamedTuple):
    """One realization: wave loads, components of the elevation, and the motion of the platform about its offset."""

    loads: WaveLoads
    parts: Components
    motion: FloatArray

    def term(self, place: FloatArray) -> FloatArray:
        """The wave loads' term of the displaced position, shape (times, 6)."""
        return forces(self.loads, place) - forces(self.loads, np.broadcast_to(OFFSET, place.shape))


def records(state: SeaState, count: int, reach: float = REACH) -> Iterable[Record]:
    for seed in range(1, count + 1):
        sea = ArmaSea(state, reach=reach, seed=seed)
        parts = components(sea)
        motion = at_offset(parts, motion_transfer)
        yield Record(WaveLoads(sea=sea, members=issc_members(), excitation=excitation(database())), parts, motion)


def acting_axes(expected: FloatArray) -> dict[int, str]:
    """Of `NAMED`, those in which there is a force, by statistics (k, 6)."""
    size = np.max(np.abs(expected), axis=0)
    return {axis: name for axis, name in NAMED.items() if size[axis] > NOTHING * size.max()}


def against_sums(state: SeaState, count: int, reach: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Statistics of the term by eq. (1), (records, 2, 6), errors of them by the wave loads, and rms of what is left

    (records, 6), both in %.
    """
    slow = SLOW * np.sin(2.0 * np.pi / SLOW_PERIOD * TIMES)[:, None]
    exact, errors, left = [], [], []
    for record in records(state, count, reach):
        place = OFFSET + slow + record.motion
        term = at_places(record.parts, force_transfer, place) - at_offset(record.parts, force_transfer)
        found = record.term(place)
        exact.append(statistics(term)[:2])
        errors.append(100.0 * np.abs(statistics(found)[:2] - exact[-1]) / np.abs(exact[-1]))
        left.append(100.0 * np.std(found - term, axis=0) / np.std(term, axis=0))
    return np.array(exact), np.array(errors), np.array(left)


def sums(text: str, state: SeaState, count: int) -> list[Row]:
    """Mean and low-frequency spread of the term against eq. (1), worst of the records."""
    exact, errors, left = against_sums(state, count, REACH)
    far = against_sums(state, 1, FAR)[2]
    rows = []
    for axis, name in acting_axes(exact[0]).items():
        for k, (what, bound) in enumerate((("mean", MEAN_BOUND), (f"spread below {LOW} Hz", SPREAD_BOUND))):
            item = f"{text}, {name}: {what}, {exact[0, k, axis]:.4g}, against sums, worst of {count} records"
            rows.append(at_most(item, float(errors[:, k, axis].max()), bound, "%"))
        item = f"{text}, {name}: rms of what is left of the term, reach {REACH:g} and {FAR:g} m"
        rows.append(Row(item=item, measured=f"{left[:, axis].max():.2g}, {far[0, axis]:.2g} %"))
    return rows


def integrals(text: str, state: SeaState, count: int, quick: bool) -> list[Row]:
    """Mean and low-frequency spread of the term, motion about the offset, against their kernel."""
    theory = drift_spectrum(displaced_kernel(database()), state)
    expected = np.array([theory.mean, theory.spread(0.0, LOW)])
    found = np.array([statistics(record.term(OFFSET + record.motion))[:2] for record in records(state, count)])
    bounds = (MEAN_BOUND, SPREAD_BOUND)
    return against_theory(f"{text}, against integrals", expected, found, bounds, quick, acting_axes(expected))


@njit(cache=True)
def turned(amplitude, vector, x, y, result):  # type: ignore[no-untyped-def]
    for n in range(len(amplitude)):
        angle = vector[0, n] * x + vector[1, n] * y
        result[n] = amplitude[n] * complex(np.cos(angle), -np.sin(angle))


def cost(count: int) -> list[Row]:
    """Time of one instant with and without, and of the phases alone, which are turned in both."""
    sea = ArmaSea(STORM, reach=REACH)
    vector = wave_vector(Waves(sea.angular_frequency, sea.heading))
    amplitude = sea.amplitudes(0.0)
    result, still = np.empty_like(amplitude), np.zeros(6)
    position = np.array([*OFFSET, 0.0, 0.0, 0.0, 0.0])
    calls: dict[str, Callable[[float], object]] = {}
    for text, on in (("at the displaced position", True), ("at the origin", False)):
        loads = WaveLoads(sea=sea, members=issc_members(), excitation=excitation(database()), displaced_position=on)
        calls[f"wave loads of one instant {text}"] = lambda t, loads=loads: loads.evaluate(t, position, still)
    calls[f"phases of {len(amplitude)} waves alone"] = lambda t: turned(amplitude, vector, *OFFSET, result)
    rows = []
    for item, call in calls.items():
        call(0.0)
        began = time.perf_counter()
        for k in range(count):
            call(0.5 * k)
        rows.append(Row(item=item, measured=f"{1e6 * (time.perf_counter() - began) / count:.3g} µs"))
    return rows


def displaced_position(quick: bool) -> list[Row]:
    """Terms of the displaced position: mean and low-frequency spread, and what they cost."""
    count = QUICK_RECORDS if quick else RECORDS
    rows = []
    for text, state in SEAS.items():
        rows += sums(text, state, count["sums"])
        rows += integrals(text, state, count["integrals"], quick)
    return rows + cost(1000 if quick else 10000)
