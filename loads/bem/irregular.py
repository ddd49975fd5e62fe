"""A lower bound of a hull's irregular frequencies, from its water planes and draught alone.

Without a lid the equations of `tlpsim.loads.bem.solver` fail where the water that would fill the body could slosh with
Φ = 0 on the hull: ∂Φ/∂z = K Φ on the water plane, K = omega²/g in water of any depth (John 1950). Over any level z the
horizontal gradient of Φ is at least λ(z) ∫Φ² dA in square, with λ the Dirichlet eigenvalue of the section, which by
Faber and Krahn's inequality is at least that of the circle of the section's area A:

    λ(z) ≥ k² = j01² π / A(z),   j01 the first zero of J0                                                       (1)

so that K is no smaller than the least of ∫ (g'² + λ g²) dz / g(0)² over all g with g = 0 at the keel. With A no larger
than the water plane from z = 0 to -d, where the hull first widens, and than A1 from there to the draught T,

    K ≥ k coth k T                                                       if the hull nowhere widens,         (2)
    K ≥ k (k1 coth k1 (T - d) + k tanh k d) / (k + k1 coth k1 (T - d) tanh k d)    otherwise.                (3)

Upright circular cylinders reach (2); a square box comes within 4 % in k. A1 is the water plane and all the surface
above the keel that looks up, seen from above.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from tlpsim.loads.bem.mesh import Mesh, connected, joined_loops, panels, waterline_loops, whole
from tlpsim.loads.checks import require_positive
from tlpsim.loads.constants import STANDARD_GRAVITY

FloatArray = NDArray[np.float64]

FIRST_ZERO = float(special.jn_zeros(0, 1)[0])
"""j01: the circular membrane of radius a has its lowest wavenumber at j01 / a."""

_UPWARDS = 1e-3  # n_z from which a panel looks up; steeper walls count as upright


def lowest_irregular_frequency(mesh: Mesh, gravity: float = STANDARD_GRAVITY) -> float:
    """Frequency (rad/s) below which a hull without a lid has no irregular one, eqs. (2), (3).

    Each connected body of the mesh, and each of its water planes, is looked at; water in a moonpool counts as body,
    which lowers the bound. Depth does not matter.

    Parameters
    ----------
    mesh
        Wetted hull, with or without planes of symmetry.
    gravity
        In m/s².

    Returns
    -------
    The bound; infinity if nothing pierces the water.

    Raises
    ------
    ScenarioError
        If gravity is not positive or a panel has no area.
    """
    require_positive("gravity", gravity, "m/s²")
    lowest = min((_body_bound(body) for body in _bodies(whole(mesh))), default=np.inf)
    return float(np.sqrt(gravity * lowest))


def irregular_warning(mesh: Mesh, omega: ArrayLike, gravity: float = STANDARD_GRAVITY) -> str | None:
    """What to say of a hull that is to be solved without a lid at `omega` (rad/s); None if no frequency is at risk."""
    frequencies = np.atleast_1d(np.asarray(omega, dtype=np.float64))
    lowest = lowest_irregular_frequency(mesh, gravity)
    risky = int(np.sum(frequencies >= lowest))
    if not risky:
        return None
    return (
        f"mesh '{mesh.name}': {risky} of {len(frequencies)} frequencies, up to {np.max(frequencies):.4g} rad/s, may be "
        f"irregular; without a lid only those below {lowest:.4g} rad/s are safe: add a lid (hulls.lid), or drop them"
    )


def _bodies(mesh: Mesh) -> list[Mesh]:
    """The connected parts of a mesh without planes of symmetry: panels that share a vertex belong together."""
    label = connected(mesh.vertices)
    return [Mesh(name=mesh.name, vertices=mesh.vertices[label == body]) for body in np.unique(label)]


def _body_bound(body: Mesh) -> float:
    """The bound of K of one body, eqs. (2), (3)."""
    areas = _water_planes(body)
    if not len(areas):
        return float(np.inf)
    geometry = panels(body)
    draft = -float(np.min(body.vertices[:, :, 2]))
    upward = geometry.normal[:, 2] > _UPWARDS
    below = np.inf
    straight = draft
    if np.any(upward):
        straight = max(0.0, -float(np.max(body.vertices[upward, :, 2])))
        widest = float(np.sum(areas) + np.sum(geometry.area[upward] * geometry.normal[upward, 2]))
        k1 = _wavenumber(widest)
        below = k1 / np.tanh(k1 * (draft - straight))
    k = _wavenumber(float(np.max(areas)))  # eq. (3) rises with k
    bend = np.tanh(k * straight)
    return float(k / bend) if np.isinf(below) else float(k * (below + k * bend) / (k + below * bend))


def _wavenumber(area: float) -> float:
    return FIRST_ZERO * float(np.sqrt(np.pi / area))


def _water_planes(body: Mesh) -> FloatArray:
    """Areas (loops,) inside the loops of the waterline; the inner loop of a moonpool runs the other way round."""
    areas = []
    for loop in joined_loops(waterline_loops(body)):
        start, end = loop[:, 0], loop[:, 1]
        areas.append(0.5 * float(np.sum(end[:, 0] * start[:, 1] - start[:, 0] * end[:, 1])))
    return np.array([area for area in areas if area > 0.0])
