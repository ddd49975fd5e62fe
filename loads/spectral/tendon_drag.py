"""Drag of the tendons, statistically linear.

    F = sum_q k_q P^T |V| V,   V = U_q - s_q P E x'                                                      (1)
      = F_0 - B x',   F_0 = sum k P^T C0,   B = sum k s P^T C1 P E                                       (2)

The points q are those of Gauss's rule along each tendon, at the fractions s from its anchor, with
k = 1/2 rho C_d D L s ds (eq. (8) of `tlpsim.loads.platform.tendons`), or its fairlead alone in water at rest, eq. (7)
there; P projects on two axes across the line. Quadratic terms are left out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.platform.body import rotation_matrix
from tlpsim.loads.platform.motion import PlatformModel
from tlpsim.loads.platform.tendons import POINTS, WEIGHTS, drag_factors
from tlpsim.loads.spectral.hermite import expand

FloatArray = NDArray[np.float64]


def tendon_damping(
    platform: PlatformModel, pose: FloatArray, loads: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean load (6,) and damping (6, 6) of eq. (2), earth-fixed loads about the reference point.

    Parameters
    ----------
    pose
        Mean position, (6,) m, rad.
    loads
        E^T, generalized forces of earth-fixed loads, (6, 6).
    velocity
        Covariance of the rates of the platform, (6, 6).
    """
    tendons = platform.tendons
    factors = drag_factors(tendons, platform.body.water_density)
    if not np.any(factors > 0.0):
        return np.zeros(6), np.zeros((6, 6))
    levers = tendons.fairleads @ rotation_matrix(pose[3:]).T
    lines = tendons.anchors - pose[:3] - levers
    directions = lines / np.linalg.norm(lines, axis=1)[:, None]
    axes = np.linalg.svd(directions[:, None, :])[2][:, 1:]  # two unit vectors across each line
    projection = np.concatenate([axes, np.cross(levers[:, None], axes)], axis=2)
    share, strength, flow = np.ones(1), np.ones(1), np.zeros((len(factors), 1, 2))
    if platform.flow is not None:
        share, strength = POINTS, 4.0 * WEIGHTS * POINTS
        flow = np.einsum("tac,tqc->tqa", axes[:, :, :2], platform.flow)
    motion = projection @ loads.T
    spread = np.einsum("tai,ij,tbj->tab", motion, velocity, motion)
    count = len(factors) * len(share)
    covariance = spread[:, None] * (share**2)[:, None, None]
    found = expand(flow.reshape(count, 2), covariance.reshape(count, 2, 2))
    weight = factors[:, None] * strength
    steady = np.einsum("tq,tqa->ta", weight, found.mean.reshape(*weight.shape, 2))
    linear = np.einsum("tq,tqab->tab", weight * share, found.linear.reshape(*weight.shape, 2, 2))
    mean = np.einsum("tai,ta->i", projection, steady)
    return mean, np.einsum("tai,tab,tbj->ij", projection, linear, motion)
