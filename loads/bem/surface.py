"""The first-order field on the wetted hull and its waterline, as second-order forces need it.

The potential φ is constant on panels; the velocity at their centres is its tangential gradient g
(`tlpsim.loads.bem.gradient`) with the known normal velocity,

    ∇φ = g + n φ_n                                                                                          (1)

On the waterline the free-surface condition φ_z = K φ closes the trapezoidal rule from the centre of the panel beneath,
at the offset Δ:

    φ_0 = φ + ∇φ · Δ + ½ (K φ_0 - φ_z) Δ_z                                                                  (2)

The elevation relative to the moving hull, X = ξ + α × x its displacement, is η - X_z, η = -i ω φ_0 / g.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from tlpsim.loads.bem.control_surface import ControlFields, ControlSurface, control_fields
from tlpsim.loads.bem.discretization import Discretization
from tlpsim.loads.bem.gradient import TangentialGradient, tangential_gradient
from tlpsim.loads.bem.response import total_potential
from tlpsim.loads.bem.solver import Solution
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_DRY = 1e-6  # of the hull's draft
_RIGID = 6
_VERTICAL = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Waterline:
    """Straight pieces of the waterline: the panels they bound, their middles, steps and normals (pieces, 3).

    `step` runs with the hull on its left seen from outside and above, so that step = n × ẑ dl for a vertical hull.
    `normal` is n / √(1 - n_z²) times the length, which is that of the hull continued above the water.
    """

    panel: NDArray[np.int64]
    middle: FloatArray
    step: FloatArray
    normal: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Hull:
    """All panels of the wetted hull, image after image, with the operators of eqs. (1), (2).

    Attributes
    ----------
    centre, normal, area
        (n, 3), (n, 3), (n,) of panels, normals out of the body.
    places, weights
        Gauss points of the panels (n, q, 3) and their weights (n, q) in m².
    gradient
        Operator of the tangential gradient.
    waterline
        Pieces of the waterline; none for a submerged body.
    """

    name: str
    centre: FloatArray
    normal: FloatArray
    area: FloatArray
    places: FloatArray
    weights: FloatArray
    gradient: TangentialGradient
    waterline: Waterline


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceFields:
    """First-order fields on a hull at one frequency, for waves of unit amplitude to each heading.

    Attributes
    ----------
    motion
        (headings, 6): surge, sway, heave in m and roll, pitch, yaw in rad about the origin.
    potential, velocity
        On the panels, (n, headings), and at their centres, (n, headings, 3).
    displacement
        X of the panels, (n, headings, 3).
    waterline_potential, waterline_displacement
        On the pieces of the waterline, (pieces, headings) and (pieces, headings, 3).
    control
        The field on a control surface, if one was given.
    """

    omega: float
    density: float
    gravity: float
    depth: float
    headings: FloatArray
    hull: Hull
    motion: ComplexArray
    potential: ComplexArray
    velocity: ComplexArray
    displacement: ComplexArray
    waterline_potential: ComplexArray
    waterline_displacement: ComplexArray
    control: ControlFields | None


def hull_surface(discretization: Discretization) -> Hull:
    """All panels of a hull, its gradient operator, eq. (1), and its waterline; it serves all frequencies."""
    count = discretization.hull_count
    both, rule = discretization.panels, discretization.outer
    turns = [np.array([x, y, 1.0]) for x, y in discretization.images]
    corners, normal, centre, places = (
        np.concatenate([array[:count] * turn for turn in turns])
        for array in (both.corners, both.normal, both.centre, rule.places)
    )
    repeat = len(turns)
    gradient = tangential_gradient(corners, centre, normal, np.tile(both.size[:count], repeat))
    return Hull(
        name=discretization.name,
        centre=centre,
        normal=normal,
        area=np.tile(both.area[:count], repeat),
        places=places,
        weights=np.tile(rule.weights[:count], (repeat, 1)),
        gradient=gradient,
        waterline=_waterline(corners, centre, normal, gradient),
    )


def surface_fields(
    discretization: Discretization,
    solution: Solution,
    motion: ArrayLike,
    hull: Hull | None = None,
    control: ControlSurface | None = None,
) -> SurfaceFields:
    """Fields on the hull of one rigid body that moves by `motion`.

    Parameters
    ----------
    discretization, solution
        The body and its potentials at one frequency; its modes are the six of a rigid body about the origin.
    motion
        Response amplitudes (headings, 6) per m of wave amplitude; zero for a fixed body.
    hull
        From `hull_surface`, to serve several frequencies; made here if None.
    control
        From `control_surface.control_surface`, the same for all frequencies of a pair; None where it is not wanted.

    Raises
    ------
    ScenarioError
        If there are other than six modes, or the motion does not fit the solution.
    """
    if solution.radiation.shape[2] != _RIGID:
        raise ScenarioError(
            f"'{discretization.name}' has {solution.radiation.shape[2]} modes; second-order forces are those of one "
            f"rigid body, with the {_RIGID} modes about the origin: discretize it without `modes`"
        )
    body = hull_surface(discretization) if hull is None else hull
    amplitudes = np.asarray(motion, dtype=np.complex128)
    total, speed = total_potential(discretization, solution, amplitudes)
    potential, rate = (array.reshape(-1, array.shape[2]) for array in (total, speed))
    velocity = np.stack([matrix @ potential for matrix in body.gradient.matrices], axis=-1)
    velocity += rate[..., None] * body.normal[:, None, :]
    line = body.waterline
    offset = line.middle - body.centre[line.panel]
    number = solution.omega**2 / solution.gravity
    below, flow = potential[line.panel], velocity[line.panel]
    reached = below + np.einsum("phk,pk->ph", flow, offset) - 0.5 * flow[..., 2] * offset[:, 2:]
    reached /= 1.0 - 0.5 * number * offset[:, 2:]
    around = None
    if control is not None:
        bend = np.stack([_carried(matrix, velocity)[line.panel] for matrix in body.gradient.matrices], axis=-1)
        along = flow + np.einsum("phck,pk->phc", bend, offset)
        along[..., 2] = number * reached
        around = control_fields(discretization, solution, amplitudes, control, reached, along)
    return SurfaceFields(
        omega=solution.omega,
        density=solution.density,
        gravity=solution.gravity,
        depth=solution.depth,
        headings=solution.headings,
        hull=body,
        motion=amplitudes,
        potential=potential,
        velocity=velocity,
        displacement=displacement(amplitudes, body.centre),
        waterline_potential=reached,
        waterline_displacement=displacement(amplitudes, line.middle),
        control=around,
    )


def _carried(matrix: sparse.csr_matrix, field: NDArray) -> NDArray:
    """A matrix (n, n) times a field (n, ...)."""
    return np.asarray(matrix @ field.reshape(len(field), -1)).reshape(field.shape)


def displacement(motion: ComplexArray, places: FloatArray) -> ComplexArray:
    """X = ξ + α × x, (places, headings, 3), of a motion (headings, 6)."""
    return np.asarray(motion[None, :, :3] + np.cross(motion[None, :, 3:], places[:, None, :]))


def _waterline(corners: FloatArray, centre: FloatArray, normal: FloatArray, gradient: TangentialGradient) -> Waterline:
    """Edges of panels that lie in z = 0, without those of panels that lie there altogether.

    The normal is taken on to the waterline by its own gradient: the first panel of a hull that curves leans already.
    """
    start, end = corners, np.roll(corners, -1, axis=1)
    tolerance = _DRY * max(-float(np.min(corners[:, :, 2])), 1e-300)
    length = np.linalg.norm(end - start, axis=2)
    dry = (np.abs(start[:, :, 2]) < tolerance) & (np.abs(end[:, :, 2]) < tolerance) & (length > tolerance)
    panel, edge = np.nonzero(dry & (np.abs(normal[:, 2]) < 1.0 - _DRY)[:, None])
    a, b = start[panel, edge], end[panel, edge]
    middle, step = 0.5 * (a + b), b - a
    step *= np.sign(np.einsum("pk,pk->p", step, np.cross(normal[panel], _VERTICAL)))[:, None]
    bend = np.stack([(matrix @ normal)[panel] for matrix in gradient.matrices], axis=1)
    lean = normal[panel] + np.einsum("pk,pkl->pl", middle - centre[panel], bend)
    slope = lean[:, 2] / np.linalg.norm(lean[:, :2], axis=1)
    return Waterline(
        panel=panel,
        middle=middle,
        step=step,
        normal=np.cross(_VERTICAL, step) + np.linalg.norm(step, axis=1)[:, None] * slope[:, None] * _VERTICAL,
    )
