from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.bem.hulls import box, cylinder, hemisphere
from tlpsim.loads.bem.mesh import (
    Mesh,
    check,
    merged,
    panels,
    read_gdf,
    read_nemoh,
    read_stl,
    translated,
    volumes,
    whole,
    write_gdf,
    write_nemoh,
)
from tlpsim.loads.errors import ScenarioError

BOX = box(4.0, 3.0, 1.0, 0.5)


def test_whole_mesh_has_every_image_with_normals_outwards() -> None:
    complete = whole(hemisphere(1.0, 5, 4))
    geometry = panels(complete)
    assert complete.panel_count == 80
    assert np.all(np.sum(geometry.centre * geometry.normal, axis=1) > 0.9)


def test_volume_by_three_components() -> None:
    np.testing.assert_allclose(volumes(BOX), 12.0, rtol=1e-12)
    np.testing.assert_allclose(volumes(translated(BOX, (3.0, -2.0, 0.0))), 12.0, rtol=1e-12)


def test_triangles_and_quadrilaterals_of_the_same_surface_agree() -> None:
    quads = whole(BOX).vertices
    halves = np.concatenate([quads[:, [0, 1, 2, 2]], quads[:, [0, 2, 3, 3]]])
    geometry, split = panels(whole(BOX)), panels(Mesh(name="split", vertices=halves))
    assert split.area.sum() == pytest.approx(geometry.area.sum(), rel=1e-12)
    np.testing.assert_allclose(split.area @ split.centre, geometry.area @ geometry.centre, atol=1e-12)


@pytest.mark.parametrize("mesh", [BOX, hemisphere(2.0, 4, 4), cylinder(1.0, 2.0, 4, 3, 2)], ids=lambda mesh: mesh.name)
def test_files_give_the_mesh_back(mesh: Mesh, tmp_path: Path) -> None:
    write_gdf(mesh, tmp_path / "hull.gdf")
    again = read_gdf(tmp_path / "hull.gdf")
    assert again.planes == mesh.planes
    np.testing.assert_allclose(again.vertices, mesh.vertices, atol=1e-8)
    write_nemoh(mesh, tmp_path / "hull.dat")
    full = read_nemoh(tmp_path / "hull.dat")
    assert full.planes == ()
    np.testing.assert_allclose(full.vertices, whole(mesh).vertices, atol=1e-8)


@pytest.mark.parametrize("binary", [False, True])
def test_stl(binary: bool, tmp_path: Path) -> None:
    quads = whole(BOX).vertices
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    path = tmp_path / "hull.stl"
    if binary:
        record = np.zeros(len(triangles), dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
        record["v"] = triangles
        path.write_bytes(b"\0" * 80 + np.uint32(len(triangles)).tobytes() + record.tobytes())
    else:
        text = ["solid hull"]
        for triangle in triangles:
            text += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in triangle)]
            text += ["endloop", "endfacet"]
        path.write_text("\n".join([*text, "endsolid hull", ""]))
    np.testing.assert_allclose(volumes(read_stl(path)), 12.0, rtol=1e-6)


def test_a_good_mesh_passes() -> None:
    assert check(BOX, shortest_wave=10.0) == []


@pytest.mark.parametrize(
    ("vertices", "word"),
    [
        (BOX.vertices[1:], "join no other panel"),
        (BOX.vertices[:, ::-1], "into the body"),
        (BOX.vertices + np.array([0.0, 0.0, 0.5]), "above the water"),
        (BOX.vertices - np.array([0.5, 0.0, 0.0]), "across their plane"),
    ],
    ids=["gap", "normals", "dry", "plane"],
)
def test_a_bad_mesh_is_told_what_to_do(vertices: np.ndarray, word: str) -> None:
    assert any(word in line for line in check(Mesh(name="bad", vertices=vertices, planes=("x", "y"))))


def test_panels_are_measured_against_the_wave() -> None:
    assert any("wave" in line for line in check(BOX, shortest_wave=1.0))


def test_what_is_no_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="shape"):
        Mesh(name="flat", vertices=np.zeros((3, 3)))
    with pytest.raises(ScenarioError, match="no area"):
        panels(Mesh(name="point", vertices=np.zeros((1, 4, 3))))
    with pytest.raises(ScenarioError, match="planes"):
        merged("mixed", [BOX, whole(BOX)])
    for read in (read_gdf, read_nemoh, read_stl):
        (tmp_path / "text").write_text("one\ntwo\n")
        for path in (tmp_path / "text", tmp_path / "missing"):
            with pytest.raises(ScenarioError):
                read(path)
