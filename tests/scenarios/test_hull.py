"""Hulls from TOML and from mesh files."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.bem.hulls import ISSC_VOLUME, box, issc_hull
from tlpsim.loads.bem.mesh import Mesh, translated, volumes, whole, write_gdf, write_nemoh
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.issc_tlp import body as issc_body
from tlpsim.loads.issc_tlp import tendons as issc_tendons
from tlpsim.loads.platform.motion import PlatformModel, tangent_stiffness
from tlpsim.scenarios.hull import KINDS, Hull, checked, lid_of, read_hull, with_symmetry

READY = files("tlpsim.scenarios")
CYLINDER = '[hull]\nkind = "cylinder"\nradius = "500 cm"\ndraft = 10\npanel = 2.5\n'
LENGTHS = {
    "tlp": ("spacing = 60\ncolumn_radius = 7\ndraft = 30\npontoon_width = 8\npontoon_height = 9", None),
    "semisubmersible": (
        "pontoon_length = 100\npontoon_width = 14\npontoon_height = 8\npontoon_spacing = 50\ncolumn_radius = 5\n"
        "column_positions = [10, 40]\ndraft = 20",
        2 * 100 * 14 * 8 + 8 * np.pi * 25 * 12,
    ),
    "cylinder": ("radius = 5\ndraft = 10", np.pi * 25 * 10),
    "box": ("length = 20\nbeam = 12\ndraft = 5", 20 * 12 * 5),
    "hemisphere": ("radius = 6", 2 / 3 * np.pi * 216),
}


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_makes_its_hull_with_a_lid_and_a_coarser_mesh(tmp_path: Path, kind: str) -> None:
    lengths, volume = LENGTHS[kind]
    hull = read_hull(written(tmp_path / "hull.toml", f'[hull]\nkind = "{kind}"\npanel = 3\n{lengths}\n'))
    assert hull.body is None
    assert checked(hull, np.inf, 1025.0) == []
    if volume is not None:  # panels have the volume of the curved hull; a semisubmersible's columns end in polygons
        assert np.mean(volumes(hull.mesh)) == pytest.approx(volume, rel=1e-4)
    assert hull.coarse is not None
    assert hull.mesh.panel_count == 4 * hull.coarse.panel_count  # panels twice as large in both directions
    assert hull.lid is not None
    assert np.all(hull.lid.vertices[:, :, 2] == 0.0)


def test_ready_issc_hull_is_the_published_one() -> None:
    hull = read_hull(Path(str(READY.joinpath("issc_tlp_hull.toml"))))
    fine = read_hull(Path(str(READY.joinpath("issc_tlp_hull.toml"))), panel=1.5)
    # Round columns cut into polygons at the pontoons' mouths: the volume converges with the panels.
    assert np.mean(volumes(fine.mesh)) == pytest.approx(ISSC_VOLUME, rel=4e-4)
    assert hull.mesh.panel_count < fine.mesh.panel_count
    assert np.max(hull.mesh.vertices[..., 0]) == pytest.approx(issc_hull().spacing / 2 + 8.4, abs=0.15)
    assert hull.body is not None
    assert hull.body.mass == issc_body().mass
    np.testing.assert_allclose(hull.body.inertia, issc_body().inertia)


def test_ready_issc_tethers_are_those_of_the_platform() -> None:
    """Stiffness of the platform model less that of its buoyancy and weight, both by their closed forms."""
    body, weight_density = issc_body(), 1025.0 * issc_body().gravity
    stiffness = tangent_stiffness(PlatformModel(body=body, tendons=issc_tendons()), np.zeros(6))
    stiffness[2, 2] -= weight_density * body.waterplane_area
    arm = body.displaced_volume * body.centre_of_buoyancy[2]
    for mode in (3, 4):
        restoring = weight_density * (body.waterplane_moments[mode - 3] + arm)
        stiffness[mode, mode] -= restoring - body.mass * body.gravity * body.centre_of_gravity[2]
    hull = read_hull(Path(str(READY.joinpath("issc_tlp_hull.toml"))))
    assert hull.body is not None
    # The file has seven digits; rounding of the platform's zeros is below 1e-4 of the smallest entry.
    np.testing.assert_allclose(hull.body.stiffness, stiffness, rtol=1e-6, atol=10.0)


def test_ready_semisubmersible_floats_upright() -> None:
    hull = read_hull(Path(str(READY.joinpath("semisubmersible_hull.toml"))))
    assert checked(hull, 40.0, 1025.0) == []
    assert hull.body is not None
    assert hull.body.mass == pytest.approx(1025.0 * np.mean(volumes(hull.mesh)), rel=1e-3)
    total = hull.body.total_stiffness(hull.mesh, 1025.0, 9.80665) - hull.body.stiffness
    assert np.all(np.diag(total)[2:5] > 0.0)


def test_body_by_radii_and_by_inertia_are_one(tmp_path: Path) -> None:
    body = '[body]\nmass = "800 t"\ncentre_of_gravity = [0, 0, "-400 cm"]\n'
    by_radii = read_hull(written(tmp_path / "a.toml", CYLINDER + body + "radii_of_gyration = [3, 4, 5]\n"))
    inertia = "inertia = [[7.2e6, 0, 0], [0, 1.28e7, 0], [0, 0, 2.0e7]]\nstiffness = [1, 2, 3, 4, 5, 6]\n"
    by_inertia = read_hull(written(tmp_path / "b.toml", CYLINDER + body + inertia))
    assert by_radii.body is not None
    assert by_inertia.body is not None
    np.testing.assert_allclose(by_radii.body.inertia, by_inertia.body.inertia)
    # A point mass of 8e5 kg, 4 m below the origin, adds m z² to roll and pitch and -m z to surge-pitch.
    matrix = by_radii.body.mass_matrix()
    assert matrix[3, 3] == pytest.approx(7.2e6 + 8e5 * 16.0)
    assert matrix[0, 4] == pytest.approx(-4.0 * 8e5)
    assert np.all(by_radii.body.stiffness == 0.0)
    np.testing.assert_array_equal(np.diag(by_inertia.body.stiffness), [1, 2, 3, 4, 5, 6])


def test_body_that_does_not_float_is_told(tmp_path: Path) -> None:
    body = "[body]\nmass = 5e5\ncentre_of_gravity = [0, 0, -4]\nradii_of_gyration = [3, 4, 5]\n"
    hull = read_hull(written(tmp_path / "hull.toml", CYLINDER + body))
    (warning,) = checked(hull, np.inf, 1025.0)
    assert "5e+05 kg" in warning
    assert "stiffness" in warning
    held = read_hull(written(tmp_path / "held.toml", CYLINDER + body + "stiffness = [0, 0, 1e6, 0, 0, 0]\n"))
    assert checked(held, np.inf, 1025.0) == []


BAD = {
    "no section": ("x = 1", r"\[hull\] is missing"),
    "no kind": ("[hull]\npanel = 1", "kind is missing"),
    "kind": ('[hull]\nkind = "cilinder"', "did you mean 'cylinder'"),
    "unit": (CYLINDER.replace("500 cm", "5 ft"), "not a unit of length"),
    "negative": (CYLINDER.replace("10", "-10"), "hull.draft = -10: must be greater than 0"),
    "missing": (CYLINDER.replace("draft = 10\n", ""), "hull.draft: is missing"),
    "unknown": (CYLINDER + "draught = 1\n", "did you mean 'draft'"),
    "text": (CYLINDER + "[body]\nmass = 'heavy'\ncentre_of_gravity = [0,0,0]\ninertia = [1,1,1]\n", "no number"),
    "two inertias": (
        CYLINDER + "[body]\nmass = 1\ncentre_of_gravity = [0,0,0]\ninertia = [1,1,1]\nradii_of_gyration = [1,1,1]\n",
        "one of radii_of_gyration and inertia",
    ),
    "shape": (CYLINDER + "[body]\nmass = 1\ncentre_of_gravity = [0,0,0]\ninertia = [1,1]\n", "3 lists of 3"),
    "ragged": (
        CYLINDER + "[body]\nmass = 1\ncentre_of_gravity = [0,0,0]\ninertia = [[1,0,0],[0,1],[0,0,1]]\n",
        "3 lists of 3",
    ),
    "not positive": (
        CYLINDER + "[body]\nmass = 1\ncentre_of_gravity = [0,0,0]\ninertia = [1,-1,1]\n",
        "not positive definite",
    ),
    "not finite": (CYLINDER + "[body]\nmass = 1\ncentre_of_gravity = [0,0,0]\ninertia = [1,inf,1]\n", "not finite"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_file_is_refused_in_one_line(tmp_path: Path, case: str) -> None:
    text, message = BAD[case]
    with pytest.raises(ScenarioError, match=message) as error:
        read_hull(written(tmp_path / "hull.toml", text))
    assert str(tmp_path / "hull.toml") in str(error.value)
    assert "\n" not in str(error.value)


def test_panel_over_the_file(tmp_path: Path) -> None:
    path = written(tmp_path / "hull.toml", CYLINDER)
    assert read_hull(path, panel=1.25).mesh.panel_count > 2 * read_hull(path).mesh.panel_count
    with pytest.raises(ScenarioError, match="--symmetry"):
        read_hull(path, symmetry="x")


def write_stl(mesh: Mesh, path: Path) -> None:
    corners = whole(mesh).vertices
    rows = ["solid hull"]
    for triangle in np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]):
        rows += ["facet normal 0 0 0", "outer loop"]
        rows += [f"vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in triangle]
        rows += ["endloop", "endfacet"]
    path.write_text("\n".join([*rows, "endsolid"]))


BOX = box(6.0, 4.0, 2.0, 1.0)


def test_mesh_files_are_read_by_their_suffix(tmp_path: Path) -> None:
    write_gdf(BOX, tmp_path / "box.gdf")
    write_nemoh(BOX, tmp_path / "box.dat")
    write_nemoh(BOX, tmp_path / "box.mar")
    write_stl(BOX, tmp_path / "box.STL")
    for name in ("box.gdf", "box.dat", "box.mar", "box.STL"):
        hull = read_hull(tmp_path / name)
        assert np.mean(volumes(hull.mesh)) == pytest.approx(48.0), name
        assert hull.lid is not None
        assert (hull.body, hull.coarse) == (None, None)
    with pytest.raises(ScenarioError, match="--panel"):
        read_hull(tmp_path / "box.gdf", panel=1.0)
    with pytest.raises(ScenarioError, match="no such file"):
        read_hull(tmp_path / "none.gdf")
    with pytest.raises(ScenarioError, match="no suffix of a hull"):
        read_hull(written(tmp_path / "box.obj", ""))


@pytest.mark.parametrize("symmetry", ["x", "y", "xy"])
def test_symmetry_keeps_one_part_of_a_mesh(tmp_path: Path, symmetry: str) -> None:
    write_stl(BOX, tmp_path / "box.stl")
    full, part = read_hull(tmp_path / "box.stl"), read_hull(tmp_path / "box.stl", symmetry=symmetry)
    assert part.mesh.planes == tuple(symmetry)
    assert len(part.mesh.vertices) * 2 ** len(symmetry) == len(full.mesh.vertices)
    np.testing.assert_allclose(volumes(part.mesh), volumes(full.mesh))
    assert checked(part, np.inf, 1025.0) == []


def test_part_of_a_body_is_declared_symmetric() -> None:
    quarter = Mesh(name="quarter", vertices=BOX.vertices)
    np.testing.assert_allclose(volumes(with_symmetry(quarter, "xy")), 48.0)


def test_what_is_not_symmetric_is_refused() -> None:
    lopsided = whole(BOX).vertices.copy()
    # Shifted forwards below, without a change of the volume: the centroid tells it.
    lopsided[..., 0] += np.where(lopsided[..., 2] < -1.0, 0.3, 0.0) * (lopsided[..., 0] > 0.0)
    with pytest.raises(ScenarioError, match="not symmetric in x"):
        with_symmetry(Mesh(name="lopsided", vertices=lopsided), "x")
    with pytest.raises(ScenarioError, match="crosses x = 0"):
        with_symmetry(translated(BOX, [0.1, 0.0, 0.0]), "x")
    with pytest.raises(ScenarioError, match="no panel"):
        with_symmetry(translated(BOX, [-9.0, 0.0, 0.0]), "x")
    with pytest.raises(ScenarioError, match="must be x, y or xy"):
        with_symmetry(BOX, "z")


def test_lid_covers_water_planes_only() -> None:
    """A box with a moonpool: a lid over its outer waterline would lie on water that is outside."""
    assert lid_of(BOX) is not None
    assert lid_of(translated(BOX, [0.0, 0.0, -1.0])) is None
    inner = box(2.0, 2.0, 2.0, 1.0)
    walls = [part.vertices[np.ptp(part.vertices[..., 2], axis=1) > 0.0] for part in (BOX, inner)]
    walls[1] = walls[1][:, ::-1]
    x, y, z = np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.0, 2.0]), -2.0
    cells = [
        [[x[i], y[j], z], [x[i], y[j + 1], z], [x[i + 1], y[j + 1], z], [x[i + 1], y[j], z]]
        for i, j in ((1, 0), (0, 1), (1, 1))
    ]
    ring = Mesh(name="moonpool", vertices=np.concatenate([*walls, np.array(cells)]), planes=("x", "y"))
    np.testing.assert_allclose(volumes(ring), 2.0 * (6.0 * 4.0 - 2.0 * 2.0))
    assert lid_of(ring) is None


def as_hull(mesh: Mesh) -> Hull:
    return Hull(mesh=mesh, lid=None, body=None, coarse=None)


def test_broken_meshes_are_refused_and_poor_ones_told() -> None:
    assert checked(as_hull(BOX), np.inf, 1025.0) == []
    (coarse,) = checked(as_hull(BOX), 3.0, 1025.0)
    assert "panels below 0.5 m" in coarse
    with pytest.raises(ScenarioError, match="cut the mesh at z = 0"):
        checked(as_hull(translated(BOX, [0.0, 0.0, 0.5])), np.inf, 1025.0)
    with pytest.raises(ScenarioError, match="reverse every panel"):
        checked(as_hull(Mesh(name="inside out", vertices=BOX.vertices[:, ::-1], planes=BOX.planes)), np.inf, 1025.0)
    with pytest.raises(ScenarioError, match="close gaps"):
        checked(as_hull(Mesh(name="open", vertices=BOX.vertices[1:], planes=BOX.planes)), np.inf, 1025.0)


def test_a_gap_without_volume_is_only_told() -> None:
    """One panel of the bottom cut in two, whose neighbours were not."""
    bottom = int(np.flatnonzero(np.all(BOX.vertices[..., 2] == -2.0, axis=1))[0])
    a, b, c, d = BOX.vertices[bottom]
    halves = np.array([[a, (a + b) / 2, (c + d) / 2, d], [(a + b) / 2, b, c, (c + d) / 2]])
    vertices = np.concatenate([np.delete(BOX.vertices, bottom, axis=0), halves])
    (finding,) = checked(as_hull(Mesh(name="cut", vertices=vertices, planes=BOX.planes)), np.inf, 1025.0)
    assert "join no other panel" in finding
