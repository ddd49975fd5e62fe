"""WAMIT's difference-frequency quadratic transfer functions, read; conventions in `...exchange.conventions`.

    .10d, .11d, .12d   PER1 PER2 BETA1 BETA2 I MOD PHA RE IM

The three files differ in how a run came to the numbers, not in their layout. A row is T_ij of the wave of the first
period and heading with the conjugate of the second one, in ρ g L (forces) and ρ g L² (moments) a unit amplitude
squared. What is there for one order of the two waves gives the other, T_ji = T_ij*; elements that a file leaves out for
two waves that it has are zero.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.exchange.conventions import CONVENTIONS, MODES, moments_arm, turned
from tlpsim.loads.bem.exchange.wamit_rows import drift_scale, mode_of, numeric_rows
from tlpsim.loads.bem.quadratic_transfer import QuadraticTransfer, adjoint
from tlpsim.loads.constants import SEA_WATER_DENSITY, STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError

ComplexArray = NDArray[np.complex128]

SUFFIXES = (".10d", ".11d", ".12d")
"""Of the files that are read."""
_COLUMNS = 9


def read_wamit_quadratic(
    path: str | Path,
    depth: float = np.nan,
    density: float = SEA_WATER_DENSITY,
    gravity: float = STANDARD_GRAVITY,
    *,
    length: float = 1.0,
    reference_point: ArrayLike = (0.0, 0.0, 0.0),
) -> QuadraticTransfer:
    """Quadratic transfer function of a file .10d, .11d or .12d of one body.

    Parameters
    ----------
    path
        Of the file.
    depth, density, gravity
        Of the run, in m (infinity for deep water, NaN where it is not known), kg/m³, m/s²; the file does not tell them.
    length
        ULEN of the run, m.
    reference_point
        (3,) m, origin of the body's axes (XBODY), that the moments of the run refer to.

    Returns
    -------
    Of all pairs of headings where the file has them all, else of two waves of one heading.

    Raises
    ------
    ScenarioError
        If the file cannot be read, is of several bodies, or lacks a pair of periods.
    """
    file = Path(path)
    rows = numeric_rows(file, _COLUMNS)
    periods = np.unique([row[:2] for row in rows])[::-1]
    if periods[-1] <= 0.0:
        raise ScenarioError(f"{file} has a wave period of {periods[-1]:g} s; run the code at periods above zero")
    headings = np.unique([row[2:4] for row in rows])
    transfer = _of_pairs(file, rows, periods, headings)
    unknown = np.isnan(transfer[..., 0])
    if np.any(unknown):
        transfer = np.einsum("aa...->a...", transfer)
        unknown = np.einsum("aa...->a...", unknown)
    if np.any(unknown):
        a, i, j = np.argwhere(unknown)[0]
        raise ScenarioError(
            f"{file}: {int(unknown.sum())} pairs of waves of one heading are not there, the first of {periods[i]:g} "
            f"and {periods[j]:g} s at {headings[a]:g}°; run the code for all pairs of its periods"
        )
    if len(headings) == 1 and transfer.ndim == 5:
        transfer = transfer[0]
    convention = CONVENTIONS["WAMIT"]
    transfer = turned(transfer, convention.time_sign) * drift_scale(density, gravity, length)
    try:
        return QuadraticTransfer(
            omega=2.0 * np.pi / periods,
            heading=headings * convention.heading_unit,
            transfer=transfer @ moments_arm(reference_point).T,
            depth=depth,
            density=density,
            gravity=gravity,
            contents=f"{file.name} of WAMIT; its run decided if the potential of second order is in it",
        )
    except ScenarioError as error:
        raise ScenarioError(f"{file}: {error}") from error


def _of_pairs(path: Path, rows: list[list[float]], periods: NDArray, headings: NDArray) -> ComplexArray:
    """T (h, h, n, n, 6) without dimensions; NaN for two waves of which the file has no row in either order."""
    place = {value: index for index, value in enumerate(periods.tolist())}
    turn = {value: index for index, value in enumerate(headings.tolist())}
    shape = (len(turn), len(turn), len(place), len(place), MODES)
    result = np.full(shape, np.nan, dtype=np.complex128)
    for row in rows:
        waves = result[turn[row[2]], turn[row[3]], place[row[0]], place[row[1]]]
        if np.all(np.isnan(waves)):
            waves[:] = 0.0
        waves[mode_of(path, abs(row[4]))] = complex(row[7], row[8])
    return np.where(np.isnan(result), adjoint(result), result)
