"""Random processes by digital filters: the fits, the sampled records and the speed. Part of benchmarks/filters.py.

Kaimal at the orders of the paper, random layouts, the orders that the certificate recommends, waves, 24 records of
three hours against their targets, and generation beside sums of trigonometric functions and the FFT.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from report import Row, at_least, at_most
from scipy import stats

from tlpsim.loads.filters.arma import Fit, Orders, fit, recommended_orders, spectrum
from tlpsim.loads.filters.certificate import Certificate, FilterFitWarning
from tlpsim.loads.filters.matching import correlation_from_spectrum
from tlpsim.loads.filters.model import covariance
from tlpsim.loads.filters.process import generate
from tlpsim.loads.waves.spectra import jonswap
from tlpsim.loads.wind.coherence import Decay, coherence_by_name, cross_spectrum
from tlpsim.loads.wind.profile import Profile
from tlpsim.loads.wind.spectra import SPECTRA, spectrum_by_name, wind_points

FloatArray = NDArray[np.float64]
Array = NDArray[np.float64] | NDArray[np.complex128]
Spectrum = Callable[[FloatArray], FloatArray]

SIX_POINTS = np.array([(0, y, z) for y, z in ((-30, 22), (0, 22), (30, 22), (-20, 40), (20, 40), (0, 70))], dtype=float)
SPEED = 40.0
ROUGHNESS = 0.005
WAVE_ORDERS = Orders(long=59, autoregressive=8, moving_average=7)
RECORDS = 24
DURATION = 3 * 3600.0
SEGMENT = 1024.0  # s, for the estimates of spectra
TERMS = 1024


def wind(
    name: str,
    position: FloatArray = SIX_POINTS,
    speed: float = SPEED,
    roughness: float = ROUGHNESS,
    coherence: str = "davenport",
) -> Spectrum:
    """Cross-spectra of the wind at points (n, 3), the wind along x."""
    points = wind_points(position[:, 2], Profile(speed_10=speed, roughness_length=roughness))
    density, root = spectrum_by_name(name).density, coherence_by_name(coherence)
    return cross_spectrum(
        lambda frequency: density(frequency, points),
        lambda frequency: root(frequency, position, 0.0, points, Decay()),
    )


def wind_band(step: float) -> tuple[float, float]:
    return 0.002, min(0.4, 0.4 / step)


def quiet_fit(target: Spectrum, step: float, orders: Orders, band: tuple[float, float]) -> Fit:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FilterFitWarning)
        return fit(target, step, orders=orders, band=band)


def auto_rows(title: str, certificate: Certificate, largest: float, mean: float) -> list[Row]:
    return [
        at_most(f"{title}: auto-spectra, largest error", certificate.auto_error_max, largest, "dB"),
        at_most(f"{title}: auto-spectra, rms error", certificate.auto_error_rms, mean, "dB"),
    ]


def kaimal_at_the_orders_of_the_paper(quick: bool) -> list[Row]:
    certificate = quiet_fit(wind("kaimal"), 1.0, Orders(), wind_band(1.0)).certificate
    title = f"Kaimal, 6 points, 1 s, {certificate.orders_used}"
    return [
        *auto_rows(title, certificate, 0.6, 0.2),
        at_most(f"{title}: cross-spectra, largest error", certificate.cross_error_max, 0.09),
        at_most(f"{title}: root coherence, largest error", certificate.coherence_error_max, 0.04),
        at_most(f"{title}: variance below Nyquist, error", 100.0 * certificate.variance_error, 0.5, "%"),
        Row(item=f"{title}: largest pole", measured=f"{certificate.largest_pole:.4f}"),
        Row(item=f"{title}: variance above Nyquist", measured=f"{100.0 * certificate.variance_lost:.1f} %"),
    ]


def random_layouts(quick: bool) -> list[Row]:
    return [
        *layout_rows("steps 1 to 2 s", (1.0, 1.25, 1.5, 2.0), 40 if quick else 300, 1.3),
        *layout_rows("steps 0.5 and 0.7 s", (0.5, 0.7), 10 if quick else 100, None),
    ]


def layout_rows(title: str, steps: Sequence[float], cases: int, largest: float | None) -> list[Row]:
    """Any spectrum, coherence, layout and wind; AR(P) spans 25 s or more, and its order is 25 or more."""
    generator = np.random.default_rng(2)
    unstable = fallbacks = 0
    errors: dict[str, list[float]] = {name: [] for name in SPECTRA}
    for _ in range(cases):
        count = int(generator.integers(1, 9))
        position = np.column_stack(
            [generator.uniform(low, high, count) for low, high in ((-40, 40), (-60, 60), (8, 120))]
        )
        name = str(generator.choice(list(SPECTRA)))
        coherence = str(generator.choice(["davenport", "davenport", "npd"]))
        target = wind(name, position, generator.uniform(8.0, 50.0), 10.0 ** generator.uniform(-4.0, -2.0), coherence)
        step = float(generator.choice(steps))
        orders = Orders(long=max(25, int(np.ceil(25.0 / step))))
        certificate = quiet_fit(target, step, orders, wind_band(step)).certificate
        unstable += not certificate.largest_pole < 1.0
        fallbacks += bool(certificate.fallback)
        errors[name].append(certificate.auto_error_max)
    rows = [
        at_most(f"{cases} random layouts, winds, spectra, {title}: unstable models", unstable, 0),
        Row(item=f"{cases} random layouts, {title}: lower orders taken", measured=str(fallbacks)),
    ]
    for name, found in errors.items():
        if not found:
            continue
        item = f"{len(found)} random layouts, {title}, {name}: largest error of an auto-spectrum"
        if largest is not None and name in ("kaimal", "harris", "api"):
            rows.append(at_most(item, max(found), largest, "dB"))
        else:
            rows.append(Row(item=item, measured=f"{max(found):.3g} dB"))
    return rows


def recommended(quick: bool) -> list[Row]:
    rows = []
    for name in ("npd", "davenport") if quick else ("npd", "davenport", "ochi_shin", "simiu_leigh"):
        for step in (1.0,) if quick else (0.5, 1.0, 2.0):
            target, band = wind(name), wind_band(step)
            orders = recommended_orders(target, step, band=band)
            if orders is None:
                rows.append(
                    Row(item=f"{name}, {step:g} s: recommended orders", measured="none", bound="some", ok=False)
                )
                continue
            certificate = quiet_fit(target, step, orders, band).certificate
            rows += auto_rows(f"{name}, 6 points, {step:g} s, recommended {orders}", certificate, 1.2, 0.35)
    return rows


def waves(quick: bool) -> list[Row]:
    rows = []
    seas = [(12.0, 14.0, 3.3)] if quick else [(12.0, 14.0, 3.3), (12.0, 14.0, 1.0), (4.0, 8.0, 3.3), (15.0, 18.0, 3.3)]
    seas += [] if quick else [(12.0, 14.0, 5.0)]
    for height, period, enhancement in seas:
        for step in (0.5, 1.0, 2.0):
            if step > period / 7.0:
                continue  # the Nyquist frequency would be below 3.5 times the peak
            rows += wave_rows(height, period, enhancement, step)
    return rows


def wave_rows(height: float, period: float, enhancement: float, step: float) -> list[Row]:
    def target(frequency: FloatArray) -> FloatArray:
        return jonswap(frequency, height, period, enhancement)

    start = time.perf_counter()
    result = fit(target, step, orders=WAVE_ORDERS, white_floor=1e-4, polish=True)
    elapsed = time.perf_counter() - start
    frequency = np.linspace(0.0, 0.5 / step, 8001)
    density, found = target(frequency), spectrum(result.model, frequency)[:, 0, 0].real
    core = density > 0.01 * density.max()
    largest = float(np.max(np.abs(10.0 * np.log10(found[core] / density[core]))))
    density_error = 100.0 * float(np.sqrt(np.sum((found - density) ** 2) / np.sum(density**2)))
    height_error = 100.0 * abs(4.0 * float(np.sqrt(covariance(result.model, 0)[0, 0, 0])) / height - 1.0)
    title = f"JONSWAP Hs {height:g} m, Tp {period:g} s, gamma {enhancement:g}, {step:g} s, ARMA(8, 7)"
    rows = [
        at_most(f"{title}: error where S > 1 % of the peak", largest, 0.35, "dB"),
        at_most(f"{title}: rms error of the density", density_error, 2.0, "%"),
        # Of the whole Hs, hence with what lies above the Nyquist frequency.
        at_most(f"{title}: error of Hs", height_error, 0.4, "%"),
    ]
    if enhancement != 3.3:  # neighbours of the JONSWAP spectrum: shown, not bounded
        rows = [replace(row, bound="", ok=None) for row in rows]
    return [*rows, Row(item=f"{title}: time of the fit", measured=f"{elapsed:.2f} s")]


def estimates(samples: FloatArray, step: float) -> tuple[FloatArray, NDArray[np.complex128], int]:
    """Cross-spectra (nf, m, m) of records (records, count, m) by Hann segments without overlap, and their number."""
    length = round(SEGMENT / step)
    records, count, size = samples.shape
    segments = samples[:, : count // length * length].reshape(records * (count // length), length, size)
    window = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    transform = np.fft.rfft(segments * window[:, None], axis=1)
    density = np.einsum("sfi,sfj->fij", transform, transform.conj())
    density *= 2.0 * step / (np.sum(window**2) * len(segments))
    return np.fft.rfftfreq(length, step), density, len(segments)


def seen_through_the_window(target: Spectrum, step: float) -> Array:
    """What `estimates` gives for the target on average: its correlation times that of the window."""
    length = round(SEGMENT / step)
    window = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    overlap = np.fft.irfft(np.abs(np.fft.rfft(window, 2 * length)) ** 2)[:length]
    weighted = correlation_from_spectrum(target, step, length - 1) * (overlap / overlap[0])[:, None, None]
    phase = np.fft.rfft(weighted, axis=0)
    # sum over both signs of the lag, with R_{-k} = R_k^T
    return 2.0 * step * (phase + np.conj(np.swapaxes(phase, 1, 2)) - weighted[0])


def sampled_rows(title: str, result: Fit, target: Spectrum, band: tuple[float, float], quick: bool) -> list[Row]:
    """Estimates from 24 records against the target: 95 of 100 frequencies must lie inside their 95 % bands."""
    step, count = result.model.step, round(DURATION / result.model.step)
    records = 6 if quick else RECORDS
    samples = np.array([generate(result.model, 11, record, count) for record in range(records)])
    frequency, density, averages = estimates(samples, step)
    # Neighbours share half of a Hann window's power: every other frequency is nearly independent.
    chosen = np.flatnonzero((frequency >= band[0]) & (frequency <= band[1]))[::2]
    found, expected = density[chosen], seen_through_the_window(target, step)[chosen]
    size = found.shape[1]
    ratio = np.real(np.einsum("fii->fi", found)) / np.real(np.einsum("fii->fi", expected))
    low, high = stats.chi2.ppf([0.025, 0.975], 2 * averages) / (2 * averages)
    inside = np.mean((ratio > low) & (ratio < high), axis=0)
    # The share itself scatters: three standard deviations of a binomial share.
    least = 95.0 - 300.0 * np.sqrt(0.05 * 0.95 / len(chosen))
    rows = [
        at_least(
            f"{title}, {records} x 3 h: auto-spectra inside 95 % bands ({low:.3f} to {high:.3f}), worst of {size}",
            100.0 * float(inside.min()),
            float(least),
            "%",
        ),
        Row(item=f"{title}: the same, mean of all", measured=f"{100.0 * float(inside.mean()):.1f} %"),
    ]
    if size > 1:
        rows += coherence_rows(title, found, expected, averages)
    return rows + gaussian_rows(title, samples, result)


def coherence_rows(title: str, found: Array, expected: Array, averages: int) -> list[Row]:
    """Fisher's transform of the root coherence is normal where its square is above 0.35 (Enochson and Goodman 1965)."""
    size = found.shape[1]
    shares, counts = [], []
    for i in range(size):
        for j in range(i):
            root, measured = (
                np.abs(matrix[:, i, j]) / np.sqrt(np.real(matrix[:, i, i] * matrix[:, j, j]))
                for matrix in (expected, found)
            )
            valid = root**2 > 0.35
            if np.sum(valid) < 10:
                continue
            offset = np.arctanh(measured[valid]) - np.arctanh(root[valid]) - 0.5 / (averages - 1)
            shares.append(100.0 * np.mean(np.abs(offset) < 1.96 * np.sqrt(0.5 / (averages - 1))))
            counts.append(int(np.sum(valid)))
    total = float(np.average(shares, weights=counts))
    # The pairs share points: the scatter is taken as that of one pair.
    least = 95.0 - 300.0 * np.sqrt(0.05 * 0.95 / np.mean(counts))
    return [at_least(f"{title}: coherence inside 95 % bands, {len(shares)} pairs", total, float(least), "%")]


