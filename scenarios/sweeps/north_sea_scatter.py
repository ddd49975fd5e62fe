"""Write north_sea.csv: probabilities of significant wave height and peak period in the northern North Sea.

The joint distribution of Johannessen, Meling and Haver, "Joint Distribution for Wind and Waves in the Northern North
Sea", ISOPE 2001, fitted to simultaneous wind and wave measurements of 1973 to 1999. With the 1-hour mean wind speed u
at 10 m, the significant height h and the peak period t of a sea state of 3 hours

    u        Weibull, shape 1.708, scale 8.426 m/s                                                       (1)
    h | u    Weibull, shape 2.0 + 0.135 u, scale 1.8 + 0.100 u^1.322 m                                   (2)
    t | h    lognormal, mean 4.883 + 2.68 h^0.529 s, coefficient of variation -0.0017 + 0.259 exp(-0.113 h)   (3)

The period's dependence on the wind at a given height is left out: eq. (3) is that at the mean wind speed of the height,

    1.764 + 3.426 h^0.78                                                                                 (4)

which is the wind speed that the sweep north_sea.toml takes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

FloatArray = NDArray[np.float64]

FILE = Path(__file__).with_name("north_sea.csv")
HEIGHTS = np.arange(0.0, 19.0, 1.0)
"""m, edges of the cells"""
PERIODS = np.arange(3.0, 25.0, 1.0)
"""s, edges of the cells"""
LEAST = 1e-8
"""Probability of a cell below which it is left empty: 0.03 sea states in 1000 years"""


def height_exceedance(height: ArrayLike) -> FloatArray:
    """Probability that the significant height (m) of a sea state is above a value, by eqs. (1) and (2)."""
    speed = np.linspace(0.0, 60.0, 6001)
    scaled = speed / 8.426
    density = 1.708 / 8.426 * scaled**0.708 * np.exp(-(scaled**1.708))
    shape, scale = 2.0 + 0.135 * speed, 1.8 + 0.100 * speed**1.322
    above = np.exp(-((np.asarray(height, dtype=np.float64)[..., None] / scale) ** shape))
    return np.asarray(np.trapezoid(above * density, speed, axis=-1))


def period_probability(period: ArrayLike, height: ArrayLike) -> FloatArray:
    """Probability that the peak period (s) is below a value at a significant height (m), by eq. (3)."""
    height = np.asarray(height, dtype=np.float64)
    mean = 4.883 + 2.68 * height**0.529
    variance = np.log1p((-0.0017 + 0.259 * np.exp(-0.113 * height)) ** 2)
    return np.asarray(ndtr((np.log(period) - np.log(mean) + 0.5 * variance) / np.sqrt(variance)))


def mean_wind_speed(height: ArrayLike) -> FloatArray:
    """Mean 1-hour wind speed at 10 m (m/s) of sea states of a significant height (m), eq. (4)."""
    return np.asarray(1.764 + 3.426 * np.asarray(height, dtype=np.float64) ** 0.78)


def scatter(parts: int = 20) -> FloatArray:
    """Probability of each cell, (heights - 1, periods - 1), by so many parts of its height; its sum is 1."""
    edges = np.linspace(HEIGHTS[0], HEIGHTS[-1], parts * (len(HEIGHTS) - 1) + 1)
    share = -np.diff(height_exceedance(edges))
    within = np.diff(period_probability(PERIODS, (0.5 * (edges[1:] + edges[:-1]))[:, None]), axis=1)
    cells = (share[:, None] * within).reshape(len(HEIGHTS) - 1, parts, -1).sum(axis=1)
    return np.asarray(np.where(cells >= LEAST, cells, 0.0) / np.sum(cells[cells >= LEAST]))


def text() -> str:
    """The diagram as CSV, a row a height, with the middles of the cells."""
    middles = [0.5 * (edges[1:] + edges[:-1]) for edges in (HEIGHTS, PERIODS)]
    lines = [
        "# Northern North Sea: probability of the significant height (m, rows) and the peak period (s, columns) of a",
        "# sea state of 3 h, after Johannessen, Meling and Haver (ISOPE 2001); made by north_sea_scatter.py",
        "Hs\\Tp," + ",".join(f"{period:g}" for period in middles[1]),
    ]
    for height, row in zip(middles[0], scatter(), strict=True):
        lines.append(f"{height:g}," + ",".join(f"{cell:.4e}" if cell else "" for cell in row))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
    print(f"{FILE.name}: {int(np.sum(scatter() > 0.0))} sea states", file=sys.stderr)
