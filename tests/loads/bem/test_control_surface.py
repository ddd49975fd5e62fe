import numpy as np
import pytest

from tlpsim.loads.bem.control_surface import control_surface
from tlpsim.loads.bem.discretization import discretize
from tlpsim.loads.bem.hulls import box, hemisphere
from tlpsim.loads.bem.mesh import merged, translated, whole
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.bem.surface import hull_surface, surface_fields
from tlpsim.loads.errors import ScenarioError


def test_control_surface_encloses_its_volume_and_the_water_plane() -> None:
    pair = merged("pair", [translated(whole(box(1.0, 1.0, 0.5, 0.25)), (x, 0.5, 0.0)) for x in (-2.0, 2.0)])
    hull = hull_surface(discretize(pair))
    surface = control_surface(hull, np.inf, 4.0, radius=4.0, below=1.0)
    # A cylinder without lid: the normals miss the lid's, the sums are exact for polynomials.
    np.testing.assert_allclose(surface.normal.sum(axis=0), [0.0, 0.0, -16.0 * np.pi], atol=1e-9)
    assert np.sum(surface.places * surface.normal) == pytest.approx(3.0 * 16.0 * np.pi, rel=1e-9)
    moments = np.einsum("pi,pj->ij", surface.circle, surface.circle_normal)[:2, :2]
    np.testing.assert_allclose(moments, 16.0 * np.pi * np.eye(2), atol=1e-9)
    # The circle between two rays is integrated by two points: corners of the area lie between the pieces.
    assert np.sum(surface.water_area) == pytest.approx(16.0 * np.pi - 2.0, rel=3e-4)
    inside = (np.abs(np.abs(surface.water_seen[:, 0]) - 2.0) < 0.5) & (np.abs(surface.water_seen[:, 1] - 0.5) < 0.5)
    assert not np.any(inside)
    assert np.all(np.linalg.norm(surface.water, axis=1) < 4.0)


def test_control_surface_that_meets_the_hull_or_the_bottom_is_refused() -> None:
    hull = hull_surface(discretize(hemisphere(1.0, 4, 3)))
    for wrong in ({"radius": 0.9}, {"below": 0.5}, {"below": 3.5}):
        with pytest.raises(ScenarioError, match="meets 'hemisphere'"):
            control_surface(hull, 3.0, 5.0, **wrong)


def test_an_undisturbed_wave_brings_no_flux_of_mass() -> None:
    body = discretize(hemisphere(0.02, 3, 2), 3.0)
    solution = solve(body, 1.0, [0.5], 1.0, 1.0)
    hull = hull_surface(body)
    surface = control_surface(hull, 3.0, 5.0, radius=2.0, below=1.5)
    found = surface_fields(body, solution, np.zeros((1, 6)), hull, surface).control
    assert found is not None
    through = np.einsum("phk,pk->h", found.velocity, surface.normal)
    rise = np.einsum("ph,p->h", found.water_velocity[..., 2], surface.water_area)
    # Continuity, against a flux of some 10 through either half; the body is a hundredth of the surface's radius.
    np.testing.assert_allclose(through + rise, 0.0, atol=5e-3)