def gaussian_rows(title: str, samples: FloatArray, result: Fit) -> list[Row]:
    """Tests on samples so far apart that they are nearly independent; p-values times the number of tests."""
    deviation = np.sqrt(np.diagonal(covariance(result.model, 0)[0]))
    apart = round(200.0 / result.model.step)
    sparse = (samples[:, ::apart] / deviation).reshape(-1, samples.shape[2])
    tests = 2 * sparse.shape[1]
    shape = min(float(stats.jarque_bera(column).pvalue) for column in sparse.T)
    whole = min(float(stats.kstest(column, "norm").pvalue) for column in sparse.T)
    return [
        at_least(f"{title}: Gaussian, Jarque-Bera, least p x {tests} ({len(sparse)} samples)", tests * shape, 0.05),
        at_least(f"{title}: Gaussian, Kolmogorov-Smirnov, least p x {tests}", tests * whole, 0.05),
    ]


def sampled_wind(quick: bool) -> list[Row]:
    target = wind("kaimal")
    result = quiet_fit(target, 1.0, Orders(), wind_band(1.0))
    return sampled_rows("Kaimal, 6 points, 1 s, sampled", result, target, wind_band(1.0), quick)


def sampled_waves(quick: bool) -> list[Row]:
    def target(frequency: FloatArray) -> FloatArray:
        return jonswap(frequency, 12.0, 14.0, 3.3)

    result = fit(target, 0.5, orders=WAVE_ORDERS, white_floor=1e-4, polish=True)
    grid = np.linspace(0.0, 1.0, 4001)
    core = grid[target(grid) > 0.01 * target(grid).max()]
    return sampled_rows(
        "JONSWAP Hs 12 m, Tp 14 s, 0.5 s, sampled",
        result,
        lambda frequency: target(frequency)[:, None, None],
        (float(core[0]), float(core[-1])),
        quick,
    )


