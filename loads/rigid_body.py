"""Inertia of a rigid body about the origin.

M = [[m 1, -m S(c)], [m S(c), I_G - m S(c)²]],   S(a) b = a × b,   c the centre of gravity             (1)
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def cross_matrix(vector: ArrayLike) -> FloatArray:
    """Matrix S of the cross product, S(a) b = a × b, (3, 3)."""
    x, y, z = np.asarray(vector, dtype=np.float64)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def mass_matrix(mass: float, centre_of_gravity: ArrayLike, inertia: ArrayLike) -> FloatArray:
    """Mass matrix (6, 6) about the origin, kg, kg m, kg m², eq. (1).

    Parameters
    ----------
    mass
        kg.
    centre_of_gravity
        (3,) m.
    inertia
        (3, 3) kg m² about the centre of gravity.
    """
    moment = mass * cross_matrix(centre_of_gravity)
    about_origin = np.asarray(inertia, dtype=np.float64) - moment @ cross_matrix(centre_of_gravity)
    return np.block([[mass * np.eye(3), -moment], [moment, about_origin]])
