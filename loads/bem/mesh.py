"""Panel meshes: the record, its geometry, its files, and the checks that tell a bad mesh from a good one.

A panel is four vertices in anticlockwise order seen from the fluid, so that its normal points out of the body; a
triangle repeats its third vertex. A mesh with planes of symmetry holds only the panels on the positive side:
plane "x" mirrors x to -x, plane "y" mirrors y to -y.

    area, centroid, normal of a quadrilateral: by its two triangles; the panel is then made flat in its mean plane  (1)
    V = ∫ x n_x dS = ∫ y n_y dS = ∫ z n_z dS   (the waterplane at z = 0 adds nothing)                               (2)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from tlpsim.loads.errors import ScenarioError

FloatArray = NDArray[np.float64]

PLANES: dict[tuple[str, ...], FloatArray] = {
    (): np.array([[1.0, 1.0]]),
    ("x",): np.array([[1.0, 1.0], [-1.0, 1.0]]),
    ("y",): np.array([[1.0, 1.0], [1.0, -1.0]]),
    ("x", "y"): np.array([[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]),
}
"""Planes of symmetry -> signs (images, 2) of x and y of each image; the first image is the mesh itself."""

_PANELS_PER_WAVELENGTH = 6.0
_VOLUME_TOLERANCE = 5e-3
_SAME_POINT = 1e-6  # of the extent of all


@dataclass(frozen=True, slots=True, kw_only=True)
class Mesh:
    """Panels of a body below the water: vertices (n, 4, 3) in m, and the planes of symmetry that complete them."""

    name: str
    vertices: FloatArray
    planes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Make the array read-only and refuse what is no mesh."""
        vertices = np.array(self.vertices, dtype=np.float64)
        if vertices.ndim != 3 or vertices.shape[1:] != (4, 3) or len(vertices) == 0:
            raise ScenarioError(f"mesh '{self.name}': vertices have shape {vertices.shape}; (panels, 4, 3) is needed")
        if not np.all(np.isfinite(vertices)):
            raise ScenarioError(f"mesh '{self.name}': a vertex is not finite; repair the file it comes from")
        if self.planes not in PLANES:
            raise ScenarioError(f"mesh '{self.name}': planes {self.planes} unknown; one of {list(PLANES)} is needed")
        vertices.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)

    @property
    def images(self) -> FloatArray:
        """Signs (images, 2) of x and y that make the whole body of the stored panels."""
        return PLANES[self.planes]

    @property
    def panel_count(self) -> int:
        """Number of panels of the whole body."""
        return len(self.vertices) * len(self.images)


@dataclass(frozen=True, slots=True, kw_only=True)
class Panels:
    """Geometry of flat panels: (n, 3) centroids and unit normals out of the body, areas, longest diagonals, corners."""

    centre: FloatArray
    normal: FloatArray
    area: FloatArray
    size: FloatArray
    corners: FloatArray


def panels(mesh: Mesh) -> Panels:
    """Flat panels of the stored part of a mesh, eq. (1).

    Raises
    ------
    ScenarioError
        If a panel has no area.
    """
    a, b, c, d = np.moveaxis(mesh.vertices, 1, 0)
    first, second = np.cross(b - a, c - a) / 2.0, np.cross(c - a, d - a) / 2.0
    vector = first + second
    area = np.linalg.norm(vector, axis=1)
    extent = np.max(np.linalg.norm(mesh.vertices - mesh.vertices[:, :1], axis=2), axis=1)
    flat = area <= 1e-12 * np.maximum(extent, 1e-300) ** 2
    if np.any(flat):
        where = int(np.flatnonzero(flat)[0])
        raise ScenarioError(f"mesh '{mesh.name}': panel {where} has no area; remove it or merge its vertices")
    normal = vector / area[:, None]
    weights = np.stack([np.sum(first * normal, axis=1), np.sum(second * normal, axis=1)], axis=1) / area[:, None]
    centre = weights[:, :1] * (a + b + c) / 3.0 + weights[:, 1:] * (a + c + d) / 3.0
    height = np.einsum("pvk,pk->pv", mesh.vertices - centre[:, None, :], normal)
    corners = mesh.vertices - height[:, :, None] * normal[:, None, :]
    size = np.maximum(np.linalg.norm(c - a, axis=1), np.linalg.norm(d - b, axis=1))
    return Panels(centre=centre, normal=normal, area=area, size=size, corners=corners)


