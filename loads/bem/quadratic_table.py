"""The quadratic part of the difference-frequency transfer function of a hull, at all pairs of some frequencies.

T_ij comes from products of first-order fields (`tlpsim.loads.bem.quadratic`), on one control surface that serves the
shortest wave, or from the pressure. The body moves as it does in the database of the same problem
(`tlpsim.loads.bem.database`), and a coarse mesh extrapolates in the same way, so that the diagonal is the mean drift
there. A pair has the share of the correction of the shorter of its waves. The potential of second order is left out.

A hull of one or two planes of symmetry needs the half or quarter s of the control surface on one side of them only:
with R a reflection in those planes, P_R that of forces, and the integral over s taken m times for m images,

    T(β_a, β_b) = 1/m Σ_R P_R T_s(R β_a, R β_b)                                                              (1)

where the parts of T on the hull, which are taken whole, are the same for every R.

The fields of all frequencies are kept in files that are mapped into memory, since a control surface for short waves has
many points: the system keeps as much of them in memory as there is room for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations_with_replacement
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.bem.control_surface import ControlSurface, control_surface
from tlpsim.loads.bem.convergence import limit, resolved_share
from tlpsim.loads.bem.database import Problem
from tlpsim.loads.bem.discretization import Discretization, discretize
from tlpsim.loads.bem.quadratic import FORMS, quadratic_part
from tlpsim.loads.bem.quadratic_transfer import (
    FIXED_BODY,
    MOVING_BODY,
    QUADRATIC_PART,
    QuadraticTransfer,
    adjoint,
    require_frequencies,
)
from tlpsim.loads.bem.response import response_amplitudes
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.bem.surface import Hull, SurfaceFields, hull_surface, surface_fields
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import wavenumber

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_ON_PLANE = 1e-9  # of the largest distance of a point from a plane
_WIDER = 1.002  # steps of the radius in which an even number of points is looked for
_KEPT = ("potential", "velocity", "displacement", "waterline_potential", "waterline_displacement")
_KEPT_AROUND = ("velocity", "circle_potential", "water_potential", "water_velocity")


def quadratic_table(
    problem: Problem,
    *,
    form: str = "control",
    pairs: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> QuadraticTransfer:
    """Quadratic part of the transfer function at the frequencies and headings of a problem.

    Parameters
    ----------
    problem
        Hull, water, frequencies, headings, and mass and stiffness of a moving body; the body is fixed without them.
    form
        "control" or "pressure", as for `tlpsim.loads.bem.quadratic.quadratic_part`. By pressure it takes seconds, and
        at sharp edges, as those of pontoons, it can be tens of percent off between two frequencies.
    pairs
        Waves of two headings too: (h, h, n, n, 6) instead of (h, n, n, 6).
    progress
        Called as `progress(done, total)` after each frequency, which take nearly all of the time.

    Raises
    ------
    ScenarioError
        If there are fewer than two frequencies, they do not ascend, or the form is unknown.
    """
    omega = np.atleast_1d(np.asarray(problem.omega, dtype=np.float64))
    require_frequencies(omega)
    if form not in FORMS:
        raise ScenarioError(f"form of second-order forces is '{form}'; one of {sorted(FORMS)} is needed")
    numbers = np.asarray(wavenumber(omega, problem.depth, problem.gravity))
    bodies = [discretize(problem.mesh, problem.depth, problem.lid)]
    if problem.coarse is not None:
        bodies.append(discretize(problem.coarse, problem.depth, problem.coarse_lid))
    hulls = [hull_surface(body) for body in bodies]
    sides: list[ControlSurface | None] = [None] * len(bodies)
    images = [np.ones((1, 2))] * len(bodies)
    if form == "control":
        shortest = 2.0 * np.pi / float(numbers[-1])
        images = [body.images for body in bodies]
        sides = [
            _one_side(_symmetric(hull, problem.depth, shortest), each) for hull, each in zip(hulls, images, strict=True)
        ]
    with TemporaryDirectory(prefix="tlpsim-", ignore_cleanup_errors=True) as name:
        fields: list[list[SurfaceFields]] = [[] for _ in bodies]
        shelves: list[dict[str, NDArray]] = [{} for _ in bodies]
        for index, value in enumerate(omega):
            for number, body in enumerate(bodies):
                found = _fields(problem, body, hulls[number], sides[number], images[number], float(value))
                place = Path(name) / str(number)
                fields[number].append(_shelved(found, shelves[number], place, index, len(omega)))
            progress(index + 1, len(omega))
        fine, *coarse = (_table(each, image, form, pairs) for each, image in zip(fields, images, strict=True))
        del fields, shelves
    for rough in coarse:
        share = resolved_share(problem.coarse, numbers)  # type: ignore[arg-type]
        fine = limit(fine, rough, np.minimum(share[:, None], share)[..., None]).value
    kind = FIXED_BODY if problem.mass is None else MOVING_BODY
    return QuadraticTransfer(
        omega=omega,
        heading=np.atleast_1d(np.asarray(problem.heading, dtype=np.float64)),
        transfer=fine,
        depth=problem.depth,
        density=problem.density,
        gravity=problem.gravity,
        contents=f"{QUADRATIC_PART}; {kind} '{problem.mesh.name}', form '{form}'",
    )


def _symmetric(hull: Hull, depth: float, shortest_wave: float) -> ControlSurface:
    """Control surface whose points are symmetric where the hull is: with an even number of them around."""
    found = control_surface(hull, depth, shortest_wave)
    radius = float(np.linalg.norm(found.circle[0]))
    while len(found.circle) % 2:
        radius *= _WIDER
        found = control_surface(hull, depth, shortest_wave, radius)
    return found


def _one_side(whole: ControlSurface, images: FloatArray) -> ControlSurface:
    """The part of a control surface on one side of the planes of symmetry, with the weight of all images, eq. (1)."""
    axes = np.flatnonzero(np.any(images < 0.0, axis=0))

    def weight(places: FloatArray) -> FloatArray:
        inside = places[:, axes]
        near = _ON_PLANE * np.max(np.abs(places), initial=0.0)
        return np.asarray(np.prod(np.where(inside > near, 2.0, np.where(inside < -near, 0.0, 1.0)), axis=1))

    wall, circle, water = (weight(places) for places in (whole.places, whole.circle, whole.water))
    return replace(
        whole,
        places=whole.places[wall > 0.0],
        normal=(whole.normal * wall[:, None])[wall > 0.0],
        circle=whole.circle[circle > 0.0],
        circle_normal=(whole.circle_normal * circle[:, None])[circle > 0.0],
        water=whole.water[water > 0.0],
        water_seen=whole.water_seen[water > 0.0],
        water_share=whole.water_share[water > 0.0],
        water_piece=whole.water_piece[water > 0.0],
        water_area=(whole.water_area * water)[water > 0.0],
    )


def _reflections(images: FloatArray) -> FloatArray:
    """Diagonals (m, 6) of P_R: forces and displacements are polar, moments and rotations axial vectors."""
    x, y = images.T
    return np.stack([x, y, np.ones_like(x), y, x, x * y], axis=1)


def _fields(
    problem: Problem,
    body: Discretization,
    hull: Hull,
    side: ControlSurface | None,
    images: FloatArray,
    omega: float,
) -> SurfaceFields:
    """Fields at one frequency for all reflections R of all headings, R slowest."""
    heading = np.atleast_1d(np.asarray(problem.heading, dtype=np.float64))
    turned = np.arctan2(images[:, 1:] * np.sin(heading), images[:, :1] * np.cos(heading)).ravel()
    solution = solve(body, omega, turned, problem.density, problem.gravity)
    motion = np.zeros((len(turned), 6), dtype=np.complex128)
    if problem.mass is not None and problem.stiffness is not None:
        own = response_amplitudes(solution, problem.mass, problem.stiffness)[: len(heading)]
        motion = (_reflections(images)[:, None, :] * own).reshape(-1, 6)
    return surface_fields(body, solution, motion, hull, side)


def _shelved(found: SurfaceFields, shelf: dict[str, NDArray], place: Path, index: int, count: int) -> SurfaceFields:
    """Fields whose arrays lie in files `place`*, one for each kind of array of `count` frequencies."""

    def kept(record: Any, names: tuple[str, ...], prefix: str) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for name in names:
            value, key = getattr(record, name), f"{place}-{prefix}{name}"
            if value.size:
                if key not in shelf:
                    shelf[key] = np.memmap(key, value.dtype, "w+", shape=(count, *value.shape))
                shelf[key][index] = value
                result[name] = np.asarray(shelf[key][index])
        return result

    around = found.control
    if around is not None:
        around = replace(around, **kept(around, _KEPT_AROUND, "around-"))
    return replace(found, **kept(found, _KEPT, ""), control=around)


def _table(fields: list[SurfaceFields], images: FloatArray, form: str, pairs: bool) -> ComplexArray:
    """T (h, n, n, 6), or (h, h, n, n, 6) of pairs, of one mesh, eq. (1)."""
    sign, count = _reflections(images), len(fields)
    headings = len(fields[0].headings) // len(sign)
    result = np.zeros((headings, headings, count, count, 6), dtype=np.complex128)
    for i, j in combinations_with_replacement(range(count), 2):
        part = quadratic_part(fields[i], fields[j], form)
        part = part.reshape(len(sign), headings, len(sign), headings, 6)
        result[:, :, i, j] = np.einsum("kakbc,kc->abc", part, sign) / len(sign)
    if not pairs:
        result = np.einsum("aa...->a...", result)
    lower = np.tril_indices(count, -1)
    result[..., lower[0], lower[1], :] = adjoint(result)[..., lower[0], lower[1], :]
    return result
