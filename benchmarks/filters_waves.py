"""The filtered sea: forces against theory and against direct filtering, cost, and the response it makes.

python benchmarks/filters_waves.py [--quick]
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
from chain import motions
from numpy.typing import NDArray
from report import Row, at_most, main

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.filters.convolution import kernel_response, quadrature
from tlpsim.loads.filters.model import spectrum
from tlpsim.loads.hydro.excitation import WaveLoads
from tlpsim.loads.hydro.issc_members import issc_members
from tlpsim.loads.hydro.morison import inertia_transfer
from tlpsim.loads.waves.airy import wavenumber
from tlpsim.loads.waves.elevation import ArmaSea, transition, voids
from tlpsim.loads.waves.field import WaveComponents, wave_components
from tlpsim.loads.waves.sea import SeaState

HEADING = np.deg2rad(21.6)
REACH = 91.0
MEMBERS = issc_members()
SEAS: dict[str, tuple[str, float, float, float]] = {
    "default storm": ("pierson_moskowitz", 7.08, 14.52, 0.5),
    "JONSWAP Hs 12 m Tp 14 s, step 1 s": ("jonswap", 12.0, 14.0, 1.0),
    "JONSWAP Hs 4 m Tp 8 s": ("jonswap", 4.0, 8.0, 0.5),
    "Torsethaugen Hs 4 m Tp 8 s": ("torsethaugen", 4.0, 8.0, 0.5),
}


def state(name: str, directions: int = 1) -> SeaState:
    shape, height, period, _ = SEAS[name]
    return SeaState(
        spectrum=shape,
        significant_height=height,
        peak_period=period,
        heading=HEADING,
        directions=directions,
        water_depth=450.0,
    )


def transfer(frequency: NDArray[np.float64], offset: float) -> NDArray[np.complex128]:
    """First-order forces at an offset along the waves, shape (6, nf)."""
    one = np.ones(len(frequency))
    waves = WaveComponents(
        frequency=frequency,
        amplitude=one,
        phase=0.0 * one,
        wavenumber=wavenumber(2.0 * np.pi * frequency, 450.0),
        heading=HEADING * one,
        water_depth=450.0,
        gravity=9.80665,
    )
    return inertia_transfer(MEMBERS, waves) * np.exp(-1j * waves.wavenumber * offset)


def theory(quick: bool) -> list[Row]:
    rows = []
    for name, (_, _, _, step) in SEAS.items():
        sea = ArmaSea(state(name), sampling_step=step, reach=REACH)
        fine = 0.5 / step * (np.arange(4000) + 0.5) / 4000.0
        made, asked = spectrum(sea.model, fine)[:, 0, 0].real * quadrature(fine), sea.state.density(fine)
        exact = np.abs(transfer(fine, 0.0)) ** 2 @ (asked * quadrature(fine) * (fine < sea.state.highest_frequency))
        worst = 0.0
        for offset in (0.0, 20.0, -30.0):
            kernels = sea.kernels(transfer(sea.frequency, offset))
            response = kernel_response(kernels, fine, step, sea.half).T
            worst = max(worst, float(np.abs(np.sqrt(np.abs(response) ** 2 @ made / exact) - 1.0).max()))
        item = f"{name}: standard deviation of any force against |H|² S, offsets of 0, 20, -30 m"
        rows.append(at_most(item, 100.0 * worst, 1.0, "%", ".2f"))
    return rows


def in_time(quick: bool) -> list[Row]:
    """Against the FFT of the same 3000 samples."""
    sea = ArmaSea(state("default storm"), reach=REACH)
    loads = WaveLoads(sea=sea, members=MEMBERS)
    count, margin, rows = 1000, 1000, []
    record = sea.samples(0, count + 2 * margin)[:, 0]
    frequency = np.fft.rfftfreq(len(record), sea.sampling_step)
    frequency[0] = 1e-9
    gain = transition(frequency, sea.state.highest_frequency) * voids(frequency, sea.state, 0.5 / sea.sampling_step)
    for offset in (0.0, 20.0):
        place = np.array([offset * np.cos(HEADING), offset * np.sin(HEADING), 0.0, 0.0, 0.0, 0.0])
        exact = np.fft.irfft(np.fft.rfft(record) * gain * transfer(frequency, offset), len(record))
        times = sea.sampling_step * np.arange(margin, margin + count)
        found = np.array([loads.evaluate(t, place, np.zeros(6)).diffraction for t in times]).T
        exact = exact[:, margin : margin + count]
        error = np.sqrt(np.mean((found - exact) ** 2, axis=1) / np.mean(exact**2, axis=1))
        item = f"first-order forces in time against FFT filtering, offset {offset:g} m: rms error"
        rows.append(at_most(item, float(error.max()), 2e-3, "", ".1e"))
    return rows


def cost(quick: bool) -> list[Row]:
    seas = {
        "filtered, long-crested": ArmaSea(state("default storm"), reach=REACH),
        "filtered, 7 directions": ArmaSea(state("default storm", 7), reach=REACH),
        "harmonic, 400 components": wave_components(state("default storm"), count=400),
    }
    rows, place, rest = [], np.array([5.0, 2.0, 0.0, 0.0, 0.0, 0.0]), np.zeros(6)
    for name, sea in seas.items():
        loads = WaveLoads(sea=sea, members=MEMBERS)
        loads.evaluate(0.0, place, rest)
        walls = []
        for _ in range(5):
            began = time.perf_counter()
            for k in range(1000):
                loads.evaluate(0.5 * k, place, rest)
            walls.append((time.perf_counter() - began) / 1000 * 1e6)
        measured = statistics.median(walls)
        rows.append(Row(item=f"{name}: a call for all forces", measured=f"{measured:.0f} µs"))
    return rows


def response(quick: bool) -> list[Row]:
    """Response of the default scenario in the sea of both generators, with one wind."""
    seeds, duration = (2, 3600) if quick else (6, 10800)
    found = {
        generator: np.array(
            [
                motions([f"simulation.duration={duration}", f"simulation.seed={k}", f"waves.generator={generator}"])[0]
                for k in range(1, seeds + 1)
            ]
        )
        for generator in ("arma", "harmonic")
    }
    rows = []
    for i, degree in enumerate(DEGREES_OF_FREEDOM):
        for k, band in enumerate(("all", "low", "wave")):
            one, other = (values[:, i, k] for values in found.values())
            spread = np.sqrt((one.var(ddof=1) / one.mean() ** 2 + other.var(ddof=1) / other.mean() ** 2) / seeds)
            ratio = one.mean() / other.mean()
            rows.append(
                Row(
                    item=f"{degree}, std of {band} frequencies, filtered; harmonic, {seeds} × {duration} s",
                    measured=f"{one.mean():.4g}; {other.mean():.4g}; ratio {ratio:.3f} ± {spread:.3f}",
                    bound="" if quick else "1 within 4 standard errors",
                    ok=None if quick else abs(ratio - 1.0) < 4.0 * spread,
                )
            )
    return rows


PARTS: list[Callable[[bool], list[Row]]] = [theory, in_time, cost, response]

if __name__ == "__main__":
    main("Digital filters: waves", PARTS)
