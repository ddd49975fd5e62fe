"""Inertia of a rigid body against that of point masses."""

import numpy as np
import pytest

from tlpsim.loads.rigid_body import cross_matrix, mass_matrix


def test_cross_matrix_is_the_cross_product() -> None:
    first, second = np.random.default_rng(2).normal(size=(2, 3))
    np.testing.assert_allclose(cross_matrix(first) @ second, np.cross(first, second), rtol=1e-14, atol=1e-15)


def test_mass_matrix_is_that_of_point_masses() -> None:
    """Kinetic energy of points that move as a rigid body."""
    generator = np.random.default_rng(1)
    points, masses = generator.normal(size=(20, 3)), generator.uniform(1.0, 2.0, 20)
    centre = masses @ points / masses.sum()
    arms = points - centre
    inertia = np.einsum("p,pk,pk->", masses, arms, arms) * np.eye(3) - np.einsum("p,pi,pj->ij", masses, arms, arms)
    matrix = mass_matrix(float(masses.sum()), centre, inertia)
    velocity = generator.normal(size=6)
    speeds = velocity[:3] + np.cross(velocity[3:], points)
    assert 0.5 * velocity @ matrix @ velocity == pytest.approx(0.5 * masses @ np.sum(speeds**2, axis=1))
