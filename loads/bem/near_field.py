"""Mean drift in all six degrees of freedom, by pressure on the hull or by momentum through a surface around it.

The mean drift is the diagonal of the quadratic transfer function (`tlpsim.loads.bem.quadratic`), a_i a_i* T_ii: no
potential of second order enters it. Which form to take:

- the far field (`response.mean_drift`) for surge, sway and yaw of all that floats in a control volume: cheapest;
- the control surface for all six: its velocities are smooth, whatever the hull's edges;
- pressure on the hull, for hulls without sharp edges, and as an independent check. At an edge of 90° the velocity grows
  as r^(-1/3); though the fit of the velocity knows that, the force converges with the first power of the panels' size
  only, and on the bottom of a box from below.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.control_surface import control_surface
from tlpsim.loads.bem.discretization import Discretization
from tlpsim.loads.bem.quadratic import quadratic_part
from tlpsim.loads.bem.solver import Solution
from tlpsim.loads.bem.surface import Hull, hull_surface, surface_fields

FloatArray = NDArray[np.float64]


def near_field_drift(
    discretization: Discretization,
    solution: Solution,
    motion: ArrayLike,
    form: str = "control",
    hull: Hull | None = None,
) -> FloatArray:
    """Mean drift about the origin, (headings, 6), in N/m² and N m/m², per amplitude squared.

    Parameters
    ----------
    discretization, solution
        One rigid body with its six modes, and its potentials at one frequency.
    motion
        Response amplitudes (headings, 6) per m of wave amplitude; zero for a fixed body.
    form
        "control" or "pressure", see above.
    hull
        From `surface.hull_surface`, to serve several frequencies; made here if None.

    Raises
    ------
    ScenarioError
        If the form is unknown, the modes are not those of one rigid body, or the motion does not fit the solution.

    Notes
    -----
    Forces are those of the water on the wetted hull: what a body in roll or pitch gets of its weight is not in them.
    """
    body = hull_surface(discretization) if hull is None else hull
    around = None
    if form == "control":
        around = control_surface(body, solution.depth, 2.0 * np.pi / solution.wavenumber)
    fields = surface_fields(discretization, solution, motion, body, around)
    index = np.arange(len(solution.headings))
    return np.asarray(quadratic_part(fields, fields, form)[index, index].real)