@njit(cache=True, fastmath=True)
def trigonometric_sum(
    amplitude: FloatArray, phase: FloatArray, frequency: FloatArray, step: float, count: int
) -> FloatArray:
    """u_i(t) = sum_{j<=i} sum_f a_ij(f) cos(2 pi f t + phase_j(f)), after Shinozuka (1972)."""
    size, terms = phase.shape
    result = np.zeros((count, size))
    for n in range(count):
        for i in range(size):
            total = 0.0
            for j in range(i + 1):
                for k in range(terms):
                    total += amplitude[i, j, k] * np.cos(2.0 * np.pi * frequency[k] * n * step + phase[j, k])
            result[n, i] = total
    return result


@njit(cache=True, fastmath=True)
def combined_sum(cosine: FloatArray, sine: FloatArray, frequency: FloatArray, step: float, count: int) -> FloatArray:
    """The same with the terms of one frequency added beforehand: one cosine and one sine a frequency and step."""
    terms, size = cosine.shape
    result = np.zeros((count, size))
    for n in range(count):
        for k in range(terms):
            angle = 2.0 * np.pi * frequency[k] * n * step
            c, s = np.cos(angle), np.sin(angle)
            for i in range(size):
                result[n, i] += cosine[k, i] * c + sine[k, i] * s
    return result