def whole(mesh: Mesh) -> Mesh:
    """The same body without planes of symmetry: all panels, image after image in the order of `Mesh.images`."""
    parts = []
    for sign_x, sign_y in mesh.images:
        image = mesh.vertices * np.array([sign_x, sign_y, 1.0])
        # A reflection turns the order of the vertices; a triangle keeps its repeated vertex last.
        parts.append(image if sign_x * sign_y > 0 else turned_round(image))
    return Mesh(name=mesh.name, vertices=np.concatenate(parts), planes=())


def turned_round(vertices: FloatArray) -> FloatArray:
    """Panels (n, 4, 3) with the order of their vertices, and so their normals, reversed; triangles stay ones."""
    triangle = np.all(vertices[:, 2] == vertices[:, 3], axis=1)
    return np.where(triangle[:, None, None], vertices[:, [1, 0, 2, 2]], vertices[:, [0, 3, 2, 1]])


def volumes(mesh: Mesh) -> FloatArray:
    """Displaced volume (3,) in m³ by the x, y and z components, eq. (2); equal for a watertight mesh."""
    geometry = panels(whole(mesh))
    return np.einsum("pk,pk,p->k", geometry.centre, geometry.normal, geometry.area)


def merged(name: str, meshes: Sequence[Mesh]) -> Mesh:
    """One mesh of several parts that share their planes of symmetry."""
    planes = {mesh.planes for mesh in meshes}
    if len(planes) != 1:
        raise ScenarioError(f"mesh '{name}': its parts have different planes {sorted(planes)}; use whole() on each")
    return Mesh(name=name, vertices=np.concatenate([mesh.vertices for mesh in meshes]), planes=planes.pop())


def translated(mesh: Mesh, displacement: ArrayLike) -> Mesh:
    """The mesh moved by (3,) in m; a mesh with planes of symmetry is completed first where the move breaks them."""
    vector = np.asarray(displacement, dtype=np.float64)
    source = mesh if not np.any(vector[:2]) else whole(mesh)
    return Mesh(name=mesh.name, vertices=source.vertices + vector, planes=source.planes)


def waterline_loops(mesh: Mesh, tolerance: float = 1e-6) -> FloatArray:
    """Edges (m, 2, 3) of the stored panels that lie in z = 0, in the panels' own order."""
    start, end = mesh.vertices, np.roll(mesh.vertices, -1, axis=1)
    extent = float(np.ptp(mesh.vertices[:, :, 2])) or 1.0
    dry = np.abs(start[:, :, 2]) + np.abs(end[:, :, 2]) < tolerance * extent
    long = np.linalg.norm(end - start, axis=2) > tolerance * extent
    flat = np.all(np.abs(start[:, :, 2]) < tolerance * extent, axis=1)
    keep = dry & long & ~flat[:, None]
    return np.stack([start[keep], end[keep]], axis=1)


