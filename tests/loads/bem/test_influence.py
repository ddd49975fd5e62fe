"""The wave part of the influence matrices against brute-force quadrature over both panels."""

import numpy as np
import pytest

from tlpsim.loads.bem.green import deep_table, deep_wave, finite_table, finite_wave
from tlpsim.loads.bem.hulls import box
from tlpsim.loads.bem.influence import fill, near_pairs, quadrature
from tlpsim.loads.bem.mesh import PLANES, Panels, panels
from tlpsim.loads.bem.rankine import second_moments
from tlpsim.loads.bem.symmetry import CHARACTERS, unfolded

MESH = box(4.0, 3.0, 2.0, 0.5)
GEOMETRY = panels(MESH)
NUMBER = 0.8  # the panels of half a metre are a sixteenth of a wave long


def brute_force(geometry: Panels, i: int, j: int, image: np.ndarray, depth: float) -> tuple[complex, complex]:
    """Means over panel i, moved to its image, of the integrals over panel j of g and of dg/dn."""
    rule = quadrature(geometry, 5)
    value = slope = 0.0j
    table = finite_table(NUMBER, depth, 8.0, 2.0) if np.isfinite(depth) else None
    for place, share in zip(rule.places[i], rule.weights[i] / geometry.area[i], strict=True):
        for source, weight in zip(rule.places[j], rule.weights[j], strict=True):
            dx, dy = image[:2] * place[:2] - source[:2]
            distance = np.hypot(dx, dy)
            if table is None:
                g, g_h, g_v = deep_wave(NUMBER * distance, NUMBER * (place[2] + source[2]), deep_table())
                g, g_r, g_z = NUMBER * g, NUMBER**2 * g_h, NUMBER**2 * g_v
            else:
                g, g_r, _ = finite_wave(distance, place[2], source[2], table)
                g_z = finite_wave(distance, source[2], place[2], table)[2]
            normal = geometry.normal[j]
            across = dx * normal[0] + dy * normal[1]
            value += share * weight * g
            slope += share * weight * (g_z * normal[2] - (g_r / distance * across if distance > 0.0 else 0.0))
    return value, slope


@pytest.mark.parametrize("depth", [np.inf, 6.0])
def test_matrices_are_means_over_both_panels(depth: float) -> None:
    images, characters = PLANES[("x", "y")], CHARACTERS[4]
    count = len(GEOMETRY.area)
    moments = second_moments(GEOMETRY.corners, GEOMETRY.centre)
    fold = unfolded(count)
    nothing = np.zeros((2, 4, count, count))
    near = near_pairs(GEOMETRY, images, fold)
    field = quadrature(GEOMETRY, 2)
    single, double = fill(GEOMETRY, moments, field, images, characters, fold, near, NUMBER, depth, nothing)
    scale = np.max(np.abs(single)), np.max(np.abs(double))
    generator = np.random.default_rng(3)
    for i, j in generator.integers(0, count, (12, 2)):
        parts = np.array([brute_force(GEOMETRY, i, j, image, depth) for image in images])
        for row in range(4):
            value, slope = characters[row] @ parts
            # Fourth powers of panel over wave length: 1e-4 of the largest entry; the bottom's part is taken at the
            # centres, which leaves second powers of what is small and smooth.
            assert abs(single[row, j, i] - value) < 3e-4 * scale[0]
            assert abs(double[row, j, i] + slope) < 3e-4 * scale[1]