def best_time(action: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times)


def speed(quick: bool) -> list[Row]:
    step, count = 1.0, round(DURATION)
    target = wind("kaimal")
    result = quiet_fit(target, step, Orders(), wind_band(step))
    size = result.model.size
    generate(result.model, 0, 0, 10)
    long = 10 * count
    arma = best_time(lambda: generate(result.model, 0, 0, long), 5) / long
    long_model = quiet_fit(target, step, Orders(autoregressive=25, moving_average=0), wind_band(step)).model
    autoregressive = best_time(lambda: generate(long_model, 0, 0, long), 2) / long

    frequency = (np.arange(TERMS) + 0.5) * 0.5 / step / TERMS
    width = 0.5 / step / TERMS
    root = np.linalg.cholesky(target(frequency))
    phase = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, (size, TERMS))
    amplitude = np.ascontiguousarray(np.moveaxis(root, 0, 2)) * np.sqrt(2.0 * width)
    steps = 200 if quick else 2000
    trigonometric_sum(amplitude, phase, frequency, step, 1)
    direct = best_time(lambda: trigonometric_sum(amplitude, phase, frequency, step, steps), 2) / steps
    combined = np.einsum("ijk,jk->ki", amplitude, np.exp(1j * phase))
    parts = np.ascontiguousarray(combined.real), np.ascontiguousarray(-combined.imag)
    combined_sum(*parts, frequency, step, 1)
    added = best_time(lambda: combined_sum(*parts, frequency, step, steps), 2) / steps
    same = np.abs(combined_sum(*parts, frequency, step, 20) - trigonometric_sum(amplitude, phase, frequency, step, 20))

    bins = np.fft.rfftfreq(count, step)[1:]
    bin_width = 1.0 / DURATION
    generator = np.random.default_rng(0)

    def factors() -> Array:
        return np.linalg.cholesky(target(bins))

    def synthesis(factor: Array) -> FloatArray:
        noise = generator.standard_normal((len(bins), size, 2)) @ np.array([1.0, 1j])
        lines = np.vstack([np.zeros((1, size)), np.einsum("fij,fj->fi", factor, noise)])
        return np.fft.irfft(lines, count, axis=0) * (count * np.sqrt(bin_width) / 2.0)

    prepared = factors()
    transform = best_time(lambda: synthesis(prepared), 5) / count
    from_spectrum = best_time(lambda: synthesis(factors()), 3) / count
    return [
        at_most(f"generation, {size} points, ARMA(3, 3), with its noise", 1e9 * arma, 500.0, "ns/step", ".0f"),
        at_least(f"ARMA(3, 3) against a compiled sum of {TERMS} terms", direct / arma, 300.0, "times", ".0f"),
        Row(item=f"sum of {TERMS} terms, compiled", measured=f"{1e9 * direct:.0f} ns/step"),
        Row(
            item=f"the same with {TERMS} cosines and sines in all a step (equal to {same.max():.0e} m/s)",
            measured=f"{1e9 * added:.0f} ns/step, {added / arma:.0f} times ARMA(3, 3)",
        ),
        Row(item="generation, AR(25)", measured=f"{1e9 * autoregressive:.0f} ns/step"),
        Row(
            item="FFT synthesis of 3 h at once, factors known",
            measured=f"{1e9 * transform:.0f} ns/step, {transform / arma:.2f} times ARMA(3, 3)",
        ),
        Row(item="FFT synthesis of 3 h at once, from the spectra", measured=f"{1e9 * from_spectrum:.0f} ns/step"),
    ]


PARTS: list[Callable[[bool], Sequence[Row]]] = [
    kaimal_at_the_orders_of_the_paper,
    random_layouts,
    recommended,
    waves,
    sampled_wind,
    sampled_waves,
    speed,
]

if __name__ == "__main__":
    from report import main

    main("Random processes by digital filters", PARTS)
