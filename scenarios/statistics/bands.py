"""Statistics of a signal by frequency band, as in Table I of Li and Kareem (1990).

The spread below 0.022 Hz is the slow response to gusts and second-order forces; that from 0.022 to 0.2 Hz, the
response to waves. The variance of a band is the sum of a one-sided periodogram over it,

    var_b = (2 / (N sum w_n^2)) sum_{k in b} |sum_n w_n (x_n - x_mean) e^{-2 pi i k n / N}|^2         (1)

with a cosine taper w over a tenth of the record. Without a taper the slow drift of a finite record, whose ends
do not meet, leaks into the wave band as 1/f^2. The factor 1 / sum w^2 keeps the variance.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from tlpsim.scenarios.results import ResultsError

BAND_EDGES = (0.022, 0.2)  # Hz, Li and Kareem (1990), Table I
TAPERED_FRACTION = 0.1
# Periods of the first edge that a record must hold: the lowest line of the spectrum, at 1/T, is then at half of
# the edge or below, and at least one line apart from the wave band.
SHORTEST_RECORD_PERIODS = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class BandStatistics:
    """Statistics of one signal, in the signal's unit.

    Attributes
    ----------
    mean, std, maximum, minimum : float
        Of the samples themselves; `std` is the standard deviation.
    low_frequency, wave_frequency : float
        Standard deviations below the first edge, and from it to the second one. The first is NaN when
        the record is too short to tell slow motion from the mean.
    start, duration : float
        Beginning and length of what was evaluated, s.
    note : str
        What the reader must know of how it was evaluated, "" if nothing.
    """

    mean: float
    low_frequency: float
    wave_frequency: float
    std: float
    maximum: float
    minimum: float
    start: float
    duration: float
    note: str = ""


def band_statistics(
    time: NDArray[np.float64],
    signal: NDArray[np.float64],
    edges: tuple[float, float] = BAND_EDGES,
    start: float = 0.0,
) -> BandStatistics:
    """Mean, standard deviation by band, and extremes of a signal, eq. (1).

    Parameters
    ----------
    time : NDArray[np.float64], shape (samples,)
        Times, s, equally spaced.
    signal : NDArray[np.float64], shape (samples,)
        Values.
    edges : tuple[float, float]
        Upper edges of the low-frequency and of the wave-frequency band, Hz.
    start : float
        Time before which samples are left out, s. When what remains is too short for the low-frequency band
        the whole record is taken, and the note says so.

    Raises
    ------
    ResultsError
        When the shapes differ, there are fewer than two samples, or the times are not equally spaced.
    """
    _check(time, signal)
    first, note = first_sample(time, start, edges[0])
    step = (time[-1] - time[0]) / (len(time) - 1)
    chosen = signal[first:]
    duration = len(chosen) * step
    mean = float(np.mean(chosen))
    low, wave = _band_deviations(chosen - mean, float(step), edges)
    if duration < SHORTEST_RECORD_PERIODS / edges[0]:
        low = math.nan
        note += "; " if note else ""
        note += f"no low-frequency part: {duration:g} s is less than {SHORTEST_RECORD_PERIODS / edges[0]:.0f} s"
    return BandStatistics(
        mean=mean,
        low_frequency=low,
        wave_frequency=wave,
        std=float(np.std(chosen)),
        maximum=float(np.max(chosen)),
        minimum=float(np.min(chosen)),
        start=float(time[first]),
        duration=float(duration),
        note=note,
    )


def band_signals(
    fluctuation: NDArray[np.float64], step: float, edges: tuple[float, float] = BAND_EDGES
) -> NDArray[np.float64]:
    """Parts of a fluctuation (n,) at a step (s) in the low-frequency and in the wave-frequency band, (2, n)."""
    count = len(fluctuation)
    length = next_fast_len(count, real=True)  # a record of a prime number of samples would take ten times as long
    frequency = np.fft.rfftfreq(length, step)
    lines = np.fft.rfft(fluctuation, length)
    inside = np.stack([frequency < edges[0], (frequency >= edges[0]) & (frequency < edges[1])])
    return np.fft.irfft(np.where(inside, lines, 0.0), length)[:, :count]


def first_sample(time: NDArray[np.float64], start: float, edge: float) -> tuple[int, str]:
    """Index of the first sample at `start` or later, or 0 and a note when too little would be left."""
    if not len(time):
        return 0, ""
    step = (time[-1] - time[0]) / max(len(time) - 1, 1)
    # Half a step is taken off, for times that are a rounding error below `start`.
    first = int(np.searchsorted(time, start - 0.5 * step))
    shortest = SHORTEST_RECORD_PERIODS / edge
    if first == 0 or (len(time) - first) * step >= shortest:
        return first, ""
    left = f"less than {shortest:.0f} s would be left after {start:g} s"
    return 0, f"the whole record of {time[-1] - time[0]:g} s is used, with its transient: {left}"


def _check(time: NDArray[np.float64], signal: NDArray[np.float64]) -> None:
    if time.shape != signal.shape or time.ndim != 1 or len(time) < 2:
        raise ResultsError(
            f"statistics: times of shape {time.shape} and values of shape {signal.shape}; "
            "give two or more samples, as many values as times"
        )
    steps = np.diff(time)
    if not np.allclose(steps, steps[0], rtol=1e-6, atol=1e-9 * abs(time[-1])):
        raise ResultsError("statistics: the times are not equally spaced; give samples of one component")


def _band_deviations(fluctuation: NDArray[np.float64], step: float, edges: tuple[float, float]) -> tuple[float, float]:
    """Standard deviations in the two bands, eq. (1)."""
    count = len(fluctuation)
    taper = _cosine_taper(count, TAPERED_FRACTION)
    # The taper gives a little mean back to a record without one; it would count as slow motion.
    tapered = taper * (fluctuation - np.sum(taper * fluctuation) / np.sum(taper))
    lines = 2.0 * np.abs(np.fft.rfft(tapered)) ** 2 / (count * np.sum(taper**2))
    if count % 2 == 0:
        lines[-1] *= 0.5  # the Nyquist frequency has no mirror image
    frequency = np.fft.rfftfreq(count, step)
    # The first line, at zero frequency, is the mean.
    low = lines[1:][frequency[1:] < edges[0]].sum()
    wave = lines[1:][(frequency[1:] >= edges[0]) & (frequency[1:] < edges[1])].sum()
    return math.sqrt(low), math.sqrt(wave)


def _cosine_taper(count: int, fraction: float) -> NDArray[np.float64]:
    """Tukey's window without its two zeros, which would cost records of few samples two of them."""
    position = np.arange(1, count + 1) / (count + 1)
    rise = np.minimum(np.minimum(position, 1.0 - position) / (0.5 * fraction), 1.0)
    return 0.5 * (1.0 - np.cos(np.pi * rise))
