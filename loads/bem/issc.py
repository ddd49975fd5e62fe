"""The hydrodynamic database of the ISSC tension leg platform, computed on first use and kept in the user's cache.

Frequencies are equally spaced in ω at first, then in the wavenumber k = ω²/g: waves that run between columns at a
distance 2 b meet with phases 2 k b, so that coefficients swing with a period of π / b in k, here 0.05 rad/m from
corner to corner. Excitation swings with 2 π / b. The narrowest swing, of excitation in heave about 1.05 rad/s, sets
the spacing in ω: interpolated there, the heave of a regular wave of 6 s is 0.9 % off (`benchmarks/physics.py`). The
highest frequency is a tenth above 0.35 Hz, the end of the band in which waves act by default
(`tlpsim.loads.waves.elevation`). Panels of 3.5 m are then a third of a wave long, which is coarse, but excitation and
damping are small there.

The drift is that of the platform on its tethers, moving in the waves. So the database is one of a hull's draught, mass
and inertia. Its tethers are always those of the ISSC TLP with the pretension that balances the hull: they set the slow
and the stiff modes, outside the waves.

Headings cover 45°; the hull's symmetry gives the others (`tlpsim.loads.hydro.diffraction`). Over the whole circle
they are 96, which resolves exp(-i k b cos(β - β₀)) with b = 61 m up to k b = 37 at the highest frequency.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads import issc_tlp
from tlpsim.loads.bem.database import HydrodynamicDatabase, Problem, cached, read
from tlpsim.loads.bem.hulls import issc_hull, lid, tlp
from tlpsim.loads.constants import SEA_WATER_DENSITY, STANDARD_GRAVITY
from tlpsim.loads.issc_tlp import ISSC, WATER_DEPTH, Hull
from tlpsim.loads.platform.motion import PlatformModel
from tlpsim.loads.rigid_body import mass_matrix

FloatArray = NDArray[np.float64]

PANEL = 3.5
"""m, about the size of a panel."""
LOWEST_FREQUENCY, JOINT_FREQUENCY, HIGHEST_FREQUENCY = 0.05, 1.13, 2.43
"""rad/s; the spacing is even in ω below the joint and even in k above."""
FREQUENCY_STEP = 0.0225
"""rad/s"""
WAVENUMBER_STEP = 0.009
"""rad/m"""
HEADING_STEP = np.radians(3.75)
"""rad"""


def issc_frequencies(gravity: float = STANDARD_GRAVITY) -> FloatArray:
    """Frequencies of the database in rad/s, ascending."""
    count = round((JOINT_FREQUENCY - LOWEST_FREQUENCY) / FREQUENCY_STEP)
    even = np.linspace(LOWEST_FREQUENCY, JOINT_FREQUENCY, count + 1)
    joint, end = JOINT_FREQUENCY**2 / gravity, HIGHEST_FREQUENCY**2 / gravity
    short = np.linspace(joint, end, int(np.ceil((end - joint) / WAVENUMBER_STEP)) + 1)
    return np.concatenate([even, np.sqrt(gravity * short[1:])])


def issc_problem(
    depth: float = WATER_DEPTH,
    density: float = SEA_WATER_DENSITY,
    gravity: float = STANDARD_GRAVITY,
    hull: Hull = ISSC,
) -> Problem:
    """What the database of the ISSC TLP, or of a hull of its shape, depends on.

    Parameters
    ----------
    depth, density, gravity
        Of the water, m, infinity for deep water; kg/m³; m/s².
    hull
        What differs from the ISSC TLP.

    Raises
    ------
    ScenarioError
        If the hull sinks or reaches the bottom.
    """
    shape = replace(issc_hull(), draft=hull.draught)
    mesh, coarse = (tlp(shape, PANEL, coarse=coarse) for coarse in (False, True))
    body = issc_tlp.body(density, gravity, hull)
    pretension = issc_tlp.balancing_pretension(density, gravity, hull)
    # In deep water the tethers are those of the usual depth: they matter for the slow motions only.
    tendons = issc_tlp.tendons(depth if np.isfinite(depth) else WATER_DEPTH, pretension, draught=hull.draught)
    moored = PlatformModel(body=body, tendons=tendons)
    return Problem(
        mesh=mesh,
        lid=lid(mesh),
        coarse=coarse,
        coarse_lid=lid(coarse),
        omega=issc_frequencies(gravity),
        heading=HEADING_STEP * np.arange(round(0.25 * np.pi / HEADING_STEP) + 1),
        depth=depth,
        density=density,
        gravity=gravity,
        mass=mass_matrix(body.mass, body.centre_of_gravity, body.inertia),
        stiffness=moored.stiffness,
    )


def issc_database(
    depth: float = WATER_DEPTH,
    density: float = SEA_WATER_DENSITY,
    gravity: float = STANDARD_GRAVITY,
    hull: Hull = ISSC,
) -> HydrodynamicDatabase:
    """Database of the ISSC TLP or of a hull of its shape, read from the user's cache or computed in some 20 s.

    Parameters
    ----------
    depth
        Of the water, m; infinity for deep water.
    density
        Of the water, kg/m³.
    gravity
        In m/s².
    hull
        What differs from the ISSC TLP.

    Raises
    ------
    ScenarioError
        If the hull sinks or reaches the bottom, or a number is not positive.
    """
    return _kept(depth, density, gravity, hull)


@lru_cache(maxsize=8)
def _kept(depth: float, density: float, gravity: float, hull: Hull) -> HydrodynamicDatabase:
    return cached(issc_problem(depth, density, gravity, hull))


def database_by_name(
    name: str, depth: float, density: float, gravity: float, hull: Hull = ISSC
) -> HydrodynamicDatabase:
    """The database in a file, or that of the ISSC TLP for a site where `name` is empty.

    Parameters
    ----------
    name
        Path of an HDF5 file, or "".
    depth, density, gravity
        Of the site, m, kg/m³ and m/s².
    hull
        What differs from the ISSC TLP; without effect on a file.

    Raises
    ------
    ScenarioError
        If the file is missing or holds no database, or the ISSC TLP cannot float there.
    """
    return read(name) if name else issc_database(depth, density, gravity, hull)
