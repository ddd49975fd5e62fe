"""What serves all frequencies: panels, their Rankine integrals and quadratures, modes and symmetry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem import influence
from tlpsim.loads.bem.mesh import Mesh, Panels, panels
from tlpsim.loads.bem.rankine import influence as rankine_influence
from tlpsim.loads.bem.rankine import second_moments
from tlpsim.loads.bem.symmetry import CHARACTERS, Fold, find_fold
from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

_OUTER_ORDER = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Means:
    """How means over field panels are taken: points (n, q, 3), shares (n, q), second moments over area (n, 6)."""

    places: FloatArray
    shares: FloatArray
    spread: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Discretization:
    """All that depends on the mesh and the depth only; made by `discretize`.

    Attributes
    ----------
    panels
        Flat panels of the hull, then of the lid: n of them.
    hull_count
        Number of panels of the hull.
    images, characters, fold
        Signs (m, 2) of the images, characters (m, m) of the symmetry classes, and which fields are stored of them.
    modes
        Normal velocity (images, hull panels, modes) of each mode for unit velocity.
    direct, surface, rankine
        Integrals of 1/r, of 1/r1 and of all Rankine terms (with 1/r2 in finite depth): (2, classes, source, stored
        field), single and double layer.
    moments, outer, means, near
        Second moments of the panels, the points over which fields are averaged, how the Rankine terms are, and the
        near pairs of the wave part.
    """

    name: str
    depth: float
    panels: Panels
    hull_count: int
    images: FloatArray
    characters: FloatArray
    fold: Fold
    modes: FloatArray
    direct: FloatArray
    surface: FloatArray
    rankine: FloatArray
    moments: FloatArray
    outer: influence.Quadrature
    means: Means
    near: tuple[influence.NearPairs, ...]


def rigid_modes(mesh: Mesh, reference: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """Normal velocity (images, panels, 6) of surge, sway, heave, roll, pitch, yaw about a point."""
    geometry = panels(mesh)
    result = np.empty((len(mesh.images), len(geometry.area), 6))
    for image, signs in enumerate(mesh.images):
        turn = np.array([signs[0], signs[1], 1.0])
        normal = geometry.normal * turn
        result[image, :, :3] = normal
        result[image, :, 3:] = np.cross(geometry.centre * turn - np.asarray(reference, dtype=np.float64), normal)
    return result


def discretize(
    mesh: Mesh,
    depth: float = np.inf,
    lid: Mesh | None = None,
    modes: FloatArray | None = None,
    collocation: bool = False,
) -> Discretization:
    """Panels, Rankine integrals and quadrature of a mesh; everything that serves all frequencies.

    Parameters
    ----------
    mesh
        Wetted hull of one or several bodies.
    depth
        Water depth in m, infinity for deep water.
    lid
        Panels on the inner water plane (`hulls.lid`) against irregular frequencies.
    modes
        Normal velocity (images, panels, modes) of the modes; the six of a rigid body about the origin if None.
    collocation
        Demand the equations at the panels' centres, as most panel codes do, not in the mean over each panel, which
        halves the error at edges.

    Raises
    ------
    ScenarioError
        If the hull reaches the bottom or lid and hull differ in their planes of symmetry.
    """
    hull = panels(mesh)
    if not depth > -float(np.min(mesh.vertices[:, :, 2])):
        raise ScenarioError(
            f"mesh '{mesh.name}' reaches z = {np.min(mesh.vertices[:, :, 2]):.3g} m; depth is {depth} m"
        )
    if lid is not None and lid.planes != mesh.planes:
        raise ScenarioError(f"lid has planes {lid.planes}, mesh '{mesh.name}' {mesh.planes}; make it of the same mesh")
    both = hull if lid is None else panels(Mesh(name=mesh.name, vertices=np.concatenate([mesh.vertices, lid.vertices])))
    moving = rigid_modes(mesh) if modes is None else np.asarray(modes, dtype=np.float64)
    if moving.ndim != 3 or moving.shape[:2] != (len(mesh.images), len(hull.area)):
        raise ScenarioError(
            f"modes have shape {moving.shape}; ({len(mesh.images)} images, {len(hull.area)} panels, modes) is needed"
        )
    characters = CHARACTERS[len(mesh.images)]
    moments = second_moments(both.corners, both.centre)
    rule = influence.quadrature(both, _OUTER_ORDER)
    means = Means(
        places=both.centre[:, None] if collocation else rule.places,
        shares=np.ones((len(both.area), 1)) if collocation else rule.weights / both.area[:, None],
        spread=np.zeros_like(moments) if collocation else moments / both.area[:, None],
    )
    fold = find_fold(both, moments, len(mesh.images))
    direct = rankine_matrices(both, fold, means, moments, mesh.images, characters, 1.0, 0.0)
    surface = rankine_matrices(both, fold, means, moments, mesh.images, characters, -1.0, 0.0)
    total = direct + surface
    if np.isfinite(depth):
        total += rankine_matrices(both, fold, means, moments, mesh.images, characters, -1.0, -2.0 * depth)
    return Discretization(
        name=mesh.name,
        depth=depth,
        panels=both,
        hull_count=len(hull.area),
        images=mesh.images,
        characters=characters,
        fold=fold,
        modes=moving,
        direct=direct,
        surface=surface,
        rankine=total,
        moments=moments,
        outer=rule,
        means=means,
        near=influence.near_pairs(both, mesh.images, fold),
    )


def rankine_matrices(
    both: Panels,
    fold: Fold,
    means: Means,
    moments: FloatArray,
    images: FloatArray,
    characters: FloatArray,
    sign_z: float,
    shift: float,
) -> FloatArray:
    """Single and double layer (2, classes, source, stored field) of 1/r with the field point at sign_z z + shift."""
    result = np.zeros((2, len(images), len(both.area), len(fold.fields)))
    arrays = (both.corners, both.normal, both.centre, both.area, both.size, moments)
    field = (means.places, means.shares, means.spread)
    for image, (sign_x, sign_y) in enumerate(images):
        layers = rankine_influence(fold.fields, *field, sign_x, sign_y, sign_z, shift, *arrays)
        for layer in range(2):
            for row in range(len(images)):
                result[layer, row] += characters[row, image] * layers[layer].T
    return result
