"""Conventions of the formats, in one table, and what all readers share.

Here amplitudes are exp(+i omega t) for a wave with its crest at the origin, headings are directions of propagation in
rad, moments are about the origin, numbers in SI units. A long wave excites a body at the origin by (Haskind's relation
to first order in k, or the inertia of a small body)

    X_1 cos β + X_2 sin β = +i ρ g k V (1 + a),   a > 0                                                    (1)

so that the sign of its imaginary part tells exp(+i omega t) from exp(-i omega t). About another point c than the origin

    F_o = T F_c,   A_o = T A_c Tᵀ,   ξ_c = Tᵀ ξ_o,   T = [[1, 0], [S(c), 1]],   S(c) v = c × v               (2)

Sources: WAMIT user manual 7.4, chapters 3 to 5 (and its .1, .3, .hst files as HydroDyn of OpenFAST reads them);
Capytaine's user manual, "Conventions and differences to other codes"; manual and postprocessor of NEMOH; source of
HAMS (PotentWavForce.f90, ImplementSubs.f90), whose .3 file changed its sign between versions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tlpsim.loads.bem.database import HydrodynamicDatabase
from tlpsim.loads.constants import HORIZONTAL
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.rigid_body import cross_matrix

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MODES = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Convention:
    """How a format writes its numbers.

    Attributes
    ----------
    time_sign
        s of exp(s i omega t); 0 where it changed between versions, to be told by eq. (1).
    heading_unit
        In rad: of directions of propagation, anticlockwise from +x in all of these formats.
    phase_unit
        In rad, of a phase.
    normal
        Direction of the normal in the code's theory; no result depends on it.
    numbers
        Dimensions, with L the length scale, k = 3, 4, 5 and m = 2, 3 by translations and rotations.
    """

    time_sign: int
    heading_unit: float
    phase_unit: float
    normal: str
    numbers: str


_DEGREE = np.pi / 180.0
_SI = "SI"
_WAMIT_NUMBERS = "A / ρ L^k, B / ρ ω L^k, C / ρ g L^(k-1), X / ρ g L^m, drift / ρ g L^(m-1), rotations × L"

CONVENTIONS: Mapping[str, Convention] = {
    "tlpsim": Convention(time_sign=1, heading_unit=1.0, phase_unit=1.0, normal="out of the body", numbers=_SI),
    "WAMIT": Convention(
        time_sign=1, heading_unit=_DEGREE, phase_unit=_DEGREE, normal="into the body", numbers=_WAMIT_NUMBERS
    ),
    "HAMS": Convention(
        time_sign=0,
        heading_unit=_DEGREE,
        phase_unit=_DEGREE,
        normal="into the body",
        numbers="as WAMIT with L = 1 m",
    ),
    "Capytaine": Convention(time_sign=-1, heading_unit=1.0, phase_unit=1.0, normal="out of the body", numbers=_SI),
    "NEMOH": Convention(time_sign=-1, heading_unit=_DEGREE, phase_unit=1.0, normal="out of the body", numbers=_SI),
}
"""Format -> its convention."""


def turned(amplitude: ComplexArray, time_sign: int) -> ComplexArray:
    """Amplitudes of exp(time_sign i omega t) as those of exp(+i omega t), and back."""
    return np.asarray(amplitude if time_sign > 0 else np.conj(amplitude))


def told_time_sign(heading: FloatArray, excitation_force: ComplexArray) -> int:
    """Sign of i omega t by eq. (1), from the lowest frequency of an excitation (headings, frequencies, 6).

    Raises
    ------
    ScenarioError
        If there is no horizontal force to tell it by.
    """
    along = excitation_force[:, 0, 0] * np.cos(heading) + excitation_force[:, 0, 1] * np.sin(heading)
    told = float(np.nansum(along.imag))
    if told == 0.0:
        raise ScenarioError("no surge or sway force tells the sign of the phases; give time_sign = +1 or -1")
    return 1 if told > 0.0 else -1


def moments_arm(point: ArrayLike) -> FloatArray:
    """T of eq. (2) for a point (3,) in m."""
    result = np.eye(MODES)
    result[3:, :3] = cross_matrix(point)
    return result


def about_origin(database: HydrodynamicDatabase, point: ArrayLike) -> HydrodynamicDatabase:
    """A database whose moments and motions refer to a point (3,) in m, referred to the origin, eq. (2).

    Hydrostatics and mesh stay what they are.
    """
    if not np.any(np.asarray(point, dtype=np.float64)):
        return database
    turn = moments_arm(point)
    drift = np.full((*database.mean_drift.shape[:2], MODES), 0.0)
    if database.mean_drift.shape[2] == MODES:
        drift = database.mean_drift @ turn.T
    else:
        drift[..., HORIZONTAL] = database.mean_drift
        drift = (drift @ turn.T)[..., HORIZONTAL]
    motion = database.response_amplitude
    return replace(
        database,
        added_mass=turn @ database.added_mass @ turn.T,
        radiation_damping=turn @ database.radiation_damping @ turn.T,
        excitation_force=database.excitation_force @ turn.T,
        froude_krylov_force=database.froude_krylov_force @ turn.T,
        added_mass_infinite=turn @ database.added_mass_infinite @ turn.T,
        added_mass_zero=turn @ database.added_mass_zero @ turn.T,
        mean_drift=drift,
        response_amplitude=None if motion is None else motion @ np.linalg.inv(turn),
    )


def assembled(
    *,
    omega: ArrayLike,
    heading: ArrayLike,
    depth: float,
    density: float,
    gravity: float,
    added_mass: FloatArray,
    radiation_damping: FloatArray,
    excitation_force: ComplexArray,
    **known: Any,
) -> HydrodynamicDatabase:
    """Database of what a file holds, with frequencies and headings ascending and NaN for what it does not hold."""
    frequencies, directions = np.asarray(omega, dtype=np.float64), np.asarray(heading, dtype=np.float64)
    shape = (len(directions), len(frequencies))
    order, turns = np.argsort(frequencies, kind="stable"), np.argsort(directions, kind="stable")
    pick = np.ix_(turns, order)
    unknown = np.full((MODES, MODES), np.nan)
    motion = known.get("response_amplitude")
    return HydrodynamicDatabase(
        omega=frequencies[order],
        heading=directions[turns],
        depth=depth,
        density=density,
        gravity=gravity,
        added_mass=added_mass[order],
        radiation_damping=radiation_damping[order],
        excitation_force=excitation_force[pick],
        froude_krylov_force=known.get("froude_krylov_force", np.full((*shape, MODES), np.nan * (1 + 1j)))[pick],
        added_mass_infinite=known.get("added_mass_infinite", unknown),
        added_mass_zero=known.get("added_mass_zero", unknown),
        mean_drift=known.get("mean_drift", np.full((*shape, len(HORIZONTAL)), np.nan))[pick],
        response_amplitude=None if motion is None else motion[pick],
        hydrostatics=known.get("hydrostatics"),
        mesh=known.get("mesh"),
    )
