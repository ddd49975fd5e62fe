"""Wave drift damping by Aranha's formula, from the mean drift of the body without speed.

A body that moves slowly with velocity u = (u_x, u_y) in deep water, e = (cos β, sin β) the direction of the waves and
e' = (-sin β, cos β), gets the drift force (Aranha 1994, J. Fluid Mech. 275; 1996, J. Fluid Mech. 313)

    D(u) = (1 - 4 ω/g u·e) D_0(ω_e, β_e),   ω_e = ω (1 - ω/g u·e),   β_e = β - 2 ω/g u·e'                    (1)

to the first order of u: encounter frequency, the direction of the waves' energy seen from the body (group velocity less
u), and a change of amplitude. The damping force is -B u,

    B_ij = -∂D_i/∂u_j = ω/g [(4 D_i + ω ∂D_i/∂ω) e_j + 2 ∂D_i/∂β e'_j]                                       (2)

Limits. The formula is for deep water, and for speeds far below g/(4 ω). Its derivation is heuristic; where it has been
compared with the problem of small speed solved in full, it was good for fixed bodies, while a body that moves strongly
in the waves may depart from it, as its motions interact with the flow that it makes. The change of the yaw moment with
the speeds of surge and sway is taken to follow (1) with the moment for the force (Aranha 1996). Damping of the yaw
motion itself does not follow from drift coefficients, and is left out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

_FEWEST_FREQUENCIES = 4
_FEWEST_HEADINGS = 2
_ROUND = 1e-9  # rad


def wave_drift_damping(
    drift: ArrayLike, omega: ArrayLike, heading: ArrayLike, gravity: float = STANDARD_GRAVITY
) -> FloatArray:
    """Aranha's damping per amplitude squared, eq. (2), of forces in surge and sway, and of the moment in yaw if given.

    Parameters
    ----------
    drift
        Mean drift (frequencies, headings, 2 or 3) of surge, sway and perhaps yaw, in N/m² and N m/m².
    omega
        Frequencies in rad/s, rising, at least four.
    heading
        Directions of propagation in rad, rising, at least two. Headings that span a whole turn, 2 π from the first to
        the last, are taken as periodic. Derivatives are those of cubic splines.
    gravity
        In m/s².

    Returns
    -------
    (frequencies, headings, 2 or 3, 2)
        B in N s/m³ and N s/m²; columns are velocities of surge and sway.

    Raises
    ------
    ScenarioError
        If the arrays do not fit each other, or are too short or not rising.
    """
    values, frequencies, directions = (np.asarray(array, dtype=np.float64) for array in (drift, omega, heading))
    require_positive("angular frequencies of the drift", frequencies, "rad/s")
    require_positive("gravity", gravity, "m/s²")
    if values.ndim != 3 or values.shape[:2] != (len(frequencies), len(directions)) or values.shape[2] not in (2, 3):
        raise ScenarioError(
            f"drift has shape {values.shape}; (frequencies, headings, 2 or 3) = "
            f"({len(frequencies)}, {len(directions)}, 2 or 3) is needed"
        )
    for what, grid, fewest in (
        ("frequencies", frequencies, _FEWEST_FREQUENCIES),
        ("headings", directions, _FEWEST_HEADINGS),
    ):
        if len(grid) < fewest or np.any(np.diff(grid) <= 0.0):
            raise ScenarioError(
                f"drift damping needs derivatives: give at least {fewest} rising {what}, not {len(grid)}: {grid}"
            )
    over_frequency = CubicSpline(frequencies, values, axis=0)(frequencies, 1)
    over_heading = _by_heading(directions, values)
    scale = (frequencies / gravity)[:, None, None, None]
    along = np.stack([np.cos(directions), np.sin(directions)], axis=-1)[None, :, None, :]
    across = np.stack([-np.sin(directions), np.cos(directions)], axis=-1)[None, :, None, :]
    change = 4.0 * values + frequencies[:, None, None] * over_frequency
    return np.asarray(scale * (change[..., None] * along + 2.0 * over_heading[..., None] * across))


def _by_heading(directions: FloatArray, values: FloatArray) -> FloatArray:
    """Derivative by the heading, periodic where the headings close the circle."""
    closed = abs(directions[-1] - directions[0] - 2.0 * np.pi) < _ROUND
    if not closed:
        return np.asarray(CubicSpline(directions, values, axis=1)(directions, 1))
    ends = np.array(values)
    ends[:, -1] = ends[:, 0]
    return np.asarray(CubicSpline(directions, ends, axis=1, bc_type="periodic")(directions, 1))
