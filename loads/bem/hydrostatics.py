"""Hydrostatics of a panelled hull, and the weight of the body that floats in it.

All integrals run over the wetted hull S, normal n out of the body; by Gauss' theorem they stand for the volume and,
with ∫ n_z over hull and water plane zero for any f(x, y), for the water plane A:

    V = ∫ x n_x dS = ∫ y n_y dS = ∫ z n_z dS,    V x_b = ½ ∫ x² n_x dS,    likewise y_b and z_b            (1)
    ∫_A f(x, y) dA = -∫_S f(x, y) n_z dS                                                                 (2)

Restoring forces about the origin, of the buoyancy alone (Newman 1977, Marine Hydrodynamics, section 6.16):

    C33 = ρ g A,   C34 = ρ g ∫ y dA,   C35 = -ρ g ∫ x dA,   C45 = -ρ g ∫ x y dA
    C44 = ρ g (∫ y² dA + V z_b),   C55 = ρ g (∫ x² dA + V z_b),   C46 = -ρ g V x_b,   C56 = -ρ g V y_b       (3)

and of the weight of a mass m at x_g, y_g, z_g:

    C44 = C55 = -m g z_g,   C46 = m g x_g,   C56 = m g y_g                                               (4)

Moments are about the point of the body that rests at the origin, along axes fixed in space.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.mesh import Mesh, whole
from tlpsim.loads.constants import SEA_WATER_DENSITY, STANDARD_GRAVITY
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hydrostatics:
    """Buoyancy and water plane of a hull at rest, about the origin.

    Attributes
    ----------
    volume
        Displaced, m³.
    centre_of_buoyancy
        (3,) m.
    waterplane_area
        m².
    waterplane_first_moments
        (2,) m³: ∫ x dA and ∫ y dA.
    waterplane_second_moments
        (3,) m⁴: ∫ x² dA, ∫ y² dA and ∫ x y dA.
    stiffness
        (6, 6) N/m, N, N m by eq. (3): without the terms of the centre of gravity, `weight_stiffness`.
    """

    volume: float
    centre_of_buoyancy: FloatArray
    waterplane_area: float
    waterplane_first_moments: FloatArray
    waterplane_second_moments: FloatArray
    stiffness: FloatArray


def hydrostatics(mesh: Mesh, density: float = SEA_WATER_DENSITY, gravity: float = STANDARD_GRAVITY) -> Hydrostatics:
    """Hydrostatics of a mesh, eqs. (1) to (3), exact for its triangles.

    Parameters
    ----------
    mesh
        Wetted hull.
    density, gravity
        kg/m³, m/s².

    Raises
    ------
    ScenarioError
        If the mesh encloses no volume.
    """
    corners = whole(mesh).vertices
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    vector = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    mean = triangles.mean(axis=1)
    # Mean of a product of two coordinates over a triangle: (3 mean meanᵀ + sum over its corners / 3) / 4.
    product = 0.75 * np.einsum("ti,tj->tij", mean, mean) + np.einsum("tki,tkj->tij", triangles, triangles) / 12.0
    volume = float(np.mean(np.sum(mean * vector, axis=0)))
    if not volume > 0.0:
        raise ScenarioError(
            f"mesh '{mesh.name}' encloses {volume:.4g} m³; its normals must point out of the body: reverse every panel"
        )
    centre = 0.5 * np.einsum("tii,ti->i", product, vector) / volume
    down = -vector[:, 2]
    first = np.array([mean[:, 0] @ down, mean[:, 1] @ down])
    second = np.array([product[:, 0, 0] @ down, product[:, 1, 1] @ down, product[:, 0, 1] @ down])
    for axis, plane in enumerate(("x", "y")):
        if plane in mesh.planes:  # exactly zero, not but for rounding
            centre[axis] = first[axis] = second[2] = 0.0
    return of_figures(volume, centre, float(np.sum(down)), first, second, density, gravity)


def of_figures(
    volume: float,
    centre_of_buoyancy: ArrayLike,
    waterplane_area: float,
    first_moments: ArrayLike,
    second_moments: ArrayLike,
    density: float = SEA_WATER_DENSITY,
    gravity: float = STANDARD_GRAVITY,
) -> Hydrostatics:
    """Hydrostatics of a hull of known volume, centre of buoyancy and water plane, eq. (3).

    Parameters and their units are those of `Hydrostatics`.
    """
    centre = np.array(centre_of_buoyancy, dtype=np.float64)
    (x, y), (xx, yy, xy) = np.asarray(first_moments, dtype=np.float64), np.asarray(second_moments, dtype=np.float64)
    stiffness = np.zeros((6, 6))
    stiffness[2, 2:5] = waterplane_area, y, -x
    stiffness[3, 3:] = yy + volume * centre[2], -xy, -volume * centre[0]
    stiffness[4, 4:] = xx + volume * centre[2], -volume * centre[1]
    upper = np.triu(stiffness[:5, :5], 1)
    stiffness[:5, :5] += upper.T  # the sixth column has no mirror: a yaw turns the forces, but no force yaws
    return Hydrostatics(
        volume=volume,
        centre_of_buoyancy=centre,
        waterplane_area=waterplane_area,
        waterplane_first_moments=np.array([x, y]),
        waterplane_second_moments=np.array([xx, yy, xy]),
        stiffness=density * gravity * stiffness,
    )


def weight_stiffness(mass: float, centre_of_gravity: ArrayLike, gravity: float = STANDARD_GRAVITY) -> FloatArray:
    """Restoring matrix (6, 6) in N/m, N, N m of the weight of a body (kg, (3,) m), eq. (4)."""
    x, y, z = np.asarray(centre_of_gravity, dtype=np.float64)
    result = np.zeros((6, 6))
    result[3, 3] = result[4, 4] = -z
    result[3, 5], result[4, 5] = x, y
    return mass * gravity * result