def connected(places: FloatArray) -> NDArray[np.int64]:
    """Number (m,) of the connected part that each of m pieces with k corners (m, k, d) belongs to.

    Pieces that share a corner belong together, such as the panels of a body or the edges of a loop.
    """
    count, corners = places.shape[:2]
    points = places.reshape(count * corners, -1)
    tolerance = _SAME_POINT * float(np.max(np.ptp(points, axis=0)))
    near = cKDTree(points).query_pairs(tolerance, output_type="ndarray") // corners
    links = sparse.coo_array((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(count, count))
    return np.asarray(sparse.csgraph.connected_components(links, directed=False)[1], dtype=np.int64)


def joined_loops(edges: FloatArray) -> list[FloatArray]:
    """Chains of edges (m, 2, 3) that are connected, by x and y of their ends."""
    if not len(edges):
        return []
    number = connected(edges[:, :, :2])
    return [edges[number == value] for value in range(int(number.max()) + 1)]


def loop_centroid(edges: FloatArray) -> FloatArray:
    """Area centroid (2,) of a closed loop of edges (m, 2, 3)."""
    a, b = edges[:, 0, :2], edges[:, 1, :2]
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return np.asarray(np.sum((a + b) * twice[:, None], axis=0) / (3.0 * np.sum(twice)))


def check(mesh: Mesh, shortest_wave: float = np.inf) -> list[str]:
    """What is wrong with a mesh, each with its remedy: `faults`, then `flaws`; an empty list for a good one.

    Parameters
    ----------
    mesh
        The mesh.
    shortest_wave
        Length of the shortest wave to be solved for, in m.
    """
    return faults(mesh) + flaws(mesh, shortest_wave)


def faults(mesh: Mesh) -> list[str]:
    """What no solution survives, each with its remedy."""
    found: list[str] = []
    top = float(np.max(mesh.vertices[:, :, 2]))
    extent = _extent(mesh)
    if top > 1e-6 * extent:
        found.append(f"{mesh.name}: a vertex lies {top:.3g} m above the water; cut the mesh at z = 0")
    for axis, plane in enumerate(("x", "y")):
        lowest = float(np.min(mesh.vertices[:, :, axis]))
        if plane in mesh.planes and lowest < -1e-6 * extent:
            found.append(
                f"{mesh.name}: panels reach {plane} = {lowest:.3g} m across their plane of symmetry; keep one side only"
            )
    volume = volumes(mesh)
    if np.all(volume < 0.0):
        found.append(f"{mesh.name}: normals point into the body (volume {volume[2]:.4g} m³); reverse every panel")
    elif np.ptp(volume) > _VOLUME_TOLERANCE * np.max(np.abs(volume)):
        text = ", ".join(f"{v:.5g}" for v in volume)
        found.append(f"{mesh.name}: volume by x, y, z is {text} m³, not equal; close gaps, turn stray normals")
    return found


def flaws(mesh: Mesh, shortest_wave: float = np.inf) -> list[str]:
    """What a solution survives with less accuracy, each with its remedy; for waves down to a length in m."""
    found: list[str] = []
    gaps = _open_edges(whole(mesh), 1e-5 * _extent(mesh))
    if gaps:
        found.append(f"{mesh.name}: {gaps} edges below the waterline join no other panel; join the parts conformally")
    largest = float(np.max(panels(mesh).size))
    if largest * _PANELS_PER_WAVELENGTH / np.sqrt(2.0) > shortest_wave:
        found.append(
            f"{mesh.name}: largest panel diagonal {largest:.3g} m against a wave of {shortest_wave:.3g} m; "
            f"use panels below {shortest_wave / _PANELS_PER_WAVELENGTH:.3g} m or drop the shortest waves"
        )
    return found


def _extent(mesh: Mesh) -> float:
    """Largest of length, beam and height of the whole body."""
    return float(np.max(np.ptp(whole(mesh).vertices.reshape(-1, 3), axis=0)))


def _open_edges(mesh: Mesh, tolerance: float) -> int:
    """Number of edges, not in the waterline, that are not shared by exactly two panels in opposite directions."""
    start = mesh.vertices.reshape(-1, 3)
    end = np.roll(mesh.vertices, -1, axis=1).reshape(-1, 3)
    points = np.concatenate([start, end])
    _, index = np.unique(np.round(points / tolerance / 2.0).astype(np.int64), axis=0, return_inverse=True)
    first, last = index.ravel()[: len(start)], index.ravel()[len(start) :]
    wet = (first != last) & (np.abs(start[:, 2]) + np.abs(end[:, 2]) > tolerance)
    forward = {(int(a), int(b)) for a, b in zip(first[wet], last[wet], strict=True)}
    return sum((b, a) not in forward for a, b in forward)


def read_gdf(path: str | Path) -> Mesh:
    """Mesh of a WAMIT low-order .gdf file, scaled by its length unit; columns ISX, ISY become planes of symmetry.

    Raises
    ------
    ScenarioError
        If the file is missing, or holds other than four vertices a panel.
    """
    lines = _lines(path)
    try:
        isx, isy = (int(float(word)) for word in lines[2].split()[:2])
        count = int(float(lines[3].split()[0]))
        numbers = np.array(" ".join(lines[4:]).split()[: 12 * count], dtype=np.float64)
        vertices = numbers.reshape(count, 4, 3)
    except (IndexError, ValueError) as error:
        raise ScenarioError(f"{path}: not a low-order .gdf ({error}); export flat panels, IGDEF = 0") from error
    if isx not in (0, 1) or isy not in (0, 1):
        raise ScenarioError(f"{path}: ISX, ISY are {isx}, {isy}; only 0 and 1 are known here")
    planes = tuple(plane for plane, present in (("x", isx), ("y", isy)) if present)
    return Mesh(name=Path(path).stem, vertices=vertices, planes=planes)


def write_gdf(mesh: Mesh, path: str | Path, gravity: float = 9.80665) -> None:
    """Write a mesh as a WAMIT low-order .gdf file in m."""
    rows = [
        mesh.name,
        f"1.0 {gravity}",
        f"{int('x' in mesh.planes)} {int('y' in mesh.planes)}",
        f"{len(mesh.vertices)}",
    ]
    rows += [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices.reshape(-1, 3)]
    Path(path).write_text("\n".join(rows) + "\n")


def read_nemoh(path: str | Path) -> Mesh:
    """Mesh of a NEMOH .dat or .mar file; its symmetry flag stands for the plane y = 0.

    Raises
    ------
    ScenarioError
        If the file is missing or is not a list of vertices and a list of panels, each ended by zeros.
    """
    lines = _lines(path)
    try:
        flag = int(float(lines[0].split()[1]))
        rows = [[float(word) for word in line.split()] for line in lines[1:] if line.strip()]
        end = next(i for i, row in enumerate(rows) if row[0] == 0.0)
        points = {int(row[0]): row[1:4] for row in rows[:end]}
        quads: list[list[list[float]]] = []
        for row in rows[end + 1 :]:
            if row[0] == 0.0:
                break
            quads.append([points[int(number)] for number in row[:4]])
        vertices = np.array(quads, dtype=np.float64)
    except (IndexError, KeyError, StopIteration, ValueError) as error:
        raise ScenarioError(
            f"{path}: not a NEMOH mesh ({error!r}); vertices, zeros, panels, zeros are needed"
        ) from error
    return Mesh(name=Path(path).stem, vertices=vertices, planes=("y",) if flag == 1 else ())


def write_nemoh(mesh: Mesh, path: str | Path) -> None:
    """Write a mesh as a NEMOH file; a plane "x" is completed first, since the format knows y = 0 only."""
    source = mesh if mesh.planes in ((), ("y",)) else whole(mesh)
    rows = [f"2 {int(source.planes == ('y',))}"]
    rows += [f"{i + 1} {x:.9g} {y:.9g} {z:.9g}" for i, (x, y, z) in enumerate(source.vertices.reshape(-1, 3))]
    rows.append("0 0. 0. 0.")
    rows += [" ".join(str(4 * p + k + 1) for k in range(4)) for p in range(len(source.vertices))]
    rows.append("0 0 0 0")
    Path(path).write_text("\n".join(rows) + "\n")


def read_stl(path: str | Path) -> Mesh:
    """Mesh of an ASCII or binary STL file of the wetted surface, normals out of the body; triangles, no symmetry.

    Raises
    ------
    ScenarioError
        If the file is missing or is no STL.
    """
    from stl import mesh as files  # takes long to import, and few need it

    try:
        triangles = np.asarray(files.Mesh.from_file(str(path), calculate_normals=False).vectors, dtype=np.float64)
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read ({error.strerror}); give the path of a mesh file") from error
    except Exception as error:  # the library raises what the bytes happen to break
        raise ScenarioError(f"{path}: not an STL file ({error}); export it as binary or ASCII STL") from error
    if len(triangles) == 0:
        raise ScenarioError(f"{path}: holds no triangles; export it as binary or ASCII STL")
    return Mesh(name=Path(path).stem, vertices=triangles[:, [0, 1, 2, 2]])


def _lines(path: str | Path) -> list[str]:
    try:
        return Path(path).read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: cannot be read ({error}); give the path of a text mesh file") from error
