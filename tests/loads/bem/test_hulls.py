import numpy as np
import pytest

from tlpsim.loads.bem.hulls import ISSC_VOLUME, LID_REACH, TlpHull, box, cylinder, hemisphere, issc_hull, lid, tlp
from tlpsim.loads.bem.mesh import Mesh, check, panels, volumes
from tlpsim.loads.errors import ScenarioError


@pytest.mark.parametrize(
    ("mesh", "volume", "waterplane"),
    [
        (hemisphere(3.0, 8, 6), 2.0 / 3.0 * np.pi * 27.0, 9.0 * np.pi),
        (cylinder(2.0, 5.0, 6, 4, 3), 20.0 * np.pi, 4.0 * np.pi),
        (box(4.0, 3.0, 1.0, 0.4), 12.0, 12.0),
    ],
    ids=["hemisphere", "cylinder", "box"],
)
def test_volume_waterplane_and_closure(mesh: Mesh, volume: float, waterplane: float) -> None:
    np.testing.assert_allclose(volumes(mesh), volume, rtol=1e-12)
    assert check(mesh) == []
    cover = panels(lid(mesh, 2))
    assert cover.area.sum() * 4.0 == pytest.approx(LID_REACH**2 * waterplane, rel=1e-9)
    np.testing.assert_allclose(cover.normal[:, 2], 1.0)


@pytest.mark.parametrize("panel", [6.0, 4.0, 2.5])
def test_tlp_is_watertight_with_its_volume(panel: float) -> None:
    hull = TlpHull(spacing=86.25, column_radius=8.435, draft=35.0, pontoon_width=7.5, pontoon_height=10.5)
    mesh = tlp(hull, panel)
    assert check(mesh) == []
    half, radius = 3.75, 8.435
    chord = half * np.sqrt(radius**2 - half**2) + radius**2 * np.arcsin(half / radius)
    exact = 4 * np.pi * radius**2 * 35.0 + 4 * 10.5 * (86.25 * 7.5 - 2 * chord)
    # The columns' polygon holds the circle's area; only the pontoons' ends, a hundredth of the hull, are cut by chords.
    np.testing.assert_allclose(volumes(mesh), exact, rtol=5e-3)


def test_issc_hull_has_the_published_volume() -> None:
    hull = issc_hull()
    assert hull.column_radius == pytest.approx(8.435, rel=0.01)
    assert volumes(tlp(hull, 2.0))[2] == pytest.approx(ISSC_VOLUME, rel=1e-3)


def test_lid_of_a_tlp_lies_inside_its_columns() -> None:
    centre = panels(lid(tlp(issc_hull(), 4.0), 2)).centre
    assert np.all(np.hypot(centre[:, 0] - 43.125, centre[:, 1] - 43.125) < 8.4)


def test_a_length_that_is_not_positive_is_refused() -> None:
    with pytest.raises(ScenarioError, match="cylinder"):
        cylinder(1.0, -2.0, 4, 4, 2)
